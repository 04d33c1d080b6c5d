#include "identification/comparison/error_change.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "identification/signals/steady.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing_support::arm_log;
using testing_support::arm_machine;
using testing_support::arm_model;

/// @return a comparison on a log with sensor noise, into which tests inject errors
const CompareResult& compared() {
  static const CompareResult result = [] {
    CompareOptions options;
    options.find_regions = false;
    return compare(arm_model(), {arm_log(0.8, 7)}, options);
  }();
  return result;
}

/// @return the comparison with the error of one quantity replaced by white noise of standard deviation `size` [SI]
CompareResult with_error(CompareResult r, const std::string& stage, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (ComparedSeries& s : r.logs[0].series) {
    if (s.stage != stage) continue;
    double squares = 0.0;
    long n = 0;
    for (Eigen::Index k = 0; k < s.measured.size(); ++k) {
      if (!std::isfinite(s.measured[k])) continue;
      s.predicted[k] = s.measured[k] + size * normal(random);
      squares += std::pow(s.predicted[k] - s.measured[k], 2);
      ++n;
    }
    for (StageScore& score : r.scores) {
      if (score.stage == stage) score.rmse = std::sqrt(squares / static_cast<double>(n));
    }
  }
  return r;
}

TEST(ErrorChange, IsTheGeometricMeanWhereItActsAndOverall) {
  CompareResult before, after;
  before.scores.resize(2);
  before.scores[0].stage = "force";
  before.scores[1].stage = "pump";
  for (StageScore& s : before.scores) {
    s.at = "x";
    s.rmse = 4.0;
    s.n = 100;
  }
  after = before;
  after.scores[0].rmse = 1.0;
  const Machine machine = arm_machine();
  const ErrorChange c = error_change(machine, before, after, "force", "x");
  EXPECT_DOUBLE_EQ(c.own, 0.25);
  EXPECT_DOUBLE_EQ(c.overall, 0.5);  // sqrt(0.25 * 1)
  EXPECT_FALSE(c.worse());
  EXPECT_TRUE((ErrorChange{0.9, 1.02, {}}.worse())) << "not better where it acts";
  EXPECT_TRUE((ErrorChange{1.05, 0.9, {}}.worse())) << "larger overall error";
  EXPECT_FALSE((ErrorChange{1.01, 0.9, {}}.worse())) << "refitting alone changes as much";
}

/// Every start and stop leaves 50 kN, before and after; in steady motion 2 kN become 0.5 kN.
TEST(ErrorChange, ErrorsOfSteadyMotionAreToldApart) {
  ErrorChangeOptions options;
  options.settled_s = 0.3;  // strokes of 2.4 s
  const auto with = [&options](CompareResult r, double steady) {
    const MachineSignals& s = r.logs[0].signals;
    const Eigen::VectorXd since = since_unsteady(s, s.cylinders[0], options.unsteady_span);
    double squares = 0.0, n = 0.0, rows = 0.0;
    for (ComparedSeries& c : r.logs[0].series) {
      if (c.stage != "force") continue;
      for (Eigen::Index k = 0; k < c.measured.size(); ++k) {
        if (!std::isfinite(c.measured[k])) continue;
        const bool settled = since[k] >= options.settled_s;
        const double error = settled ? steady : 5e4;
        c.predicted[k] = c.measured[k] + (k % 2 == 0 ? error : -error);
        squares += error * error;
        n += 1.0;
        rows += settled ? 1.0 : 0.0;
      }
    }
    EXPECT_GT(rows, 50.0);
    EXPECT_GT(n - rows, 50.0);
    for (StageScore& score : r.scores)
      if (score.stage == "force") score.rmse = std::sqrt(squares / n);
    return r;
  };
  const CompareResult before = with(compared(), 2e3), after = with(compared(), 500.0);
  const ErrorChange c = error_change(arm_machine(), before, after, {{"force"}, "arm"}, options);
  EXPECT_GT(c.own, 0.98);
  EXPECT_NEAR(c.own_steady, 0.25, 1e-9);
  // a change of a pump has no force of its own
  const ErrorChange pump = error_change(arm_machine(), before, after, {{"pump"}, "main"}, options);
  EXPECT_EQ(pump.own_steady, pump.own);
}

TEST(ErrorChange, GrowthOfAnotherErrorIsHarm) {
  CompareResult before = with_error(compared(), "force", 4e3, 1);
  before = with_error(before, "pump", 2e5, 2);
  CompareResult after = with_error(before, "force", 1e3, 3);
  after = with_error(after, "pump", 2.6e5, 4);
  const ErrorChange c = error_change(arm_machine(), before, after, "force", "arm");
  // The error falls to a quarter; a fifth more for two draws of the noise.
  EXPECT_LT(c.own, 0.3);
  ASSERT_THAT(c.harmed, SizeIs(1));
  EXPECT_EQ(c.harmed[0].stage, "pump");
  EXPECT_THAT(c.harmed[0].sentence, HasSubstr("pump main grew from"));
  EXPECT_TRUE(c.worse());
}

