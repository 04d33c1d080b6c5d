#include "simulator/hidden_effects/visibility.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "models/math/linear_algebra.h"
#include "simulator/hidden_effects/drive.h"
#include "simulator/hidden_effects/largest_demand.h"
#include "simulator/hidden_effects/log_columns.h"

namespace sparflow::simulator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMean_s = 0.3;         // [s] over which changes and noise are averaged
constexpr double kLeastSize = 1.0;      // [-] standard deviations where the effect acts
constexpr double kLeastSeconds = 10.0;  // [s] for which an effect of that size must act
constexpr double kLeastActing_s = 3.0;  // [s] one stroke; no law can be tested on a shorter event
constexpr double kMostAbsorbed =
    0.9;  // [-] a diagnosis need not name an effect with a larger absorbed share
constexpr double kForceShareNoise = 0.01;

/// One measured quantity: its change by the effect, and the basis of a law that may be learned from this log.
struct Channel {
  std::string name;
  double deviation = 0.0;  // standard deviation of the noise of a mean over kMean_s
  bool learned = false;    // pressures and pumps, for which a law is learned
  std::vector<double> change;
  std::vector<VectorXd> basis;
  // sums of the current mean
  double sum = 0.0;
  VectorXd basis_sum;
  int count = 0;

  void add(double value, const VectorXd& own) {
    sum += value;
    if (basis_sum.size() == 0) basis_sum = VectorXd::Zero(own.size());
    basis_sum += own;
    ++count;
  }
  /// Ends a mean, which is dropped when it has less than half of its rows.
  void close(int rows) {
    if (2 * count >= rows) {
      change.push_back(sum / count);
      basis.emplace_back(basis_sum / count);
    }
    sum = 0.0;
    basis_sum = VectorXd();
    count = 0;
  }
  /// Appends the means of another log of the same quantity.
  void append(const Channel& other) {
    change.insert(change.end(), other.change.begin(), other.change.end());
    basis.insert(basis.end(), other.basis.begin(), other.basis.end());
  }
};

/// Pressure that the return line or the counterbalance valve determines, and which of the two does.
struct DeterminedPressure {
  double pressure = 0.0;
  bool counterbalance = false;
  bool fed_a = false;  // it is the pressure of chamber A
};

DeterminedPressure determined_pressure(const Cylinder& drive, const CylinderLaws& laws,
                                       const CylinderState& c) {
  const double fed = c.side > 0 ? drive.area_piston() : drive.area_rod();
  const double other = c.side > 0 ? drive.area_rod() : drive.area_piston();
  const double least = std::max(c.pilot_pressure, laws.rest_tank);
  DeterminedPressure r;
  r.counterbalance = least > (c.side * c.force + other * c.return_pressure) / fed;
  r.pressure = r.counterbalance ? least : c.return_pressure;
  r.fed_a = (c.side > 0) == r.counterbalance;
  return r;
}

/// A second crane without one of the effects, driven beside the first, with the channels that compare both.
struct Shadow {
  std::unique_ptr<HiddenCase> crane;
  std::unique_ptr<Plant> plant;
  SensorState sensors;
  std::vector<Channel> force, speed, pump;
  std::vector<std::vector<Channel>> pressure;  // by cylinder, for each direction and branch (2 x 2)
};

std::vector<Channel> channels_like(const Machine& machine, double rate, double factor,
                                   const char* what) {
  std::vector<Channel> all(machine.cylinders.size());
  const double n = std::max(1.0, kMean_s * rate);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Cylinder& c = machine.cylinders[i];
    all[i].name = std::string(what) + " of " + c.name;
    all[i].deviation =
        kPressureNoise * factor / std::sqrt(n) *
        std::hypot(c.hydraulic() ? c.area_piston() : 0.0, c.hydraulic() ? c.area_rod() : 0.0);
  }
  return all;
}

constexpr std::size_t kNothing = std::numeric_limits<std::size_t>::max();

