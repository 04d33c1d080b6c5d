#include "studies/problem_set_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "optimizer/baselines/strategies_statistics.h"

namespace sparflow::bench {
namespace {

/// [-] A bound counts as tight where the cheapest path of the grid, driven slowly, lies at most this far above the bound
/// of any motion; the lattice is then fine enough, independent of the optimiser.
constexpr double kTight = 0.015;

/// [-] It counts as tight at its own time where the path of dynamic programming, driven in that time, lies at most this
/// far above it; twice kWithin, because the path has steps.
constexpr double kTightOwn = 0.04;

constexpr double kWithin = 0.02;  // [-] required gap

using Excess = std::vector<double>;  // relative

struct Count {
  int feasible = 0, solved = 0, infeasible = 0, named = 0, above_baseline = 0, wrongly_solved = 0;
  int below_bound = 0;
  // excess over the estimated bound, from 3 times the shortest time on and below it
  std::vector<double> bound_slow, bound_fast;
  std::vector<double> bound_tight;            // of bound_slow, where the bound is tight
  std::vector<double> gap_twice, gap_thrice;  // over the slow path, from 2 and 3 times on
  std::vector<double> sequential, line, seconds;
};

bool tight(const ReachFigures& f) {
  return f.unlimited > 0.0 && f.unlimited < (1.0 + kTight) * f.slow_bound;
}

bool tight_own(const ReachFigures& f) {
  return f.grid_path > 0.0 && f.grid_path < (1.0 + kTightOwn) * f.bound;
}

std::ptrdiff_t within(const std::vector<double>& excess) {
  return std::count_if(excess.begin(), excess.end(), [](double x) { return x <= kWithin; });
}

/// Counts an infeasible reach and describes it.
std::string add_infeasible(const ReachTask& task, const ReachFigures& f, Count& c) {
  const bool solved = f.optimum() != nullptr;
  ++c.infeasible;
  if (solved) ++c.wrongly_solved;
  if (!solved && !f.worst.empty()) ++c.named;
  return fmt::format("{:44} infeasible ({}): {}\n", task.problem.name, task.why_not,
                     solved            ? "SOLVED"
                     : f.worst.empty() ? "NO LIMIT NAMED: " + f.named
                                       : f.named);
}

/// Counts and describes the excess of the other strategies over the optimum.
std::string against_strategies(const ReachFigures& f, const StrategyOutcome& best, Count& c) {
  std::string text;
  for (const StrategyOutcome& o : f.comparison.row("equal")->outcomes) {
    if (!o.found() || o.kind == kOptimal || o.kind == kMinimumTime) continue;
    const double excess = o.energy.total / best.energy.total - 1.0;
    if (excess < 0.0) ++c.above_baseline;
    if (o.kind == kSequential) c.sequential.push_back(excess);
    if (o.kind == kJointLine) c.line.push_back(excess);
    if (o.kind == kSequential || o.kind == kJointLine || o.kind == kTipLine)
      text += fmt::format("  {} {:+.1f} %", o.kind, 100.0 * excess);
  }
  return text;
}

/// Counts and describes the excess of the optimum over its bounds.
std::string against_bounds(const ReachTask& task, const ReachFigures& f,
                           const StrategyOutcome& best, Count& c) {
  std::string text;
  if (f.bound > 0.0) {
    const double excess = best.energy.total / f.bound - 1.0;
    if (excess < 0.0) ++c.below_bound;
    const bool slow = best.duration >= 3.0 * f.comparison.shortest;
    if (!task.is_restricted()) (slow ? c.bound_slow : c.bound_fast).push_back(excess);
    if (!task.is_restricted() && slow && tight(f)) c.bound_tight.push_back(excess);
    text += fmt::format("  bound {:+.1f} %", 100.0 * excess);
  }
  if (f.unlimited > 0.0) {
    const double gap = best.energy.total / f.unlimited - 1.0;
    const double ratio = best.duration / f.comparison.shortest;
    if (!task.is_restricted() && ratio >= 2.0) c.gap_twice.push_back(gap);
    if (!task.is_restricted() && ratio >= 3.0) c.gap_thrice.push_back(gap);
    text += fmt::format("  unlimited time {:.2f} kJ", f.unlimited / 1e3);
  }
  return text;
}

/// Counts a reach and describes it in one line.
std::string add_reach(const ReachTask& task, const ReachFigures& f, Count& c) {
  c.seconds.push_back(f.comparison.solve_s);
  if (!task.meant_feasible) return add_infeasible(task, f, c);
  ++c.feasible;
  const StrategyOutcome* best = f.optimum();
  if (best == nullptr) return fmt::format("{:44} not solved: {}\n", task.problem.name, f.named);
  ++c.solved;
  const std::string others = against_strategies(f, *best, c) + against_bounds(task, f, *best, c);
  return fmt::format("{:44} {:8.2f} kJ {:6.2f} s ({:.2f} x shortest){}\n", task.problem.name,
                     best->energy.total / 1e3, best->duration,
                     best->duration / f.comparison.shortest, others);
}

void print_spread(const char* what, const std::vector<double>& v) {
  if (v.empty()) return;
  fmt::print(
      "{}: median {:+.2f} %, quartiles {:+.2f} .. {:+.2f}, 95th {:+.2f}, worst {:+.2f} ({} "
      "reaches)\n",
      what, 100 * quantile(v, 0.5), 100 * quantile(v, 0.25), 100 * quantile(v, 0.75),
      100 * quantile(v, 0.95), 100 * quantile(v, 1.0), v.size());
}

void print_counts(const Count& c) {
  fmt::print(
      "\nfeasible {}: solved {} ({:.1f} %)\ninfeasible {}: named {}, solved nevertheless {}\n",
      c.feasible, c.solved, 100.0 * c.solved / std::max(1, c.feasible), c.infeasible, c.named,
      c.wrongly_solved);
  fmt::print("optimum above a baseline: {} times\n", c.above_baseline);
  print_spread("sequential over the optimum", c.sequential);
  print_spread("simultaneous (best end) over the optimum", c.line);
  fmt::print("optimum below its estimated bound: {} times\n", c.below_bound);
  print_spread("optimum over the estimated bound, from 3 times the shortest time on", c.bound_slow);
  print_spread("optimum over the estimated bound, in less time", c.bound_fast);
  if (!c.bound_slow.empty()) {
    fmt::print(
        "within 2 % of it from 3 times the shortest time on: {} of {}; where the bound is tight: "
        "{} of {}\n",
        within(c.bound_slow), c.bound_slow.size(), within(c.bound_tight), c.bound_tight.size());
  }
  print_spread("optimum over the cheapest path at unlimited time, from 2 times the shortest on",
               c.gap_twice);
  print_spread("the same from 3 times on", c.gap_thrice);
  fmt::print("seconds a comparison: median {:.1f}, worst {:.1f}\n", quantile(c.seconds, 0.5),
             quantile(c.seconds, 1.0));
}

}  // namespace

void print_reach(const ReachTask& task, const ReachFigures& figures) {
  if (figures.left_out) return;
  Count alone;
  fmt::print("{}", add_reach(task, figures, alone));
  std::fflush(stdout);
}

void print_summary(const std::vector<ReachTask>& tasks, const std::vector<ReachFigures>& figures) {
  Count c;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (!figures[i].left_out) add_reach(tasks[i], figures[i], c);
  }
  print_counts(c);
}

