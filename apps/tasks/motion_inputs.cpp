#include "apps/tasks/motion_inputs.h"

#include <fmt/format.h>

#include "apps/tasks/inputs.h"
#include "models/files/machine_file.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

/// Warns where the problem names another machine than that of the model. A problem needs no machine of its own when the
/// model file has one.
void tell_other_machine(const ProblemAndModel& both, const Listener& listener) {
  if (both.problem.machine_path.empty()) return;
  try {
    const std::string own = load_machine(both.problem.machine_path).name;
    if (own == both.model.machine.name) return;
    listener.say_warning(
        fmt::format("the problem names machine {}, but the model was fitted for {}; the "
                    "model's machine is used",
                    own, both.model.machine.name));
  } catch (const InputError&) {
    return;
  }
}

}  // namespace

std::optional<ProblemAndModel> load_problem_with_model(const std::string& problem_path,
                                                       const std::string& model_path,
                                                       const Listener& listener) {
  if (!model_path.empty())
    return load_problem_for(problem_path, read_model(model_path, listener), listener);
  ProblemAndModel both;
  both.problem = load_problem_with(problem_path, [&](const std::string& named) -> const Machine* {
    if (named.empty()) return nullptr;
    both.model = read_model(named, listener);
    return &both.model.machine;
  });
  for (const std::string& n : both.problem.notes) listener.say_note(n);
  if (both.problem.model_path.empty()) return std::nullopt;
  return both;
}

ProblemAndModel load_problem_for(const std::string& problem_path, CraneModel model,
                                 const Listener& listener) {
  ProblemAndModel both;
  both.model = std::move(model);
  both.problem =
      load_problem_with(problem_path, [&](const std::string&) { return &both.model.machine; });
  for (const std::string& n : both.problem.notes) listener.say_note(n);
  tell_other_machine(both, listener);
  return both;
}

UsageError no_model() {
  return UsageError(
      "no model: give --model MODEL.json, or name a model in the problem file (key `model`)");
}

ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path, const Listener& listener) {
  std::optional<ProblemAndModel> both = load_problem_with_model(problem_path, model_path, listener);
  if (!both) throw no_model();
  return std::move(*both);
}

void require_one_move(const std::string& verb, const MotionProblem& problem) {
  if (moves_at_an_end(problem)) {
    throw InputError({problem.file, 0, 0}, "velocity",
                     fmt::format("{} knows motions from rest to rest only; drop the velocities, or "
                                 "use `optimize`",
                                 verb));
  }
  if (problem.stops.empty()) return;
  throw InputError({problem.file, 0, 0}, "cycle",
                   fmt::format("{} knows single moves only, and this problem is a cycle of {}; "
                               "`optimize` solves cycles, or give one leg as start and goal",
                               verb, problem.stops.size() + 1));
}

int intervals_of(const MotionProblem& problem, int asked) {
  return asked > 0 ? asked : problem.knots.value_or(101) - 1;
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

}  // namespace sparflow
