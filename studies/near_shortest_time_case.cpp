#include "studies/near_shortest_time_case.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <limits>

#include "bench/planned_seeds.h"
#include "optimizer/baselines/strategies.h"
#include "optimizer/bounds/energy_bound_time.h"
#include "optimizer/grid/driven_grid_path.h"
#include "optimizer/solve/child_processes.h"

namespace sparflow::bench {
namespace {

/// Default settings of `sparflow optimize`.
constexpr int kDefaultPaths = 8, kDefaultIntervals = 100;

OptimizeOptions usual_options() {
  OptimizeOptions options;
  options.intervals = kDefaultIntervals;
  options.processes = 1;
  return options;
}

OptimizeOptions heavy_options(const MotionProblem& problem, const ShortTimeSettings& settings) {
  OptimizeOptions options = usual_options();
  options.sequence_rounds = 6;
  // Beside obstacles a solve takes ten times longer, and motions differ by their paths round the obstacles, which the
  // seed paths already contain.
  if (!problem.obstacles.empty()) return options;
  options.intervals = settings.intervals;
  options.search_intervals = settings.intervals / 2;
  options.smooth_starts = 4;
  options.sequential_starts = 16;
  options.grid_starts = 8;
  options.grid_nodes = 40000;
  options.searched_starts = 4;
  return options;
}

int heavy_paths(const MotionProblem& problem, const ShortTimeSettings& settings) {
  return problem.obstacles.empty() ? settings.paths : settings.paths_beside_obstacles;
}

std::string heavy_name(int k) { return fmt::format("heavy {}", k + 1); }

/// Runs one search and keeps its result. @param search returns (value, start)
void add(std::vector<ShortTimeFound>& found, const std::string& name,
         const std::function<std::pair<double, std::string>()>& search) {
  const auto begin = std::chrono::steady_clock::now();
  const auto [value, from] = search();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  found.push_back({name, value, took.count(), from});
}

std::pair<double, std::string> outcome(const OptimizeResult& r, double value) {
  if (r.best_start < 0) return {0.0, r.message};
  return {value, r.starts[static_cast<std::size_t>(r.best_start)].seed};
}

/// Searches of one reach.
class ShortTime {
 public:
  ShortTime(const ReachTask& task, const ShortTimeSettings& settings)
      : model_(*task.model), settings_(settings), problem_(task.problem) {
    problem_.idle_power = 0.0;
    problem_.objective = {};
    usual_ = planned_seeds(problem_, kDefaultPaths, kDefaultIntervals);
    // The seeds begin at 2, because that of the default run is 1.
    for (int k = 0; k < settings.seeds; ++k) {
      heavy_.push_back(planned_seeds(problem_, heavy_paths(problem_, settings), settings.intervals,
                                     static_cast<std::uint64_t>(k) + 2));
    }
  }

  ShortTimeFigures run() {
    if (usual_.empty()) return figures_;
    shortest_times();
    figures_.duration = settings_.factor * best_of(figures_.times);
    if (!(figures_.duration > 0.0)) return figures_;
    problem_.duration = {figures_.duration, figures_.duration};
    energies();
    if (settings_.bounds) bounds();
    return figures_;
  }

 private:
  void shortest_times() {
    std::vector<ShortTimeFound>& found = figures_.times;
    MotionProblem timed = problem_;
    timed.objective.energy = 0.0;
    timed.objective.time = 1e3;
    timed.duration = {0.0, std::numeric_limits<double>::infinity()};
    const auto of = [](const OptimizeResult& r) { return outcome(r, r.duration); };
    add(found, "default", [&] { return of(optimize(model_, timed, usual_, usual_options())); });
    add(found, "named when infeasible",
        [&] { return of(shortest_motion(model_, problem_, usual_, usual_options())); });
    add(found, "strategies", [&] {
      StrategyOptions options = strategy_options();
      options.equal_time = false;
      const StrategyComparison c = compare_strategies(model_, problem_, usual_, options);
      return std::pair{c.shortest, c.shortest_of};
    });
    for (std::size_t k = 0; k < heavy_.size(); ++k) {
      add(found, heavy_name(static_cast<int>(k)), [&] {
        return of(optimize(model_, timed, heavy_[k], heavy_options(problem_, settings_)));
      });
    }
  }