double noise_factor(const LogRequest& request) {
  return request.noise_factor > 0.0 ? request.noise_factor : 1.0;
}

/// @param without index of the effect that the second crane lacks, or kNothing
std::unique_ptr<Shadow> make_shadow(const LogRequest& request, std::size_t without,
                                    const Plant& plant) {
  auto s = std::make_unique<Shadow>();
  const Machine& machine = request.machine;
  const double factor = noise_factor(request);
  s->crane = draw_hidden(request);
  if (without != kNothing)
    s->crane->hidden.erase(s->crane->hidden.begin() + static_cast<std::ptrdiff_t>(without));
  s->plant = std::make_unique<Plant>(machine, s->crane->laws, s->crane->hidden, plant.state().q,
                                     plant.state().h);
  const double n = std::max(2.0, kMean_s * request.rate);
  s->force = channels_like(machine, request.rate, factor, "force");
  s->speed = channels_like(machine, request.rate, factor, "speed");
  for (std::size_t i = 0; i < s->speed.size(); ++i) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(machine.cylinders[i].joint)];
    const double sensor =
        (joint.type == JointType::kRevolute ? kAngleNoise : kTravelNoise) * factor;
    // Standard deviation of the slope of a line through n readings, at the transmission of the first posture.
    s->speed[i].deviation = sensor * std::abs(plant.state().cylinders[i].rate) * request.rate *
                            std::sqrt(12.0 / (n * n * n));
    s->pressure.emplace_back();
    for (int k = 0; k < 4; ++k) {
      Channel one;
      one.name = "pressure of " + machine.cylinders[i].name;
      one.deviation = kPressureNoise * factor / std::sqrt(n);
      one.learned = true;
      s->pressure.back().push_back(std::move(one));
    }
  }
  for (const Pump& p : machine.pumps) {
    Channel one;
    one.name = "pump " + p.name;
    one.deviation = kPressureNoise * factor / std::sqrt(n);
    one.learned = true;
    s->pump.push_back(std::move(one));
  }
  return s;
}

/// Demand of a pump [Pa]: the largest measured pressure plus margin of the commanded cylinders. It is computed for each
/// crane, because an effect elsewhere may change the leader, and with it the margin, without an effect in the pump.
LargestDemand asked_pressure(const Pump& pump, double standby, const CraneLaws& laws,
                             const PlantState& s, const SensorState& read) {
  LargestDemand asked{standby};
  for (const int i : pump.feeds) {
    const auto k = static_cast<std::size_t>(i);
    const double u = s.cylinders[k].command;
    if (u == 0.0) continue;
    asked.add(i, (u > 0.0 ? read.pressure_a[k] : read.pressure_b[k]) + laws.cylinders[k].margin);
  }
  return asked;
}

