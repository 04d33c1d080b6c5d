/// Compares variants of the motion optimiser in one run on one core, as ratios of times: phases with exact Hessians, the
/// single smooth NLP, L-BFGS, finite differences, ADOL-C, dynamic programming; growth with mesh, joints and kernels.
///   build/bench/motion_speed [--json OUT.json] [--only ways|growth] [--reaches 6]
/// Times are processor times, which depend least on other programs of the machine. docs/speed.md has the tables.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bench/motion_cases.h"
#include "bench/motion_speed_derivatives.h"
#include "bench/planned_seeds.h"
#include "bench/program_options.h"
#include "models/math/error.h"
#include "optimizer/grid/energy_grid.h"
#include "problems/time_parametrise.h"

namespace {

using namespace sparflow;
using namespace sparflow::bench;

constexpr double kEqualEnergy = 1.005;  // [-] ratio up to which energies count as equal

/// One solve, or one search. [s], [J]
struct Run {
  bool solved = false;
  std::string message;
  double cpu = 0.0;                      // all, checks of the motion included
  double solve = 0.0;                    // part of `cpu` in Ipopt
  double callbacks = 0.0, linear = 0.0;  // parts of `solve`: problem functions, KKT solver
  int iterations = 0;
  double energy = 0.0;  // by the exact law
};

/// Times one start. @param work returns the start's result
template <class Work>
Run timed(const Work& work) {
  const double cpu = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  const StartResult r = work();
  Run run;
  run.cpu = cpu_seconds() - cpu;
  const double wall =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  // The solver reports wall times, which are scaled to processor time by the ratio of the totals.
  const double share = run.cpu / std::max(wall, 1e-9);
  run.solve = share * r.solve_s;
  run.callbacks = share * r.callbacks_s;
  run.linear = share * r.linear_solver_s;
  run.iterations = r.iterations;
  run.energy = r.energy_exact;
  run.solved = r.motion.size() > 1 && r.excess <= 1e-5 && r.energy_exact > 0.0;
  run.message = fmt::format("{}: {}", to_string(r.status), r.message);
  return run;
}

struct Way {
  std::string name;
  OptimizeOptions options;
  bool phases = true;
};

OptimizeOptions one_solve(int intervals) {
  OptimizeOptions options;
  options.intervals = intervals;
  options.processes = 1;
  options.max_seconds =
      600.0;  // wall time, long because the machine may be busy; the iterations limit a solve
  options.schedule.clear();  // Only the seed's own modes are solved, without a smooth stage.
  return options;
}

/// A variant that solves the same reach from the same start motion.
std::vector<Way> ways(const CraneModel& model, const MotionProblem& problem) {
  std::vector<Way> all;
  all.push_back({"phases, exact Hessian", one_solve(100)});
  Way mumps{"phases, exact Hessian, MUMPS", one_solve(100)};
  mumps.options.ipopt = {{"linear_solver", "mumps"}};
  all.push_back(mumps);
  Way smooth{"single smooth NLP, exact Hessian", one_solve(100), false};
  smooth.options.modes = false;
  smooth.options.schedule = {{20e-3, 10e5}, {2e-3, 1e5}};
  smooth.options.smooth_iterations = 1000;
  all.push_back(smooth);
  Way bfgs{"phases, L-BFGS", one_solve(100)};
  bfgs.options.ipopt = {{"hessian_approximation", "limited-memory"}};
  bfgs.options.phase_iterations = 500;
  all.push_back(bfgs);
  Way differences{"phases, finite differences", one_solve(100)};
  differences.options.knot_wrapper = [](const CraneKnotOptions&, std::shared_ptr<KnotModel> knot) {
    return with_finite_differences(std::move(knot));
  };
  all.push_back(differences);
  Way gradients{"phases, differenced gradients, L-BFGS", one_solve(100)};
  gradients.options.knot_wrapper = differences.options.knot_wrapper;
  gradients.options.ipopt = bfgs.options.ipopt;
  gradients.options.phase_iterations = 500;
  all.push_back(gradients);
#ifdef SPARFLOW_ADOLC
  Way adolc{"phases, ADOL-C", one_solve(100)};
  adolc.options.knot_wrapper = [&model, &problem](const CraneKnotOptions& options,
                                                  std::shared_ptr<KnotModel> knot) {
    return with_adolc(model, problem, options, std::move(knot));
  };
  all.push_back(adolc);
#endif
  return all;
}

struct ReachRuns {
  std::string name, seed;
  std::vector<Run> by_way;
  Run task;                // optimize() with default options
  double task_wall = 0.0;  // [s] wall time with two processes
  std::vector<Run> grids;  // searches on joint grids, by size
  std::vector<long> nodes;
};

/// Chooses the first path of the planner that is not a straight line, else the straight line.
const SeedMotion* chosen_seed(const std::vector<SeedMotion>& seeds, double duration) {
  const SeedMotion* chosen = nullptr;
  for (const SeedMotion& s : seeds) {
    if (s.shortest_duration > duration) continue;
    if (chosen == nullptr || (chosen->straight_line && !s.straight_line)) chosen = &s;
  }
  return chosen;
}

void run_grids(const CraneModel& model, const MotionProblem& problem, double target,
               ReachRuns& runs) {
  double last = 0.0;
  for (const int nodes : {15000, 60000, 250000, 1000000}) {
    if (4.5 * last > 12.0)
      break;  // The next search is four times larger and takes at least four times longer.
    const double cpu = cpu_seconds();
    EnergyGrid grid(model, problem, EnergyGridOptions{nodes});
    const GridPath path = grid.path_for_duration(problem.duration.min);
    Run run;
    run.cpu = last = cpu_seconds() - cpu;
    run.solved = path.found && path.duration_s <= problem.duration.min * (1.0 + 1e-9);
    run.energy = path.energy_J;
    run.message = path.message;
    runs.grids.push_back(run);
    runs.nodes.push_back(grid.nodes());
    if (run.solved && run.energy <= kEqualEnergy * target) break;
  }
}

ReachRuns run_reach(const CraneModel& model, const MotionProblem& problem) {
  ReachRuns runs;
  runs.name = problem.name;
  const std::vector<SeedMotion> seeds = planned_seeds(problem, 6, 100);
  const double duration = problem.duration.min;
  const SeedMotion* seed = chosen_seed(seeds, duration);
  if (seed == nullptr)
    throw InputError({}, problem.name, "no planned path keeps the limits in the given time");
  runs.seed = seed->name;
  for (const Way& way : ways(model, problem)) {
    const auto solve = [&] {
      return timed([&] {
        StartResult r = optimize_from(model, problem, *seed, duration, way.options);
        // A start returns its seed when it fails, which is no solution by this variant.
        if (way.phases && !r.modes_held) r.energy_exact = 0.0;
        return r;
      });
    };
    Run run = solve();
    if (run.cpu < 0.5) {  // The first run only warms the caches.
      const Run again = solve();
      if (again.cpu < run.cpu) run = again;
    }
    runs.by_way.push_back(run);
  }
  const double cpu = cpu_seconds() + children_cpu_seconds();
  const OptimizeResult task = optimize(model, problem, seeds);
  runs.task.cpu = cpu_seconds() + children_cpu_seconds() - cpu;
  runs.task_wall = task.solve_s;
  runs.task.solved = task.status == OptimizeStatus::kOptimal;
  runs.task.energy = task.energy.total;
  runs.task.message = task.message;
  const double ours = runs.task.solved ? runs.task.energy : runs.by_way.front().energy;
  run_grids(model, problem, ours, runs);
  return runs;
}

struct GrowthRow {
  std::string what;
  int value = 0;
  Run run;
};

/// One reach whose solve is timed.
struct TimedReach {
  const CraneModel& model;
  const MotionProblem& problem;
  SeedMotion seed;
};

GrowthRow growth_row(const std::string& what, int value, const TimedReach& reach, int intervals,
                     int iterations) {
  OptimizeOptions options = one_solve(intervals);
  options.phase_iterations = iterations;
  options.tightenings = 0;
  options.refine = 2;  // The growth of the solve is measured, not that of the checks.
  GrowthRow row{what, value, {}};
  row.run = timed([&] {
    return optimize_from(reach.model, reach.problem, reach.seed, reach.problem.duration.min,
                         options);
  });
  return row;
}

SeedMotion straight_line(const MotionProblem& problem) {
  Eigen::MatrixXd path(2, problem.start.size());
  path.row(0) = problem.start.transpose();
  path.row(1) = std::get<JointGoal>(problem.goal).q.transpose();
  const TimedMotion timed = time_parametrise(problem, path, 0.0);
  return {"line", timed.motion, timed.shortest, true};
}

std::vector<GrowthRow> run_growth(const CraneModel& model, const MotionProblem& lift) {
  std::vector<GrowthRow> rows;
  rows.reserve(18);
  const std::vector<SeedMotion> seeds = planned_seeds(lift, 2, 100);
  for (const int intervals : {50, 100, 200, 400, 800, 1600})
    rows.push_back(growth_row("intervals", intervals, {model, lift, seeds.front()}, intervals, 25));
  for (const int joints : {2, 3, 4, 5, 6, 7}) {
    const MotionProblem chain = chain_problem(joints);
    const CraneModel synthetic = synthetic_model(chain.machine, 100);
    rows.push_back(growth_row("joints", joints, {synthetic, chain, straight_line(chain)}, 100, 25));
  }
  const MotionProblem chain = chain_problem(3);
  for (const int centres : {50, 100, 300, 600, 1200, 2400}) {
    const CraneModel synthetic = synthetic_model(chain.machine, centres);
    rows.push_back(growth_row("kernels a process", centres,
                              {synthetic, chain, straight_line(chain)}, 100, 12));
  }
  return rows;
}

// --- output ------------------------------------------------------------------------------

nlohmann::json as_json(const Run& run) {
  return {{"solved", run.solved},          {"cpu_s", run.cpu},
          {"solve_s", run.solve},          {"callbacks_s", run.callbacks},
          {"linear_solver_s", run.linear}, {"iterations", run.iterations},
          {"energy_J", run.energy},        {"message", run.message}};
}

void print_reach(const ReachRuns& r, const std::vector<Way>& ways) {
  fmt::print("\n{}, from {}\n", r.name, r.seed);
  for (std::size_t w = 0; w < ways.size(); ++w) {
    const Run& run = r.by_way[w];
    fmt::print("  {:38} {:9.1f} ms {:5} iterations  {:8.3f} kJ  {}\n", ways[w].name, 1e3 * run.cpu,
               run.iterations, 1e-3 * run.energy, run.solved ? "" : "not solved: " + run.message);
  }
}

void print_ways(const std::vector<ReachRuns>& runs, const std::vector<Way>& ways) {
  fmt::print(
      "\nOne solve, N = 100, from the same planned path; medians over {} reaches (ratios: of each "
      "reach's own)\n{:40} {:>9} {:>9} {:>9} {:>9} {:>6} {:>9} {:>8} {:>12}  {}\n",
      runs.size(), "", "all ms", "solve ms", "callbacks", "linear", "iter", "ms/iter", "ratio",
      "energy", "not solved");
  for (std::size_t w = 0; w < ways.size(); ++w) {
    const auto of = [&](const auto& figure) {
      std::vector<double> figures(runs.size());
      std::transform(runs.begin(), runs.end(), figures.begin(),
                     [&](const ReachRuns& r) { return figure(r.by_way[w], r.by_way.front()); });
      std::erase_if(figures, [](double x) { return std::isnan(x); });
      return median(figures);
    };
    std::string failed;
    for (const ReachRuns& r : runs) {
      if (!r.by_way[w].solved) failed += (failed.empty() ? "" : ", ") + r.name;
    }
    fmt::print(
        "{:40} {:9.1f} {:9.1f} {:9.1f} {:9.1f} {:6.0f} {:9.2f} {:8.2f} {:+10.2f} %  {}\n",
        ways[w].name, of([](const Run& r, const Run&) { return 1e3 * r.cpu; }),
        of([](const Run& r, const Run&) { return 1e3 * r.solve; }),
        of([](const Run& r, const Run&) { return 1e3 * r.callbacks; }),
        of([](const Run& r, const Run&) { return 1e3 * r.linear; }),
        of([](const Run& r, const Run&) { return double(r.iterations); }),
        of([](const Run& r, const Run&) { return 1e3 * r.solve / std::max(1, r.iterations); }),
        of([](const Run& r, const Run& ours) { return r.solve / ours.solve; }),
        of([](const Run& r, const Run& ours) {
          return r.solved && ours.solved ? 100.0 * (r.energy / ours.energy - 1.0) : std::nan("");
        }),
        failed);
  }
}

void print_tasks(const std::vector<ReachRuns>& runs) {
  fmt::print(
      "\nWhole task (optimize() with its defaults) and dynamic programming on the joint grid until "
      "within {:.1f} % of its energy\n{:14} {:>9} {:>9} {:>9}   {:>10} {:>9} {:>9} {:>8}\n",
      100.0 * (kEqualEnergy - 1.0), "reach", "wall s", "cpu s", "kJ", "nodes", "cpu s", "energy",
      "ratio");
  std::vector<double> wall, cpu;
  wall.reserve(runs.size());
  cpu.reserve(runs.size());
  for (const ReachRuns& r : runs) {
    wall.push_back(r.task_wall);
    cpu.push_back(r.task.cpu);
    fmt::print("{:14} {:9.2f} {:9.2f} {:9.2f}", r.name, r.task_wall, r.task.cpu,
               1e-3 * r.task.energy);
    for (std::size_t g = 0; g < r.grids.size(); ++g) {
      const Run& grid = r.grids[g];
      const std::string energy =
          grid.solved ? fmt::format("{:+.2f} %", 100.0 * (grid.energy / r.task.energy - 1.0))
                      : "no path";
      const bool equal = grid.solved && grid.energy <= kEqualEnergy * r.task.energy;
      const std::string ratio = equal ? fmt::format("{:.2f}", grid.cpu / r.task.cpu)
                                      : (g + 1 == r.grids.size() ? "never" : "");
      if (g > 0) fmt::print("{:44}", "");
      fmt::print("   {:10} {:9.2f} {:>9} {:>8}\n", r.nodes[g], grid.cpu, energy, ratio);
    }
  }
  fmt::print("{:14} {:9.2f} {:9.2f}\n", "median", median(wall), median(cpu));
}

void print_growth(const std::vector<GrowthRow>& rows) {
  fmt::print("\nGrowth, one solve\n{:18} {:>6} {:>6} {:>10} {:>10} {:>10} {:>10}\n", "", "", "iter",
             "ms/iter", "callbacks", "linear", "exponent");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const GrowthRow& row = rows[i];
    const double n = std::max(1, row.run.iterations);
    std::string exponent;
    if (i > 0 && rows[i - 1].what == row.what) {
      const GrowthRow& before = rows[i - 1];
      const double last = before.run.solve / std::max(1, before.run.iterations);
      exponent = fmt::format("{:.2f}", std::log(row.run.solve / n / last) /
                                           std::log(double(row.value) / before.value));
    }
    fmt::print("{:18} {:6} {:6} {:10.3f} {:10.3f} {:10.3f} {:>10}\n", row.what, row.value,
               row.run.iterations, 1e3 * row.run.solve / n, 1e3 * row.run.callbacks / n,
               1e3 * row.run.linear / n, exponent);
  }
}

