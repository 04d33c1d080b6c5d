/// Tests of the likelihoods used by learn_pressure: gradients, small cases by hand, sparse against exact form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "identification/learning/gaussian_process/gp_likelihood.h"
#include "identification/learning/gaussian_process/minimise_bounded.h"
#include "identification/learning/gaussian_process/sparse_gp.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// n random points in the unit square with a smooth function, a slope and noise.
GpPoints example(Index n, int basis = 2, double noise = 0.05) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  GpPoints p{ArrayXd(n), ArrayXd(n), VectorXd(n), MatrixXd::Ones(n, basis), VectorXd::Zero(basis)};
  for (Index i = 0; i < n; ++i) {
    p.x1[i] = uniform(random);
    p.x2[i] = uniform(random);
    p.y[i] = 0.5 + 2.0 * p.x2[i] + std::sin(3.0 * p.x1[i]) * std::cos(2.0 * p.x2[i]) +
             noise * normal(random);
    if (basis == 2) p.basis(i, 1) = p.x2[i];
  }
  if (basis == 2) {  // flat prior of the constant, standard deviation 0.7 of the slope
    p.basis_precision[1] = 1.0 / 0.49;
  }
  return p;
}

const GpHyper kHyper(std::log(0.4), std::log(0.6), std::log(0.8), std::log(0.01));

TEST(GpLikelihood, IsThatOfTwoPointsByHand) {
  // With the constant mean integrated out only the difference d = y1 - y2 counts, whose variance is 2 (s^2 + n^2 - k):
  // log p = -1/2 [d^2 / (2(a-k)) + log(a^2-k^2) + log(2/(a+k)) + log 2 pi], a = s^2 + n^2.
  GpPoints p{ArrayXd(2), ArrayXd(2), VectorXd(2), MatrixXd::Ones(2, 1), VectorXd::Zero(1)};
  p.x1 << 0.0, 0.4;
  p.x2 << 0.0, 0.6;
  p.y << 1.0, 3.5;
  const double a = 0.81, k = 0.8 * std::exp(-1.0), d = 2.5;
  const double by_hand = -0.5 * (d * d / (2 * (a - k)) + std::log(a * a - k * k) +
                                 std::log(2 / (a + k)) + std::log(2 * std::numbers::pi));
  EXPECT_NEAR(exact_log_likelihood(p, kHyper, nullptr), by_hand, 1e-12);  // rounding
  const GpPosterior posterior = exact_posterior(p, kHyper);
  EXPECT_NEAR(posterior.beta[0], 2.25, 1e-12);  // by symmetry the average
  EXPECT_NEAR(posterior.weight[1], 0.5 * d / (a - k), 1e-12);
  EXPECT_NEAR(posterior.weight[0], -posterior.weight[1], 1e-12);
}

TEST(GpLikelihood, PriorOfTheMeanIsAKernelOfItsOwn) {
  // With a proper prior on both coefficients p(y) = N(y | 0, K + noise I + H B H^T), written directly.
  GpPoints points = example(12);
  points.basis_precision << 4.0, 1.0 / 0.49;
  MatrixXd covariance = kernel_matrix(points.x1, points.x2, points.x1, points.x2, kHyper);
  covariance.diagonal().array() += std::exp(kHyper[3]);
  covariance +=
      points.basis * points.basis_precision.cwiseInverse().asDiagonal() * points.basis.transpose();
  const double direct = -0.5 * (points.y.dot(symmetric_inverse(covariance) * points.y) +
                                12 * std::log(2 * std::numbers::pi)) -
                        0.5 * Cholesky(covariance).log_det();
  EXPECT_NEAR(exact_log_likelihood(points, kHyper, nullptr), direct, 1e-8);  // condition 1e4
  SparseGp sparse(points, choose_inducing(points.x1, points.x2, kHyper, 12, 0.0).rows);
  EXPECT_NEAR(sparse.bound(kHyper, nullptr), direct, 1e-3);  // jitter, see below
}

template <class Function>
void expect_gradient(Function function, const GpHyper& hyper) {
  GpHyper gradient;
  function(hyper, &gradient);
  for (int i = 0; i < 4; ++i) {
    // Fourth-order differences with a step of 1e-3 in the logarithm: truncation 1e-12 relative.
    const double h = 1e-3;
    const auto at = [&](double step) {
      GpHyper moved = hyper;
      moved[i] += step;
      return function(moved, nullptr);
    };
    const double numeric = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    EXPECT_NEAR(gradient[i], numeric, 1e-7 * (10.0 + std::abs(numeric))) << "component " << i;
  }
}

TEST(GpLikelihood, ExactGradientAgreesWithDifferences) {
  for (int basis : {1, 2}) {
    const GpPoints points = example(60, basis);
    for (const GpHyper& hyper :
         {kHyper, GpHyper(-0.2, -2.0, 1.0, -6.0), GpHyper(1.0, 0.5, 2.0, -2.0)}) {
      expect_gradient(
          [&](const GpHyper& at, GpHyper* g) { return exact_log_likelihood(points, at, g); },
          hyper);
    }
  }
}

TEST(GpLikelihood, SparseGradientAgreesWithDifferences) {
  for (int basis : {1, 2}) {
    const GpPoints points = example(120, basis);
    const InducingChoice choice = choose_inducing(points.x1, points.x2, kHyper, 14, 0.0);
    ASSERT_EQ(choice.rows.size(), 14u);
    SparseGp sparse(points, choice.rows);
    for (const GpHyper& hyper :
         {kHyper, GpHyper(-0.2, -2.0, 1.0, -6.0), GpHyper(0.0, 0.2, 2.0, -2.0)}) {
      expect_gradient([&](const GpHyper& at, GpHyper* g) { return sparse.bound(at, g); }, hyper);
    }
  }
}

