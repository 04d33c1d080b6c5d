// A plane is taken where it predicts motions that were left out not worse than a Gaussian process does.
#include "identification/learning/gaussian_process/choose_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace sparflow {
namespace {

constexpr double kFlowTop = 1.6e-3, kLoadTop = 2.5e5;  // [m^3/s], [N]

double plane(double flow, double force) { return 8e5 + force / 0.02 + 2e9 * flow; }

/// Motions of 60 samples each, every one at its own load and with an error of its own (deviation `shared`, friction for
/// instance) beside the noise of 0.5 bar.
GpDataset motions(int count, double shared, const std::function<double(double, double)>& law) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  constexpr int kEach = 60;
  GpDataset set{"boom extend", Eigen::ArrayXd(count * kEach), Eigen::ArrayXd(count * kEach),
                Eigen::ArrayXd(count * kEach)};
  for (int m = 0; m < count; ++m) {
    const double load = kLoadTop * uniform(random), error = shared * normal(random);
    for (int k = 0; k < kEach; ++k) {
      const Eigen::Index i = m * kEach + k;
      set.flow[i] = kFlowTop * uniform(random);
      set.force[i] = load + 0.05 * kLoadTop * uniform(random);
      set.pressure[i] = law(set.flow[i], set.force[i]) + error + 0.5e5 * normal(random);
      set.group.push_back(m);
    }
  }
  return set;
}

TEST(ChooseLaw, PlaneIsTakenWhereErrorsAreThoseOfWholeMotions) {
  const GpDataset set = motions(12, 3e5, plane);
  const LearnedGp chosen = learn_gp(set);
  EXPECT_EQ(chosen.report.law, PressureLaw::kPlane);
  EXPECT_EQ(chosen.parameters.law, PressureLaw::kPlane);
  EXPECT_LT(chosen.report.plane_left_out, chosen.report.process_left_out);
  // what was chosen is a plane: no curvature anywhere, beyond the data neither
  const GaussianProcess process(chosen.parameters);
  const GpDerivatives far = process.mean_derivatives(3.0 * kFlowTop, -kLoadTop);
  EXPECT_EQ(far.d_flow_flow, 0.0);
  EXPECT_EQ(far.d_force_force, 0.0);
  // 12 motions with errors of 3 bar determine the level to 0.9 bar; four of these deviations
  EXPECT_NEAR(process.mean(0.5 * kFlowTop, 0.5 * kLoadTop), plane(0.5 * kFlowTop, 0.5 * kLoadTop),
              3.6e5);
  // the uncertainty grows outside the samples
  EXPECT_GT(process.variance(3.0 * kFlowTop, 3.0 * kLoadTop),
            4.0 * process.variance(0.5 * kFlowTop, 0.5 * kLoadTop));
  // left to its likelihood the process follows the errors of single motions
  LearnGpOptions always;
  always.simplest_law = false;
  EXPECT_EQ(learn_gp(set, always).report.law, PressureLaw::kPlaneAndProcess);
}

TEST(ChooseLaw, ProcessIsTakenWhereTheLawIsCurved) {
  const auto curved = [](double flow, double force) {
    return plane(flow, force) + 6e12 * flow * flow;  // 15 bar at the largest flow
  };
  const LearnedGp chosen = learn_gp(motions(12, 0.5e5, curved));
  EXPECT_EQ(chosen.report.law, PressureLaw::kPlaneAndProcess);
  EXPECT_LT(chosen.report.process_left_out, 0.7 * chosen.report.plane_left_out);
}

TEST(ChooseLaw, OneGroupIsNoReasonForAPlane) {
  GpDataset set = motions(12, 3e5, plane);
  set.group.clear();
  const LearnedGp learned = learn_gp(set);
  EXPECT_EQ(learned.report.law, PressureLaw::kPlaneAndProcess);
  EXPECT_EQ(learned.report.plane_left_out, 0.0);
}

TEST(ChooseLaw, NumbersOfTheGroupsDoNotMatter) {
  const GpDataset set = motions(4, 3e5, plane);
  GpDataset renamed = set;
  for (int& g : renamed.group) g = 10 * g - 7;
  const LearnedGp a = learn_gp(set), b = learn_gp(renamed);
  EXPECT_EQ(a.report.plane_left_out, b.report.plane_left_out);
  EXPECT_EQ(a.report.process_left_out, b.report.process_left_out);
}

}  // namespace
}  // namespace sparflow