/// Largest relative difference between the derivatives of one model by ADOL-C and by hand.
double adolc_difference(const CraneModel& model, const MotionProblem& problem) {
  CraneKnotOptions options;
  options.smoothing.pressure = 0.3e5;
  options.modes.resize(3, 3);
  options.modes << CylinderMode::kExtend, CylinderMode::kExtend, CylinderMode::kExtend,  //
      CylinderMode::kRetract, CylinderMode::kExtend, CylinderMode::kRetract,             //
      CylinderMode::kRest, CylinderMode::kRetract, CylinderMode::kExtend;
  const auto ours = std::make_shared<CraneKnotModel>(model, problem, options);
  const auto inner = std::make_shared<CraneKnotModel>(model, problem, options);
  const std::shared_ptr<KnotModel> taped = with_adolc(model, problem, options, inner);
  if (taped == nullptr) return std::nan("");
  return largest_difference(*ours, *taped, problem, options.modes, 300);
}

int run(const std::string& json_path, const std::string& only, int reaches) {
  fmt::print("{}, g++ {}, load {:.1f}; processor times of one core\n", processor(), __VERSION__,
             load_average());
  const CraneModel model = bundled_model();
  std::vector<MotionProblem> problems = loader_crane_reaches();
  problems.resize(std::min(problems.size(), static_cast<std::size_t>(reaches)));
  nlohmann::json json = {
      {"cpu", processor()}, {"compiler", "g++ " __VERSION__}, {"load", load_average()}};
  if (only != "growth") {
    const double difference = adolc_difference(model, problems.front());
    fmt::print("ADOL-C against the derivatives by hand, 300 random points: {:.1e} relative\n",
               difference);
    if (difference > 1e-9)
      throw InputError({}, "ADOL-C", "its derivatives differ from those derived by hand");
    if (!std::isnan(difference)) json["adolc_difference"] = difference;
    const std::vector<Way> all = ways(model, problems.front());
    std::vector<ReachRuns> runs;
    runs.reserve(problems.size());
    for (const MotionProblem& problem : problems) {
      runs.push_back(run_reach(model, problem));
      print_reach(runs.back(), all);
      nlohmann::json entry = {{"seed", runs.back().seed}, {"task_wall_s", runs.back().task_wall}};
      for (std::size_t w = 0; w < all.size(); ++w)
        entry["ways"][all[w].name] = as_json(runs.back().by_way[w]);
      entry["task"] = as_json(runs.back().task);
      for (std::size_t g = 0; g < runs.back().grids.size(); ++g) {
        entry["grids"].push_back(as_json(runs.back().grids[g]));
        entry["grids"].back()["nodes"] = runs.back().nodes[g];
      }
      json["reaches"][problem.name] = entry;
    }
    print_ways(runs, all);
    print_tasks(runs);
  }
  if (only != "ways") {
    const std::vector<GrowthRow> rows = run_growth(model, problems.front());
    print_growth(rows);
    for (const GrowthRow& row : rows) {
      nlohmann::json entry = as_json(row.run);
      entry[row.what] = row.value;
      json["growth"].push_back(entry);
    }
  }
  if (!json_path.empty()) write_file_atomically(json_path, json.dump(2) + "\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  setvbuf(stdout, nullptr, _IOLBF, 0);  // The run takes minutes, so each line is printed at once.
  std::string json, only;
  int reaches = 6;
  bench::ProgramOptions app(
      "Compares variants of the motion optimiser as ratios of times in one run on one core.");
  app.add("--json", json, "file for the figures (JSON)");
  app.add("--only", only, "part to run: ways (variants) or growth").one_of({"ways", "growth"});
  app.add("--reaches", reaches, "number of reaches").range(1, 6);
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    return run(json, only, reaches);
  } catch (const InputError& error) {
    std::cerr << "motion_speed: " << error.what() << "\n";
    return 3;
  }
}
