/// The bundled reaches and random ones, solved: what is feasible, what is named, what it costs against baselines and
/// against what is known. build/bench/problem_set [--random 200 --seed 1] [--write problems/best_known.json]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "bench/program_options.h"
#include "models/error.h"
#include "models/kinematics.h"
#include "models/model_file.h"
#include "optimizer/child_processes.h"
#include "optimizer/energy_bound_time.h"
#include "optimizer/energy_grid.h"
#include "optimizer/strategies_summary.h"
#include "planners/seed_paths.h"
#include "problems/bundled.h"
#include "problems/clearance.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

using nlohmann::json;

struct Task {
  MotionProblem problem;
  const CraneModel* model = nullptr;
  bool meant_feasible = true;
  std::string why_not;  // of one made infeasible on purpose
};

struct Figures {
  StrategyComparison comparison;
  double bound = 0.0;       // [J] certified, of motions in the optimum's time; 0 = none
  double slow_bound = 0.0;  // [J] of any motion of any duration
  double unlimited = 0.0;   // [J] cheapest path of the grid at unlimited time, 0 = not asked
  std::string named;        // what is said of an infeasible one
};

/// A bound is tight where the cheapest path of the grid, driven slowly, lies this close above the bound of any motion: the
/// lattice then is fine enough, whatever the optimiser found.
constexpr double kTight = 0.015;

struct Settings {
  int intervals = 100, paths = 4;
  bool grid = true, bound = true, timed = true;
  json optima;  // by problem: of an earlier run, not solved again
};

std::vector<SeedMotion> seeds_of(const MotionProblem& problem, const Settings& settings,
                                 std::string* message) {
  SeedOptions options;
  options.count = settings.paths;
  std::vector<SeedMotion> seeds;
  TimingOptions timing;
  timing.intervals = settings.intervals;
  const SeedResult found = find_seed_paths(problem, options);
  *message = found.message;
  for (const SeedPath& path : found.paths) {
    const TimedMotion timed = time_parametrise(problem, path.path, 0.0, timing);
    if (timed.motion.size() < 2) continue;
    seeds.push_back({fmt::format("{} {}", path.planner, seeds.size() + 1), timed.motion,
                     timed.shortest, path.planner == "straight line"});
  }
  return seeds;
}

const StrategyOutcome* optimum_of(const Figures& f) {
  const StrategyRow* row = f.comparison.row("equal");
  const StrategyOutcome* best = row != nullptr ? row->find(kOptimal) : nullptr;
  return best != nullptr && best->found() ? best : nullptr;
}

/// What --write-optima wrote of a problem: energies and times without the motions.
StrategyComparison earlier_comparison(const json& entry) {
  StrategyComparison c;
  if (!entry.contains("energies_J")) return c;
  c.shortest = entry.at("shortest_s").get<double>();
  c.solve_s = entry.at("solve_s").get<double>();
  StrategyRow row;
  row.name = "equal";
  for (const auto& [kind, energy] : entry.at("energies_J").items()) {
    StrategyOutcome o;
    o.kind = kind;
    o.duration = entry.at("duration_s").get<double>();
    o.energy.total = energy.get<double>();
    o.motion.t = Eigen::Vector2d(0.0, o.duration);  // found
    row.outcomes.push_back(std::move(o));
  }
  c.rows.push_back(std::move(row));
  return c;
}

void compare(const Task& task, const Settings& settings, Figures& f) {
  const std::vector<SeedMotion> seeds = seeds_of(task.problem, settings, &f.named);
  if (seeds.empty()) return;
  StrategyOptions options;
  options.idle_power = task.problem.idle_power;
  options.least_control = false;
  options.baselines.intervals = options.optimize.intervals = settings.intervals;
  options.baselines.polished_orders = 2;
  options.optimize.processes = 1;
  options.baselines.optimize = options.optimize;
  f.comparison = compare_strategies(*task.model, task.problem, seeds, options);
  f.named = f.comparison.message;
}

