#pragma once
/// Motion of the point from which a payload hangs, computed from a log's joint positions and their derivatives.
#include <span>

#include "models/effects/series.h"
#include "models/effects/swing_state.h"

namespace sparflow {

/// Acceleration and Jacobian of the tip in the base frame, sample by sample; NaN where the positions are not known.
/// @pre machine.tip.joint >= 0
TipMotion tip_motion(const MachineSeries& log);

/// Acceleration with which a weight on a rope pulls the tip beyond one that is fixed to it [samples x 3, m/s^2, base frame]: the
/// spherical pendulum below a point with acceleration a. With n the unit vector from the tip to the weight, G = (g - a) / rope,
///   n'' = G - n (n G) - n |n'|^2 - 2 damping omega n',   omega^2 = |g| / rope,
/// the rope carries T = rope (n G + |n'|^2) per mass, and the result is -T n + g - a. Every run begins at rest in the direction of
/// g - a. For small deflections its horizontal part is the tip's acceleration through a second-order lag, less that acceleration.
/// @param acceleration [samples x 3, m/s^2] of the tip; where it is NaN the last one continues
/// @param rope [m] > 0  @param damping ratio of the free sway [-] >= 0
Eigen::MatrixX3d pull_of_hanging_weight(const MachineSeries& log,
                                        const Eigen::MatrixX3d& acceleration, double rope,
                                        double damping, std::span<const LoadPart> parts = {});

}  // namespace sparflow
