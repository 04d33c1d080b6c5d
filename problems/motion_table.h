#pragma once
/// Motion file (CSV): a motion with its flows, pressures and power by the exact law.
#include <map>
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/machine/trajectory.h"
#include "problems/motion_limits.h"

namespace sparflow {

/// Columns: t_s, q_*, qd_*, qdd_* by joint, Q_*_lpm, P_*_bar, x_*_m (stroke) and, where the valve's full flow is known,
/// u_* (command, -1..1) by cylinder, p_*_bar by pump, power_W, payload_kg. It can be read as a log.
/// @param least flows of the valves below which a cylinder stands: its command is then 0
std::string motion_csv(const CraneModel& model, const Trajectory& motion, double payload,
                       const LeastFlows& least = {});

/// The same with the problem's payload and its valves' least flows; of a cycle the payload changes at its stops.
std::string motion_csv(const CraneModel& model, const MotionProblem& problem,
                       const Trajectory& motion);

/// Payload at an instant of a motion; at a stop it is the one from then on. [kg]
double payload_at(const MotionProblem& problem, const Trajectory& motion, double t);

/// The same motion at a fixed rate: positions and speeds are those of the motion at each instant, accelerations are the
/// mean over each step, so that the rows are a motion again. The last step ends with the motion and may be shorter.
/// @param rate [Hz], > 0
Trajectory at_rate(const Trajectory& motion, double rate);

/// Reads a motion (t, q, qd, qdd; other columns are ignored).
/// @throws InputError with line and column name
Trajectory load_motion(const std::string& path, const Machine& machine);

/// The same of columns in memory. @param name of the motion in messages  @throws InputError with column name and row
Trajectory motion_from_columns(const std::string& name,
                               const std::map<std::string, std::vector<double>>& columns,
                               const Machine& machine);

/// Whether the header of a table names a speed and an acceleration of every joint, as motion files do.
bool names_speeds(const std::string& header, const Machine& machine);

}  // namespace sparflow
