/// Solves the bundled reaches or random ones: which are feasible, which limits are named, and how the energies compare
/// with baselines, bounds and best known energies.
///   build/bench/problem_set [--random 200 --seed 1] [--write problems/best_known.json]
///   build/bench/problem_set --obstacles 200 --seed 1
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "bench/program_options.h"
#include "models/math/error.h"
#include "optimizer/solve/kept_work.h"
#include "studies/best_known.h"
#include "studies/obstacles/obstacle_reaches.h"
#include "studies/problem_set_report.h"

namespace sparflow::bench {
namespace {

/// Random reaches beside obstacles.
int run_beside_obstacles(const std::vector<ReachTask>& tasks, int paths, int processes,
                         bool compare_planner) {
  const int count = static_cast<int>(tasks.size());
  // One task alone runs here, so that a crash can be looked at; otherwise each has a child of its own.
  const std::vector<ChildResult> results = run_in_children(
      count, std::max(2, processes),
      [&](int i) {
        const ReachTask& task = tasks[static_cast<std::size_t>(i)];
        const ObstacleFigures f = solve_beside_obstacles(task, paths, compare_planner);
        print_obstacle_reach(task, f);
        std::fflush(stdout);
        return pack_obstacle_figures(f);
      },
      [&](int i, int done, const ChildResult&) {
        fmt::print(stderr, "{}/{} {}\n", done, count,
                   tasks[static_cast<std::size_t>(i)].problem.name);
      });
  std::vector<ObstacleFigures> figures;
  figures.reserve(results.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    figures.emplace_back();
    if (results[i].ok) {
      figures.back() = unpack_obstacle_figures(results[i].bytes);
      continue;
    }
    figures.back().crashed = true;
    figures.back().status = "failed";
    figures.back().message = results[i].error;
    print_obstacle_reach(tasks[i], figures.back());
  }
  print_obstacle_summary(tasks, figures);
  return std::any_of(figures.begin(), figures.end(), [](const auto& f) { return f.crashed; }) ? 5
                                                                                              : 0;
}

int run(int argc, char** argv) {
  ProgramOptions app("Solves the problem set or random reaches");
  int random_count = 0, obstacle_count = 0, processes = 2;
  bool compare_planner = false;
  std::uint64_t seed = 1;
  std::string only, write, optima, keep;
  ReachSettings settings;
  app.add("--random", random_count, "random reaches instead of the bundled ones");
  app.add("--obstacles", obstacle_count,
          "random reaches beside windows, walls, shelves and boxes at the tip, by optimize alone");
  app.flag("--compare-planner", compare_planner,
           "with --obstacles: solve also from paths of the joint grid alone");
  app.add("--seed", seed, "seed of the first random reach");
  app.add("--only", only, "bundled reaches whose name contains this");
  app.add("--write", write,
          "file of best known energies (JSON), updated where a lower one is found");
  app.add("--write-optima", keep, "file for energies, times and bounds of this run (JSON)");
  app.add("--optima", optima,
          "file of --write-optima: only the bounds are computed again; with --no-bound --no-grid "
          "those of "
          "the file are printed");
  app.add("--intervals", settings.intervals, "mesh intervals");
  app.add("--paths", settings.paths, "largest number of seed paths");
  app.flag("!--no-bound", settings.bound, "leave out the estimated lower bound");
  app.flag("!--no-grid", settings.grid, "leave out the grid's cheapest path at unlimited time");
  app.flag("!--no-timed-bound", settings.timed,
           "leave out the bound of motions in the reach's own time");
  app.add("--faster-than", settings.faster_than,
          "only reaches with less time than this many times the shortest; 0: all");
  app.add("--processes", processes, "reaches in parallel");
  app.add_journal();
  if (const auto code = app.parse(argc, argv)) return *code;
  if (!optima.empty()) {
    std::ifstream in(optima);
    settings.optima = nlohmann::json::parse(in, nullptr, false);
    if (!settings.optima.is_object())
      throw InputError({optima}, "", "not a file of --write-optima");
  }
  ModelCache models;
  if (obstacle_count > 0) {
    return run_beside_obstacles(obstacle_tasks(obstacle_count, seed, models), settings.paths,
                                processes, compare_planner);
  }
  const std::vector<ReachTask> tasks =
      random_count > 0 ? random_tasks(random_count, seed, models) : bundled_tasks(only, models);
  const auto task = [&](int i) -> const ReachTask& { return tasks[static_cast<std::size_t>(i)]; };
  std::vector<std::string> files = files_of(tasks, models);
  if (!optima.empty()) files.push_back(optima);
  const std::unique_ptr<Journal> journal =
      app.journal(files, {"--processes", "--write", "--write-optima"});
  KeptWork work;
  work.count = static_cast<int>(tasks.size());
  work.at_once = processes;
  work.name = [&](int i) { return fmt::format("reach {}", task(i).problem.name); };
  work.work = [&](int i) { return pack_figures(solve_reach(task(i), settings)); };
  const std::vector<ChildResult> results =
      run_kept(work, *journal, [&](int i, int done, const ChildResult& r) {
        if (r.ok) print_reach(task(i), unpack_figures(r.bytes));
        fmt::print(stderr, "{}/{} {}\n", done, work.count, task(i).problem.name);
      });
  std::vector<ReachFigures> figures;
  figures.reserve(results.size());
  for (const ChildResult& r : results) {
    figures.emplace_back();
    if (r.ok) {
      figures.back() = unpack_figures(r.bytes);
    } else {
      figures.back().named.clear();
      fmt::print(stderr, "a solve failed: {}\n", r.error);
    }
  }
  print_summary(tasks, figures);
  print_gap_by_time(tasks, figures);
  if (!keep.empty()) write_optima(keep, tasks, figures);
  if (!write.empty()) write_best_known(write, tasks, figures);
  journal->remove();
  return 0;
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  return sparflow::bench::run_program("problem_set", sparflow::bench::run, argc, argv);
}
