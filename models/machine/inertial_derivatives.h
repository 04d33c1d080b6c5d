#pragma once
/// Torques that accelerate the machine, with their first and second derivatives in closed form. A motion's optimiser needs them at every
/// knot; dual numbers through the recursion of inertial_torque.h give the same at some thirty times the cost.
///
/// Every mass is a point p(q) or, for an inertia about a joint's axis, a vector without a place. With D the derivatives of p by
/// joint coordinates, its part of torque i is m D_i . p'' (principle of virtual work: Craig 2005, sec. 6.5), and the derivatives of p'' by
/// q_l, qd_l and qdd_l are D_l'', 2 D_l' and D_l, where ' is by time along the motion. A revolute joint turns everything beyond it, so
/// that D_ab... = z_a x D_b... for a <= b <= ... with its axis z_a, and a prismatic one shifts it, so that D_ab... = 0.
#include <vector>

#include "models/machine/machine.h"
#include "models/math/jet.h"

namespace sparflow {

/// inertial_torque() with derivatives by the variables of q, qd and qdd.
/// @param q, qd, qdd by joint, at most Jet::kMax / 3 of them: each a variable of its own (Jet::variable) or a constant
/// @param payload [kg], a point mass at the tip
/// @return [N m] or [N] by joint; empty where an input is another function of the variables, for which the recursion stands
/// @throws std::domain_error when a four-bar cannot close at q
std::vector<Jet> inertial_torque_of_variables(const Machine& machine, const std::vector<Jet>& q,
                                              const std::vector<Jet>& qd,
                                              const std::vector<Jet>& qdd, double payload);

}  // namespace sparflow
