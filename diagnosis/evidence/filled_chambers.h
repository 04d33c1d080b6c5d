#pragma once
/// Where a valve's flow sets the speed of a rod. Behind a load that runs ahead, the chamber that grows falls to the pressure of the
/// anti-cavitation valve: a void opens, the rod follows its load and not the command, and the flow fills the void first.
/// Source: Merritt (1967), Hydraulic Control Systems, ch. 6 (cavitation under overrunning loads).
#include "identification/signals/signals.h"

namespace sparflow {

/// Whether the chamber that grows, by the rod's speed or by the command, carries pressure, at the sample and in the filter's window
/// about it, which would mix both states. Everywhere true where the log does not measure both chambers.
/// @param least_pressure [Pa] below which a chamber counts as void  @return [samples]
Mask chambers_filled(const MachineSignals& signals, const CylinderSignals& cylinder,
                     double least_pressure);

}  // namespace sparflow
