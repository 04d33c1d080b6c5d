#include "models/effects/formula/user_signals.h"

#include "models/machine/linkage.h"

namespace sparflow {
namespace {

/// d2x/dt2 of the rod. For derivatives the slope of d3x/dq3 is needed, by central differences: 1e-4 rad leave 1e-8 of it,
/// and it only enters second derivatives.
template <class T>
T rod_acceleration(const Instant<T>& s, const SignalPlace& at) {
  const auto rates = [&](double q) {
    return linkage_rates(at.machine, static_cast<int>(at.cylinder), q);
  };
  const auto j = static_cast<std::size_t>(at.machine.cylinders[at.cylinder].joint);
  const T &q = s.q[j], &qd = s.qd[j], &qdd = s.qdd[j];
  if constexpr (std::is_same_v<T, double>) {
    const Taylor3 x = rates(q);
    return x.d1 * qdd + x.d2 * qd * qd;
  } else {
    /// Step of the difference quotient of the third derivative.
    /// @threshold [rad or m] 1e-6..1e-2; numerical: truncation h^2 and rounding 1e-16/h are both below 1e-8
    constexpr double kStep = 1e-4;
    const Taylor3 x = rates(q.value);
    const double d4 = (rates(q.value + kStep).d3 - rates(q.value - kStep).d3) / (2.0 * kStep);
    return q.chain(x.d1, x.d2, x.d3) * qdd + q.chain(x.d2, x.d3, d4) * qd * qd;
  }
}

/// A signal that instants have.
template <class Value>
SignalInfo known(SignalInfo info, Value value) {
  info.value = value;
  info.jet = value;
  return info;
}

template <class T>
T of_pump(const std::vector<T>& values, const SignalPlace& at) {
  return at.pump < 0 ? T(0.0) : values[static_cast<std::size_t>(at.pump)];
}

}  // namespace

const std::vector<SignalInfo>& user_effect_signals() {
  using enum SignalInfo::Owner;
  using At = const SignalPlace&;
  using Log = const MachineSeries&;
  constexpr EffectStage kForce = EffectStage::kForce, kPressure = EffectStage::kPressure;
  static const std::vector<SignalInfo> signals = {
      known({"v", "m/s", "speed of the rod, positive when it extends", kCylinder},
            [](const auto& s, At at) { return s.speed[at.cylinder]; }),
      known({"a", "m/s^2", "acceleration of the rod", kCylinder, kForce,
             [](Log log, std::size_t i) { return log.cylinders[i].acceleration; }},
            [](const auto& s, At at) { return rod_acceleration(s, at); }),
      known({"x", "m", "length of the cylinder, pin to pin", kCylinder},
            [](const auto& s, At at) { return s.length[at.cylinder]; }),
      known({"stroke", "m", "x - length_at_zero_stroke", kCylinder},
            []<class T>(const Instant<T>& s, At at) {
              const Cylinder& c = at.machine.cylinders[at.cylinder];
              return s.length[at.cylinder] - T(c.length_at_zero_stroke.value_or(0.0));
            }),
      known({"F", "N", "static force, positive when the load pushes the rod in", kCylinder},
            [](const auto& s, At at) { return s.static_force[at.cylinder]; }),
      known({"Q", "m^3/s", "flow into the supply chamber, not negative", kCylinder},
            [](const auto& s, At at) { return s.flow[at.cylinder]; }),
      known({"Q_return", "m^3/s", "flow out of the return chamber, not negative", kCylinder},
            [](const auto& s, At at) { return s.return_flow[at.cylinder]; }),
      {"u", "1", "command of the valve, -1 to 1", kCylinder, kForce,
       [](Log log, std::size_t i) { return log.cylinders[i].command; }},
      known({"direction", "1", "+1 extends, -1 retracts, 0 rests", kCylinder},
            []<class T>(const Instant<T>& s, At at) { return T(s.side[at.cylinder]); }),
      {"pA", "Pa", "pressure of the bore side", kCylinder, kForce,
       [](Log log, std::size_t i) { return log.cylinders[i].pressure_a; }},
      {"pB", "Pa", "pressure of the rod side", kCylinder, kForce,
       [](Log log, std::size_t i) { return log.cylinders[i].pressure_b; }},
      known({"payload", "kg", "load at the tip", kMachine},
            []<class T>(const Instant<T>& s, At) { return T(s.payload); }),
      known({"oil", "degC", "temperature of the oil", kMachine, kForce,
             [](Log log, std::size_t) { return log.oil; }},
            []<class T>(const Instant<T>& s, At) { return T(s.oil); }),
      {"t", "s", "time since the log began", kMachine, kForce,
       [](Log log, std::size_t) -> Eigen::VectorXd { return log.time.array() - log.time[0]; }},
      known(
          {"Q_pump", "m^3/s", "flow of the pump, the sum over what it feeds", kMachine, kPressure},
          [](const auto& s, At at) { return of_pump(s.pump_flow, at); }),
      known({"p_pump", "Pa", "pressure of the pump", kMachine, EffectStage::kPump},
            [](const auto& s, At at) { return of_pump(s.pump_pressure, at); }),
      known({"Q_return_sum", "m^3/s", "return flow of all cylinders together", kMachine, kPressure},
            []<class T>(const Instant<T>& s, At) {
              T sum = 0.0;
              for (const T& q : s.return_flow) sum += q;
              return sum;
            }),
      known({"q.", "rad or m", "position of the joint", kJoint},
            [](const auto& s, At at) { return s.q[at.joint]; }),
      known({"qd.", "rad/s or m/s", "speed of the joint", kJoint},
            [](const auto& s, At at) { return s.qd[at.joint]; }),
      known({"qdd.", "rad/s^2 or m/s^2", "acceleration of the joint", kJoint},
            [](const auto& s, At at) { return s.qdd[at.joint]; })};
  return signals;
}

}  // namespace sparflow
