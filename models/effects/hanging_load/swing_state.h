#pragma once
/// State of a hanging load, estimated from measured forces. What swung before the log begins, or before another load was taken,
/// is in no signal but the forces.
#include <span>
#include <vector>

#include "models/effects/hanging_load/pendulum.h"
#include "models/effects/series.h"

namespace sparflow {

/// Rows [first, last) of a gap-free run during which the payload stays the same, and the state of the weight at the first row.
struct LoadPart {
  Eigen::Index first, last;
  Pendulum start;
};

/// Parts of a log with the state that fits the cylinders' measured forces best, by nonlinear least squares with a prior: the state
/// in which the part before has ended, or a weight at rest when a run begins. Each cylinder's force is compared while it moves, since
/// friction carries the load of one at rest, and without its mean, its friction and the part along the force that accelerates the machine
/// with a fixed payload, since these are other effects'; the whole logged payload hangs.
/// @param rope [m] > 0  @param damping ratio of the free sway [-] >= 0
std::vector<LoadPart> swinging_parts(const MachineSeries& log, const TipMotion& tip, double rope,
                                     double damping);

/// Acceleration with which a weight on a rope pulls the tip beyond one that is fixed to it [samples x 3, m/s^2, base frame]: the
/// spherical pendulum below a point with acceleration a. With n the unit vector from the tip to the weight, G = (g - a) / rope,
///   n'' = G - n (n G) - n |n'|^2 - 2 damping omega n',   omega^2 = |g| / rope,
/// the weight's own acceleration is a + rope n'', and the result is rope n'': by Newton's second law the suspension pulls with all that
/// gravity does not, so that damping, which is its pins' and its rope's (the air's is a hundredth of it), acts on the tip as well. Every
/// run begins at rest in the direction of g - a, every part in its own state. For small deflections its horizontal part is the tip's acceleration through a second-order lag, less that acceleration.
/// @param acceleration [samples x 3, m/s^2] of the tip; where it is NaN the last one continues
/// @param rope [m] > 0  @param damping ratio of the free sway [-] >= 0  @param parts in the order of the rows; may be empty
Eigen::MatrixX3d pull_of_hanging_weight(const MachineSeries& log,
                                        const Eigen::MatrixX3d& acceleration, double rope,
                                        double damping, std::span<const LoadPart> parts = {});

/// Number of parts of a log whose state is estimated; each has four values.
int swinging_part_count(const MachineSeries& log);

}  // namespace sparflow
