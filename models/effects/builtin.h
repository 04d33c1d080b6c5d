#pragma once
/// The built-in effects' makers, one a file; registry.cpp lists them.
#include <memory>

#include "models/effects/effect.h"

namespace sparflow {

std::unique_ptr<Effect> make_coulomb_friction();
std::unique_ptr<Effect> make_unmodelled_mass();
std::unique_ptr<Effect> make_pump_lag();

/// Unit vector from a joint towards the next (or the tip), in the joint's frame: "along the link".
Eigen::Vector3d link_direction(const Machine& machine, int joint);

}  // namespace sparflow
