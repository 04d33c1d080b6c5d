#include "models/math/linear_algebra.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNearOne = 1e-12;  // some thousand times the rounding of numbers near one

MatrixXd normal_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MatrixXd m(rows, columns);
  for (double& x : m.reshaped()) x = normal(random);
  return m;
}

TEST(LinearAlgebra, LeastNormSolutionsSolveAndLieInTheSpan) {
  // With these sizes pivoting permutes the columns, by a permutation that is not its own inverse.
  const Eigen::Vector4d size(1.0, 100.0, 1000.0, 10.0);
  const MatrixXd a = normal_matrix(9, 4, 1) * size.asDiagonal(), b = normal_matrix(4, 3, 2);
  const MatrixXd x = least_norm_columns(a, b);
  EXPECT_LT((a.transpose() * x - b).cwiseAbs().maxCoeff(), size.maxCoeff() * kNearOne);
  // Least norm means that x has no part normal to the columns of A.
  EXPECT_LT((complement_of(a).transpose() * x).cwiseAbs().maxCoeff(), kNearOne);
}

TEST(LinearAlgebra, LeastSquaresOfLeastNormWithoutFullRank) {
  for (const Eigen::Index rank : {1, 3, 5}) {
    const MatrixXd a = normal_matrix(12, rank, 3) * normal_matrix(rank, 5, 4);
    const VectorXd b = normal_matrix(12, 1, 5);
    const VectorXd x = least_squares_of_least_norm(a, b);
    EXPECT_LT((a.transpose() * (a * x - b)).cwiseAbs().maxCoeff(), 100.0 * kNearOne) << rank;
    const MatrixXd null = complement_of(a.transpose());
    ASSERT_EQ(null.cols(), 5 - rank);
    if (rank < 5) {
      EXPECT_LT((null.transpose() * x).cwiseAbs().maxCoeff(), kNearOne) << rank;
    }
  }
}

TEST(LinearAlgebra, LeastNormOfAnEmptySystemIsZero) {
  const VectorXd x = least_squares_of_least_norm(MatrixXd::Zero(4, 3), VectorXd::Ones(4));
  EXPECT_EQ(x, VectorXd::Zero(3));
  const MatrixXd none = least_norm_columns(MatrixXd(5, 0), MatrixXd(0, 2));
  EXPECT_EQ(none, MatrixXd::Zero(5, 2));
}

TEST(LinearAlgebra, ComplementAndSpanMakeUpTheSpace) {
  MatrixXd a = normal_matrix(6, 3, 6);
  a.col(2) = a.col(0) - 2.0 * a.col(1);
  const MatrixXd span = span_of(a), rest = complement_of(a);
  ASSERT_EQ(span.cols(), 2);
  ASSERT_EQ(rest.cols(), 4);
  MatrixXd all(6, 6);
  all << span, rest;
  EXPECT_LT((all.transpose() * all - MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff(), kNearOne);
  EXPECT_LT((rest.transpose() * a).cwiseAbs().maxCoeff(), kNearOne);
}

TEST(LinearAlgebra, ProjectionIsTheLeastSquaresOneForDependentColumnsToo) {
  const MatrixXd a = normal_matrix(40, 3, 9);
  MatrixXd b = normal_matrix(40, 5, 10);
  b.col(1) *= 1e9;  // columns of pressures and of ones
  for (const double apart : {1.0, 1e-4, 0.0}) {
    b.col(4) = b.col(0) + apart * normal_matrix(40, 1, 11);
    MatrixXd x;
    const MatrixXd left = without_projection(a, b, &x);
    // normal to all columns, in units of their lengths; nearly dependent ones are determined to rounding / apart
    const VectorXd scale = b.colwise().norm();
    EXPECT_LT((scale.cwiseInverse().asDiagonal() * b.transpose() * left).cwiseAbs().maxCoeff(),
              1e-6)
        << apart;
    EXPECT_LT((a - b * x - left).cwiseAbs().maxCoeff(), 1e-6) << apart;
    const MatrixXd span = span_of(b);
    EXPECT_LT((a - span * (span.transpose() * a) - left).cwiseAbs().maxCoeff(), 1e-6) << apart;
  }
}

TEST(LinearAlgebra, CholeskySolvesAndRefuses) {
  const MatrixXd half = normal_matrix(5, 8, 7), b = normal_matrix(5, 2, 8);
  const MatrixXd a = gram_of_rows(half);
  EXPECT_LT((a - half * half.transpose()).cwiseAbs().maxCoeff(), kNearOne);
  const Cholesky factor(a);
  EXPECT_NEAR(Cholesky(Eigen::Matrix2d{{4.0, 2.0}, {2.0, 3.0}}).log_det(), std::log(8.0), kNearOne);
  EXPECT_LT((a * factor.solve_columns(b) - b).cwiseAbs().maxCoeff(), 100.0 * kNearOne);
  MatrixXd x = b;
  factor.solve_lower(x);
  EXPECT_LT((factor.lower() * x - b).cwiseAbs().maxCoeff(), kNearOne);
  factor.solve_upper(x);
  EXPECT_LT((x - symmetric_inverse(a) * b).cwiseAbs().maxCoeff(), 100.0 * kNearOne);
  Cholesky refused;
  EXPECT_FALSE(refused.compute(-a));
}

}  // namespace
}  // namespace sparflow