Figures solve(const Task& task, const Settings& settings) {
  Figures f;
  if (const auto earlier = settings.optima.find(task.problem.name);
      earlier != settings.optima.end()) {
    f.comparison = earlier_comparison(*earlier);
    f.named = earlier->value("named", "");
  } else {
    compare(task, settings, f);
  }
  f.comparison.problem = task.problem.name;
  f.comparison.file = task.problem.file;
  if (settings.bound) {
    const EnergyBound bound = energy_bound(*task.model, task.problem);
    if (bound.valid) f.bound = f.slow_bound = bound.lower_bound_J;
    const StrategyOutcome* best = optimum_of(f);
    if (settings.timed && bound.valid && best != nullptr) {
      const TimedBound timed = energy_bound_at(*task.model, task.problem, best->duration);
      if (timed.valid) f.bound = std::max(f.bound, timed.value);
    }
  }
  if (settings.grid && task.problem.machine.joint_count() <= 4) {
    EnergyGridOptions grid;
    grid.nodes = 20000;
    const GridPath path = EnergyGrid(*task.model, task.problem, grid).cheapest_path(0.0);
    if (path.found) f.unlimited = path.slow_energy_J;
  }
  return f;
}

std::string pack_figures(const Figures& f) {
  return Packer()
      .text(packed(f.comparison))
      .number(f.unlimited)
      .number(f.bound)
      .number(f.slow_bound)
      .text(f.named)
      .bytes();
}

Figures unpack_figures(const std::string& bytes) {
  Unpacker u(bytes);
  Figures f;
  f.comparison = unpacked_comparison(u.text());
  f.unlimited = u.number();
  f.bound = u.number();
  f.slow_bound = u.number();
  f.named = u.text();
  return f;
}

/// A reach between two random postures, or one made infeasible on purpose (every tenth).
Task random_task(const MotionProblem& base, const CraneModel& model, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Task task;
  task.model = &model;
  MotionProblem& p = task.problem;
  p = base;
  p.file.clear();
  p.obstacles.clear();
  p.tip_line.reset();
  p.idle_power = 0.0;
  p.name = fmt::format("{} random {}", base.machine.name, seed);
  const Eigen::Index n = p.start.size();
  const auto posture = [&] {
    Eigen::VectorXd q(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Range& r = p.limits.position[static_cast<std::size_t>(j)];
      q[j] = r.lo + (0.05 + 0.9 * unit(random)) * (r.hi - r.lo);  // off the ends of the range
    }
    return q;
  };
  p.start = posture();
  const Eigen::VectorXd end = posture();
  p.payload = std::floor(300.0 * unit(random));
  const Eigen::Vector3d tip = tip_position<double>(p.machine, end);
  p.goal = TipGoal{tip};
  Eigen::MatrixXd line(2, n);
  line << p.start.transpose(), end.transpose();
  const double reach = time_parametrise(p, line, 0.0).shortest;
  // time enough: what the straight line to the posture behind the goal needs, up to four times that
  const double duration = std::max(1.0, reach * (1.02 + 3.0 * unit(random) * unit(random)));
  p.duration = {duration, duration};
  if (seed % 10 == 0) {
    task.meant_feasible = false;
    const Eigen::Vector3d base_point = tip_position<double>(p.machine, p.start);
    if (seed % 20 == 0) {
      task.why_not = "out of reach";
      Eigen::Vector3d out = tip;
      out.x() = (out.x() < 0.0 ? -1.0 : 1.0) * (20.0 + base_point.norm());
      p.goal = TipGoal{out};
    } else {
      task.why_not = "too short a time";
      p.duration = {0.15 * reach, 0.15 * reach};
    }
  }
  return task;
}

struct Count {
  int feasible = 0, solved = 0, infeasible = 0, named = 0, above_baseline = 0, wrongly_solved = 0;
  int below_bound = 0;
  // excess over the certified bound, from 3 times the shortest time on and below it
  std::vector<double> bound_slow, bound_fast;
  std::vector<double> bound_tight;  // of bound_slow, where the bound is tight
  std::vector<double> gap, sequential, line, seconds;
};

