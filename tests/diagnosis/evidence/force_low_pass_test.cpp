/// Further low-pass of forces: its noise by many draws, and its width by the noise of the positions.
#include "diagnosis/evidence/force_low_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnosis/evidence/sensor_noise.h"
#include "identification/signals/low_pass.h"
#include "identification/signals/smoothing.h"
#include "models/machine/inertial_torque.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

class ForceLowPass : public testing::Test {
 protected:
  const Machine machine = testing_support::drawn_machine("loader_crane");
  MachineSignals log =
      make_signals(machine, testing_support::hidden_case(machine, {}, {5, 60.0}).train);
  const EvidenceOptions options = {};

  /// Positions with white noise of this deviation in place of their own. [rad] or [m]
  void set_position_noise(double deviation) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    for (Index j = 0; j < log.q.cols(); ++j)
      for (Index k = 0; k < log.q.rows(); ++k)
        log.q_measured(k, j) = log.q(k, j) + deviation * normal(random);
  }
};

TEST_F(ForceLowPass, KernelHasUnitGainAndIsSymmetric) {
  for (const double width : {0.0, 0.03, 0.2, 1.0}) {
    const VectorXd kernel = raised_cosine(width, 0.02);
    EXPECT_NEAR(kernel.sum(), 1.0, 1e-12);
    EXPECT_EQ(kernel.size() % 2, 1);
    EXPECT_NEAR((kernel - kernel.reverse()).norm(), 0.0, 1e-12);
  }
  EXPECT_EQ(raised_cosine(0.0, 0.02).size(), 1);
}

/// White noise through the filter's second derivative and the kernel has the deviation that is computed, up to that of an estimate
/// from 20,000 samples, each of which is alike to some fifty others.
TEST_F(ForceLowPass, NoiseOfAccelerationsIsThatOfManyDraws) {
  set_position_noise(3e-4);
  const ForceNoise noise(machine, log, 0, options);
  ASSERT_TRUE(noise.known());
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  constexpr Index kSamples = 20000;
  const VectorXd time = VectorXd::LinSpaced(kSamples, 0.0, log.step * (kSamples - 1));
  const std::vector<SampleRange> runs = {{0, kSamples}};
  const VectorXd white = VectorXd::NullaryExpr(kSamples, [&] { return normal(random); });
  const VectorXd second = SavitzkyGolay(time, runs, log.window, log.order).apply(white, 2);
  const auto deviation = [&](double width) {
    const VectorXd kernel = raised_cosine(width, log.step);
    const Index half = kernel.size();
    std::vector<std::pair<Index, Index>> whole = {{0, kSamples}};
    const VectorXd out = convolved(second, kernel, whole).segment(half, kSamples - 2 * half);
    return std::sqrt(out.squaredNorm() / static_cast<double>(out.size()));
  };
  for (const double width : {0.3, 0.7})
    EXPECT_NEAR(noise.of_accelerations(width) / noise.of_accelerations(0.0),
                deviation(width) / deviation(0.0), 0.1 * deviation(width) / deviation(0.0));
}

/// The deviation of the force is that of the inertia times the acceleration's, at one posture: a second way to it.
TEST_F(ForceLowPass, NoiseOfAForceIsThatOfTheInertiaTimesTheAccelerations) {
  set_position_noise(3e-4);
  for (Index k = 1; k < log.q.rows(); ++k) {
    log.q.row(k) = log.q.row(0);
    log.cylinders[1].rate[k] = log.cylinders[1].rate[0];
    log.payload[k] = log.payload[0];
  }
  const Index n = machine.joint_count();
  const int joint = machine.cylinders[1].joint;
  double squares = 0.0;
  for (Index j = 0; j < n; ++j) {
    const VectorXd torque =
        inertial_torque<double>(machine, VectorXd(log.q.row(0)), VectorXd(VectorXd::Zero(n)),
                                VectorXd(VectorXd::Unit(n, j)), log.payload[0]);
    squares += std::pow(torque[joint] / log.cylinders[1].rate[0], 2);
  }
  const double by_hand = std::sqrt(squares) * 3e-4 *
                         SavitzkyGolay(VectorXd::LinSpaced(101, 0.0, 100.0 * log.step), {{0, 101}},
                                       log.window, log.order)
                             .noise_gain(2);
  // the noise of the positions is estimated from 3,000 samples
  EXPECT_NEAR(ForceNoise(machine, log, 1, options).of_accelerations(0.0), by_hand, 0.05 * by_hand);
}

TEST_F(ForceLowPass, IsAsWideAsTheNoiseOfThePositionsDemands) {
  const MachineSignals* logs[] = {&log};
  double before = -1.0;
  for (const double deviation : {1e-9, 1e-4, 1e-2}) {
    set_position_noise(deviation);
    const double width = low_pass_width(machine, logs, 0, options);
    EXPECT_GE(width, before);
    before = width;
    if (deviation < 1e-8) {
      EXPECT_EQ(width, 0.0);
    }
    const ForceNoise noise(machine, log, 0, options);
    if (width < options.force_widths.back()) {
      EXPECT_LE(noise.of_accelerations(width),
                std::max(3.0 * noise.of_pressures(width),
                         options.force_noise_share * noise.largest_force()));
    }
  }
  EXPECT_EQ(before, options.force_widths.back());
  EvidenceOptions none;
  none.force_widths.clear();
  EXPECT_EQ(low_pass_width(machine, logs, 0, none), 0.0);
}

}  // namespace
}  // namespace sparflow
