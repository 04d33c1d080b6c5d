/// Which rows count as steady motion in a comparison with references: the times since commands and pumps moved.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "diagnosis/evidence/evidence.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A log, and the longest time in it for which commands and pump stand.
class SettledRows : public ::testing::Test {
 protected:
  const Machine machine = testing_support::drawn_machine("loader_crane");
  const CraneModel model = CraneModel::untrained(machine);
  const Log log = testing_support::hidden_case(machine, {}, {5, 60.0}).train;
  const VectorXd still = settled_since(log);
  Index last = 0;       ///< last sample of that time
  double middle = 0.0;  ///< [s] its middle

  void SetUp() override {
    still.unaryExpr([](double t) { return std::isfinite(t) ? t : 0.0; }).maxCoeff(&last);
    ASSERT_GT(still[last], 1.5);
    middle = log.time[last] - 0.5 * still[last];
  }
  VectorXd settled_since(const Log& of) const {
    EvidenceOptions options;
    options.settles = true;
    return collect_evidence(model, {make_signals(machine, of)}, {}, nullptr, options)
        .since_change.at(0);
  }
};

/// Behind a pump whose pressure swings nothing is settled, however long the levers have stood.
TEST_F(SettledRows, WhileAPumpsPressureMovesNothingIsSettled) {
  Log swinging = log;
  for (Channel& c : swinging.channels) {
    if (c.role != Role::kPumpPressure) continue;
    for (Index k = 0; k < swinging.samples(); ++k) {
      const double t = swinging.time[k] - middle;
      if (std::abs(t) < 0.5) c.values[k] += 30e5 * std::sin(2.0 * std::numbers::pi * t);
    }
  }
  const VectorXd since = settled_since(swinging);
  Index at = 0;
  (swinging.time.array() - middle).abs().minCoeff(&at);
  EXPECT_EQ(since[at], 0.0);
  // half a window after the swing the clock runs again, as after a command
  EXPECT_NEAR(since[last], 0.5 * still[last] - 0.5, 0.2);
  EXPECT_GT(still[at], 0.5);
}

/// A filtered row has its part of what follows within half a window, so that the rows right before a lever moves are no steady ones.
TEST_F(SettledRows, RowsWhoseFilterReachesAMovingLeverAreNotSettled) {
  Log moved = log;
  for (Channel& c : moved.channels) {
    if (c.role != Role::kCommand) continue;
    for (Index k = 0; k < moved.samples(); ++k)
      if (moved.time[k] >= middle && moved.time[k] < middle + 0.2) c.values[k] += 0.3;
  }
  const VectorXd since = settled_since(moved);
  const double half = 0.5 * make_signals(machine, log).window;
  ASSERT_GT(0.5 * still[last], 2.0 * half);
  for (Index k = 0; k < since.size(); ++k) {
    const double before = middle - moved.time[k];
    if (before > 0.0 && before < 0.95 * half) {
      EXPECT_EQ(since[k], 0.0) << before << " s before";
    } else if (before > 1.1 * half && before < 2.0 * half) {
      EXPECT_EQ(since[k], still[k]) << before << " s before";
    }
  }
}

}  // namespace
}  // namespace sparflow