  void energies() {
    std::vector<ShortTimeFound>& found = figures_.energies;
    const double duration = figures_.duration;
    const auto of = [](const OptimizeResult& r) { return outcome(r, r.energy.total); };
    add(found, "default",
        [&] { return of(optimize_at(model_, problem_, usual_, duration, usual_options())); });
    add(found, "strategies", [&] {
      const StrategyComparison c = compare_strategies(model_, problem_, usual_, strategy_options());
      const StrategyRow* row = c.row("equal");
      const StrategyOutcome* best = row != nullptr ? row->find(kOptimal) : nullptr;
      return best != nullptr && best->found() ? std::pair{best->energy.total, best->detail}
                                              : std::pair{0.0, c.message};
    });
    add(found, kDynamicProgramming, [&] { return grid_path_alone(); });
    add(found, "optimum of 1.4 times the duration, compressed in time", [&] {
      constexpr double kSlower = 1.4;
      const OptimizeResult slow =
          optimize_at(model_, problem_, usual_, kSlower * duration, usual_options());
      if (slow.best_start < 0) return outcome(slow, 0.0);
      return of(optimize_at(model_, problem_, {{"slower optimum", slow.motion, 0.0, false}},
                            duration, heavy_options(problem_, settings_)));
    });
    for (std::size_t k = 0; k < heavy_.size(); ++k) {
      add(found, heavy_name(static_cast<int>(k)), [&] {
        return of(
            optimize_at(model_, problem_, heavy_[k], duration, heavy_options(problem_, settings_)));
      });
    }
  }

  StrategyOptions strategy_options() const {
    StrategyOptions options;
    options.least_control = false;
    options.baselines.intervals = kDefaultIntervals;
    options.optimize = options.baselines.optimize = usual_options();
    return options;
  }

  /// Energy [J] of the grid's cheapest path for this duration, without further optimisation.
  std::pair<double, std::string> grid_path_alone() const {
    const DrivenGridPath path =
        driven_grid_path(model_, problem_, figures_.duration, {settings_.grid_nodes});
    return {path.energy, path.energy > 0.0 ? "grid path" : path.message};
  }

  void bounds() {
    const TimedBound time = least_duration(model_, problem_);
    if (time.valid) figures_.least_duration = time.value;
    const TimedBound energy = energy_bound_at(model_, problem_, figures_.duration);
    if (energy.valid) figures_.least_energy = energy.value;
  }

  const CraneModel& model_;
  const ShortTimeSettings& settings_;
  MotionProblem problem_;
  std::vector<SeedMotion> usual_;
  std::vector<std::vector<SeedMotion>> heavy_;
  ShortTimeFigures figures_;
};

void pack_found(Packer& p, const std::vector<ShortTimeFound>& found) {
  p.number(static_cast<double>(found.size()));
  for (const ShortTimeFound& f : found)
    p.text(f.search).number(f.value).number(f.seconds).text(f.from);
}

std::vector<ShortTimeFound> unpack_found(Unpacker& u) {
  std::vector<ShortTimeFound> found(static_cast<std::size_t>(u.number()));
  for (ShortTimeFound& f : found) {
    f.search = u.text();
    f.value = u.number();
    f.seconds = u.number();
    f.from = u.text();
  }
  return found;
}

}  // namespace

double best_of(const std::vector<ShortTimeFound>& found) {
  double best = 0.0;
  for (const ShortTimeFound& f : found) {
    if (f.value > 0.0 && (best == 0.0 || f.value < best)) best = f.value;
  }
  return best;
}

ShortTimeFigures short_time_of(const ReachTask& task, const ShortTimeSettings& settings) {
  return ShortTime(task, settings).run();
}

std::string pack_short_time(const ShortTimeFigures& f) {
  Packer p;
  pack_found(p, f.times);
  pack_found(p, f.energies);
  p.number(f.duration).number(f.least_duration).number(f.least_energy);
  return p.bytes();
}

ShortTimeFigures unpack_short_time(const std::string& bytes) {
  Unpacker u(bytes);
  ShortTimeFigures f;
  f.times = unpack_found(u);
  f.energies = unpack_found(u);
  f.duration = u.number();
  f.least_duration = u.number();
  f.least_energy = u.number();
  return f;
}

}  // namespace sparflow::bench
