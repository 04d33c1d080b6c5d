#pragma once
/// Areas from measured flow: Q = A |v| + leakage, of each direction of motion.
#include "identification/machine_from_log/load_fit.h"

namespace sparflow::from_log {

/// Fills flow_piston and flow_annulus of a cylinder whose flow a log has.
void areas_from_flow(const Machine& machine, int cylinder, const SketchRows& rows,
                     const MachineFromLogOptions& options, AreaState& area);

}  // namespace sparflow::from_log
