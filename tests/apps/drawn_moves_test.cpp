// Moves drawn from a seed for the loop of trust and the scenarios of the benchmark.
#include "apps/tasks/benchmark/drawn_moves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tasks/trust/trust_task.h"
#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "models/math/error.h"
#include "problems/bundled.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;

TEST(DrawnMoves, StartWithinTheRangesCanBeHeldAndHaveTimeEnough) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  const std::vector<benchmark::Scenario> moves =
      drawn_moves(machine, plant::default_parameters(machine), 7, 6);
  ASSERT_EQ(moves.size(), 6u);
  MoveDrawing judge(machine, 1);
  int postures = 0;
  for (const benchmark::Scenario& m : moves) {
    ASSERT_EQ(m.goals.size(), 1u);
    const benchmark::ScenarioGoal& goal = m.goals.front();
    EXPECT_TRUE(judge.holds(m.start, m.payload)) << m.id;
    for (Eigen::Index j = 0; j < m.start.size(); ++j) {
      const Range r = machine.joints[static_cast<std::size_t>(j)].position;
      EXPECT_GE(m.start[j], r.lo);
      EXPECT_LE(m.start[j], r.hi);
    }
    EXPECT_GE((goal.tip - tip_position<double>(machine, m.start)).norm(),
              DrawnMovesOptions{}.least_way);
    EXPECT_GE(goal.duration, 6.0);
    EXPECT_GE(m.time_limit, goal.duration);
    if (!goal.q) continue;
    ++postures;
    EXPECT_LT(judge.shortest(m.start, *goal.q, m.payload), goal.duration);
    EXPECT_EQ(goal.tip, tip_position<double>(machine, *goal.q));
  }
  EXPECT_GT(postures, 0) << "three in ten moves go to a posture";
}

TEST(DrawnMoves, AreTheSameForASeedAndOthersForAnother) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  const plant::PlantParameters plant = plant::default_parameters(machine);
  const auto first = drawn_moves(machine, plant, 7, 2), again = drawn_moves(machine, plant, 7, 2),
             other = drawn_moves(machine, plant, 8, 2);
  EXPECT_EQ(first[1].start, again[1].start);
  EXPECT_EQ(first[1].goals[0].duration, again[1].goals[0].duration);
  EXPECT_NE(first[1].start, other[1].start);
}

TEST(DrawnMoves, AMachineThatHoldsNothingIsNamed) {
  Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  const plant::PlantParameters plant = plant::default_parameters(machine);
  for (Pump& p : machine.pumps) p.max_pressure = 1.0;
  try {
    drawn_moves(machine, plant, 1, 1);
    FAIL() << "a move was drawn";
  } catch (const UsageError& e) {
    EXPECT_THAT(e.what(), HasSubstr(machine.name));
  }
}

TEST(TrustTask, NumbersOutsideTheirRangesAreRefused) {
  TrustTask task;
  task.moves = 0;
  EXPECT_THROW(check_ranges(task), UsageError);
  task = {};
  task.train_seconds = std::nan("");
  EXPECT_THROW(check_ranges(task), UsageError);
  task = {};
  task.rate = 1.0;
  EXPECT_THROW(check_ranges(task), UsageError);
  EXPECT_NO_THROW(check_ranges(TrustTask{}));
}

}  // namespace
}  // namespace sparflow
