#include "models/effects/formula/user_effect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "models/effects/formula/effect_file.h"
#include "models/effects/hydraulics.h"
#include "models/effects/instant.h"
#include "models/effects/registry.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

EffectStage stage_of(UserEffectStage stage) {
  switch (stage) {
    case UserEffectStage::kForce:
      return EffectStage::kForce;
    case UserEffectStage::kFlow:
      return EffectStage::kFlow;
    case UserEffectStage::kPressure:
      return EffectStage::kPressure;
    case UserEffectStage::kPump:
      return EffectStage::kPump;
  }
  return EffectStage::kForce;
}

EffectPlace place_of(UserEffectPlace place) {
  switch (place) {
    case UserEffectPlace::kCylinder:
      return EffectPlace::kCylinder;
    case UserEffectPlace::kPump:
      return EffectPlace::kPump;
    case UserEffectPlace::kMachine:
      return EffectPlace::kMachine;
  }
  return EffectPlace::kMachine;
}

/// d2x/dt2 from the joint's motion. For derivatives the slope of d3x/dq3 is needed, by central differences:
/// 1e-4 rad leave 1e-8 of it, and it only enters second derivatives.
double rod_acceleration(const Machine& machine, int cylinder, double q, double qd, double qdd) {
  const Taylor3 x = linkage_rates(machine, cylinder, q);
  return x.d1 * qdd + x.d2 * qd * qd;
}
Jet rod_acceleration(const Machine& machine, int cylinder, const Jet& q, const Jet& qd,
                     const Jet& qdd) {
  constexpr double kStep = 1e-4;
  const Taylor3 x = linkage_rates(machine, cylinder, q.value);
  const double d4 = (linkage_rates(machine, cylinder, q.value + kStep).d3 -
                     linkage_rates(machine, cylinder, q.value - kStep).d3) /
                    (2.0 * kStep);
  return q.chain(x.d1, x.d2, x.d3) * qdd + q.chain(x.d2, x.d3, d4) * qd * qd;
}

double value_at(const Eigen::VectorXd& v, Eigen::Index row, double otherwise) {
  return v.size() > row ? v[row] : otherwise;
}

class UserEffect final : public Effect {
 public:
  explicit UserEffect(UserEffectSpec spec) : spec_(std::move(spec)) {
    info_.id = spec_.id;
    info_.title = spec_.title;
    info_.stage = stage_of(spec_.stage);
    info_.place = place_of(spec_.place);
    // The catalogue lists proportional parameters first.
    for (const bool linear : {true, false}) {
      for (std::size_t k = 0; k < spec_.parameters.size(); ++k) {
        const UserParameter& p = spec_.parameters[k];
        if (p.proportional != linear) continue;
        info_.parameters.push_back(
            {p.name, p.unit, p.si, p.lower, p.upper, p.typical, p.meaning, linear, p.grid});
        law_index_.push_back(k);
        linear_ += linear ? 1 : 0;
      }
    }
    info_.equation = spec_.equation;
    for (const UserSignal& s : spec_.signals) info_.signals.push_back(s.name);
    info_.confused_with = spec_.confused_with;
    info_.separated_by = spec_.separated_by;
    info_.citation = spec_.citation;
    info_.in_motion = !spec_.in_motion() ? "nothing: its law uses signals that only a log has"
                      : spec_.stage == UserEffectStage::kFlow ? "nothing: a motion prescribes flow"
                                                              : user_effect_stage_name(spec_.stage);
  }

  const EffectInfo& info() const override { return info_; }
  std::string definition() const override { return spec_.definition; }

  std::vector<int> places(const Machine& machine) const override {
    for (const UserSignal& s : spec_.signals) {
      if (!s.joint.empty() && machine.joint_index(s.joint) < 0) return {};
    }
    if (spec_.place == UserEffectPlace::kCylinder && spec_.stage != UserEffectStage::kForce) {
      return hydraulic_cylinders(machine);
    }
    return Effect::places(machine);
  }

