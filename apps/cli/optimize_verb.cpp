#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>

#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/motion_page.h"
#include "models/math/error.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_time.h"
#include "optimizer/grid/driven_grid_path.h"
#include "optimizer/solve/child_processes.h"
#include "optimizer/solve/child_progress.h"
#include "problems/motion_table.h"

namespace sparflow::cli {
namespace {

struct OptimizeArguments {
  std::string problem, model, output;
  SeedOptions seeds;
  int intervals = 0;
  int processes = 0;
  bool smooth_only = false;
  bool bound = false;
  double rate = 0.0;
  std::string from;
  Outputs outputs;
};

int exit_code(OptimizeStatus status) {
  switch (status) {
    case OptimizeStatus::kOptimal:
      return kDone;
    case OptimizeStatus::kInterrupted:
      return kInterrupted;
    case OptimizeStatus::kFeasible:
    case OptimizeStatus::kInfeasible:
    case OptimizeStatus::kFailed:
      return kNotSolved;
  }
  return kInternal;
}

/// Without a seed path: from paths of the joint grid, unless the planner has shown that there is no motion.
OptimizeResult without_seeds(const CraneModel& model, const MotionProblem& problem,
                             const Seeds& seeds, const OptimizeOptions& options) {
  OptimizeResult result;
  if (may_have_a_path(problem, seeds.paths.status)) {
    result = optimize(model, problem, {}, options);
    if (result.motion.size() > 1 || !result.starts.empty()) return result;
  }
  result.status = OptimizeStatus::kInfeasible;
  result.message = fmt::format("{}: infeasible. {}", problem.name, seeds.paths.message);
  for (const std::string& r : seeds.refused) result.message += " " + r + ".";
  return result;
}

/// A part of the computation of the bound.
struct BoundPart {
  const char* words;
  double of_rest;  ///< share of the work left that it is expected to be [1]
};
/// Only the progress that is told depends on the shares.
/// @threshold [1] 0..1; chosen: a timed bound evaluates a hundred bounds, the first parts two grids
constexpr BoundPart kBoundParts[] = {{"path of the joint grid", 0.05},
                                     {"bound of any duration", 0.1},
                                     {"bound with the price of time", 0.5},
                                     {"bound of the longest duration", 1.0}};

/// Sets the energies found by dynamic programming alone, and the larger of two estimated lower bounds: that of any
/// motion and that of motions within the problem's largest duration.
/// @param begin called with the number of each part as it begins; gives the progress that the part is to tell
void set_bound(const CraneModel& model, const MotionProblem& problem,
               const std::function<WorkProgress(int part)>& begin, OptimizeResult& result) {
  begin(0);
  const DrivenGridPath path = driven_grid_path(model, problem, result.duration);
  result.grid_path_energy = path.energy;
  result.unlimited_energy = path.slow_energy;
  EnergyBoundOptions any;
  any.progress = begin(1);
  const EnergyBound bound = energy_bound(model, problem, any);
  result.bound_note = bound.message;
  if (!bound.valid) return;
  result.lower_bound = bound.lower_bound_J;
  TimedBoundOptions options;
  if (problem.idle_power > 0.0 && !problem.duration.fixed()) {
    options.progress = begin(2);
    const TimedBound cost = cost_bound(model, problem, problem.idle_power, options);
    if (cost.valid) result.lower_bound_cost = cost.value;
  }
  // Within half a percent of the bound of any motion, the limited time can raise the energy by no more than that.
  const double time = problem.duration.max;
  if (!std::isfinite(time) || result.energy.total < 1.005 * bound.lower_bound_J) return;
  options.progress = begin(3);
  const TimedBound timed = energy_bound_at(model, problem, time, options);
  if (timed.valid && timed.price_W > 0.0 && timed.value > result.lower_bound) {
    result.lower_bound = timed.value;
    result.lower_bound_time = time;
  }
}

/// Computes the bound in a process of its own, which can be ended at any time, and adds its time to that of the result.
void add_bound(const CraneModel& model, const MotionProblem& problem, OptimizeResult& result) {
  if (interrupted()) {
    result.interrupted = true;
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  ChildProgress done(1);  // outlives the progress that shows it
  Progress progress("bound");
  std::atomic<int>& part = done.step();
  progress.watch([&] { return Progress::Now{done.share(), kBoundParts[part.load()].words}; });
  const ChildResult child = run_in_child(
      [&] {
        OptimizeResult r = result;
        set_bound(
            model, problem,
            [&](int next) {
              const double from = done.share();
              part = next;
              return part_of([&](double share, const std::string&) { done.set(0, share); }, from,
                             from + kBoundParts[next].of_rest * (1.0 - from));
            },
            r);
        Packer p;
        p.number(r.grid_path_energy).number(r.unlimited_energy).number(r.lower_bound);
        p.number(r.lower_bound_time).number(r.lower_bound_cost).text(r.bound_note);
        return p.bytes();
      },
      interrupted);
  result.interrupted = interrupted();
  result.bound_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.solve_s += result.bound_s;
  if (!child.ok) {
    result.bound_note = "no lower bound: " + child.error;
    return;
  }
  Unpacker u(child.bytes);
  result.grid_path_energy = u.number();
  result.unlimited_energy = u.number();
  result.lower_bound = u.number();
  result.lower_bound_time = u.number();
  result.lower_bound_cost = u.number();
  result.bound_note = u.text();
}

int run(const OptimizeArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("optimize", outputs,
                      {{"--problem", a.problem}, {"--model", a.model}, {"--from", a.from}});
  check_writable(a.output);
  a.outputs.check();
  const auto [problem, model] = load_problem_and_model(a.problem, a.model);
  OptimizeOptions options;
  options.intervals = a.intervals > 0 ? a.intervals : problem.knots.value_or(101) - 1;
  options.processes = a.processes > 0 ? a.processes : 2;
  if (a.smooth_only) {
    options.modes = false;
    options.schedule.push_back({2e-3, 1e5});
    options.smooth_iterations = 1000;
  }
  options.interrupted = interrupted;
  Seeds seeds;
  OptimizeResult result;
  {
    Progress progress("optimize");
    SeedOptions seed_options = a.seeds;
    seed_options.progress = [&](double share, const std::string& what) {
      progress(0.2 * share, what);
    };
    if (a.from.empty()) {
      seeds = make_seeds(problem, seed_options, options.intervals);
    } else {  // warm start
      seeds.motions.push_back({"previous motion", load_motion(a.from, model.machine), 0.0, false});
      seeds.motions.back().shortest_duration = seeds.motions.back().motion.duration();
      // Beside it one path of the grid, because another goal or payload may ask for another sequence of moves.
      options.sequential_starts = options.smooth_starts = 0;
      options.grid_starts = 1;
      options.sequence_rounds = 2;
    }
    progress(0.2, fmt::format("solving from {} paths", seeds.motions.size()));
    finish_on_interrupt();
    options.progress = [&](double share, const std::string& what) {
      progress(0.2 + 0.8 * share, what);
    };
    result = seeds.motions.empty() ? without_seeds(model, problem, seeds, options)
                                   : optimize(model, problem, seeds.motions, options);
  }
  if (a.bound && result.motion.size() > 1) add_bound(model, problem, result);
  if (result.motion.size() > 1 && !a.output.empty()) {
    const Trajectory rows = a.rate > 0.0 ? at_rate(result.motion, a.rate) : result.motion;
    write_file_atomically(a.output, motion_csv(model, rows, problem.payload,
                                               least_flows(model.machine, problem.limits)));
  }
  if (!a.outputs.json.empty()) a.outputs.write_json(optimize_json(model, problem, result));
  if (!a.outputs.report.empty()) {
    motion_page(model, problem, result, compared_motion(seeds, result)).write(a.outputs.report);
  }
  tell(optimize_table(model, problem, result));
  if (result.motion.size() > 1 && !a.output.empty())
    tell(fmt::format("motion written to {}\n", a.output));
  return result.interrupted ? kInterrupted : exit_code(result.status);
}

}  // namespace

void add_optimize_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<OptimizeArguments>();
  CLI::App* verb =
      app.add_subcommand("optimize", "compute the energy-optimal motion from start to goal");
  verb->add_option("--problem,-p", a->problem, "motion problem (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--model", a->model, "fitted model; absent: the one that the problem names")
      ->type_name("MODEL.json");
  verb->add_option("--output,-o", a->output, "motion to write (CSV)")->type_name("MOTION.csv");
  verb->add_option("--rate", a->rate, "rows per second of --output; absent: the mesh of the solve")
      ->type_name("HZ")
      ->check(number_from(0.1, 1e5));
  verb->add_option("--paths", a->seeds.count, "largest number of seed paths")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--seconds", a->seeds.seconds, "time for the path search [s]")
      ->check(number_from(1e-3, 1e6))
      ->capture_default_str();
  verb->add_option("--seed", a->seeds.random_seed, "random seed of the path search")
      ->capture_default_str();
  verb->add_option("--intervals", a->intervals,
                   "mesh intervals; absent: as the problem's knots, or 100")
      ->check(CLI::Range(10, 5000));
  verb->add_option("--processes", a->processes, "starts solved in parallel; absent: 2")
      ->check(CLI::Range(1, 256));
  verb->add_flag("--smooth-only", a->smooth_only,
                 "solve the single smooth NLP without modes (for comparison)");
  verb->add_flag("--bound", a->bound,
                 "also report the energy found by dynamic programming on a joint grid, the energy "
                 "at unlimited "
                 "time and an estimated lower bound (docs/energy_bound.md)");
  verb->add_option(
          "--from", a->from,
          "start from this motion (CSV of an earlier run, for another goal or payload) and "
          "one path of the joint grid")
      ->type_name("MOTION.csv")
      ->check(CLI::ExistingFile);
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
