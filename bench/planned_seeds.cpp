#include "bench/planned_seeds.h"

#include <fmt/format.h>

#include "problems/time_parametrise.h"

namespace sparflow::bench {

std::vector<SeedMotion> planned_seeds(const MotionProblem& problem, int most, int intervals,
                                      std::uint64_t seed, SeedResult* planned) {
  SeedOptions options;
  options.count = most;
  options.random_seed = seed;
  TimingOptions timing;
  timing.intervals = intervals;
  SeedResult found = find_seed_paths(problem, options);
  std::vector<SeedMotion> seeds;
  seeds.reserve(found.paths.size());
  for (const SeedPath& path : found.paths) {
    const TimedMotion timed = time_parametrise(problem, path.path, 0.0, timing);
    if (timed.motion.size() < 2) continue;
    seeds.push_back({fmt::format("{} {}", path.planner, seeds.size() + 1), timed.motion,
                     timed.shortest, path.planner == "straight line"});
  }
  if (planned != nullptr) *planned = std::move(found);
  return seeds;
}

}  // namespace sparflow::bench
