#pragma once
/// The page and the texts of optimize.
#include <optional>
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

/// The motion that the optimum is compared with: a seed path, driven in the same duration.
struct ComparedMotion {
  std::string name;
  Trajectory motion;
};

/// Appends drawings of a motion with the problem's obstacles, and the paths of the tip along other motions: from the side,
/// and from above where the machine does not stay in one vertical plane. Obstacles that a view cannot show are named.
void add_views(Page& page, const Machine& machine, const MotionProblem& problem,
               const Trajectory& motion, const std::vector<ComparedMotion>& beside);

/// Appends the motion: crane at several instants, joint speeds, flows, pressures, power, throttling loss of each
/// cylinder, limits at their worst, all starts.
void add_motion(Page& page, const CraneModel& model, const MotionProblem& problem,
                const OptimizeResult& result, const std::optional<ComparedMotion>& baseline = {});

/// Makes a page of add_motion() with a verdict.
Page motion_page(const CraneModel& model, const MotionProblem& problem,
                 const OptimizeResult& result, const std::optional<ComparedMotion>& baseline = {});

/// "31 % less than the straight joint line to the nearest goal configuration (120.6 kJ) and 4 % less than the cheapest
/// straight line (85.9 kJ) in the same time"; also names the cheapest seed path where it is neither of these. Returns
/// "" when no seed keeps the limits in that time.
std::string against_seeds(const OptimizeResult& result);
/// Energy over the estimated lower bound, less one: the gap of page, terminal and JSON. NaN without a bound.
double bound_gap(const OptimizeResult& result);
/// Whether most of the moving time lies outside the flows and forces of the pressure models' data.
bool mostly_outside_data(const OptimizeResult& result);
/// The headline of page and JSON without full stop: energy, what it is compared with, gap to the bound, and that most of the
/// motion lies outside what the model has learned, where it does.
std::string motion_headline(const OptimizeResult& result);
/// Explains, when every pump has constant pressure, that the energy depends on the strokes alone; "" otherwise.
std::string constant_pressure_note(const CraneModel& model);

/// Returns the result of `optimize` as JSON (keys: docs/commands.md).
std::string optimize_json(const CraneModel& model, const MotionProblem& problem,
                          const OptimizeResult& result);

/// Returns the result as text of one screen.
std::string optimize_table(const CraneModel& model, const MotionProblem& problem,
                           const OptimizeResult& result);

}  // namespace sparflow
