// Loads beyond those a process has learned, for which the balance of forces continues its law.
#include "models/hydraulics/loads_beyond.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "models/hydraulics/gaussian_process.h"
#include "models/math/error.h"
#include "tests/models/numeric.h"

namespace sparflow::test_support {
namespace {

constexpr double kBarBeyond = 1e5;
constexpr double kSupply = 0.01;                       // [m^2]
constexpr double kLightest = -40e3, kHeaviest = 20e3;  // [N] learned loads
constexpr double kLevel = 5 * kBarBeyond, kLeast = 2 * kBarBeyond;

/// A process that is a plane, for both directions; the test parameter is the direction.
class LoadsBeyondPlane : public ::testing::TestWithParam<int> {
 protected:
  static int side() { return GetParam(); }
  /// @param at_zero [Pa] without load and flow  @param share of the load that the plane takes
  static GaussianProcess plane(double at_zero, double share) {
    GpParameters p;
    p.length_flow = 1e-3;
    p.length_force = 50e3;
    p.mean_constant = at_zero;
    p.mean_slope = side() * share / kSupply;
    // One centre makes the pressure depend on flow, by 3 bar.
    p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
    p.weight[0] = 3 * kBarBeyond;
    p.force_min = side() > 0 ? kLightest : -kHeaviest;
    p.force_max = side() > 0 ? kHeaviest : -kLightest;
    p.beyond = {side(), 1.0 / kSupply, kLevel, share / kSupply, share / kSupply, kLeast};
    return GaussianProcess(p);
  }
  static double at(const GaussianProcess& process, double load) {
    return process.mean(1e-2, side() * load);  // so fast that the centre contributes nothing
  }
};

TEST_P(LoadsBeyondPlane, HeavierLoadsFollowTheStaticBranchAboveTheValve) {
  // At 40 bar the valve is active up to 35 bar * A_supply = 35 kN; a line through the learned loads would stay at 40 bar.
  const GaussianProcess valve = plane(40 * kBarBeyond, 0.0);
  const double corner = 0.5 * loads_beyond::kRounded;
  for (const double load : {20e3, 25e3, 30e3, 35e3, 50e3, 100e3}) {
    const double truth = std::max(40 * kBarBeyond, kLevel + load / kSupply);
    // The transition at the border belongs to neither branch, so only the corner is checked there.
    EXPECT_NEAR(at(valve, load), truth, corner + 1e3) << load;
  }
}

TEST_P(LoadsBeyondPlane, TheStaticBranchContinues) {
  const GaussianProcess branch = plane(kLevel, 1.0);
  for (const double load : {20e3, 22e3, 60e3})
    EXPECT_NEAR(at(branch, load), kLevel + load / kSupply, 1.0) << load;
}

TEST_P(LoadsBeyondPlane, LighterLoadsStayAboveTankPressure) {
  // from 60 bar at -40 kN by 1 bar for 100 N
  const GaussianProcess branch = plane(100 * kBarBeyond, 1.0);
  for (const double load : {-40e3, -60e3, -90e3, -99e3, -120e3, -400e3}) {
    const double truth = std::max(kLeast, 100 * kBarBeyond + load / kSupply);
    EXPECT_NEAR(at(branch, load), truth, 0.5 * loads_beyond::kRounded + 1e3) << load;
  }
  EXPECT_NEAR(at(plane(40 * kBarBeyond, 0.0), -1e6), 40 * kBarBeyond, 1.0);
}

TEST_P(LoadsBeyondPlane, TheLearnedRangeIsUnchanged) {
  const GaussianProcess with = plane(40 * kBarBeyond, 0.2);
  GpParameters p = with.parameters();
  p.beyond = {};
  const GaussianProcess without(p);
  for (const double load : {kLightest, -10e3, 0.0, kHeaviest}) {
    EXPECT_EQ(with.mean(3e-4, side() * load), without.mean(3e-4, side() * load));
    EXPECT_EQ(with.mean_derivatives(3e-4, side() * load).d_force_force,
              without.mean_derivatives(3e-4, side() * load).d_force_force);
  }
}

TEST_P(LoadsBeyondPlane, DerivativesAreThoseOfTheValues) {
  // Kinks are rounded over 2 bar (2 kN of load) and are smooth at steps of 100 N and 1e-5 m^3/s.
  const GaussianProcess process = plane(40 * kBarBeyond, 0.25);
  for (const double load : {-250e3, -165e3, -45e3, 20.5e3, 26e3, 43e3, 80e3}) {
    const double q0 = 4e-4, f0 = side() * load;
    const GpDerivatives d = process.mean_derivatives(q0, f0);
    const auto flow = [&](double x) { return process.mean_derivatives(q0 + 1e-3 * x, f0); };
    const auto force = [&](double x) { return process.mean_derivatives(q0, f0 + 1e4 * x); };
    const auto derivative = [](const auto& at, double GpDerivatives::*of) {
      return numeric_derivative([&](double x) { return at(x).*of; }, 0.0);
    };
    const double tolerance = 1e-4 * kBarBeyond;
    EXPECT_NEAR(d.value, process.mean(q0, f0), 1e-9 * d.value) << load;
    EXPECT_NEAR(1e-3 * d.d_flow, derivative(flow, &GpDerivatives::value), tolerance) << load;
    EXPECT_NEAR(1e4 * d.d_force, derivative(force, &GpDerivatives::value), tolerance) << load;
    EXPECT_NEAR(1e-3 * 1e-3 * d.d_flow_flow, 1e-3 * derivative(flow, &GpDerivatives::d_flow),
                tolerance)
        << load;
    EXPECT_NEAR(1e4 * 1e-3 * d.d_flow_force, 1e4 * derivative(flow, &GpDerivatives::d_force),
                tolerance)
        << load;
    EXPECT_NEAR(1e4 * 1e4 * d.d_force_force, 1e4 * derivative(force, &GpDerivatives::d_force),
                tolerance)
        << load;
  }
}

INSTANTIATE_TEST_SUITE_P(BothSides, LoadsBeyondPlane, ::testing::Values(1, -1));

TEST(LoadsBeyond, InvalidParametersAreNamed) {
  GpParameters p;
  p.beyond.side = 1;
  p.beyond.static_slope = 0.0;
  EXPECT_THROW(GaussianProcess{p}, InputError);
  p.beyond.static_slope = 100.0;
  p.beyond.slope_heavier = 101.0;
  EXPECT_THROW(GaussianProcess{p}, InputError);
  p.beyond.slope_heavier = 100.0;
  EXPECT_NO_THROW(GaussianProcess{p});
}

}  // namespace
}  // namespace sparflow::test_support
