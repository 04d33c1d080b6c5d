// Moves of signals made by hand: rests, cuts, gaps, and the energy of a constant power.
#include "identification/signals/moves.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/files/machine_file.h"
#include "problems/bundled.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// 20 s at 10 Hz of the loader crane; its first cylinder moves at 0.1 m/s in the given stretches [s].
MachineSignals moving_in(const std::vector<std::pair<double, double>>& stretches) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  MachineSignals s;
  const Index n = 201;
  s.time = Eigen::VectorXd::LinSpaced(n, 0.0, 20.0);
  s.runs = {{0, n}};
  s.cylinders.resize(machine.cylinders.size());
  for (CylinderSignals& c : s.cylinders) {
    c.moving = Mask::Constant(n, false);
    c.speed = c.flow = Eigen::VectorXd::Zero(n);
  }
  for (Index k = 0; k < n; ++k) {
    for (const auto& [from, to] : stretches) {
      if (s.time[k] < from - 1e-9 || s.time[k] > to + 1e-9) continue;
      s.cylinders[0].moving[k] = true;
      s.cylinders[0].speed[k] = 0.1;
      s.cylinders[0].flow[k] = 1e-4;
    }
  }
  s.pumps.resize(machine.pumps.size());
  for (PumpSignals& p : s.pumps) p.pressure = Eigen::VectorXd::Constant(n, 100e5);
  return s;
}

TEST(RecordedMoves, ARestOfASecondEndsAMoveAndAShorterOneDoesNot) {
  const std::vector<RecordedMove> moves =
      recorded_moves(moving_in({{2.0, 4.0}, {4.6, 6.0}, {8.0, 10.0}, {14.0, 14.5}}));
  ASSERT_EQ(moves.size(), 2U) << "half a second at 0.1 m/s is a correction";
  EXPECT_EQ(moves[0].samples.begin, 19);
  EXPECT_EQ(moves[0].samples.end, 62);
  EXPECT_NEAR(moves[0].way, 0.1 * (2.1 + 1.5), 1e-9);
  EXPECT_NEAR(moves[0].gain, moves[0].way, 1e-9);
  EXPECT_TRUE(moves[0].from_rest && moves[0].to_rest);
}

TEST(RecordedMoves, ACycleGainsNothing) {
  MachineSignals s = moving_in({{2.0, 6.0}});
  s.cylinders[0].speed.tail(160) *= -1.0;  // from 4.1 s on
  const std::vector<RecordedMove> moves = recorded_moves(s);
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_NEAR(moves[0].way, 0.1 * 4.1, 1e-9);
  EXPECT_NEAR(moves[0].gain, 0.1 * 0.1, 1e-9);
}

TEST(RecordedMoves, ALongOneIsCutAtItsLongestRest) {
  MoveOptions options;
  options.longest_s = 5.0;
  const std::vector<RecordedMove> moves =
      recorded_moves(moving_in({{1.0, 4.0}, {4.4, 6.5}, {7.2, 10.0}, {10.3, 11.5}}), options);
  ASSERT_EQ(moves.size(), 3U);
  EXPECT_EQ(moves[0].samples.end, 42);    // 1.0 to 6.5 s is longer than 5 s and is cut at 4.0 s
  EXPECT_EQ(moves[1].samples.end, 67);    // the longest rest of all
  EXPECT_EQ(moves[2].samples.begin, 71);  // 7.2 to 11.5 s stays whole
  EXPECT_EQ(moves[2].samples.end, 117);
}

TEST(RecordedMoves, AGapAndTheEndsOfTheLogCutOne) {
  MachineSignals s = moving_in({{0.0, 2.0}, {5.0, 9.0}});
  s.runs = {{0, 70}, {71, 201}};
  const std::vector<RecordedMove> moves = recorded_moves(s);
  ASSERT_EQ(moves.size(), 3U);
  EXPECT_FALSE(moves[0].from_rest);
  EXPECT_TRUE(moves[0].to_rest);
  EXPECT_FALSE(moves[1].to_rest);
  EXPECT_FALSE(moves[2].from_rest);
}

TEST(RecordedMoves, EnergyOfAConstantPowerAndTimeAtRest) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  MachineSignals s = moving_in({{2.0, 4.0}, {8.0, 10.0}});
  // 21 samples of 1 kW, and half an interval of 0.1 s on either side
  EXPECT_NEAR(measured_energy(machine, s, {19, 42})[0], 1000.0 * 2.1, 1e-6);
  EXPECT_NEAR(time_at_rest(s), 20.0 - 2 * 2.1, 1e-9);
  s.pumps[0].pressure.resize(0);
  EXPECT_TRUE(std::isnan(measured_energy(machine, s, {19, 42})[0]));
}

}  // namespace
}  // namespace sparflow
