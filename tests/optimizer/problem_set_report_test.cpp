// What the problem set counts: a reach that cannot be done is named only when a limit is.
#include "bench/problem_set_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// What is printed of reaches that cannot be done, each told apart by what is said of it: a line each, then the counts.
std::string printed(const std::vector<bench::ReachFigures>& figures) {
  std::vector<bench::ReachTask> tasks(figures.size());
  testing::internal::CaptureStdout();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    tasks[i].problem.name = "reach " + std::to_string(i);
    tasks[i].meant_feasible = false;
    bench::print_reach(tasks[i], figures[i]);
  }
  bench::print_summary(tasks, figures);
  return testing::internal::GetCapturedStdout();
}

TEST(ProblemSetReport, AMessageWithoutALimitIsNoName) {
  bench::ReachFigures said, named;
  said.named = "no way tried reaches the goal";
  named.named = "infeasible. Worst: flow of pump main at t=0.26 s";
  named.worst = "flow of pump main at t=0.26 s";
  const std::string text = printed({said, named});
  EXPECT_THAT(text, HasSubstr("NOT NAMED, only said: no way tried"));
  EXPECT_THAT(text, HasSubstr("infeasible 2: named 1, solved all the same 0"));
}

TEST(ProblemSetReport, WhatIsLeftOutIsNeitherPrintedNorCounted) {
  bench::ReachFigures out;
  out.left_out = true;
  const std::string text = printed({out});
  EXPECT_THAT(text, Not(HasSubstr("reach 0")));
  EXPECT_THAT(text, HasSubstr("infeasible 0: named 0"));
}

}  // namespace
}  // namespace sparflow