TEST(ErrorChange, AnErrorMovedFromOnePlaceToAnotherIsHarm) {
  // A mass may reduce the jib's error and increase the boom's: the overall error falls, but the change is not wanted.
  CompareResult before = compared();
  {
    CompareResult* r = &before;
    ComparedSeries twin = *std::find_if(r->logs[0].series.begin(), r->logs[0].series.end(),
                                        [](const ComparedSeries& s) { return s.stage == "force"; });
    twin.at = "other";
    r->logs[0].series.push_back(twin);
    StageScore score = *r->find("force", "arm");
    score.at = "other";
    r->scores.push_back(score);
  }
  const auto with = [](CompareResult r, double arm, double other) {
    unsigned seed = 1;
    for (ComparedSeries& s : r.logs[0].series) {
      if (s.stage != "force") continue;
      const double size = s.at == "arm" ? arm : other;
      std::mt19937 random(seed++);
      std::normal_distribution<double> normal;
      for (Eigen::Index k = 0; k < s.measured.size(); ++k)
        s.predicted[k] = s.measured[k] + size * normal(random);
    }
    for (StageScore& s : r.scores) {
      if (s.stage == "force") s.rmse = s.at == "arm" ? arm : other;
    }
    return r;
  };
  const ErrorChange taken =
      error_change(arm_machine(), with(before, 4e3, 2e3), with(before, 1e3, 3.2e3), "force");
  EXPECT_LT(taken.own, 1.0);
  ASSERT_THAT(taken.harmed, SizeIs(1));
  EXPECT_EQ(taken.harmed[0].at, "other");
  const ErrorChange little =
      error_change(arm_machine(), with(before, 4e3, 1e3), with(before, 1e3, 1.3e3), "force");
  EXPECT_THAT(little.harmed, IsEmpty());
}

TEST(ErrorChange, VariationBetweenMotionsIsNoHarm) {
  // Other noise of the same size is larger or smaller by chance.
  const CompareResult before = with_error(compared(), "pump", 2e5, 2);
  for (unsigned seed = 10; seed < 20; ++seed) {
    const CompareResult after = with_error(before, "pump", 2e5, seed);
    EXPECT_THAT(error_change(arm_machine(), before, after, "force", "arm").harmed, IsEmpty())
        << seed;
  }
}

TEST(ErrorChange, GrowthOfTheEnergyErrorIsHarmAlthoughNoRmsGrew) {
  // Before, the error cancels in the energy; afterwards it is smaller but of one sign.
  CompareResult before = with_error(compared(), "pump", 6e5, 2);
  CompareResult after = before;
  for (ComparedSeries& s : after.logs[0].series) {
    if (s.stage == "pump") s.predicted = (s.measured.array() + 4e5).matrix();
  }
  for (StageScore& s : after.scores) {
    if (s.stage == "pump") s.rmse = 4e5;
  }
  const ErrorChange c = error_change(arm_machine(), before, after, "force", "arm");
  ASSERT_THAT(c.harmed, SizeIs(1));
  EXPECT_EQ(c.harmed[0].stage, "energy");
  EXPECT_GT(c.harmed[0].after, c.harmed[0].before);
}

TEST(ErrorChange, ExtrapolationErrorsOfAPressureAreNoHarm) {
  CompareResult before = with_error(compared(), "pressure", 1e5, 2);
  CompareResult after = with_error(before, "pressure", 4e5, 3);
  const auto pressure_harmed = [&] {
    const ErrorChange c = error_change(arm_machine(), before, after, "force", "arm");
    return std::any_of(c.harmed.begin(), c.harmed.end(),
                       [](const HarmedError& h) { return h.stage == "pressure"; });
  };
  EXPECT_TRUE(pressure_harmed());
  for (ComparedSeries& s : after.logs[0].series) {
    if (s.stage == "pressure") s.extrapolated.setConstant(true);
  }
  EXPECT_FALSE(pressure_harmed());
}

TEST(ErrorChange, TooFewSamplesAreNotTested) {
  // All but a second of the test log lies outside the training range; the RMS of that second varies by more than a tenth.
  CompareResult before = with_error(compared(), "pressure", 1e5, 2);
  CompareResult after = with_error(before, "pressure", 1.5e5, 3);
  const auto learned_for = [&](double seconds) {
    for (ComparedSeries& s : after.logs[0].series) {
      if (s.stage != "pressure") continue;
      s.extrapolated.setConstant(true);
      double left = seconds;
      for (Eigen::Index k = 0; k < s.measured.size() && left > 0.0; ++k) {
        if (!std::isfinite(s.measured[k])) continue;
        s.extrapolated[k] = false;
        left -= after.logs[0].signals.step;
      }
    }
    return error_change(arm_machine(), before, after, "force", "arm").harmed;
  };
  EXPECT_THAT(learned_for(1.0), IsEmpty());
  EXPECT_FALSE(learned_for(8.0).empty()) << "pieces of one second are tested";
}

TEST(ErrorChange, OverallDeviationIsTheVariationBetweenMotions) {
  const CompareResult before = with_error(compared(), "pump", 2e5, 2);
  int beyond = 0;
  for (unsigned seed = 10; seed < 30; ++seed) {
    const ErrorChange c =
        error_change(arm_machine(), before, with_error(before, "pump", 2e5, seed), "force", "arm");
    EXPECT_GT(c.overall_deviation, 0.0);
    beyond += std::abs(std::log(c.overall)) > 2.0 * c.overall_deviation ? 1 : 0;
  }
  EXPECT_LE(beyond, 3) << "one in twenty is beyond two standard errors";
  const ErrorChange grown =
      error_change(arm_machine(), before, with_error(before, "pump", 2.4e5, 4), "force", "arm");
  EXPECT_GT(std::log(grown.overall), 2.0 * grown.overall_deviation);
}

TEST(ErrorChange, PoolsSeveralStages) {
  CompareResult before = with_error(compared(), "force", 4e3, 1);
  before = with_error(before, "pump", 4e5, 2);
  const CompareResult after = with_error(with_error(before, "force", 2e3, 3), "pump", 1e5, 4);
  const ErrorChange both =
      error_change(arm_machine(), before, after, std::vector<std::string>{"force", "pump"});
  EXPECT_LT(both.own, error_change(arm_machine(), before, after, "force").own);
  EXPECT_GT(both.own, error_change(arm_machine(), before, after, "pump").own);
}

}  // namespace
}  // namespace sparflow
