#pragma once
/// Motion problems with their models, and seed paths for them.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/report/motion_pages/motion_page.h"
#include "apps/report/motion_pages/plan_page.h"
#include "apps/tasks/task.h"
#include "models/chain/crane_model.h"
#include "models/math/error.h"
#include "optimizer/solve/optimize.h"
#include "planners/seed_paths.h"
#include "problems/problem.h"

namespace sparflow {

/// A motion problem with its model. The machine in the model file replaces the one that the problem file names.
struct ProblemAndModel {
  MotionProblem problem;
  CraneModel model;
};
/// Reads the problem file once, and the model that is given or that the file names.
/// @param model_path empty: the model that the problem names  @return nothing when there is no model  @throws InputError
std::optional<ProblemAndModel> load_problem_with_model(const std::string& problem_path,
                                                       const std::string& model_path,
                                                       const Listener& listener);
/// Reads a problem for a model that is there already.
ProblemAndModel load_problem_for(const std::string& problem_path, CraneModel model,
                                 const Listener& listener);
/// The error of a problem without a model.
UsageError no_model();
/// As load_problem_with_model. @throws UsageError when there is no model
ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path, const Listener& listener);

/// Refuses a cycle, or a motion that begins or ends moving, where a verb knows one move from rest to rest only. @param verb whose words the sentence begins with  @throws InputError
void require_one_move(const std::string& verb, const MotionProblem& problem);

/// Mesh intervals of a problem: those that are asked for, else as its knots, else 100. @param asked 0: not asked for
int intervals_of(const MotionProblem& problem, int asked);

/// Seed paths of OMPL and the motions made of them by time parametrisation.
struct Seeds {
  SeedResult paths;
  std::vector<SeedMotion> motions;   ///< the paths that the limits allow to be driven
  std::vector<std::string> refused;  ///< why the other paths cannot be driven
};
Seeds make_seeds(const MotionProblem& problem, const SeedOptions& options, int intervals);

/// The seed that a page draws beside the optimum: the cheapest straight joint line at this duration, or the cheapest
/// seed where no straight line keeps the limits; nothing when no seed does.
std::optional<ComparedMotion> compared_motion(const Seeds& seeds, const OptimizeResult& result);

/// The work of `plan`. @param options its progress is the listener's  @throws UsageError for a number outside its range
Seeds plan_task(const MotionProblem& problem, SeedOptions options, const Listener& listener);
/// The paths as the page draws them, as JSON (keys: docs/commands.md), as text of one screen, and all waypoints as CSV.
PlannedPaths drawn_paths(const Seeds& seeds);
std::string plan_json(const MotionProblem& problem, const Seeds& seeds);
std::string plan_table(const MotionProblem& problem, const Seeds& seeds);
std::string plan_csv(const Machine& machine, const std::vector<SeedPath>& paths);

}  // namespace sparflow
