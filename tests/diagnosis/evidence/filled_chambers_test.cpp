/// Where a chamber that grows carries no pressure, the valve does not set the speed.
#include "diagnosis/evidence/filled_chambers.h"

#include <gtest/gtest.h>

#include "diagnosis/evidence/evidence.h"
#include "models/files/machine_file.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kVoid = 2e5;  // [Pa]

/// 2 s in steps of 20 ms: a rod with 50 bar in both chambers.
struct Rod {
  MachineSignals signals;
  CylinderSignals cylinder;

  Rod() {
    const Index n = 100;
    signals.step = 0.02;
    signals.window = 0.2;  // five samples on either side
    cylinder.speed = cylinder.command = VectorXd::Zero(n);
    cylinder.pressure_a_smooth = cylinder.pressure_b_smooth = VectorXd::Constant(n, 50e5);
  }
  Mask filled() const { return chambers_filled(signals, cylinder, kVoid); }
  Index left_out() const { return (!filled()).count(); }
};

TEST(FilledChambers, AVoidInTheChamberThatGrowsLeavesOutTheFilterWindowAboutIt) {
  Rod rod;
  rod.cylinder.speed.setConstant(-0.1);
  rod.cylinder.pressure_b_smooth.segment(40, 10).setZero();
  const Mask filled = rod.filled();
  EXPECT_TRUE(filled.head(35).all());
  EXPECT_FALSE(filled.segment(35, 20).any());
  EXPECT_TRUE(filled.tail(45).all());
}

TEST(FilledChambers, TheChamberThatShrinksMayBeEmpty) {
  Rod rod;
  rod.cylinder.speed.setConstant(0.1);
  rod.cylinder.command.setConstant(0.4);
  rod.cylinder.pressure_b_smooth.setZero();
  EXPECT_EQ(rod.left_out(), 0);
  rod.cylinder.pressure_a_smooth.setZero();
  EXPECT_EQ(rod.left_out(), 100);
}

TEST(FilledChambers, AValveThatFillsAVoidMovesNoRod) {
  Rod rod;
  rod.cylinder.command.segment(50, 1).setConstant(0.5);
  rod.cylinder.pressure_a_smooth.setZero();
  EXPECT_EQ(rod.left_out(), 11);
}

TEST(FilledChambers, ARodAtRestMayStandOnOneChamber) {
  Rod rod;
  rod.cylinder.pressure_a_smooth.setZero();
  // what the noise of a position makes of a rod at rest
  for (Index k = 0; k < rod.cylinder.speed.size(); ++k)
    rod.cylinder.speed[k] = 5e-3 * (k % 2 == 0 ? 1.0 : -1.0);
  EXPECT_EQ(rod.left_out(), 0);
}

TEST(FilledChambers, WithoutBothPressuresNothingIsKnownOfAVoid) {
  Rod rod;
  rod.cylinder.speed.setConstant(0.1);
  rod.cylinder.pressure_a_smooth.setZero();
  rod.cylinder.pressure_b_smooth.resize(0);
  EXPECT_EQ(rod.left_out(), 0);
}

/// The lift's rod runs ahead of its valve by a half while its upper chamber is void: the gain that the flow channel learns from the
/// other rows is that of the valve.
TEST(FilledChambers, AVoidDoesNotChangeTheGainThatIsLearned) {
  const Machine machine = testing_support::drawn_machine("loader_crane");
  const CraneModel model = CraneModel::untrained(machine);
  MachineSignals log =
      make_signals(machine, testing_support::hidden_case(machine, {}, {5, 60.0}).train);
  CylinderSignals& rod = log.cylinders[0];
  const auto gain = [&](bool leaves_out) {
    EvidenceOptions options;
    if (!leaves_out) options.mechanisms.switch_off(Mechanism::kVoid);
    const Evidence e = collect_evidence(model, {log}, {}, nullptr, options);
    const EvidenceChannel& c = *e.find(EvidenceKind::kFlow, 0);
    return (c.baseline.transpose() * c.baseline).ldlt().solve(c.baseline.transpose() * c.y).eval();
  };
  const VectorXd truth = gain(true);
  ASSERT_EQ(truth.size(), 2);
  int turns = 0;
  for (Index k = 0; k < rod.speed.size(); ++k) {
    if (!(rod.command[k] < 0.0) || (k / 50) % 2 == 0) continue;
    ++turns;
    rod.speed[k] *= 1.5;
    rod.pressure_b[k] = rod.pressure_b_smooth[k] = 0.0;
  }
  ASSERT_GT(turns, 100) << "the log does not retract";
  EXPECT_NEAR(gain(true)[1] / truth[1], 1.0, 0.02);  // fewer rows with the same noise
  EXPECT_GT(gain(false)[1] / truth[1], 1.1) << "the void moves nothing: this test shows nothing";
}

}  // namespace
}  // namespace sparflow
