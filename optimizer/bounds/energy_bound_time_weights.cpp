#include "optimizer/bounds/energy_bound_time_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {

TimedWeights::TimedWeights(const CraneModel& model, const MotionProblem& problem,
                           const Machine& loaded, const std::vector<Range>& force_range)
    : MoveWeights(model, problem, loaded, force_range),
      position_(problem.limits.position),
      speed_(problem.limits.velocity),
      acceleration_(problem.limits.acceleration),
      pump_flow_(pump_flow_limits(model, problem)) {
  for (const PumpModel& pump : model.pumps) pump_standby_.push_back(pump.standby);
  for (const CylinderDemand& a : demands()) {
    for (const CylinderDemand& b : demands()) {
      if (a.joint == b.joint && a.pump != b.pump) possible_ = false;
    }
  }
}

TimedMove TimedWeights::move_of(int joint, int direction, const double* force,
                                const double* rate) const {
  TimedMove m;
  m.joint = joint;
  m.direction = direction;
  const Range& v = speed_[static_cast<std::size_t>(joint)];
  double speed = std::max(0.0, direction == 0 ? v.hi : -v.lo);
  const CylinderDemand* hardest = nullptr;
  double most = 0.0, own_area = 0.0;
  for (const CylinderDemand& d : demands()) {
    if (d.joint != joint) continue;
    const double r = rate[d.cylinder];
    const int side = (direction == 0) == (r > 0.0) ? 0 : 1;
    const double area = d.area[side] * std::abs(r);
    m.pump = d.pump;
    m.area += area;
    if (!(area > 0.0)) continue;
    speed = std::min(speed, d.valve_flow[side] / area);
    const double least = d.load_sensing ? d.table[side].least(force[d.cylinder]) : 0.0;
    if (hardest != nullptr && least <= most) continue;
    hardest = &d;
    most = least;
    own_area = area;
  }
  m.top = speed;
  if (hardest == nullptr) m.pump = -1;
  if (m.pump < 0) {
    m.area = 1.0;  // the travel itself takes the place of the volume
    return m;
  }
  m.top = speed * m.area;
  m.standby =
      std::max(0.0, shares_.energy_weight * pump_standby_[static_cast<std::size_t>(m.pump)]);
  if (hardest->load_sensing && shares_.energy_weight > 0.0) {
    const int side = (direction == 0) == (rate[hardest->cylinder] > 0.0) ? 0 : 1;
    const DemandTable& table = hardest->table[side];
    table.rising(force[hardest->cylinder], m.demand);
    for (double& p : m.demand) p *= shares_.energy_weight;
    m.flow_step = table.flow_max() / kFlowKnots * m.area / own_area;
  }
  return m;
}

Eigen::VectorXd TimedWeights::place_of(const double* q) const {
  Eigen::VectorXd place(static_cast<Eigen::Index>(position_.size()));
  for (std::size_t j = 0; j < position_.size(); ++j) {
    const Range& r = position_[j];
    place[static_cast<Eigen::Index>(j)] = (q[j] - 0.5 * (r.lo + r.hi)) / (r.hi - r.lo);
  }
  return place;
}

void TimedWeights::make_moves(const double* q, const double* force, const double* rate) const {
  moves_.clear();
  move_share_.clear();
  const Eigen::VectorXd place = place_of(q);
  for (Eigen::Index j = 0; j < shares_.share.rows(); ++j) {
    for (const int direction : {0, 1}) {
      if (!(shares_.share(j, direction) > 0.0)) continue;
      TimedMove m = move_of(static_cast<int>(j), direction, force, rate);
      if (!(m.top > 0.0)) continue;
      moves_.push_back(m);
      const double grown =
          shares_.tilt.size() > 0 ? std::exp(shares_.tilt.row(2 * j + direction).dot(place)) : 1.0;
      move_share_.push_back(grown * shares_.share(j, direction));
    }
  }
}

