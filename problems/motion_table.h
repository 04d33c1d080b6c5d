#pragma once
/// Motion file (CSV): a motion with its flows, pressures and power by the exact law.
#include <string>

#include "models/chain/crane_model.h"
#include "models/machine/trajectory.h"

namespace sparflow {

/// Columns: t_s, q_*, qd_*, qdd_* by joint, Q_*_lpm and P_*_bar by cylinder, p_*_bar by pump, power_W.
std::string motion_csv(const CraneModel& model, const Trajectory& motion, double payload);

/// Reads a motion (t, q, qd, qdd; other columns are ignored).
/// @throws InputError with line and column name
Trajectory load_motion(const std::string& path, const Machine& machine);

}  // namespace sparflow
