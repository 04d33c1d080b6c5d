#include "optimizer/solve/optimize.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "models/math/error.h"
#include "optimizer/solve/grid_seeds.h"
#include "optimizer/solve/optimize_cycle.h"
#include "optimizer/solve/optimize_outcome.h"

namespace sparflow {

std::vector<Eigen::VectorXd> end_postures(const std::vector<SeedMotion>& seeds) {
  std::vector<Eigen::VectorXd> ends;
  ends.reserve(seeds.size());
  for (const SeedMotion& s : seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  return ends;
}

OptimizeResult shortest_motion(const CraneModel& model, const MotionProblem& problem,
                               const std::vector<SeedMotion>& seeds,
                               const OptimizeOptions& options) {
  MotionProblem fastest = problem;
  fastest.objective = {0.0, 1e3, 0.0, problem.objective.smoothness};
  const double shortest = shortest_seed(seeds);
  const double guess = shortest > 0.0 ? 1.1 * shortest : std::max(problem.duration.min, 1.0);
  fastest.duration = {0.0, 20.0 * guess};
  OptimizeOptions direct = options;
  direct.schedule.clear();
  direct.sequential_starts = 0;
  direct.sequence_rounds = 0;
  return optimize_in(model, fastest, seeds, {guess, 0.02 * guess, 20.0 * guess}, direct);
}

OptimizeResult optimize_at(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, double duration,
                           const OptimizeOptions& options) {
  return optimize_in(model, problem, seeds, TimeWindow::fixed(duration), options);
}

void require_complete(const CraneModel& model, const MotionProblem& problem) {
  const std::vector<std::string> missing = model.missing();
  if (missing.empty()) return;
  throw InputError({problem.file, 0, 0}, "model",
                   fmt::format("the model has no working pressure for {}; fit it on a log in "
                               "which that movement occurs",
                               fmt::join(missing, ", ")));
}

OptimizeResult optimize(const CraneModel& model, const MotionProblem& problem,
                        const std::vector<SeedMotion>& seeds, const OptimizeOptions& options) {
  require_complete(model, problem);
  if (!problem.stops.empty()) return optimize_cycle(model, problem, {}, options);
  if (seeds.empty()) {
    const GridSeeds found = grid_seeds(model, problem, options.grid_nodes);
    if (!found.motions.empty()) return optimize(model, problem, found.motions, options);
    OptimizeResult none;
    none.status = OptimizeStatus::kInfeasible;
    none.message = fmt::format("{}: infeasible. {}", problem.name, found.message);
    return none;
  }
  if (problem.duration.fixed())
    return optimize_at(model, problem, seeds, problem.duration.min, options);

  // A free duration is a variable of every start. Its result depends on the initial duration, so two are tried.
  const auto begin = std::chrono::steady_clock::now();
  const double shortest = shortest_seed(seeds);
  const double lo = std::max(problem.duration.min, 0.05 * shortest);
  // An endless window is cut off where the search begins, and widened while the result lies at its end.
  const bool endless = std::isinf(problem.duration.max);
  double hi = endless ? std::max(6.0 * shortest, 2.0 * lo) : std::max(problem.duration.max, lo);
  OptimizeResult best;
  int durations = 0;
  const auto cost = [](const OptimizeResult& o) {
    return o.best_start < 0 ? std::numeric_limits<double>::infinity()
                            : o.starts[static_cast<std::size_t>(o.best_start)].cost;
  };
  double told = 0.0;
  const auto search = [&](double guess, double told_to) {
    const TimeWindow window{std::clamp(guess, lo, hi), lo, hi};
    OptimizeOptions part = options;
    part.progress = part_of(options.progress, told, told_to);
    told = told_to;
    OptimizeResult r = optimize_in(model, problem, seeds, window, part);
    ++durations;
    if (durations == 1 || cost(r) < cost(best)) best = std::move(r);
  };
  const auto stopped = [&] { return options.interrupted && options.interrupted(); };
  // Where time costs nothing the longest motion is the cheapest, which may be far from either.
  const bool time_is_free = problem.idle_power <= 0.0 && problem.objective.time <= 0.0;
  /// Longest duration over the shortest from which the search begins there as well.
  /// @threshold [1] 2..20; chosen: beyond the two others, which are 1.3 and 3 times the shortest
  constexpr double kFarFromBoth = 4.0;
  const bool from_longest = time_is_free && !endless && hi > kFarFromBoth * shortest;
  const double each = from_longest ? 1.0 / 3.0 : endless ? 0.45 : 0.5;  // the rest for widenings
  search(1.3 * shortest, each);
  if (!stopped()) search(3.0 * shortest, 2.0 * each);
  if (!stopped() && from_longest) search(hi, 1.0);
  /// Share of a window's end from which a result lies at it.
  /// @threshold [1] 0.9..1; chosen: an optimum inside the window is flat, so its duration is not exact
  constexpr double kAtTheEnd = 0.98;
  /// Factor by which an endless window is widened then.
  /// @threshold [1] 1.5..10; chosen: few searches lead to any duration
  constexpr double kWider = 4.0;
  /// Largest number of widenings.
  /// @threshold [1] 0..20; chosen: a thousand times the first window; ends a search in which time costs next to nothing
  constexpr int kMostWidenings = 5;
  for (int i = 0; endless && i < kMostWidenings && !stopped(); ++i) {
    if (best.best_start < 0 || best.duration < kAtTheEnd * hi) break;
    hi *= kWider;
    search(2.0 * best.duration, 0.5 * (1.0 + told));
  }
  best.evaluated_durations = durations;
  best.solve_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return best;
}

}  // namespace sparflow
