#include "models/hydraulics/gaussian_process.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "models/hydraulics/gp_kernel.h"
#include "models/hydraulics/uninformed_length.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

constexpr KernelIsa kIsas[] = {KernelIsa::kBaseline, KernelIsa::kAvx2, KernelIsa::kAvx512};

/// Runs every test with every instruction set that this machine has.
class GpKernel : public testing::TestWithParam<KernelIsa> {
 protected:
  void SetUp() override {
    before_ = kernel_isa();
    if (!set_kernel_isa(GetParam())) GTEST_SKIP() << "this machine lacks it";
    EXPECT_EQ(kernel_isa(), GetParam());
  }
  void TearDown() override { set_kernel_isa(before_); }

 private:
  KernelIsa before_ = KernelIsa::kBaseline;
};

TEST_P(GpKernel, ExponentialIsExactToRounding) {
  // One centre at 0 and y = 0: the kernel is exp(-x^2/2). The argument is rounded once by every
  // method, so that the reference takes the rounded argument.
  const std::vector<double> zero(8, 0.0);
  std::vector<double> out(8);
  double worst = 0.0;
  for (int i = 0; i <= 200000; ++i) {
    const double x = 37.0 * i / 200000.0;  // arguments 0 .. -684
    kernel_vector({zero.data(), zero.data(), zero.data(), 8}, x, 0.0, out.data());
    const long double exact = std::exp(static_cast<long double>(-0.5 * (x * x)));
    worst = std::max(worst, std::abs(static_cast<double>((out[0] - exact) / exact)));
    for (int lane = 1; lane < 8; ++lane) ASSERT_EQ(out[0], out[static_cast<std::size_t>(lane)]);
  }
  EXPECT_LT(worst, 1e-15);  // truncation 2e-17, the rest rounding: measured 4e-16
}

TEST_P(GpKernel, UnderflowGivesZeroAndNoNaN) {
  const std::vector<double> zero(8, 0.0), one(8, 1.0);
  const KernelCentres centres{zero.data(), zero.data(), one.data(), 8};
  EXPECT_EQ(kernel_sum(centres, 0.0, 0.0), 8.0);
  for (double x : {37.2, 38.6, 100.0, 1e10, 1e100, 1e160, std::numeric_limits<double>::max()}) {
    EXPECT_EQ(kernel_sum(centres, x, 0.0), 0.0) << x;
    const KernelSums s = kernel_sum_derivatives(centres, -x, x);
    for (double value : {s.value, s.d_x, s.d_y, s.d_xx, s.d_xy, s.d_yy}) EXPECT_EQ(value, 0.0) << x;
  }
  EXPECT_TRUE(std::isnan(kernel_sum(centres, std::nan(""), 0.0)));  // NaN is passed on
  EXPECT_EQ(kernel_sum({nullptr, nullptr, nullptr, 0}, 1.0, 1.0), 0.0);
}

TEST_P(GpKernel, SumsMatchLongDouble) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (std::size_t n : {1u, 7u, 8u, 9u, 200u, 301u}) {
    const std::size_t size = kernel_padded(n);
    std::vector<double> x(size), y(size), w(size), k(size);
    for (std::size_t j = 0; j < n; ++j) x[j] = 2 * normal(random), y[j] = 2 * normal(random);
    for (std::size_t j = 0; j < n; ++j) w[j] = 100 * normal(random);
    const KernelCentres centres{x.data(), y.data(), w.data(), size};
    for (int repeat = 0; repeat < 20; ++repeat) {
      const double qx = 3 * normal(random), qy = 3 * normal(random);
      long double value = 0, dx = 0, dy = 0, dxx = 0, dxy = 0, dyy = 0, scale = 0;
      kernel_vector(centres, qx, qy, k.data());
      for (std::size_t j = 0; j < n; ++j) {
        const long double u = static_cast<long double>(qx) - x[j];
        const long double v = static_cast<long double>(qy) - y[j];
        const long double kj = std::exp(-0.5L * (u * u + v * v)), e = w[j] * kj;
        value += e, dx -= e * u, dy -= e * v;
        dxx += e * (u * u - 1), dxy += e * u * v, dyy += e * (v * v - 1);
        scale += std::abs(e) * (1 + u * u + v * v);
        // The argument r is rounded four times on its way: 4 * 2^-53 * r relative in the kernel.
        const double r = static_cast<double>(0.5L * (u * u + v * v));
        EXPECT_NEAR(k[j], static_cast<double>(kj), (1e-15 + 5e-16 * r) * static_cast<double>(kj));
      }
      const double tolerance = 1e-14 * static_cast<double>(scale);  // same rounding, weighted
      const KernelSums s = kernel_sum_derivatives(centres, qx, qy);
      EXPECT_NEAR(kernel_sum(centres, qx, qy), static_cast<double>(value), tolerance);
      EXPECT_NEAR(s.value, static_cast<double>(value), tolerance);
      EXPECT_NEAR(s.d_x, static_cast<double>(dx), tolerance);
      EXPECT_NEAR(s.d_y, static_cast<double>(dy), tolerance);
      EXPECT_NEAR(s.d_xx, static_cast<double>(dxx), tolerance);
      EXPECT_NEAR(s.d_xy, static_cast<double>(dxy), tolerance);
      EXPECT_NEAR(s.d_yy, static_cast<double>(dyy), tolerance);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Isas, GpKernel, testing::ValuesIn(kIsas),
                         [](const auto& tested) { return kernel_isa_name(tested.param); });

/// A process of the size and units of a boom cylinder; its variance core need not come from data for derivatives.
GpParameters example(Eigen::Index n) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  GpParameters p;
  p.length_flow = 7e-4;
  p.length_force = 9e4;
  p.signal_std = 30e5;
  p.mean_constant = 12e5;
  p.mean_slope = 40.0;
  p.mean_flow_slope = 6e9;
  p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    p.flow[j] = 1.6e-3 * uniform(random);
    p.force[j] = 4e5 * (uniform(random) - 0.3);
    p.weight[j] = 1e-6 * (uniform(random) - 0.5);
  }
  const Eigen::MatrixXd root =
      Eigen::MatrixXd::NullaryExpr(n + 3, n + 3, [&] { return uniform(random); });
  p.variance_core = 1e-16 * root * root.transpose();
  return p;
}