void compare_row(const Machine& machine, const PlantState& a, const SensorState& read, Shadow& s) {
  const PlantState& b = s.plant->state();
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const Cylinder& drive = machine.cylinders[i];
    const CylinderState &ca = a.cylinders[i], &cb = b.cylinders[i];
    VectorXd lever(2);
    lever << std::max(0.0, ca.command), std::min(0.0, ca.command);
    s.speed[i].add(ca.speed - cb.speed, lever);
    const double read_a = read.pressure_a[i] - s.sensors.pressure_a[i];
    const double read_b = read.pressure_b[i] - s.sensors.pressure_b[i];
    if (std::abs(ca.speed) > kMoving) {
      const double change = drive.hydraulic()
                                ? drive.area_piston() * read_a - drive.area_rod() * read_b
                                : ca.force - cb.force;
      s.force[i].add(change, VectorXd());
    }
    if (!drive.hydraulic() || ca.side == 0 || ca.side != cb.side) continue;
    const DeterminedPressure ra = determined_pressure(drive, s.crane->laws.cylinders[i], ca);
    const DeterminedPressure rb = determined_pressure(drive, s.crane->laws.cylinders[i], cb);
    double change = ra.pressure - rb.pressure;
    if (ra.counterbalance !=
        rb.counterbalance)  // The effect changes the branch: the same chamber is compared.
      change = ra.fed_a ? ca.pressure_a - cb.pressure_a : ca.pressure_b - cb.pressure_b;
    change += ra.fed_a ? read_a - (ca.pressure_a - cb.pressure_a)
                       : read_b - (ca.pressure_b - cb.pressure_b);
    const double q = (ra.counterbalance ? ca.flow : ca.return_flow) / 1e-3, f = ca.force / 1e5;
    // Polynomials up to the fourth degree stand for a learned law, which is smooth but not linear in flow and force.
    VectorXd own(15);
    Index term = 0;
    for (int degree = 0; degree <= 4; ++degree) {
      for (int n = 0; n <= degree; ++n) own[term++] = std::pow(q, n) * std::pow(f, degree - n);
    }
    s.pressure[i][(ca.side > 0 ? 0U : 2U) + (ra.counterbalance ? 1U : 0U)].add(change, own);
  }
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
    const CraneLaws& laws = s.crane->laws;
    const LargestDemand asked = asked_pressure(machine.pumps[p], laws.standby[p], laws, a, read);
    const LargestDemand without =
        asked_pressure(machine.pumps[p], laws.standby[p], laws, b, s.sensors);
    VectorXd margins = VectorXd::Zero(static_cast<Index>(machine.cylinders.size()) + 1);
    margins[asked.leader + 1] = 1.0;
    s.pump[p].add(read.pump[p] - asked.pressure - (s.sensors.pump[p] - without.pressure), margins);
  }
}

/// Whether another effect of the catalogue has the same law at this place. @param effect with its place set
bool has_equivalent_effect(const Machine& machine, const HiddenEffect& effect) {
  int pump = -1;
  if (effect.id == "flow_dependent_margin") pump = machine.pump_index(effect.at);
  if (effect.id == "line_loss") pump = machine.pump_of_cylinder(machine.cylinder_index(effect.at));
  return pump >= 0 && machine.pumps[static_cast<std::size_t>(pump)].feeds.size() == 1;
}

bool shows(const Visibility& v) {
  return v.size >= kLeastSize && v.seconds >= kLeastActing_s &&
         v.energy >= kLeastSize * kLeastSize * kLeastSeconds / kMean_s;
}

void judge_channel(const Channel& c, bool learned, Visibility& best, double& whole, double& left) {
  const auto n = static_cast<Index>(c.change.size());
  if (n < 10 || !(c.deviation > 0.0)) return;
  VectorXd x = Eigen::Map<const VectorXd>(c.change.data(), n) / c.deviation;
  const double before = x.squaredNorm();
  if (learned && c.basis.front().size() > 0) {
    MatrixXd basis(n, c.basis.front().size());
    for (Index i = 0; i < n; ++i) basis.row(i) = c.basis[static_cast<std::size_t>(i)].transpose();
    x -= basis * least_squares(basis, x);
  }
  const double energy = x.squaredNorm();
  if (c.learned) {
    whole += before;
    left += energy;
  }
  if (!(energy > 0.0)) return;
  Visibility v;
  v.energy = energy;
  v.size = std::sqrt(x.array().pow(4).sum() / energy);
  v.seconds = energy / (v.size * v.size) * kMean_s;
  v.channel = c.name;
  v.absorbed = c.learned ? 1.0 : 0.0;  // judge() sets the share once all channels are known
  if (std::make_pair(shows(v), v.energy) > std::make_pair(shows(best), best.energy)) best = v;
}

/// All channels of a second crane, in a fixed order.
std::vector<Channel*> channels_of(Shadow& s) {
  std::vector<Channel*> all;
  for (auto* group : {&s.force, &s.speed, &s.pump}) {
    for (Channel& c : *group) all.push_back(&c);
  }
  for (auto& group : s.pressure) {
    for (Channel& c : group) all.push_back(&c);
  }
  return all;
}