  std::vector<EvidenceKind> shows_in() const override {
    switch (spec_.stage) {
      case UserEffectStage::kForce:
        return {EvidenceKind::kForce};
      case UserEffectStage::kFlow:
        return {EvidenceKind::kFlow};
      case UserEffectStage::kPressure:
        return {EvidenceKind::kReturnExtend, EvidenceKind::kReturnRetract,
                EvidenceKind::kSupplyExtend, EvidenceKind::kSupplyRetract};
      case UserEffectStage::kPump:
        return {EvidenceKind::kPump};
    }
    return {};
  }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    add(UserEffectStage::kForce, s, at, p, out);
  }
  template <class T>
  void add_pressure_law(const Instant<T>& s, int at, std::span<const double> p,
                        std::span<T> out) const {
    add(UserEffectStage::kPressure, s, at, p, out);
  }
  template <class T>
  void add_pump_law(const Instant<T>& s, int at, std::span<const double> p,
                    std::span<T> out) const {
    add(UserEffectStage::kPump, s, at, p, out);
  }
  SPARFLOW_EFFECT_LAW(add_force)
  SPARFLOW_EFFECT_LAW(add_pressure)
  SPARFLOW_EFFECT_LAW(add_pump)

  bool columns(const MachineSeries& log, EvidenceKind kind, int index, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const std::vector<EvidenceKind> kinds = shows_in();
    if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) return false;
    if (at >= 0 && at != index) return false;
    const Machine& machine = *log.machine;
    const bool of_pump = spec_.stage == UserEffectStage::kPump;
    const auto place = static_cast<std::size_t>(index);
    if (spec_.stage == UserEffectStage::kPressure || spec_.stage == UserEffectStage::kFlow) {
      if (!machine.cylinders[place].hydraulic()) return false;
    }
    if (!measured(log, index)) return false;
    std::vector<double> p(spec_.parameters.size()), gradient(p.size());
    for (std::size_t k = 0; k < law_index_.size(); ++k) {
      const auto s = k - static_cast<std::size_t>(linear_);
      p[law_index_[k]] = info_.parameters[k].linear ? info_.parameters[k].typical : shape[s];
    }
    std::vector<double> signals(spec_.signals.size());
    Instant<double> instant = make_instant(machine);
    columns.setZero(log.samples(), linear_);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      fill_instant(log, k, instant);
      for (std::size_t i = 0; i < signals.size(); ++i) {
        signals[i] = log_signal(spec_.signals[i], log, k, instant, index, of_pump);
      }
      spec_.law.value_and_gradient(signals, p, gradient);
      const double scale =
          of_pump ? 1.0 : in_evidence(machine.cylinders[place], kind, instant.side[place]);
      for (int c = 0; c < linear_; ++c) {
        columns(k, c) = scale * gradient[law_index_[static_cast<std::size_t>(c)]];
      }
    }
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }

 private:
  /// What one unit of the law adds to that evidence channel.
  static double in_evidence(const Cylinder& c, EvidenceKind kind, int side) {
    if (kind == EvidenceKind::kForce) return 1.0;
    if (kind == EvidenceKind::kFlow) return side < 0 ? -1.0 / c.area_rod() : 1.0 / c.area_piston();
    // A working pressure that is higher at the same load has its cause in the return chamber or in the supply chamber.
    const int back = return_side(kind);
    return back != 0 ? supply_area(c, back) / return_area(c, back) : 1.0;
  }

  /// Whether the log contains the measured signals of the law.
  bool measured(const MachineSeries& log, int index) const {
    for (const UserSignal& s : spec_.signals) {
      if (s.kind == SignalKind::kOil && log.oil.size() == 0) return false;
      if (s.kind != SignalKind::kCommand && s.kind != SignalKind::kPressureA &&
          s.kind != SignalKind::kPressureB) {
        continue;
      }
      const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(index)];
      const Eigen::VectorXd& v = s.kind == SignalKind::kCommand     ? c.command
                                 : s.kind == SignalKind::kPressureA ? c.pressure_a
                                                                    : c.pressure_b;
      if (v.size() == 0) return false;
    }
    return true;
  }

  double log_signal(const UserSignal& signal, const MachineSeries& log, Eigen::Index k,
                    const Instant<double>& s, int index, bool of_pump) const {
    const auto i = static_cast<std::size_t>(index);
    switch (signal.kind) {
      case SignalKind::kTime:
        return log.time[k] - log.time[0];
      case SignalKind::kAcceleration:
        return log.cylinders[i].acceleration[k];
      case SignalKind::kCommand:
        return log.cylinders[i].command[k];
      case SignalKind::kPressureA:
        return log.cylinders[i].pressure_a[k];
      case SignalKind::kPressureB:
        return log.cylinders[i].pressure_b[k];
      case SignalKind::kOil:
        return value_at(log.oil, k, 40.0);
      default:
        return instant_signal(signal, s, index, of_pump);
    }
  }

  template <class T>
  T instant_signal(const UserSignal& signal, const Instant<T>& s, int index, bool of_pump) const {
    const Machine& machine = *s.machine;
    const auto i = static_cast<std::size_t>(index);
    const auto joint = [&] { return static_cast<std::size_t>(machine.joint_index(signal.joint)); };
    const int pump = of_pump ? index : machine.pump_of_cylinder(index);
    const auto p = static_cast<std::size_t>(pump);
    switch (signal.kind) {
      case SignalKind::kSpeed:
        return s.speed[i];
      case SignalKind::kAcceleration: {
        const auto j = static_cast<std::size_t>(machine.cylinders[i].joint);
        return rod_acceleration(machine, index, s.q[j], s.qd[j], s.qdd[j]);
      }
      case SignalKind::kLength:
        return s.length[i];
      case SignalKind::kStroke:
        return s.length[i] - T(machine.cylinders[i].length_at_zero_stroke.value_or(0.0));
      case SignalKind::kStaticForce:
        return s.static_force[i];
      case SignalKind::kFlow:
        return s.flow[i];
      case SignalKind::kReturnFlow:
        return s.return_flow[i];
      case SignalKind::kDirection:
        return T(s.side[i]);
      case SignalKind::kPayload:
        return T(s.payload);
      case SignalKind::kOil:
        return T(s.oil);
      case SignalKind::kPumpFlow:
        return pump < 0 ? T(0.0) : s.pump_flow[p];
      case SignalKind::kPumpPressure:
        return pump < 0 ? T(0.0) : s.pump_pressure[p];
      case SignalKind::kReturnSum: {
        T sum = 0.0;
        for (const T& q : s.return_flow) sum += q;
        return sum;
      }
      case SignalKind::kJointPosition:
        return s.q[joint()];
      case SignalKind::kJointSpeed:
        return s.qd[joint()];
      case SignalKind::kJointAcceleration:
        return s.qdd[joint()];
      default:
        // Only logs have this signal; laws with it are not evaluated in motions.
        return T(std::numeric_limits<double>::quiet_NaN());
    }
  }

  template <class T>
  void add(UserEffectStage stage, const Instant<T>& s, int at, std::span<const double> p,
           std::span<T> out) const {
    if (stage != spec_.stage || !spec_.in_motion()) return;
    constexpr std::size_t kMost = 32;
    SPARFLOW_CHECK(p.size() <= kMost && spec_.signals.size() <= kMost, "a law has few names");
    std::array<double, kMost> parameters{};
    for (std::size_t k = 0; k < p.size(); ++k) parameters[law_index_[k]] = p[k];
    thread_local std::vector<T> signals;
    signals.resize(spec_.signals.size());
    const bool of_pump = stage == UserEffectStage::kPump;
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (at >= 0 && static_cast<std::size_t>(at) != i) continue;
      // At rest a law of the working pressure has no supply chamber to act on.
      if (stage == UserEffectStage::kPressure && s.side[i] == 0) continue;
      for (std::size_t k = 0; k < signals.size(); ++k) {
        signals[k] = instant_signal(spec_.signals[k], s, static_cast<int>(i), of_pump);
      }
      out[i] += spec_.law.evaluate<T>(std::span<const T>(signals),
                                      std::span<const double>(parameters.data(), p.size()));
    }
  }

  UserEffectSpec spec_;
  EffectInfo info_;
  std::vector<std::size_t> law_index_;  // index in the law of each catalogue parameter
  int linear_ = 0;
};

