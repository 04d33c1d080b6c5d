#include "bench/motion_speed_derivatives.h"

#ifndef SPARFLOW_ADOLC

namespace sparflow::bench {
std::shared_ptr<KnotModel> with_adolc(const CraneModel& /*model*/, const MotionProblem& /*problem*/,
                                      const CraneKnotOptions& /*options*/,
                                      std::shared_ptr<KnotModel> /*inner*/) {
  return nullptr;
}
}  // namespace sparflow::bench

#else

#include <adolc/adolc.h>

#include <numeric>
#include <vector>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace Eigen {
template <>
struct NumTraits<adouble> : NumTraits<double> {
  using Real = adouble;
  using NonInteger = adouble;
  using Nested = adouble;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};
}  // namespace Eigen

namespace sparflow::bench {

/// A taped value with its derivative with respect to the one joint coordinate on which a linkage depends.
struct Rate {
  adouble value = 0.0, d1 = 0.0;
  Rate() = default;
  Rate(double v) : value(v) {}  // NOLINT: implicit, so that constants can be used
  Rate(const adouble& v, const adouble& d) : value(v), d1(d) {}
  Rate& operator+=(const Rate& b) { return *this = *this + b; }
  Rate& operator-=(const Rate& b) { return *this = *this - b; }
  friend Rate operator+(const Rate& a, const Rate& b) { return {a.value + b.value, a.d1 + b.d1}; }
  friend Rate operator-(const Rate& a, const Rate& b) { return {a.value - b.value, a.d1 - b.d1}; }
  friend Rate operator*(const Rate& a, const Rate& b) {
    return {a.value * b.value, a.d1 * b.value + a.value * b.d1};
  }
  friend Rate operator/(const Rate& a, const Rate& b) {
    const adouble ratio = a.value / b.value;
    return {ratio, (a.d1 - ratio * b.d1) / b.value};
  }
  friend Rate sin(const Rate& a) { return {sin(a.value), cos(a.value) * a.d1}; }
  friend Rate cos(const Rate& a) { return {cos(a.value), -sin(a.value) * a.d1}; }
  friend Rate sqrt(const Rate& a) {
    const adouble root = sqrt(a.value);
    return {root, 0.5 * a.d1 / root};
  }
};
inline double plain(const Rate& a) { return a.value.value(); }

}  // namespace sparflow::bench

namespace Eigen {
template <>
struct NumTraits<sparflow::bench::Rate> : NumTraits<double> {
  using Real = sparflow::bench::Rate;
  using NonInteger = sparflow::bench::Rate;
  using Nested = sparflow::bench::Rate;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1 };
};
}  // namespace Eigen

namespace sparflow::bench {
namespace {

using Taped = Eigen::Matrix<adouble, Eigen::Dynamic, 1>;

/// Joint torques by virtual work, tau_k = -sum m g . dp/dq_k.
std::vector<adouble> torques(const Machine& machine, const Taped& q, double payload) {
  const int n = machine.joint_count();
  const std::vector<Frame<adouble> > frames = forward_kinematics<adouble>(machine, q);
  const Vector3<adouble> gravity = machine.gravity.cast<adouble>();
  std::vector<adouble> torque(static_cast<std::size_t>(n), adouble(0.0));
  std::vector<Vector3<adouble> > axes;
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Vector3<adouble> local = machine.joints[i].axis.cast<adouble>();
    axes.push_back(frames[i].rotation * local);
  }
  const auto carry = [&](double mass, int joint, const Vector3<adouble>& p) {
    for (int k = 0; k <= joint; ++k) {
      const auto i = static_cast<std::size_t>(k);
      Vector3<adouble> column = axes[i];
      if (machine.joints[i].type == JointType::kRevolute) {
        const Vector3<adouble> arm = p - frames[i].position;
        const Vector3<adouble>& z = axes[i];
        for (int a = 0; a < 3; ++a) {
          const int b = (a + 1) % 3,
                    c = (a + 2) % 3;  // Eigen's cross() would copy ADOL-C's temporaries.
          column[a] = z[b] * arm[c] - z[c] * arm[b];
        }
      }
      const adouble work = gravity.dot(column);
      torque[i] -= mass * work;
    }
  };
  for (const Link& link : machine.links) {
    Vector3<adouble> p = point_in_base(frames, link.joint, link.cog);
    if (link.slides_with >= 0) {
      const auto s = static_cast<std::size_t>(link.slides_with);
      for (int i = 0; i < 3; ++i) p[i] += link.fraction * q[link.slides_with] * axes[s][i];
      const adouble work = gravity.dot(axes[s]);
      torque[s] -= link.mass * link.fraction * work;
    }
    carry(link.mass, link.joint, p);
  }
  if (payload > 0.0)
    carry(payload, machine.tip.joint, point_in_base(frames, machine.tip.joint, machine.tip.xyz));
  std::vector<LinkageMass<Rate> > masses;
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
    masses.clear();
    append_linkage_masses(machine, c, Rate(q[j], 1.0), masses);
    for (const LinkageMass<Rate>& m : masses) {
      Vector3<adouble> p, rate;
      for (int i = 0; i < 3; ++i) {
        p[i] = m.position[i].value;
        rate[i] = m.position[i].d1;
      }
      if (j > 0) {
        const Frame<adouble>& parent = frames[static_cast<std::size_t>(j - 1)];
        p = (parent.position + parent.rotation * p).eval();
        rate = (parent.rotation * rate).eval();
      }
      carry(m.mass, j - 1, p);
      const adouble work = gravity.dot(rate);
      torque[static_cast<std::size_t>(j)] -= m.mass * work;
    }
  }
  return torque;
}