void print_gap_by_time(const std::vector<ReachTask>& tasks,
                       const std::vector<ReachFigures>& figures) {
  constexpr double kFrom[] = {1.0, 1.3, 2.0, 3.0, 3.4, 1e9};
  fmt::print(
      "\ntime / shortest | tight | within 2 % of the bound | optimum above it, median, 95th | "
      "above the slow path, median | tight at its own time | within 2 %\n");
  Excess all, all_own;
  for (std::size_t k = 0; k + 1 < std::size(kFrom); ++k) {
    Excess fine, own, slow;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const ReachFigures& f = figures[i];
      const StrategyOutcome* best = f.optimum();
      if (!tasks[i].meant_feasible || best == nullptr || !(f.unlimited > 0.0)) continue;
      if (tasks[i].is_restricted()) continue;
      const double ratio = best->duration / f.comparison.shortest;
      if (ratio < (k == 0 ? 0.0 : kFrom[k]) || ratio >= kFrom[k + 1]) continue;
      slow.push_back(best->energy.total / f.unlimited - 1.0);
      if (!(f.bound > 0.0)) continue;
      const double excess = best->energy.total / f.bound - 1.0;
      if (tight(f)) fine.push_back(excess);
      if (tight_own(f)) own.push_back(excess);
    }
    all.insert(all.end(), fine.begin(), fine.end());
    all_own.insert(all_own.end(), own.begin(), own.end());
    if (fine.empty() && own.empty()) continue;
    fmt::print("{:.1f} .. {:<6} | {:3} | {:3} | {:.2f} %, {:.2f} % | {:.2f} % | {:3} | {:3}\n",
               kFrom[k], k + 2 < std::size(kFrom) ? fmt::format("{:.1f}", kFrom[k + 1]) : "",
               fine.size(), within(fine), 100.0 * quantile(fine, 0.5), 100.0 * quantile(fine, 0.95),
               100.0 * quantile(slow, 0.5), own.size(), within(own));
  }
  fmt::print(
      "within 2 % of the bound: {} of {} where the lattice is fine, {} of {} where the bound is "
      "tight at its own time\n",
      within(all), all.size(), within(all_own), all_own.size());
}

}  // namespace sparflow::bench