TEST(GpLikelihood, BoundIsBelowAndTightensToTheExactValue) {
  const GpPoints points = example(80);
  const double exact = exact_log_likelihood(points, kHyper, nullptr);
  double before = -1e300;
  for (Index count : {3, 8, 20, 50, 80}) {
    SparseGp sparse(points, choose_inducing(points.x1, points.x2, kHyper, count, 0.0).rows);
    const double bound = sparse.bound(kHyper, nullptr);
    // Rounding of a likelihood of some hundred nats, and the jitter on the matrix of the centres.
    EXPECT_LE(bound, exact + 1e-4);
    EXPECT_GE(bound, before - 1e-4);  // the choices are nested, so the bound cannot fall
    before = bound;
  }
  // The greedy choice stops where a point adds only rounding; the jitter of 1e-9 s^2 costs up to
  // n * 1e-9 * s^2 / noise = 1e-5 in the bound.
  EXPECT_NEAR(before, exact, 1e-3);
}

/// @return mean and variance of a posterior at one point
std::pair<double, double> predict(const GpPosterior& p, const GpHyper& hyper, double x1,
                                  double x2) {
  const Index m = p.weight.size(), b = p.beta.size();
  VectorXd basis(m + b);
  basis.head(m) =
      kernel_matrix(p.x1, p.x2, ArrayXd::Constant(1, x1), ArrayXd::Constant(1, x2), hyper);
  basis[m] = 1.0;
  if (b == 2) basis[m + 1] = x2;
  return {basis.head(m).dot(p.weight) + basis.tail(b).dot(p.beta),
          std::exp(hyper[2]) - basis.dot(p.core * basis)};
}

TEST(GpLikelihood, SparsePredictsLikeExact) {
  const GpPoints points = example(400);
  const GpPosterior exact = exact_posterior(points, kHyper);
  SparseGp sparse(points, choose_inducing(points.x1, points.x2, kHyper, 40, 0.0).rows);
  const GpPosterior few = sparse.posterior(kHyper);
  for (double x1 : {-0.5, 0.1, 0.5, 0.9, 3.0}) {
    for (double x2 : {-1.0, 0.2, 0.7, 2.0}) {
      const auto [mean, variance] = predict(exact, kHyper, x1, x2);
      const auto [sparse_mean, sparse_variance] = predict(few, kHyper, x1, x2);
      // 40 points leave a mean conditional variance of 1e-5 s^2: a 30th of a noise deviation of 0.1.
      EXPECT_NEAR(sparse_mean, mean, 0.01) << x1 << " " << x2;
      EXPECT_NEAR(sparse_variance, variance, 1e-3 + 0.02 * variance) << x1 << " " << x2;
      EXPECT_GT(sparse_variance, 0.0);
    }
  }
}

TEST(GpLikelihood, LeaveOneOutAgreesWithRefitting) {
  const GpPoints points = example(25);
  const VectorXd residual = leave_one_out_residuals(points, kHyper);
  for (Index i : {0, 7, 24}) {
    std::vector<Index> others;
    for (Index j = 0; j < 25; ++j) {
      if (j != i) others.push_back(j);
    }
    const GpPosterior posterior = exact_posterior(points.select(others), kHyper);
    EXPECT_NEAR(residual[i],
                predict(posterior, kHyper, points.x1[i], points.x2[i]).first - points.y[i],
                1e-9);  // rounding of two factorisations
  }
}

TEST(MinimiseBounded, FindsTheMinimumOfRosenbrockFreeAndHeld) {
  const auto rosenbrock = [](const VectorXd& x, VectorXd& g) {
    const double a = 1 - x[0], b = x[1] - x[0] * x[0];
    g = Eigen::Vector2d(-2 * a - 400 * x[0] * b, 200 * b);
    return a * a + 100 * b * b;
  };
  MinimiseOptions options;
  options.value_tolerance = 1e-15;  // the curvature is 200: 1e-8 in x
  const Eigen::Vector2d start(-1.2, 1.0), lower(-5, -5), upper(5, 5);
  const Minimum free = minimise_bounded(rosenbrock, start, lower, upper, options);
  EXPECT_TRUE(free.converged);
  EXPECT_NEAR(free.x[0], 1.0, 1e-7);
  EXPECT_NEAR(free.x[1], 1.0, 1e-7);
  // x0 <= 0.5: on the bound the minimum is at x1 = 0.25.
  const Minimum on_bound =
      minimise_bounded(rosenbrock, start, lower, Eigen::Vector2d(0.5, 5), options);
  EXPECT_TRUE(on_bound.converged);
  EXPECT_EQ(on_bound.x[0], 0.5);
  EXPECT_NEAR(on_bound.x[1], 0.25, 1e-8);
}

TEST(MinimiseBounded, StepsBackFromWhereTheFunctionIsNotDefined) {
  const auto with_edge = [](const VectorXd& x, VectorXd& g) {
    const double root = std::sqrt(x[0] + 0.2);  // NaN left of -0.2
    g = Eigen::Vector2d(0.5 / root - 2.0 + 4.0 * x[0] * x[0] * x[0], 2.0 * (x[1] - 1.0));
    return root - 2.0 * x[0] + std::pow(x[0], 4) + (x[1] - 1.0) * (x[1] - 1.0);
  };
  const Minimum m = minimise_bounded(with_edge, Eigen::Vector2d(3, 3), Eigen::Vector2d(-5, -5),
                                     Eigen::Vector2d(5, 5));
  EXPECT_TRUE(m.converged);
  VectorXd g(2);
  with_edge(m.x, g);
  EXPECT_LT(g.norm(), 1e-2);  // 1e-7 of the value with curvature 6: 1e-3 in x
}

}  // namespace
}  // namespace sparflow