/// The gap by the reach's time as a multiple of the shortest.
void report_by_time(const std::vector<Task>& tasks, const std::vector<Figures>& figures) {
  constexpr double kFrom[] = {1.0, 1.3, 2.0, 3.0, 3.4, 1e9};
  fmt::print(
      "\ntime / shortest | tight | within 2 % of the bound | optimum above it, median, 95th | "
      "above the slow path, median\n");
  for (std::size_t k = 0; k + 1 < std::size(kFrom); ++k) {
    std::vector<double> excess, slow;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const Figures& f = figures[i];
      const StrategyOutcome* best = optimum_of(f);
      if (!tasks[i].meant_feasible || best == nullptr || !(f.unlimited > 0.0)) continue;
      if (!tasks[i].problem.obstacles.empty() || tasks[i].problem.tip_line) continue;
      const double ratio = best->duration / f.comparison.shortest;
      if (ratio < (k == 0 ? 0.0 : kFrom[k]) || ratio >= kFrom[k + 1]) continue;
      slow.push_back(best->energy.total / f.unlimited - 1.0);
      if (f.unlimited < (1.0 + kTight) * f.slow_bound)
        excess.push_back(best->energy.total / f.bound - 1.0);
    }
    if (excess.empty()) continue;
    fmt::print("{:.1f} .. {:<6} | {:3} | {:3} | {:.2f} %, {:.2f} % | {:.2f} %\n", kFrom[k],
               k + 2 < std::size(kFrom) ? fmt::format("{:.1f}", kFrom[k + 1]) : "", excess.size(),
               std::count_if(excess.begin(), excess.end(), [](double x) { return x <= 0.02; }),
               100.0 * quantile(excess, 0.5), 100.0 * quantile(excess, 0.95),
               100.0 * quantile(slow, 0.5));
  }
}

void report(const std::vector<Task>& tasks, const std::vector<Figures>& figures) {
  Count c;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const Figures& f = figures[i];
    const StrategyOutcome* best = optimum_of(f);
    c.seconds.push_back(f.comparison.solve_s);
    if (!tasks[i].meant_feasible) {
      ++c.infeasible;
      if (best != nullptr) {
        ++c.wrongly_solved;
      } else if (!f.named.empty()) {
        ++c.named;
      }
      fmt::print("{:44} infeasible ({}): {}\n", tasks[i].problem.name, tasks[i].why_not,
                 best != nullptr   ? "SOLVED"
                 : f.named.empty() ? "NOT NAMED"
                                   : f.named);
      continue;
    }
    ++c.feasible;
    if (best == nullptr) {
      fmt::print("{:44} not solved: {}\n", tasks[i].problem.name, f.named);
      continue;
    }
    ++c.solved;
    std::string others;
    for (const StrategyOutcome& o : f.comparison.row("equal")->outcomes) {
      if (!o.found() || o.kind == kOptimal || o.kind == kMinimumTime) continue;
      const double excess = o.energy.total / best->energy.total - 1.0;
      if (excess < 0.0) ++c.above_baseline;
      if (o.kind == kSequential) c.sequential.push_back(excess);
      if (o.kind == kJointLine) c.line.push_back(excess);
      if (o.kind == kSequential || o.kind == kJointLine || o.kind == kTipLine)
        others += fmt::format("  {} {:+.1f} %", o.kind, 100.0 * excess);
    }
    if (f.bound > 0.0) {
      const double excess = best->energy.total / f.bound - 1.0;
      if (excess < 0.0) ++c.below_bound;
      const bool hemmed = !tasks[i].problem.obstacles.empty() || tasks[i].problem.tip_line;
      const bool slow = best->duration >= 3.0 * f.comparison.shortest;
      if (!hemmed) (slow ? c.bound_slow : c.bound_fast).push_back(excess);
      if (!hemmed && slow && f.unlimited > 0.0 && f.unlimited < (1.0 + kTight) * f.slow_bound)
        c.bound_tight.push_back(excess);
      others += fmt::format("  bound {:+.1f} %", 100.0 * excess);
    }
    if (f.unlimited > 0.0) {
      c.gap.push_back(best->energy.total / f.unlimited - 1.0);
      others += fmt::format("  unlimited time {:.2f} kJ", f.unlimited / 1e3);
    }
    fmt::print("{:44} {:8.2f} kJ {:6.2f} s ({:.2f} x shortest){}\n", tasks[i].problem.name,
               best->energy.total / 1e3, best->duration, best->duration / f.comparison.shortest,
               others);
  }
  const auto spread = [](const char* what, const std::vector<double>& v) {
    if (v.empty()) return;
    fmt::print(
        "{}: median {:+.2f} %, quartiles {:+.2f} .. {:+.2f}, 95th {:+.2f}, worst {:+.2f} ({} "
        "reaches)\n",
        what, 100 * quantile(v, 0.5), 100 * quantile(v, 0.25), 100 * quantile(v, 0.75),
        100 * quantile(v, 0.95), 100 * quantile(v, 1.0), v.size());
  };
  fmt::print(
      "\nfeasible {}: solved {} ({:.1f} %)\ninfeasible {}: named {}, solved all the same {}\n",
      c.feasible, c.solved, 100.0 * c.solved / std::max(1, c.feasible), c.infeasible, c.named,
      c.wrongly_solved);
  fmt::print("optimum above a baseline: {} times\n", c.above_baseline);
  spread("sequential over the optimum", c.sequential);
  spread("simultaneous (best end) over the optimum", c.line);
  fmt::print("optimum below its certified bound: {} times\n", c.below_bound);
  spread("optimum over the certified bound, from 3 times the shortest time on", c.bound_slow);
  spread("optimum over the certified bound, in less time", c.bound_fast);
  if (!c.bound_slow.empty()) {
    const auto near = [](const std::vector<double>& v) {
      return fmt::format("{} of {}",
                         std::count_if(v.begin(), v.end(), [](double x) { return x <= 0.02; }),
                         v.size());
    };
    fmt::print(
        "within 2 % of it from 3 times the shortest time on: {}; where the bound is tight: {}\n",
        near(c.bound_slow), near(c.bound_tight));
  }
  spread("optimum over the grid's cheapest path at unlimited time", c.gap);
  fmt::print("seconds a comparison: median {:.1f}, worst {:.1f}\n", quantile(c.seconds, 0.5),
             quantile(c.seconds, 1.0));
}

