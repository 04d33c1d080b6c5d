// Share of a higher return pressure that reaches the supply, from a process that follows max(static branch, valve).
#include "models/hydraulics/return_rise.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/models/effects/effect_series.h"
#include "tests/models/numeric.h"

namespace sparflow::test_support {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kBarPa = 1e5;
constexpr double kFlow = 5e-4;

/// A cylinder whose counterbalance valve is active up to a resisting load of 30 kN, and a process fitted to its law.
class ReturnRise : public ::testing::TestWithParam<int> {
 protected:
  ReturnRise() {
    const double length =
        6e3;  // [N] shorter than the checked range, longer than the spacing of the centres
    const Index n = 61;
    const ArrayXd load = ArrayXd::LinSpaced(n, -90e3, 90e3);
    GpParameters p;
    p.length_flow = 1e-2;  // so long that flow hardly matters
    p.length_force = length;
    p.signal_std = 50 * kBarPa;
    p.noise_std = 0.01 * kBarPa;
    p.flow = ArrayXd::Constant(n, kFlow);
    p.force = side() * load;
    p.flow_min = 0.0, p.flow_max = 1e-3, p.force_min = -90e3, p.force_max = 90e3;
    MatrixXd k(n, n);
    Eigen::VectorXd y(n);
    for (Index i = 0; i < n; ++i) {
      y[i] = std::max(static_branch(load[i]), valve(load[i])) / (p.signal_std * p.signal_std);
      for (Index j = 0; j < n; ++j) {
        const double d = (load[i] - load[j]) / length;
        k(i, j) = std::exp(-0.5 * d * d) + (i == j ? 1e-6 : 0.0);
      }
    }
    p.weight = k.ldlt().solve(y).array();
    process_ = GaussianProcess(p);
  }
  static int side() { return GetParam(); }
  double fed() const { return side() > 0 ? cylinder_.area_piston() : cylinder_.area_rod(); }
  double other() const { return side() > 0 ? cylinder_.area_rod() : cylinder_.area_piston(); }
  double static_branch(double load) const { return (load + 6 * kBarPa * other()) / fed(); }
  /// The valve's branch takes up a fifth of a larger load.
  double valve(double load) const { return static_branch(30e3) + 0.2 * (load - 30e3) / fed(); }
  double true_rise(double load, double rise) const {
    const double r = rise * other() / fed();
    return std::max(static_branch(load) + r, valve(load)) -
           std::max(static_branch(load), valve(load));
  }
  template <class T>
  T rise_of(const T& flow, const T& load, const T& rise) const {
    const T force = side() * load;
    return supply_rise<T>({process_, cylinder_, side()}, process_mean(process_, flow, force), flow,
                          force, rise);
  }

  Cylinder cylinder_ = two_direct_cylinders().cylinders[0];
  GaussianProcess process_;
};

TEST_P(ReturnRise, ReachesTheSupplyOnTheStaticBranchOnly) {
  for (const double bar : {-6.0, -2.0, 2.0, 6.0, 15.0}) {
    const double rise = bar * kBarPa, whole = rise * other() / fed();
    // The process rounds the kink and differs from each branch by a hundredth of a bar, as does the rounded corner.
    const double tolerance = 0.02 * std::abs(whole) + 0.05 * kBarPa;
    for (const double load : {-70e3, -30e3, 0.0})
      EXPECT_NEAR(rise_of(kFlow, load, rise), true_rise(load, rise), tolerance)
          << bar << ", " << load;
    for (const double load : {60e3, 70e3})
      EXPECT_NEAR(rise_of(kFlow, load, rise), whole, tolerance) << bar << " bar, load, " << load;
    // In between the result is never more than the rise and never of the other sign; below, the valve's fall may be missed.
    for (double load = 12e3; load < 60e3; load += 4e3) {
      const double missed = (bar < 0.0 ? 0.2 * std::abs(whole) : 0.0) + tolerance;
      const double rounded = 3.0 * kBarPa;  // a kink of 1.2/A_supply within one length-scale
      EXPECT_NEAR(rise_of(kFlow, load, rise), true_rise(load, rise), missed + rounded) << load;
    }
  }
}

TEST_P(ReturnRise, IsZeroWithoutARiseAndContinuous) {
  for (const double load : {-30e3, 29e3, 60e3}) {
    EXPECT_EQ(rise_of(kFlow, load, 0.0), 0.0);
    EXPECT_NEAR(rise_of(kFlow, load, 1.0), rise_of(kFlow, load, -1.0), 10.0);  // [Pa] of 1 Pa each
  }
}

TEST_P(ReturnRise, DerivativesAreThoseOfTheValues) {
  constexpr double kSums = 1e-10;  // rounding of the kernel's sums, of values near one
  constexpr double kNoise =
      kSums / 2.5e-3;  // of a quotient over the least step of numeric_derivative
  for (const double sign : {-1.0, 1.0}) {
    for (const double load : {-30e3, 25e3, 33e3, 60e3}) {
      const auto at = [&]<class T>(const T& x, const T& y) {
        const T rise = sign * 5 * kBarPa * (1.0 + 0.1 * x);
        return T(rise_of<T>(kFlow * (1.0 + x), load + 1e3 * y, rise) / kBarPa);
      };
      const Jet j = at(Jet::variable(0.1, 0, 2), Jet::variable(0.02, 1, 2));
      const auto dx = [&](double v) { return at(v, 0.02); };
      const auto dy = [&](double v) { return at(0.1, v); };
      const auto jx = [&](double v) {
        return at(Jet::variable(v, 0, 2), Jet::variable(0.02, 1, 2)).gradient(1);
      };
      const auto jy = [&](double v) {
        return at(Jet::variable(0.1, 0, 2), Jet::variable(v, 1, 2)).gradient(1);
      };
      const double size = 1.0 + std::abs(j.value) + std::abs(j.gradient(0)) +
                          std::abs(j.gradient(1)) + std::abs(j.hessian(1, 1));
      EXPECT_NEAR(j.value, at(0.1, 0.02), kSums * size);  // two orders of summing the kernel
      EXPECT_NEAR(j.gradient(0), numeric_derivative(dx, 0.1), kNoise * size) << load;
      EXPECT_NEAR(j.gradient(1), numeric_derivative(dy, 0.02), kNoise * size) << load;
      EXPECT_NEAR(j.hessian(1, 0), numeric_derivative(jx, 0.1), kNoise * size) << load;
      EXPECT_NEAR(j.hessian(1, 1), numeric_derivative(jy, 0.02), kNoise * size) << load;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BothSides, ReturnRise, ::testing::Values(1, -1));

}  // namespace
}  // namespace sparflow::test_support
