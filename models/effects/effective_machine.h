#pragma once
/// What a list of effects means for a motion: another machine, laws along the chain, limits.
#include <memory>
#include <span>

#include "models/effects/effect.h"

namespace sparflow {

/// The machine with every effect that is another machine (masses, tilt) applied, in order.
/// @return without such effects `machine` itself, not copied: it must then outlive the result
std::shared_ptr<const Machine> effective_machine(const Machine& machine,
                                                 std::span<const AppliedEffect> effects);

/// Whether an effect adds to forces or pressures of a motion. Not: those that are another machine; those of the
/// flow and sensor stages; those whose info says that a motion sees nothing of them.
bool acts_in_motion(const Effect& effect);

/// Whether any of the laws that act in a motion depends on the joint accelerations (inertia). Found by evaluating
/// them at a few states with different accelerations, so that it holds for user effects, too.
bool uses_acceleration(const Machine& machine, std::span<const AppliedEffect> effects);

/// The smallest of a pump's own largest flow and what the effects leave it. [m^3/s]
/// @param own 0 = not limited  @return 0 = not limited
double effect_flow_limit(const Machine& machine, std::span<const AppliedEffect> effects, int pump,
                         double own);

}  // namespace sparflow