Visibility judge(Shadow& s, bool learned) {
  Visibility best;
  double whole = 0.0, left = 0.0;
  for (const Channel* c : channels_of(s)) judge_channel(*c, learned, best, whole, left);
  if (best.absorbed > 0.0) best.absorbed = whole > 0.0 ? 1.0 - left / whole : 0.0;
  return best;
}

/// Drives the request's crane with one second crane for each entry of `without` beside it.
std::vector<std::unique_ptr<Shadow>> drive_beside(const LogRequest& request,
                                                  const std::vector<std::size_t>& without) {
  const Machine& machine = request.machine;
  const std::unique_ptr<HiddenCase> one = draw_hidden(request);
  std::vector<std::unique_ptr<Shadow>> shadows(without.size());
  std::vector<double> force_squares(machine.cylinders.size(), 0.0);
  const int mean_rows = std::max(1, static_cast<int>(std::lround(kMean_s * request.rate)));
  SensorState read;
  int row = 0;
  const auto follow = [&](const Plant& plant, const StepInput& in) {
    for (std::size_t k = 0; k < shadows.size(); ++k) {
      if (!shadows[k]) shadows[k] = make_shadow(request, without[k], plant);
      shadows[k]->plant->follow(plant.state());
      shadows[k]->plant->step(in.payload, in.oil, in.command);
    }
  };
  const auto compare = [&](Plant& plant, double) {
    plant.sense(read);
    ++row;
    for (std::size_t i = 0; i < force_squares.size(); ++i)
      force_squares[i] += std::pow(plant.state().cylinders[i].force, 2);
    for (const auto& s : shadows) {
      s->plant->sense(s->sensors);
      compare_row(machine, plant.state(), read, *s);
      if (row % mean_rows != 0) continue;
      for (Channel* c : channels_of(*s)) c->close(mean_rows);
    }
  };
  drive_log(request, *one, follow, compare);
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    if (machine.cylinders[i].hydraulic()) continue;
    for (const auto& s : shadows) {
      s->force[i].deviation = kForceShareNoise * noise_factor(request) *
                              std::sqrt(force_squares[i] / std::max(1, row) / mean_rows);
    }
  }
  return shadows;
}

}  // namespace

std::vector<Visibility> visibility(const LogRequest& request, bool learned,
                                   const LogRequest* reference) {
  std::vector<std::size_t> each(request.effects.size());
  std::iota(each.begin(), each.end(), std::size_t{0});
  const auto shadows = drive_beside(request, each);
  if (learned &&
      reference) {  // Both cranes of the reference log are the same, so that the change is zero there.
    const auto beside = drive_beside(*reference, {kNothing});
    const std::vector<Channel*> known = channels_of(*beside.front());
    for (const auto& s : shadows) {
      const std::vector<Channel*> all = channels_of(*s);
      for (std::size_t c = 0; c < all.size(); ++c) all[c]->append(*known[c]);
    }
  }
  const std::vector<HiddenEffect> drawn = draw_hidden(request)->drawn;
  std::vector<Visibility> all;
  for (std::size_t k = 0; k < shadows.size(); ++k) {
    const std::string& id = request.effects[k].id;
    if (id == "sensor_delay" || id == "sensor_fault") {
      constexpr double kAlways = std::numeric_limits<double>::infinity();
      all.push_back({kAlways, kAlways, kAlways, "the recording", 0.0});
      continue;
    }
    all.push_back(judge(*shadows[k], learned));
    all.back().equivalent = has_equivalent_effect(request.machine, drawn[k]);
  }
  return all;
}

bool visible(const Visibility& v) {
  return shows(v) && v.absorbed <= kMostAbsorbed && !v.equivalent;
}

}  // namespace sparflow::simulator
