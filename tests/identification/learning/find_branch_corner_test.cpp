// The corner between two branches of the supply pressure, which a smooth Gaussian process cannot represent, is identified.
#include "identification/learning/find_branch_corner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "identification/learning/fit.h"
#include "identification/learning/learn_loads_beyond.h"
#include "models/hydraulics/gaussian_process.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

constexpr double kBarCorner = 1e5;

/// Bore 120, rod 80 mm; the corner lies near 40 bar of load, somewhat lower for fast motions.
class FindBranchCorner : public ::testing::TestWithParam<int> {
 protected:
  FindBranchCorner() {
    cylinder_.bore = 0.12;
    cylinder_.rod = 0.08;
  }
  static int side() { return GetParam(); }
  double supply() const { return side() > 0 ? cylinder_.area_piston() : cylinder_.area_rod(); }
  double valve(double load) const { return 36 * kBarCorner + 0.2 * load / supply(); }
  double line(double flow, double load) const {
    return load / supply() + 4 * kBarCorner + 8e11 * flow * flow;
  }
  double truth(double flow, double load) const { return std::max(valve(load), line(flow, load)); }

  /// @param skip true for loads, as pressures of the supply [Pa], that no sample has
  GpDataset samples(const std::function<bool(double)>& skip,
                    const std::function<double(double, double)>& law) const {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform;
    std::normal_distribution<double> noise(0.0, 0.8 * kBarCorner);
    constexpr Eigen::Index n = 900;
    GpDataset set{"", Eigen::ArrayXd(n), Eigen::ArrayXd(n), Eigen::ArrayXd(n)};
    for (Eigen::Index k = 0; k < n;) {
      const double load = kBarCorner * (-60 + 200 * uniform(random));
      if (skip(load)) continue;
      set.flow[k] = 1e-4 + 5e-4 * uniform(random);
      set.force[k] = side() * load * supply();
      set.pressure[k] = law(set.flow[k], load * supply()) + noise(random);
      ++k;
    }
    return set;
  }
  GpDataset both(const std::function<bool(double)>& skip) const {
    return samples(skip, [&](double q, double load) { return truth(q, load); });
  }
  /// Learns a pressure model as `fit` does, with or without the corner. @return largest error over the loads [Pa]
  double worst(const GpDataset& set, const BranchCorner& corner) const {
    GpDataset rest = set;
    for (Eigen::Index k = 0; k < rest.flow.size() && corner.there(); ++k)
      rest.pressure[k] -= corner_rise(corner, rest.flow[k], rest.force[k]).value;
    GpParameters p = learn_gp(rest.flow, rest.force, rest.pressure).parameters;
    p.corner = corner;
    const GaussianProcess process(p);
    double error = 0.0;
    for (const double flow : {2e-4, 5e-4}) {
      for (double load = -50; load <= 130; load += 5) {
        const double force = side() * load * kBarCorner * supply();
        error = std::max(
            error, std::abs(process.mean(flow, force) - truth(flow, load * kBarCorner * supply())));
      }
    }
    return error;
  }

  Cylinder cylinder_;
};

TEST_P(FindBranchCorner, IsFoundWithoutSamplesNearIt) {
  const GpDataset set = both([](double load) { return load > 0 && load < 90 * kBarCorner; });
  const BranchCorner corner = find_branch_corner(set, cylinder_, side());
  ASSERT_TRUE(corner.there());
  // Slopes of 1 and 0.2 differ by 0.8. Either is known from hundreds of samples over 50 bar, far better than 5 %.
  EXPECT_NEAR(corner.per_force, side() * 0.8 / supply(), 0.04 / supply());
  // Three times the noise of one sample, in a gap of 90 bar without any.
  EXPECT_LT(worst(set, corner), 2.5 * kBarCorner);
  EXPECT_GT(worst(set, {}), 6 * kBarCorner) << "a smooth law interpolates linearly";
}

TEST_P(FindBranchCorner, ReducesTheErrorWithSamplesAroundIt) {
  const GpDataset set = both([](double) { return false; });
  const BranchCorner corner = find_branch_corner(set, cylinder_, side());
  ASSERT_TRUE(corner.there());
  // Twice the noise of one sample, as the largest error over 74 points.
  EXPECT_LT(worst(set, corner), 1.5 * kBarCorner);
  EXPECT_GT(worst(set, {}), worst(set, corner));
}

TEST_P(FindBranchCorner, IsAbsentInOneBranchAndInASmoothLaw) {
  const auto all = [](double) { return false; };
  const GpDataset valves = samples(all, [&](double, double load) { return valve(load); });
  const GpDataset lines = samples(all, [&](double q, double load) { return line(q, load); });
  const GpDataset bowl = samples(all, [&](double, double load) {
    return 40 * kBarCorner + 0.4 * load / supply() + 3e-8 * load * load / (supply() * supply());
  });
  for (const GpDataset& set : {valves, lines, bowl})
    EXPECT_FALSE(find_branch_corner(set, cylinder_, side()).there());
}

TEST_P(FindBranchCorner, IsAbsentWithTooFewSamples) {
  GpDataset set = both([](double) { return false; });
  set.flow.conservativeResize(20);
  set.force.conservativeResize(20);
  set.pressure.conservativeResize(20);
  EXPECT_FALSE(find_branch_corner(set, cylinder_, side()).there());
}

INSTANTIATE_TEST_SUITE_P(BothSides, FindBranchCorner, ::testing::Values(1, -1));

TEST(Fit, IdentifiesCornersBetweenValveAndStaticBranch) {
  const Machine machine = testing_support::drawn_machine("loader_crane");
  const auto logs = testing_support::hidden_case(machine, {}, {4, 120.0, {}, 60.0});
  const FitResult fitted = fit(machine, {logs.train}, {logs.test});
  int corners = 0;
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const CylinderModel& m = fitted.model.cylinders[i];
    for (const bool extend : {true, false}) {
      const BranchCorner& c = (extend ? m.extend : m.retract).parameters().corner;
      if (!c.there()) continue;
      ++corners;
      const Cylinder& cylinder = machine.cylinders[i];
      const double area = extend ? cylinder.area_piston() : cylinder.area_rod();
      const double share = c.per_force * area * (extend ? 1 : -1);  // 1 - valve's share
      EXPECT_GE(share, 0.4 - 1e-9) << cylinder.name;
      EXPECT_LE(share, 1.0 + 1e-9) << cylinder.name;
    }
  }
  EXPECT_GE(corners, 2);
}

}  // namespace
}  // namespace sparflow
