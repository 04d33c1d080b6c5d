// The split into return line and counterbalance valve, on pressures that are the maximum of both laws.
#include "diagnosis/evidence/branches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sparflow {
namespace {

using Eigen::Index;

/// Boom-sized cylinder, extending: both laws [Pa], noise 0.3 bar, motions of 2 s at 50 Hz.
struct Made {
  BranchData data;
  Mask line;     ///< truth: the return line sets the pressures
  Mask at_kink;  ///< both laws are within 1.5 bar: neither answer is wrong
};

struct Scene {
  double least_load = -20e3, largest_load = 250e3;  ///< [N] opposing
  bool valve = true;
  double tank_line = 0.0;  ///< [Pa/(m^3/s)^2] by the return flow of all cylinders
  double cold = 0.0;  ///< [Pa] pressure at full flow with oil of 20 degC above that with 70 degC
  unsigned seed = 1;
};

Made make(const Scene& scene) {
  constexpr double kSupply = 25.4e-3, kReturn = 15.1e-3;  // [m^2]
  constexpr Index n = 6000;
  std::mt19937 random(scene.seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.3e5);
  Made m;
  BranchData& d = m.data;
  for (Eigen::VectorXd* v :
       {&d.p_return, &d.p_supply, &d.q_return, &d.q_supply, &d.force, &d.q_return_total, &d.oil}) {
    v->resize(n);
  }
  d.moving = Mask::Constant(n, true);
  m.line = m.at_kink = Mask::Constant(n, false);
  double load = 0.0, flow = 0.0, other = 0.0;
  for (Index k = 0; k < n; ++k) {
    if (k % 100 == 0) {
      load = scene.least_load + (scene.largest_load - scene.least_load) * unit(random);
      flow = 0.2e-3 + 1.2e-3 * unit(random);
      other = 1e-3 * unit(random);
    }
    const double force = load * (1.0 + 0.1 * std::sin(0.05 * static_cast<double>(k)));
    d.q_supply[k] = flow;
    d.q_return[k] = flow * kReturn / kSupply;
    d.q_return_total[k] = d.q_return[k] + other;
    d.oil[k] = 20.0 + 50.0 * static_cast<double>(k) / static_cast<double>(n);
    const double colder = scene.cold * (70.0 - d.oil[k]) / 50.0 * d.q_return[k] / 0.83e-3;
    const double line = 4e5 + colder + 3e8 * d.q_return[k] + 4e11 * std::pow(d.q_return[k], 2) +
                        scene.tank_line * std::pow(d.q_return_total[k], 2);
    const double by_line = (force + line * kReturn) / kSupply;
    const double by_valve =
        scene.valve ? 45e5 + 4e9 * flow + 0.34 * force / kSupply : -1e9;  // pilot ratio about 3
    const double supply = std::max(by_line, by_valve);
    m.line[k] = by_line > by_valve;
    m.at_kink[k] = std::abs(by_line - by_valve) < 1.5e5;
    d.p_supply[k] = supply + noise(random);
    d.p_return[k] = (supply * kSupply - force) / kReturn + noise(random);
    d.force[k] = d.p_supply[k] * kSupply - d.p_return[k] * kReturn;
  }
  return m;
}

/// Checks the shares of samples away from the intersection of both laws that were labelled, and labelled wrongly.
void check(const Made& m, const BranchSplit& split, double least_named) {
  const Mask clear = !m.at_kink;
  const auto count = [](const Mask& mask) { return static_cast<double>(mask.count()); };
  const Mask named = split.return_line || split.counterbalance;
  const Mask wrong = clear && ((split.return_line && !m.line) || (split.counterbalance && m.line));
  EXPECT_GT(count(clear && named) / count(clear), least_named);
  EXPECT_LT(count(wrong) / count(clear), 0.005);  // three-sigma tails on both sides
  EXPECT_FALSE((split.return_line && split.counterbalance).any());
}

TEST(Branches, BothAreFoundAlsoWhereTheValveActsAgainstTheLoad) {
  const Made m = make({});
  // The test needs hundreds of samples in which the valve acts against the load, or it would test the sign of the load.
  ASSERT_GT((!m.line && m.data.force.array() > 0.0).count(), 500);
  check(m, split_branches({m.data}).front(), 0.9);
}

// The other cylinder raises the return pressure by 10 bar: a return chamber at 20 bar still follows the return line.
TEST(Branches, ASharedTankLineDoesNotLookLikeAValve) {
  Scene scene;
  scene.tank_line = 4e12;
  const Made m = make(scene);
  check(m, split_branches({m.data}).front(), 0.85);
}

// Cold oil needs 40 bar more in the return line than warm oil: neither is a valve, and the rows are no outliers.
TEST(Branches, WarmingOilDoesNotLookLikeAValve) {
  Scene scene;
  scene.cold = 40e5;
  check(make(scene), split_branches({make(scene).data}).front(), 0.85);
  scene.valve = false;
  scene.least_load = 20e3;
  Made m = make(scene);
  const BranchSplit seen = split_branches({m.data}).front();
  EXPECT_GT(seen.return_line.count(), 5700);
  EXPECT_EQ(seen.counterbalance.count(), 0);
  m.data.oil.resize(0);
  EXPECT_LT(split_branches({m.data}).front().return_line.count(), seen.return_line.count() - 100)
      << "the oil temperature has no influence here";
}

TEST(Branches, WithoutValveAllSamplesFollowTheReturnLine) {
  Scene scene;
  scene.valve = false;
  scene.least_load = 20e3;
  const BranchSplit split = split_branches({make(scene).data}).front();
  EXPECT_GT(split.return_line.count(), 5700);
  EXPECT_EQ(split.counterbalance.count(), 0);
}

TEST(Branches, WithOverrunningLoadsAllSamplesFollowTheValve) {
  Scene scene;
  scene.least_load = -200e3;
  scene.largest_load = -50e3;
  const BranchSplit split = split_branches({make(scene).data}).front();
  EXPECT_EQ(split.return_line.count(), 0);
  EXPECT_GT(split.counterbalance.count(), 5700);
}

// With one load alone the log does not contain the slope of the valve's law; a second log with other loads does.
TEST(Branches, LogsTogetherDetermineMoreThanOneAlone) {
  Scene narrow;
  narrow.least_load = 100e3;
  narrow.largest_load = 130e3;
  narrow.seed = 2;
  const Made a = make(narrow), b = make({});
  const std::vector<BranchSplit> splits = split_branches({a.data, b.data});
  check(a, splits[0], 0.8);
  check(b, splits[1], 0.85);
}

TEST(Branches, MissingValuesAndTooFewSamplesAreInNoMask) {
  Made m = make({});
  m.data.p_return.head(1000).setConstant(std::nan(""));
  const BranchSplit split = split_branches({m.data}).front();
  EXPECT_FALSE(split.return_line.head(1000).any() || split.counterbalance.head(1000).any());
  m.data.moving.tail(m.data.moving.size() - 1050).setConstant(false);
  const BranchSplit few = split_branches({m.data}).front();
  EXPECT_FALSE(few.return_line.any() || few.counterbalance.any());
}

TEST(Branches, OptionsDecideWhatIsNamed) {
  const Made m = make({});
  BranchOptions many;
  many.fewest_samples = static_cast<int>(m.data.moving.size()) + 1;
  BranchOptions certain;
  certain.least_probability = 1.0;
  for (const BranchOptions& options : {many, certain}) {
    const BranchSplit none = split_branches({m.data}, 0, options).front();
    EXPECT_FALSE(none.return_line.any() || none.counterbalance.any());
  }
}

}  // namespace
}  // namespace sparflow