adouble learned_mean(const GaussianProcess& process, const adouble& flow, const adouble& force) {
  const GpParameters& p = process.parameters();
  adouble sum = p.mean_constant + p.mean_slope * force + p.mean_flow_slope * flow;
  const adouble x = flow / p.length_flow, y = force / p.length_force;
  const double variance = p.signal_std * p.signal_std;
  for (Eigen::Index j = 0; j < p.weight.size(); ++j) {
    const adouble dx = x - p.flow[j] / p.length_flow, dy = y - p.force[j] / p.length_force;
    sum += variance * p.weight[j] * exp(-0.5 * (dx * dx + dy * dy));
  }
  if (p.corner.there()) {
    const adouble u = p.corner.level + p.corner.per_flow * flow + p.corner.per_force * force;
    sum += 0.5 * (u + sqrt(u * u + kCornerRounded * kCornerRounded));
  }
  return sum;
}

/// max(0, x - gap) with a rounded corner, 0 at x = 0.
adouble above(const adouble& x, const adouble& gap) {
  constexpr double kSquare = loads_beyond::kRounded * loads_beyond::kRounded;
  const adouble over = x - gap;
  return 0.5 * (over + sqrt(over * over + kSquare)) - 0.5 * (sqrt(gap * gap + kSquare) - gap);
}

/// max(0, x), smoothed over 0 <= x <= bend. The tape contains all branches, so that it can be replayed at other loads.
adouble excess(const adouble& x, double bend) {
  const adouble u = x / bend, none = 0.0;
  const adouble curve = bend * u * u * u * (1.0 - 0.5 * u), line = x - 0.5 * bend;
  adouble bent, out;
  condassign(bent, x - bend, line, curve);
  condassign(out, x, bent, none);
  return out;
}

/// The pressure model, and its extrapolation beyond the learned loads as in models/hydraulics/loads_beyond.h. Both sides
/// are added at once, since each vanishes within the learned loads.
adouble mean(const GaussianProcess& process, const adouble& flow, const adouble& force) {
  const GpParameters& p = process.parameters();
  const LoadsBeyond& b = p.beyond;
  if (b.side == 0) return learned_mean(process, flow, force);
  const double side = b.side, bend = loads_beyond::bend(b);
  const double heaviest = side > 0.0 ? p.force_max : -p.force_min;
  const double lightest = side > 0.0 ? p.force_min : -p.force_max;
  const adouble load = side * force;
  const adouble heavier = excess(load - heaviest, bend), lighter = excess(lightest - load, bend);
  const adouble border = load - heavier + lighter;
  const adouble g = learned_mean(process, flow, side * border);
  const adouble gap = g - b.static_level - b.static_slope * border;
  const adouble fall = b.slope_lighter * lighter;
  return g + b.slope_heavier * heavier + above((b.static_slope - b.slope_heavier) * heavier, gap) -
         fall + above(fall, g - b.least);
}

class Adolc final : public WrappedKnotModel {
 public:
  Adolc(const CraneModel& model, const MotionProblem& problem, const CraneKnotOptions& options,
        std::shared_ptr<KnotModel> inner)
      : WrappedKnotModel(std::move(inner)), model_(model), problem_(problem), options_(options) {
    SPARFLOW_CHECK(
        model.effects.empty() && options.modes.rows() > 0 && options.command_weight == 0.0,
        "only phases of a model without effects can be taped");
    lower_.resize(static_cast<std::size_t>(size()));
    rows_.resize(lower_.size());
    for (std::size_t i = 0; i < lower_.size(); ++i) {
      lower_[i].resize(i + 1);
      rows_[i] = lower_[i].data();
    }
    tapes_.resize(static_cast<std::size_t>(options.modes.rows()), -1);
  }
  ~Adolc() override {
    for (const short tag : own_) {
      removeTape(tag, TapeRemovalType::ADOLC_REMOVE_COMPLETELY);
      free_tags().push_back(tag);
    }
  }
  Adolc(const Adolc&) = delete;
  Adolc& operator=(const Adolc&) = delete;

  void begin_node(int knot, int interval) override {
    WrappedKnotModel::begin_node(knot, interval);
    interval_ = interval;
  }