/// Every derivative against central differences of the value one order below.
template <class Value, class Derivatives>
void expect_derivatives(Value value, Derivatives derivatives, double flow, double force) {
  const double hq = 1e-4 * 7e-4, hf = 1e-4 * 9e4;  // 1e-4 length-scales: truncation 1e-8 relative
  const GpDerivatives d = derivatives(flow, force);
  const GpDerivatives qp = derivatives(flow + hq, force), qm = derivatives(flow - hq, force);
  const GpDerivatives fp = derivatives(flow, force + hf), fm = derivatives(flow, force - hf);
  const double scale = 3e6 + std::abs(d.value);
  EXPECT_NEAR(d.value, value(flow, force), 1e-12 * scale);
  EXPECT_NEAR(d.d_flow * 7e-4, (qp.value - qm.value) / (2 * hq) * 7e-4, 1e-7 * scale);
  EXPECT_NEAR(d.d_force * 9e4, (fp.value - fm.value) / (2 * hf) * 9e4, 1e-7 * scale);
  EXPECT_NEAR(d.d_flow_flow * 49e-8, (qp.d_flow - qm.d_flow) / (2 * hq) * 49e-8, 1e-7 * scale);
  EXPECT_NEAR(d.d_flow_force * 63, (fp.d_flow - fm.d_flow) / (2 * hf) * 63, 1e-7 * scale);
  EXPECT_NEAR(d.d_flow_force * 63, (qp.d_force - qm.d_force) / (2 * hq) * 63, 1e-7 * scale);
  EXPECT_NEAR(d.d_force_force * 81e8, (fp.d_force - fm.d_force) / (2 * hf) * 81e8, 1e-7 * scale);
}

TEST(GaussianProcess, MeanDerivativesMatchDifferences) {
  const GaussianProcess process(example(37));
  for (double flow : {1e-5, 6e-4, 2e-3}) {
    for (double force : {-2e5, 0.0, 1.7e5}) {
      expect_derivatives([&](double q, double f) { return process.mean(q, f); },
                         [&](double q, double f) { return process.mean_derivatives(q, f); }, flow,
                         force);
    }
  }
}

TEST(GaussianProcess, VarianceDerivativesMatchDifferences) {
  GpParameters parameters = example(37);
  parameters.variance_core *= 1e-3;  // small enough that the variance stays positive
  const GaussianProcess process(parameters);
  for (double flow : {1e-5, 6e-4, 2e-3}) {
    for (double force : {-2e5, 0.0, 1.7e5}) {
      ASSERT_GT(process.variance(flow, force), 0.0);
      expect_derivatives([&](double q, double f) { return process.variance(q, f); },
                         [&](double q, double f) { return process.variance_derivatives(q, f); },
                         flow, force);
    }
  }
}

