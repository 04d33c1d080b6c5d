#pragma once
/// State of a hanging load, estimated from measured forces. What swung before the log begins, or before another load was taken,
/// is in no signal but the forces.
#include <vector>

#include "models/effects/pendulum.h"
#include "models/effects/series.h"

namespace sparflow {

/// Rows [first, last) of a gap-free run during which the payload stays the same, and the state of the weight at the first row.
struct LoadPart {
  Eigen::Index first, last;
  Pendulum start;
};

/// Parts of a log with the state that fits the cylinders' measured forces best, by nonlinear least squares with a prior: the state
/// in which the part before has ended, or a weight at rest when a run begins. Each cylinder's force is compared without its mean, its
/// friction and the part along its acceleration, since these are other effects'; the whole logged payload hangs.
/// @param rope [m] > 0  @param damping ratio of the free sway [-] >= 0
std::vector<LoadPart> swinging_parts(const MachineSeries& log, const TipMotion& tip, double rope,
                                     double damping);

/// Number of parts of a log whose state is estimated; each has four values.
int swinging_part_count(const MachineSeries& log);

}  // namespace sparflow
