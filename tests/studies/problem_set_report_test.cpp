// Counts of the problem set: an infeasible reach counts as named only when its message names a limit.
#include "studies/problem_set_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The printed output: one line for each reach, then the counts.
std::string printed(const std::vector<bench::ReachFigures>& figures, bool feasible = false) {
  std::vector<bench::ReachTask> tasks(figures.size());
  testing::internal::CaptureStdout();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    tasks[i].problem.name = "reach " + std::to_string(i);
    tasks[i].meant_feasible = feasible;
    bench::print_reach(tasks[i], figures[i]);
  }
  bench::print_summary(tasks, figures);
  bench::print_gap_by_time(tasks, figures);
  return testing::internal::GetCapturedStdout();
}

TEST(ProblemSetReport, DoesNotCountAMessageWithoutALimitAsNamed) {
  bench::ReachFigures said, named;
  said.named = "no way tried reaches the goal";
  named.named = "infeasible. Worst: flow of pump main at t=0.26 s";
  named.worst = "flow of pump main at t=0.26 s";
  const std::string text = printed({said, named});
  EXPECT_THAT(text, HasSubstr("NO LIMIT NAMED: no way tried"));
  EXPECT_THAT(text, HasSubstr("infeasible 2: named 1, solved nevertheless 0"));
}

/// An optimum of 100 kJ that takes `times` the shortest time, `above` [-] over the slow path, its bound 1 % below it.
bench::ReachFigures solved_in(double times, double above) {
  bench::ReachFigures f;
  f.comparison.shortest = 5.0;
  StrategyRow row;
  row.name = "equal";
  StrategyOutcome best;
  best.kind = kOptimal;
  best.duration = 5.0 * times;
  best.energy.total = 100e3;
  best.motion.t = Eigen::Vector2d(0.0, best.duration);
  row.outcomes.push_back(best);
  f.comparison.rows.push_back(row);
  f.unlimited = 100e3 / (1.0 + above);
  f.slow_bound = 0.99 * f.unlimited;
  f.bound = 99e3;
  return f;
}

TEST(ProblemSetReport, ComparesWithUnlimitedTimeOnlyAtLongDurations) {
  const std::string text =
      printed({solved_in(1.9, 0.50), solved_in(2.1, 0.03), solved_in(3.1, 0.01)}, true);
  EXPECT_THAT(text, HasSubstr("feasible 3: solved 3 (100.0 %)"));
  EXPECT_THAT(text, HasSubstr("from 2 times the shortest on: median +2.00 %"));
  EXPECT_THAT(text, HasSubstr("the same from 3 times on: median +1.00 %"));
  EXPECT_THAT(text, HasSubstr("where the bound is tight: 1 of 1"));
  EXPECT_THAT(text, HasSubstr("2.0 .. 3.0    |   1 |   1 |"));
}

TEST(ProblemSetReport, CountsByTheFineLatticeAndByThePathInItsOwnTime) {
  bench::ReachFigures coarse = solved_in(1.5, 0.10), loose = solved_in(1.5, 0.10);
  coarse.slow_bound = 0.9 * coarse.unlimited;  // Its slow path does not make the bound tight.
  coarse.grid_path = 1.03 * coarse.bound;
  loose.bound = 95e3;
  loose.grid_path = 1.05 * loose.bound;
  bench::ReachFigures none = solved_in(1.5, 0.10);
  none.grid_path = 0.0;  // No path of the grid keeps all limits in that time.
  const std::string text = printed({coarse, loose, none}, true);
  EXPECT_THAT(text, HasSubstr("within 2 % of the bound: 1 of 2 where the lattice is fine, 1 of 1"));
}

TEST(ProblemSetReport, NeitherPrintsNorCountsReachesLeftOut) {
  bench::ReachFigures out;
  out.left_out = true;
  const std::string text = printed({out});
  EXPECT_THAT(text, Not(HasSubstr("reach 0")));
  EXPECT_THAT(text, HasSubstr("infeasible 0: named 0"));
}

}  // namespace
}  // namespace sparflow
