#pragma once
/// Stages and places of a user's effect, and the signals that its law can contain.
#include <vector>

#include "models/effects/formula/unit_algebra.h"

namespace sparflow {

/// The quantity to which the law adds: force of a cylinder [N], flow into it [m^3/s], its working pressure [Pa], a pump's
/// pressure [Pa]. A motion is computed in this order, so that a law may use results of earlier stages.
enum class UserEffectStage { kForce, kFlow, kPressure, kPump };
/// Whether each cylinder or pump has its own parameters, or the whole machine has one set.
enum class UserEffectPlace { kCylinder, kPump, kMachine };
const char* user_effect_stage_name(UserEffectStage stage);  ///< "force" ...
const char* user_effect_place_name(UserEffectPlace place);  ///< "cylinder" ...
Dimension user_effect_dimension(UserEffectStage stage);

/// Signals of a law; they belong to the cylinder, or to the pump that feeds it, unless stated otherwise.
enum class SignalKind {
  kSpeed,             ///< v [m/s] of the rod, positive when it extends
  kAcceleration,      ///< a [m/s^2] of the rod
  kLength,            ///< x [m] pin to pin
  kStroke,            ///< stroke [m] = x - length_at_zero_stroke
  kStaticForce,       ///< F [N] of gravity on the piston, positive when it pushes the rod in
  kFlow,              ///< Q [m^3/s] into the supply chamber, not negative
  kReturnFlow,        ///< Q_return [m^3/s] out of the return chamber, not negative
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
  bool in_motion;                ///< known for a planned motion; false: only a log has it
  UserEffectStage motion_stage;  ///< first stage of a motion's computation at which it is known
};
/// All signals, in the order of the table in docs/user_effects.md.
const std::vector<SignalInfo>& user_effect_signals();

}  // namespace sparflow
