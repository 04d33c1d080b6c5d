// Medians, pairs, intervals and ranks against values by hand.
#include "simulator/benchmark/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sparflow::benchmark {
namespace {

Row row(const std::string& scenario, const std::string& controller, double energy, bool done = true,
        std::uint64_t seed = 1) {
  Row r;
  r.scenario = scenario;
  r.controller = controller;
  r.seed = seed;
  r.done = done;
  r.energy = energy;
  r.time = 10.0;
  r.tip_error_path = 0.01;
  r.tip_error_end = 0.02;
  return r;
}

TEST(BenchmarkSummary, PairsScenariosAfterTheMeanOverSeeds) {
  const std::vector<Row> rows = {
      row("a", "best", 100.0), row("a", "other", 120.0),         row("a", "other", 140.0, true, 2),
      row("b", "best", 200.0), row("b", "other", 220.0),         row("c", "best", 50.0),
      row("c", "other", 45.0), row("d", "best", 10.0, false),    row("d", "other", 10.0),
      row("e", "best", 10.0),  row("e", "other", 99.0, true, 1), row("e", "other", 99.0, false, 2),
  };
  const std::map<std::string, Promise> promises = {{"a", {80.0, 50.0}}, {"b", {100.0, kNotKnown}}};
  const std::vector<ControllerSummary> all = summarise(rows, {"best", "other"}, "best", promises);
  ASSERT_EQ(all.size(), 2u);
  const ControllerSummary& other = all[1];
  EXPECT_EQ(other.runs, 7);
  EXPECT_EQ(other.failed, 1);
  EXPECT_EQ(other.against.n, 3);                   // d: the reference failed, e: a seed failed
  EXPECT_NEAR(other.against.median, 0.10, 1e-12);  // of 0.30, 0.10, -0.10
  EXPECT_NEAR(other.dearer, 2.0 / 3.0, 1e-12);
  EXPECT_LE(other.against.lower, other.against.median);
  EXPECT_GE(other.against.upper, other.against.median);
  EXPECT_NEAR(all[0].above_promise.median, 0.625, 1e-12);  // of 0.25 and 1
  EXPECT_NEAR(all[0].above_bound.median, 1.0, 1e-12);
  // best: 1, 1, 2, 2, 1; other: 2, 2, 1, 1, 2
  EXPECT_NEAR(all[0].rank, 1.4, 1e-12);
  EXPECT_NEAR(other.rank, 1.6, 1e-12);
}

TEST(BenchmarkSummary, IntervalCoversTheMedianOfASampleAndIsTheSameEachTime) {
  std::vector<double> values;
  for (int k = 0; k < 101; ++k) values.push_back(k);
  values.push_back(kNotKnown);
  const Estimate e = estimate(values);
  EXPECT_EQ(e.n, 101);
  EXPECT_EQ(e.median, 50.0);
  // the interval of a median of 101 equally spaced values by order statistics: ranks 41 to 61
  EXPECT_NEAR(e.lower, 40.0, 3.0);
  EXPECT_NEAR(e.upper, 60.0, 3.0);
  EXPECT_EQ(estimate(values).lower, e.lower);
  EXPECT_TRUE(std::isnan(estimate({}).median));
  EXPECT_TRUE(std::isnan(estimate({1.0}).lower));
}

}  // namespace
}  // namespace sparflow::benchmark
