#pragma once
/// Motion of the point from which a payload hangs, computed from a log's joint positions and their derivatives.
#include "models/effects/series.h"

namespace sparflow {

/// Acceleration and Jacobian of the tip in the base frame, sample by sample; NaN where the positions are not known.
/// @pre machine.tip.joint >= 0
TipMotion tip_motion(const MachineSeries& log);

}  // namespace sparflow
