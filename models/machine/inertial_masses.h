#pragma once
/// The masses that a machine accelerates, for inertial_torque.cpp and inertial_derivatives.cpp only.
#include "models/machine/machine.h"

namespace sparflow {

/// Adds links, a payload at the tip and the masses of linkages. @param dynamics has add_link(const Link&) and add_linkage(int cylinder)
/// @param payload [kg]
template <class Dynamics>
void add_all_masses(const Machine& machine, double payload, Dynamics& dynamics) {
  for (const Link& link : machine.links) dynamics.add_link(link);
  if (payload > 0.0 && machine.tip.joint >= 0) {
    Link load;
    load.joint = machine.tip.joint;
    load.mass = machine.tip.payload_scale * payload;
    load.cog = machine.tip.xyz;
    dynamics.add_link(load);
  }
  for (int c = 0; c < machine.cylinder_count(); ++c) dynamics.add_linkage(c);
}

}  // namespace sparflow