/// Energies and times of all ways, and the bounds, by problem: --optima reads them back.
void write_optima(const std::string& path, const std::vector<Task>& tasks,
                  const std::vector<Figures>& figures) {
  json all = json::object();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const Figures& f = figures[i];
    json& entry = all[tasks[i].problem.name];
    entry = {{"named", f.named}, {"solve_s", f.comparison.solve_s}};
    const StrategyOutcome* best = optimum_of(f);
    if (best == nullptr) continue;
    entry["shortest_s"] = f.comparison.shortest;
    entry["duration_s"] = best->duration;
    for (const StrategyOutcome& o : f.comparison.row("equal")->outcomes) {
      if (o.found() && o.kind != kMinimumTime) entry["energies_J"][o.kind] = o.energy.total;
    }
    entry["lower_bound_J"] = f.bound;
    entry["lower_bound_any_time_J"] = f.slow_bound;
    entry["unlimited_time_J"] = f.unlimited;
  }
  write_file_atomically(path, all.dump(1) + "\n");
}

/// Best known energies: what the file has, or what was found now where that is less.
void write_best_known(const std::string& path, const std::vector<Task>& tasks,
                      const std::vector<Figures>& figures) {
  json known = json::object();
  if (std::ifstream in(path); in) known = json::parse(in, nullptr, false);
  if (known.is_discarded() || !known.is_object()) known = json::object();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const std::string& file = tasks[i].problem.file;
    const std::string name = file.substr(file.find_last_of('/') + 1);
    if (name.empty()) continue;
    const StrategyOutcome* best = optimum_of(figures[i]);
    json& entry = known[name];
    if (best == nullptr) {
      if (entry.is_null()) entry = {{"status", "infeasible"}, {"why", figures[i].named}};
      continue;
    }
    const bool better = entry.is_null() || !entry.contains("energy_J") ||
                        entry["energy_J"].is_null() ||
                        best->energy.total < entry["energy_J"].get<double>();
    if (!better) continue;
    entry = {{"status", "optimal"},
             {"energy_J", best->energy.total},
             {"duration_s", best->duration},
             {"shortest_s", figures[i].comparison.shortest},
             {"share_moving", best->energy.share_moving},
             {"from", best->detail}};
    for (const StrategyOutcome& o : figures[i].comparison.row("equal")->outcomes) {
      if (o.found() && o.kind != kOptimal && o.kind != kMinimumTime)
        entry["baselines_J"][o.kind] = o.energy.total;
    }
    if (figures[i].bound > 0.0) entry["lower_bound_J"] = figures[i].bound;
    if (figures[i].unlimited > 0.0) entry["unlimited_time_J"] = figures[i].unlimited;
  }
  write_file_atomically(path, known.dump(1) + "\n");
}

