#pragma once
/// The signals that the law of a user's effect can contain: one table with their names, units and values.
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// The place at which a law is evaluated, and the joint that a signal names.
struct SignalPlace {
  const Machine& machine;
  std::size_t cylinder = 0;  ///< unused by signals of the machine
  int pump = -1;             ///< the pump, or that which feeds the cylinder; -1 = none
  std::size_t joint = 0;
};

struct SignalInfo {
  enum class Owner { kCylinder, kMachine, kJoint };
  const char* name;  ///< "v"; "q." for joints
  const char* unit;  ///< "m/s"
  const char* meaning;
  Owner owner;  ///< kCylinder: laws of stage pump cannot have it
  /// First stage of a motion's computation at which it is known.
  EffectStage motion_stage = EffectStage::kForce;
  /// Values in a log, where they are not those of its instants; an empty vector: not measured.
  Eigen::VectorXd (*of_log)(const MachineSeries&, std::size_t cylinder) = nullptr;
  /// Value at an instant [SI, degC]. Null: only a log has it.
  double (*value)(const Instant<double>&, const SignalPlace&) = nullptr;
  Jet (*jet)(const Instant<Jet>&, const SignalPlace&) = nullptr;

  bool in_motion() const { return value != nullptr; }  ///< known for a planned motion
};
/// All signals, in the order of the table in docs/user_effects.md.
const std::vector<SignalInfo>& user_effect_signals();

}  // namespace sparflow
