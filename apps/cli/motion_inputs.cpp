#include "apps/cli/motion_inputs.h"

#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "models/files/machine_file.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow::cli {

std::optional<ProblemAndModel> load_problem_with_model(const std::string& problem_path,
                                                       const std::string& model_path) {
  ProblemAndModel both;
  const bool given = !model_path.empty();
  if (given) both.model = load_model_with_warnings(model_path);
  both.problem = load_problem_with(problem_path, [&](const std::string& named) -> const Machine* {
    if (given) return &both.model.machine;
    if (named.empty()) return nullptr;
    both.model = load_model_with_warnings(named);
    return &both.model.machine;
  });
  for (const std::string& n : both.problem.notes) note(n);
  if (!given && both.problem.model_path.empty()) return std::nullopt;
  if (given && !both.problem.machine_path.empty()) {
    try {
      const std::string own = load_machine(both.problem.machine_path).name;
      if (own != both.model.machine.name) {
        warn(
            fmt::format("the problem names machine {}, but the model was fitted for {}; the "
                        "model's machine is used",
                        own, both.model.machine.name));
      }
    } catch (const InputError&) {
      // A problem needs no machine of its own when the model file has one.
    }
  }
  return both;
}

UsageError no_model() {
  return UsageError(
      "no model: give --model MODEL.json, or name a model in the problem file (key `model`)");
}

ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path) {
  std::optional<ProblemAndModel> both = load_problem_with_model(problem_path, model_path);
  if (!both) throw no_model();
  return std::move(*both);
}

Seeds make_seeds(const MotionProblem& problem, const SeedOptions& options, int intervals) {
  Seeds seeds;
  seeds.paths = find_seed_paths(problem, options);
  TimingOptions timing;
  timing.intervals = intervals;
  int number = 0;
  for (const SeedPath& path : seeds.paths.paths) {
    const std::string name = fmt::format("{} {}", path.planner, ++number);
    const TimedMotion timed = time_parametrise(problem, path.path, 0.0, timing);
    if (timed.motion.size() < 2) {
      seeds.refused.push_back(name + ": " + timed.message);
      continue;
    }
    seeds.motions.push_back({name, timed.motion, timed.shortest, path.planner == "straight line"});
  }
  return seeds;
}

std::optional<ComparedMotion> compared_motion(const Seeds& seeds, const OptimizeResult& result) {
  const std::string& name =
      result.straight_line_name.empty() ? result.best_seed_name : result.straight_line_name;
  for (const SeedMotion& s : seeds.motions) {
    if (s.name == name) return ComparedMotion{s.name, with_duration(s.motion, result.duration)};
  }
  return std::nullopt;
}

}  // namespace sparflow::cli
