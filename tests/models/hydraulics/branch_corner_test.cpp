// The corner between two branches is part of the mean of a process, with exact derivatives.
#include "models/hydraulics/branch_corner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/hydraulics/gaussian_process.h"
#include "models/hydraulics/return_rise.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

GpParameters with_corner() {
  GpParameters p;
  p.length_flow = 4e-4;
  p.length_force = 50e3;
  p.signal_std = 1e6;
  p.mean_constant = 40e5;
  p.mean_slope = 20.0;
  p.flow = Eigen::ArrayXd::LinSpaced(3, 1e-4, 6e-4);
  p.force = Eigen::ArrayXd::LinSpaced(3, -40e3, 60e3);
  p.weight = Eigen::ArrayXd::LinSpaced(3, -2e-7, 3e-7);
  p.force_min = -40e3;
  p.force_max = 60e3;
  p.corner = {-30e5, 8e8, 80.0};
  return p;
}

TEST(BranchCorner, IsTheHigherOfTwoBranches) {
  const BranchCorner c = with_corner().corner;
  EXPECT_NEAR(corner_rise(c, 1e-4, 0.0).value, 0.0, 0.05e5);      // 29 bar below
  EXPECT_NEAR(corner_rise(c, 1e-4, 80e3).value, 34.8e5, 0.05e5);  // by hand: -30 + 0.8 + 64
  EXPECT_FALSE(BranchCorner{}.there());
}

TEST(BranchCorner, HasExactDerivativesInTheProcess) {
  const GaussianProcess process(with_corner());
  constexpr double kFlow = 1e-8, kForce = 1.0;
  for (const double flow : {2e-4, 5e-4}) {
    for (const double force : {-20e3, 25e3, 32e3, 36e3, 55e3}) {
      const GpDerivatives d = process.mean_derivatives(flow, force);
      const auto up_q = process.mean_derivatives(flow + kFlow, force),
                 down_q = process.mean_derivatives(flow - kFlow, force),
                 up_f = process.mean_derivatives(flow, force + kForce),
                 down_f = process.mean_derivatives(flow, force - kForce);
      EXPECT_EQ(d.value, process.mean(flow, force));
      EXPECT_NEAR(d.d_flow * 2 * kFlow, up_q.value - down_q.value, 1e-3);
      EXPECT_NEAR(d.d_force * 2 * kForce, up_f.value - down_f.value, 1e-3);
      EXPECT_NEAR(d.d_flow_flow, (up_q.d_flow - down_q.d_flow) / (2 * kFlow),
                  1e-5 * std::abs(d.d_flow_flow) + 1e6);
      EXPECT_NEAR(d.d_flow_force, (up_f.d_flow - down_f.d_flow) / (2 * kForce),
                  1e-5 * std::abs(d.d_flow_force) + 1.0);
      EXPECT_NEAR(d.d_force_force, (up_f.d_force - down_f.d_force) / (2 * kForce),
                  1e-5 * std::abs(d.d_force_force) + 1e-8);
    }
  }
}

TEST(BranchCorner, GivesTheShareOfReturnPressureThatReachesTheSupply) {
  const GaussianProcess process(with_corner());
  Cylinder cylinder;
  cylinder.bore = 0.12;
  cylinder.rod = 0.08;
  const double ratio = cylinder.area_rod() / cylinder.area_piston();
  // S - V is -46, 34 and, near the corner, 2 bar
  const auto rise = [&](double force, double of_return) {
    return supply_rise<double>({process, cylinder, 1}, process.mean(1e-4, force), 1e-4, force,
                               of_return);
  };
  for (const double of_return : {-12e5, 12e5}) {
    EXPECT_NEAR(rise(-20e3, of_return), 0.0, 0.05e5);
    EXPECT_NEAR(rise(79e3, of_return), ratio * of_return, 0.05e5);
  }
  EXPECT_NEAR(rise(39e3, -12e5), -2e5, 0.5e5) << "falls to the valve's branch and no further";
  EXPECT_NEAR(rise(39e3, 12e5), ratio * 12e5, 0.5e5);
}

TEST(BranchCorner, HasASmallerForceScaleThanALongKernel) {
  GpParameters p = with_corner();
  p.length_force = 1e9;
  EXPECT_LT(GaussianProcess(p).force_scale(), 20e3);
  p.corner = {};
  EXPECT_EQ(GaussianProcess(p).force_scale(), 1e9);
}

TEST(BranchCorner, WithNonFiniteValuesIsRefused) {
  GpParameters p = with_corner();
  p.corner.per_flow = std::nan("");
  EXPECT_THROW(GaussianProcess{p}, InputError);
}

}  // namespace
}  // namespace sparflow
