#pragma once
/// Which samples of a motion are steady: what a model lacks of starts, stops and the bounce after them must not decide about laws of steady
/// motion.
#include "identification/signals/signals.h"

namespace sparflow {

/// Time since the speed of a cylinder last changed fast: within `span` by its median while it moves. A smooth reversal is no such change.
/// Infinite where there was none, in each gap-free stretch by itself. [samples, s]
/// @param span [s]
Eigen::VectorXd since_unsteady(const MachineSignals& signals, const CylinderSignals& cylinder,
                               double span);

}  // namespace sparflow