int run(int argc, char** argv) {
  bench::ProgramOptions app("The problem set and random reaches");
  int random_count = 0, processes = 2;
  std::uint64_t seed = 1;
  std::string only, write, optima, keep;
  Settings settings;
  app.add("--random", random_count, "random reaches instead of the bundled ones");
  app.add("--seed", seed, "of the first random reach");
  app.add("--only", only, "bundled reaches whose name contains this");
  app.add("--write", write, "best known energies (JSON): kept where they are better");
  app.add("--write-optima", keep, "energies, times and bounds of this run (JSON)");
  app.add("--optima", optima, "a file of --write-optima: only the bounds are computed again");
  app.add("--intervals", settings.intervals, "of the mesh");
  app.add("--paths", settings.paths, "seed paths at most");
  app.flag("!--no-bound", settings.bound, "leave out the certified lower bound");
  app.flag("!--no-grid", settings.grid, "leave out the grid's cheapest path at unlimited time");
  app.flag("!--no-timed-bound", settings.timed,
           "leave out the bound of motions in the reach's own time");
  app.add("--processes", processes, "at the same time");
  if (const auto code = app.parse(argc, argv)) return *code;
  settings.optima = json::object();
  if (!optima.empty()) {
    std::ifstream in(optima);
    settings.optima = json::parse(in, nullptr, false);
    if (!settings.optima.is_object())
      throw InputError({optima}, "", "not a file of --write-optima");
  }
  std::vector<std::unique_ptr<CraneModel>> models;
  std::vector<std::string> model_files;
  const auto model_at = [&](const std::string& file) {
    for (std::size_t i = 0; i < model_files.size(); ++i) {
      if (model_files[i] == file) return models[i].get();
    }
    model_files.push_back(file);
    models.push_back(std::make_unique<CraneModel>(load_model(file)));
    return models.back().get();
  };
  std::vector<Task> tasks;
  if (random_count == 0) {
    for (const std::string& file : bundled_files("reaches", ".yaml")) {
      if (file.find(only) == std::string::npos) continue;
      MotionProblem problem = load_problem(file);
      std::string model_file = problem.model_path;
      if (model_file.empty() && problem.machine.name == "loader-crane")
        model_file = bundled_file("models/loader_crane.json");
      if (model_file.empty()) continue;
      Task task;
      task.model = model_at(model_file);
      task.problem = load_problem(file, &task.model->machine);
      // the bundled ones say so in their first line
      std::ifstream in(file);
      std::string first;
      std::getline(in, first);
      task.meant_feasible = first.find("Infeasible") == std::string::npos;
      task.why_not = first;
      tasks.push_back(std::move(task));
    }
  }
  for (int i = 0; i < random_count; ++i) {
    // two of three on the loader crane, whose redundancy makes it the hardest
    const std::uint64_t own = seed + static_cast<std::uint64_t>(i);
    const char* reach = own % 3 != 0   ? "loader_crane_fold"
                        : own % 2 != 0 ? "hmf_lift"
                                       : "swing_crane_far";
    const std::string file = bundled_file(std::string("reaches/") + reach + ".yaml");
    const CraneModel* model = model_at(load_problem(file).model_path);
    tasks.push_back(random_task(load_problem(file, &model->machine), *model, own));
  }
  const int count = static_cast<int>(tasks.size());
  const std::vector<ChildResult> results = run_in_children(
      count, processes,
      [&](int i) { return pack_figures(solve(tasks[static_cast<std::size_t>(i)], settings)); },
      [&](int i, int done) {
        fmt::print(stderr, "{}/{} {}\n", done, count,
                   tasks[static_cast<std::size_t>(i)].problem.name);
      });
  std::vector<Figures> figures;
  for (const ChildResult& r : results) {
    figures.emplace_back();
    if (r.ok) {
      figures.back() = unpack_figures(r.bytes);
    } else {
      figures.back().named.clear();
      fmt::print(stderr, "a solve ended: {}\n", r.error);
    }
  }
  report(tasks, figures);
  report_by_time(tasks, figures);
  if (!keep.empty()) write_optima(keep, tasks, figures);
  if (!write.empty()) write_best_known(write, tasks, figures);
  return 0;
}

}  // namespace
}  // namespace sparflow

int main(int argc, char** argv) {
  try {
    return sparflow::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "problem_set: {}\n", error.what());
    return 3;
  }
}
