#pragma once
/// Pages about a motion.
#include "apps/report/page/page.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Appends the motion: crane at several instants, joints, flows, pressures, power, throttling loss per
/// cylinder, limits at their worst, all starts.
/// @param baseline a motion to compare with at equal time (the cheapest seed); may be null
void add_motion(Page& page, const CraneModel& model, const MotionProblem& problem,
                const OptimizeResult& result, const Trajectory* baseline = nullptr,
                const std::string& baseline_name = "");

Page motion_page(const CraneModel& model, const MotionProblem& problem,
                 const OptimizeResult& result, const Trajectory* baseline = nullptr,
                 const std::string& baseline_name = "");

/// "31 % less than the straight joint line to the nearest end posture (120.6 kJ) and 4 % less than the cheapest
/// straight line (85.9 kJ) in the same time", and the cheapest seed path by name where that is none of them; ""
/// when no seed keeps the limits in that time.
std::string against_seeds(const OptimizeResult& result);
/// A sentence where every pump keeps its pressure, so that no motion of the same strokes can cost less; "" else.
std::string only_strokes_count(const CraneModel& model);

/// `optimize`'s machine-readable result (keys: docs/commands.md).
std::string optimize_json(const CraneModel& model, const MotionProblem& problem,
                          const OptimizeResult& result);

/// One screen for a terminal.
std::string optimize_table(const CraneModel& model, const MotionProblem& problem,
                           const OptimizeResult& result);

}  // namespace sparflow
