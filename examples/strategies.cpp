/// One cylinder after another, all at once, or energy-optimal: the same reach in the same time.
///   strategies [PROBLEM.yaml MODEL.json]
#include "optimizer/baselines/strategies.h"

#include <fmt/format.h>

#include <exception>

#include "models/files/model_file.h"
#include "models/math/error.h"
#include "optimizer/baselines/strategies_summary.h"
#include "planners/seed_paths.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

using namespace sparflow;

namespace {

std::vector<SeedMotion> seeds_of(const MotionProblem& problem) {
  const SeedResult found = find_seed_paths(problem);
  if (found.paths.empty()) throw InputError({problem.file, 0, 0}, "", found.message);
  std::vector<SeedMotion> seeds;
  for (const SeedPath& path : found.paths) {
    const TimedMotion timed = time_parametrise(problem, path.path, 0.0);
    if (timed.motion.size() < 2) continue;
    seeds.push_back({path.planner, timed.motion, timed.shortest, path.planner == "straight line"});
  }
  if (seeds.empty()) throw InputError({problem.file, 0, 0}, "", "no path keeps the limits");
  return seeds;
}

int run(int argc, char** argv) {
  if (argc != 1 && argc != 3) throw UsageError("usage: strategies [PROBLEM.yaml MODEL.json]");
  const std::string file = argc > 1 ? argv[1] : bundled_file("reaches/loader_crane_hurry.yaml");
  const CraneModel model =
      load_model(argc > 1 ? argv[2] : bundled_file("models/loader_crane.json"));
  const MotionProblem problem = load_problem(file, &model.machine);

  StrategyOptions options;
  options.least_control = false;  // only the three strategies of interest
  options.shortest_time = false;
  options.optimize.search_intervals = 30;  // a coarse search keeps this short
  options.optimize.sequence_rounds = 1;
  options.optimize.intervals = options.baselines.intervals = 50;
  const StrategyComparison result = compare_strategies(model, problem, seeds_of(problem), options);
  const StrategyRow row = result.rows.empty() ? StrategyRow{} : result.rows.front();
  const StrategyOutcome* best = row.find(kOptimal);
  if (best == nullptr || !best->found()) {
    fmt::print(stderr, "{}\n", best ? best->why : result.message);
    return 4;
  }
  fmt::print("{}, {:.2f} s\n", result.problem, row.duration);
  for (const char* kind : {kSequential, kJointLine, kOptimal}) {
    const StrategyOutcome* o = row.find(kind);
    if (o == nullptr || !o->found()) {
      fmt::print("{:<28} {}\n", strategy_title(kind), o != nullptr ? o->why : "not tried");
    } else {
      fmt::print("{:<28} {:7.2f} kJ  {:+5.1f} %\n", strategy_title(kind), o->energy.total / 1e3,
                 100.0 * (o->energy.total / best->energy.total - 1.0));
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