  double cost_derivatives(const double* z, double* gradient_out, double* hessian_out) override {
    const short tag = tape(z);
    const int n = size();
    ::gradient(tag, n, z, gradient_out);
    ::hessian(tag, n, const_cast<double*>(z), rows_.data());
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j)
        hessian_out[i * n + j] = hessian_out[j * n + i] = rows_[static_cast<std::size_t>(i)][j];
    }
    return inner_->cost(z);
  }

 private:
  static std::vector<short>& free_tags() {
    static std::vector<short> tags = [] {
      std::vector<short> all(2000);
      std::iota(all.begin(), all.end(), static_cast<short>(1));
      return all;
    }();
    return tags;
  }

  /// Returns the tape of this interval's modes.
  short tape(const double* z) {
    short& known = tapes_[static_cast<std::size_t>(interval_)];
    if (known >= 0) return known;
    for (std::size_t k = 0; k < tapes_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      if (tapes_[k] >= 0 &&
          (options_.modes.row(row).array() == options_.modes.row(interval_).array()).all())
        return known = tapes_[k];
    }
    SPARFLOW_CHECK(!free_tags().empty(), "there is no free tape number");
    known = free_tags().back();
    free_tags().pop_back();
    own_.push_back(known);
    constexpr int kBuffer = 1 << 20;  // number of values up to which a tape stays in memory
    trace_on(known, 0, kBuffer, kBuffer, kBuffer, kBuffer);
    write_tape(z);
    trace_off();
    return known;
  }

  void write_tape(const double* z) {
    const Machine& machine = model_.machine;
    const int n = joint_count(), m = machine.cylinder_count();
    Taped q(n), qd(n);
    for (int j = 0; j < n; ++j) q[j] <<= z[j];
    for (int j = 0; j < n; ++j) qd[j] <<= z[n + j];
    const std::vector<adouble> torque = torques(machine, q, problem_.payload);
    std::vector<adouble> flow(static_cast<std::size_t>(m), adouble(0.0));
    std::vector<adouble> demand(static_cast<std::size_t>(m), adouble(0.0));
    const auto mode = [&](int c) { return options_.modes(interval_, c); };
    for (int c = 0; c < m; ++c) {
      const auto i = static_cast<std::size_t>(c);
      const Cylinder& cylinder = machine.cylinders[i];
      if (mode(c) == CylinderMode::kRest || !cylinder.hydraulic()) continue;
      const int j = cylinder.joint;
      const Rate length = cylinder_length(machine, c, Rate(q[j], 1.0));
      const adouble force = torque[static_cast<std::size_t>(j)] / length.d1;
      const bool extend = mode(c) == CylinderMode::kExtend;
      const double area = extend ? cylinder.area_piston() : -cylinder.area_rod();
      flow[i] = area * (length.d1 * qd[j]);
      const CylinderModel& learned = model_.cylinders[i];
      demand[i] = mean(extend ? learned.extend : learned.retract, flow[i], force) + learned.margin;
    }
    adouble power = 0.0;
    for (int p = 0; p < machine.pump_count(); ++p) {
      const Pump& pump = machine.pumps[static_cast<std::size_t>(p)];
      const double standby = model_.pumps[static_cast<std::size_t>(p)].standby;
      adouble sum = 0.0, top = standby;
      std::vector<std::size_t> asking;
      for (const int c : pump.feeds) {
        const auto i = static_cast<std::size_t>(c);
        if (mode(c) == CylinderMode::kRest || !machine.cylinders[i].hydraulic()) continue;
        sum += flow[i];
        asking.push_back(i);
        top = fmax(top, demand[i]);
      }
      adouble pressure = standby;
      if (pump.type == PumpType::kLoadSensing) {
        const double beta = options_.smoothing.pressure;
        // A taped copy of models/chain/pump_law.h; tests/bench/taped_law_test.cpp holds it against the first.
        adouble total = exp((standby - top) / beta);
        for (const std::size_t i : asking) total += exp((demand[i] - top) / beta);
        pressure = top + beta * log(total);
      }
      power += pressure * sum;
    }
    double value = 0.0;
    power *= options_.energy_weight / 1e3;
    power >>= value;
  }

  const CraneModel& model_;
  const MotionProblem& problem_;
  CraneKnotOptions options_;
  std::vector<std::vector<double> > lower_;  // lower triangle of the Hessian, in ADOL-C's format
  std::vector<double*> rows_;
  std::vector<short> tapes_, own_;  // by interval; used by this object
  int interval_ = 0;
};

}  // namespace

std::shared_ptr<KnotModel> with_adolc(const CraneModel& model, const MotionProblem& problem,
                                      const CraneKnotOptions& options,
                                      std::shared_ptr<KnotModel> inner) {
  return std::make_shared<Adolc>(model, problem, options, std::move(inner));
}

}  // namespace sparflow::bench

#endif
