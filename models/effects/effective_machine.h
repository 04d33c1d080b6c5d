#pragma once
/// How a list of effects acts on a motion: a changed machine, laws of the chain, limits.
#include <memory>
#include <span>

#include "models/effects/effect.h"

namespace sparflow {

/// The machine after every effect that changes it (masses, tilt) has been applied, in order.
/// @return without such effects `machine` itself, not a copy; it must then outlive the result
std::shared_ptr<const Machine> effective_machine(const Machine& machine,
                                                 std::span<const AppliedEffect> effects);

/// Whether an effect adds to forces or pressures of a motion. Effects that change the machine do not, nor do those of the
/// stages flow and sensor and those whose info().in_motion begins with "nothing".
bool acts_in_motion(const Effect& effect);

/// Whether any of the laws that act in a motion depends on the joint accelerations (inertia). They are
/// evaluated at a few states with different accelerations, which covers user effects as well.
bool uses_acceleration(const Machine& machine, std::span<const AppliedEffect> effects);

/// The smallest of a pump's own largest flow and the limits of the effects. [m^3/s]
/// @param own 0 = not limited  @return 0 = not limited
double effect_flow_limit(const Machine& machine, std::span<const AppliedEffect> effects, int pump,
                         double own);

}  // namespace sparflow
