#include "models/effects/formula/user_signals.h"

namespace sparflow {

using Stage = UserEffectStage;

const char* user_effect_stage_name(UserEffectStage stage) {
  static constexpr const char* kNames[] = {"force", "flow", "pressure", "pump"};
  return kNames[static_cast<std::size_t>(stage)];
}

const char* user_effect_place_name(UserEffectPlace place) {
  static constexpr const char* kNames[] = {"cylinder", "pump", "machine"};
  return kNames[static_cast<std::size_t>(place)];
}

Dimension user_effect_dimension(UserEffectStage stage) {
  return stage == Stage::kForce  ? dimensions::kForce
         : stage == Stage::kFlow ? dimensions::kFlow
                                 : dimensions::kPressure;
}

const std::vector<SignalInfo>& user_effect_signals() {
  static const std::vector<SignalInfo> signals = {
      {SignalKind::kSpeed, "v", "m/s", "speed of the rod, positive when it extends", true, true,
       Stage::kForce},
      {SignalKind::kAcceleration, "a", "m/s^2", "acceleration of the rod", true, true,
       Stage::kForce},
      {SignalKind::kLength, "x", "m", "length of the cylinder, pin to pin", true, true,
       Stage::kForce},
      {SignalKind::kStroke, "stroke", "m", "x - length_at_zero_stroke", true, true, Stage::kForce},
      {SignalKind::kStaticForce, "F", "N", "static force, positive when the load pushes the rod in",
       true, true, Stage::kForce},
      {SignalKind::kFlow, "Q", "m^3/s", "flow into the supply chamber, not negative", true, true,
       Stage::kForce},
      {SignalKind::kReturnFlow, "Q_return", "m^3/s", "flow out of the return chamber, not negative",
       true, true, Stage::kForce},
      {SignalKind::kCommand, "u", "1", "command of the valve, -1 to 1", true, false, Stage::kForce},
      {SignalKind::kDirection, "direction", "1", "+1 extends, -1 retracts, 0 rests", true, true,
       Stage::kForce},
      {SignalKind::kPressureA, "pA", "Pa", "pressure of the bore side", true, false, Stage::kForce},
      {SignalKind::kPressureB, "pB", "Pa", "pressure of the rod side", true, false, Stage::kForce},
      {SignalKind::kPayload, "payload", "kg", "load at the tip", false, true, Stage::kForce},
      {SignalKind::kOil, "oil", "degC", "temperature of the oil", false, true, Stage::kForce},
      {SignalKind::kTime, "t", "s", "time since the log began", false, false, Stage::kForce},
      {SignalKind::kPumpFlow, "Q_pump", "m^3/s", "flow of the pump, the sum over what it feeds",
       false, true, Stage::kPressure},
      {SignalKind::kPumpPressure, "p_pump", "Pa", "pressure of the pump", false, true,
       Stage::kPump},
      {SignalKind::kReturnSum, "Q_return_sum", "m^3/s", "return flow of all cylinders together",
       false, true, Stage::kPressure},
      {SignalKind::kJointPosition, "q.", "rad or m", "position of the joint", false, true,
       Stage::kForce},
      {SignalKind::kJointSpeed, "qd.", "rad/s or m/s", "speed of the joint", false, true,
       Stage::kForce},
      {SignalKind::kJointAcceleration, "qdd.", "rad/s^2 or m/s^2", "acceleration of the joint",
       false, true, Stage::kForce},
  };
  return signals;
}

}  // namespace sparflow
