#pragma once
/// What the law of a user's effect may be about: stages, places, and the signals it can name.
#include <vector>

#include "models/effects/formula/unit_algebra.h"

namespace sparflow {

/// The quantity the law adds to: [N] force of a cylinder, [m^3/s] flow into it, [Pa] its working pressure, [Pa] a
/// pump's pressure. In this order a motion is computed, so a law may use what comes before its stage.
enum class UserEffectStage { kForce, kFlow, kPressure, kPump };
/// Whose parameters they are: each cylinder's or pump's own, or one set for all of the machine.
enum class UserEffectPlace { kCylinder, kPump, kMachine };
const char* user_effect_stage_name(UserEffectStage stage);  ///< "force" ...
const char* user_effect_place_name(UserEffectPlace place);  ///< "cylinder" ...
Dimension user_effect_dimension(UserEffectStage stage);

/// Signals of a law; by cylinder, or of the pump that feeds it, unless said otherwise.
enum class SignalKind {
  kSpeed,             ///< v [m/s] of the rod, positive when it extends
  kAcceleration,      ///< a [m/s^2] of the rod
  kLength,            ///< x [m] pin to pin
  kStroke,            ///< stroke [m] = x - length_at_zero_stroke
  kStaticForce,       ///< F [N] of gravity on the piston, positive when it pushes the rod in
  kFlow,              ///< Q [m^3/s] into the working chamber, not negative
  kReturnFlow,        ///< Q_return [m^3/s] out of the other chamber, not negative
  kCommand,           ///< u [1], -1..1
  kDirection,         ///< direction: +1 extends, -1 retracts, 0 rests
  kPressureA,         ///< pA [Pa]
  kPressureB,         ///< pB [Pa]
  kPayload,           ///< payload [kg]
  kOil,               ///< oil [degC]
  kTime,              ///< t [s]
  kPumpFlow,          ///< Q_pump [m^3/s], sum over what the pump feeds
  kPumpPressure,      ///< p_pump [Pa]
  kReturnSum,         ///< Q_return_sum [m^3/s], over all cylinders of the machine
  kJointPosition,     ///< q.NAME [rad] or [m]
  kJointSpeed,        ///< qd.NAME
  kJointAcceleration  ///< qdd.NAME
};

struct SignalInfo {
  SignalKind kind;
  const char* name;  ///< "v"; "q." for joints
  const char* unit;  ///< "m/s"
  const char* meaning;
  bool of_cylinder;              ///< only laws of the stages force, flow and pressure have it
  bool in_motion;                ///< known for a planned motion; false: a log alone has it
  UserEffectStage motion_stage;  ///< first stage at which a motion's computation knows it
};
/// The table of docs/user_effects.md.
const std::vector<SignalInfo>& user_effect_signals();

}  // namespace sparflow