TEST(GaussianProcess, OnePointByHand) {
  // One measurement y at x0, signal s, noise n, no mean: mean = s^2/(s^2+n^2) y at x0 and times exp(-1/2)
  // one length away; variance = s^2 - s^4/(s^2+n^2) k^2.
  GpParameters p;
  p.length_flow = 2.0;
  p.length_force = 3.0;
  p.signal_std = 2.0;
  p.flow = p.force = p.weight = Eigen::ArrayXd::Constant(1, 5.0);
  p.weight[0] = 10.0 / (4.0 + 1.0);  // y = 10, n = 1
  p.variance_core = Eigen::MatrixXd::Zero(3, 3);
  p.variance_core(0, 0) = 1.0 / 5.0;
  const GaussianProcess process(p);
  EXPECT_DOUBLE_EQ(process.mean(5.0, 5.0), 8.0);
  EXPECT_DOUBLE_EQ(process.mean(7.0, 5.0), 8.0 * std::exp(-0.5));
  EXPECT_DOUBLE_EQ(process.mean(5.0, 8.0), 8.0 * std::exp(-0.5));
  EXPECT_DOUBLE_EQ(process.variance(5.0, 5.0), 4.0 - 16.0 / 5.0);
  EXPECT_DOUBLE_EQ(process.variance(7.0, 5.0), 4.0 - 16.0 / 5.0 * std::exp(-1.0));
  EXPECT_DOUBLE_EQ(process.variance(1e6, 5.0), 4.0);
}

TEST(GaussianProcess, EmptyProcessIsItsMean) {
  GpParameters p;
  p.mean_constant = 3.0;
  p.mean_slope = 2.0;
  const GaussianProcess process(p);
  EXPECT_TRUE(process.empty());
  EXPECT_DOUBLE_EQ(process.mean(1.0, 4.0), 11.0);
  EXPECT_DOUBLE_EQ(process.mean_derivatives(1.0, 4.0).d_force, 2.0);
  EXPECT_DOUBLE_EQ(process.variance(1.0, 4.0), 1.0);
}

TEST(GaussianProcess, InvalidParametersAreNamed) {
  const auto key_of = [](const GpParameters& p) {
    try {
      GaussianProcess process(p);
    } catch (const InputError& error) {
      return error.key;
    }
    return std::string("accepted");
  };
  GpParameters p = example(4);
  EXPECT_EQ(key_of(p), "accepted");
  p.length_flow = 0.0;
  EXPECT_EQ(key_of(p), "length_flow");
  p = example(4);
  p.length_force = std::nan("");
  EXPECT_EQ(key_of(p), "length_force");
  p = example(4);
  p.flow.conservativeResize(3);
  EXPECT_EQ(key_of(p), "weight");
  p = example(4);
  p.variance_core.conservativeResize(4, 4);
  EXPECT_EQ(key_of(p), "variance_core");
}

/// A process over the flow at one force, as it is learned for a slewing drive: its length over the force is rounding.
GpParameters at_one_force(double force) {
  GpParameters p;
  p.length_flow = 1e-3;
  p.length_force = 3e-9;
  p.signal_std = 3e5;
  p.noise_std = 1e4;
  p.mean_constant = 5e6;
  p.flow = Eigen::Array3d(1e-4, 3e-4, 5e-4);
  p.force = Eigen::Array3d::Constant(force);
  p.weight = Eigen::Array3d(2e-5, -1e-5, 3e-5);
  p.flow_min = 1e-4;
  p.flow_max = 5e-4;
  p.force_min = p.force_max = force;
  return p;
}

TEST(UninformedLength, IsLongAndThePressuresAtTheDataStay) {
  for (const double force : {0.0, 2e4}) {
    const GpParameters before = at_one_force(force);
    GpParameters after = before;
    EXPECT_TRUE(replace_uninformed_lengths(after));
    EXPECT_EQ(after.length_flow, before.length_flow) << "the flows vary";
    const GaussianProcess a(before), b(after);
    for (const double flow : {1e-4, 2.2e-4, 5e-4}) {
      EXPECT_EQ(a.mean(flow, force), b.mean(flow, force));
      // Nothing shows another pressure beside the only force learned: a kilonewton is a hundredth of the length, which
      // takes half of its square off the process's share.
      const double share = b.mean(flow, force) - before.mean_constant;
      EXPECT_NEAR(b.mean(flow, force + 1e3), b.mean(flow, force), 5.1e-5 * share);
      EXPECT_NEAR(b.mean_derivatives(flow, force).d_force_force, -share / 1e10,
                  1e-9 * share / 1e10);
    }
  }
}

TEST(UninformedLength, LengthsThatDataInformStay) {
  GpParameters p = at_one_force(0.0);
  p.force = Eigen::Array3d(0.0, 100.0, 200.0);
  p.force_max = 200.0;
  p.length_force = 50.0;
  EXPECT_FALSE(replace_uninformed_lengths(p));
  EXPECT_EQ(p.length_force, 50.0);
  // A plane has one centre; its range tells that the data vary.
  p.force = p.flow = p.weight = Eigen::ArrayXd::Zero(1);
  EXPECT_FALSE(replace_uninformed_lengths(p));
}

}  // namespace
}  // namespace sparflow
