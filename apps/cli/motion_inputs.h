#pragma once
/// Motion problems with their models, and seed paths for them.
#include <optional>
#include <string>
#include <vector>

#include "apps/report/motion_pages/motion_page.h"
#include "models/chain/crane_model.h"
#include "models/math/error.h"
#include "optimizer/solve/optimize.h"
#include "planners/seed_paths.h"
#include "problems/problem.h"

namespace sparflow::cli {

/// A motion problem with its model. The machine in the model file replaces the one that the problem file names.
struct ProblemAndModel {
  MotionProblem problem;
  CraneModel model;
};
/// Reads the problem file once, and the model that is given or that the file names.
/// @param model_path empty: the model that the problem names  @return nothing when there is no model  @throws InputError
std::optional<ProblemAndModel> load_problem_with_model(const std::string& problem_path,
                                                       const std::string& model_path);
/// The error of a problem without a model.
UsageError no_model();
/// The same. @throws UsageError when there is no model
ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path);

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

}  // namespace sparflow::cli