/// Adds all of them or, when one is refused, none.
std::vector<const Effect*> add_to_catalogue(const std::string& text, const std::string& file,
                                            const Machine* machine) {
  std::vector<std::string> built_in;
  for (const auto& effect : effect_catalogue()) {
    if (effect->definition().empty()) built_in.push_back(effect->info().id);
  }
  std::vector<UserEffectSpec> specs = parse_user_effects(text, file, machine, built_in);
  for (const UserEffectSpec& spec : specs) {
    const Effect* known = find_effect(spec.id);
    if (known == nullptr || known->definition() == spec.definition) continue;
    throw InputError(spec.where, fmt::format("effects[{}]", spec.id),
                     fmt::format("another definition of \"{0}\" is in use already, from another "
                                 "file or carried by the model: law \"{1}\" there, \"{2}\" here; "
                                 "make the two alike or choose another id, such as {0}_2",
                                 spec.id, known->info().equation, spec.equation));
  }
  std::vector<const Effect*> all;
  for (UserEffectSpec& spec : specs) {
    const Effect* known = find_effect(spec.id);
    all.push_back(
        known != nullptr ? known : add_user_effect(std::make_unique<UserEffect>(std::move(spec))));
  }
  return all;
}

}  // namespace

std::vector<const Effect*> register_user_effects(const std::string& text, const std::string& file,
                                                 const Machine& machine) {
  return add_to_catalogue(text, file, &machine);
}

std::vector<const Effect*> register_user_effects_file(const std::string& path,
                                                      const Machine* machine) {
  return add_to_catalogue(read_file(path), path, machine);
}

}  // namespace sparflow