void TimedWeights::prices(const double* q, const double* force, const double* rate,
                          Eigen::MatrixX2d& price) const {
  MoveWeights::prices(q, force, rate, price);
  price *= shares_.energy_weight;
  make_moves(q, force, rate);
  if (moves_.empty() || !(shares_.price > 0.0)) return;
  const double largest = *std::max_element(move_share_.begin(), move_share_.end());
  // Maximised Hamiltonian of these slopes less the price of time; it rises with alpha.
  const auto surplus = [&](double alpha) {
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      TimedMove& m = moves_[i];
      const double share = alpha * move_share_[i];
      const double least = price(m.joint, m.direction) / m.area;
      m.slope = std::max(m.least_slope(share), least);
    }
    return gain_.of(moves_, pump_flow_) - shares_.price;
  };
  // False position (Illinois variant) from the alpha at which one move alone uses up the price, to one that keeps the
  // inequality.
  const double enough = kPriceTolerance * shares_.price;
  double high = shares_.price / largest, over = surplus(high);
  if (over > enough) {
    double low = 0.0, under = -shares_.price, reached = under;
    int last = 0;
    double alpha = alpha_ratio_ * high;  // the previous posture mostly is a neighbour
    /// Largest number of steps of false position.
    /// @threshold [1] 10..200; numerical: the Illinois method converges superlinearly; this ends it on rounding only
    constexpr int kMost = 40;
    for (int i = 0; i < kMost && reached < -enough; ++i) {
      const double value = surplus(alpha);
      if (value > enough) {
        high = alpha;
        over = value;
        if (last > 0) under *= 0.5;
        last = 1;
      } else {
        low = alpha;
        under = reached = value;
        if (last < 0) over *= 0.5;
        last = -1;
      }
      alpha = (low * over - high * under) / (over - under);
    }
    if (last > 0) surplus(low);
    alpha_ratio_ = std::clamp(low * largest / shares_.price, 0.05, 0.95);
  }
  for (const TimedMove& m : moves_) {
    double& own = price(m.joint, m.direction);
    own = std::max(own, m.slope * m.area);
  }
  ramp_gain_ = std::max(ramp_gain_, gain_from_rest());
}

double TimedWeights::gain_from_rest() const {
  // Rate with a pump at that pressure; of each joint only the direction with the larger rate is summed.
  const auto at = [&](int pump, double pressure) {
    double total = 0.0, of_joint = 0.0;
    int joint = -1;
    for (const TimedMove& m : moves_) {  // ordered by joint
      if (m.pump != pump || (pump >= 0 && m.least_pressure() > pressure)) continue;
      if (m.joint != joint) {
        total += of_joint;
        of_joint = 0.0;
        joint = m.joint;
      }
      const Range& a = acceleration_[static_cast<std::size_t>(m.joint)];
      const double margin = pump >= 0 ? m.slope - pressure : m.slope;
      of_joint = std::max(of_joint, margin * m.area * std::max(a.hi, -a.lo));
    }
    return total + of_joint;
  };
  double total = at(-1, 0.0);
  for (int pump = 0; pump < static_cast<int>(pump_flow_.size()); ++pump) {
    double most = 0.0;  // the sum falls with the pressure between two cylinders' least demands
    for (const TimedMove& m : moves_) {
      if (m.pump == pump) most = std::max(most, at(pump, m.least_pressure()));
    }
    total += most;
  }
  return total;
}

double TimedWeights::largest_gain(const Eigen::VectorXd& q, const Eigen::VectorXd& slope) {
  update(q);
  moves_.clear();
  for (Eigen::Index j = 0; j < slope.size(); ++j) {
    if (slope[j] == 0.0) continue;
    TimedMove m = move_of(static_cast<int>(j), slope[j] > 0.0 ? 0 : 1, force_data(), rate_data());
    m.slope = std::abs(slope[j]) / m.area;
    if (m.top > 0.0) moves_.push_back(m);
  }
  return gain_.of(moves_, pump_flow_);
}

}  // namespace sparflow
