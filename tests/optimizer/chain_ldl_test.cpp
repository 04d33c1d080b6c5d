#include "optimizer/nlp/chain_ldl.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <string>

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A symmetric matrix as triplets of its lower triangle, and whole.
struct Symmetric {
  explicit Symmetric(int order) : dense(MatrixXd::Zero(order, order)) {}
  void add(int i, int j, double v) {
    row.push_back(i);
    column.push_back(j);
    value.push_back(v);
    dense(i, j) += v;
    if (i != j) dense(j, i) += v;
  }
  std::vector<int> row, column;
  std::vector<double> value;
  MatrixXd dense;
};

struct ChainSize {
  int knots = 8, states = 3, rows = 2, border = 2;
};

/// KKT matrix of a chain as Ipopt poses it: [W + Sigma, slacks' Sigma, J^T; J, -delta]. Each knot has `states` positions
/// and controls, its dynamics and inequality rows with slacks; border variables enter all dynamics.
class ChainKkt {
 public:
  ChainKkt(const ChainSize& size, std::mt19937& random, double delta = 0.0, double barrier = 1.0)
      : size_(size), random_(random), barrier_(barrier), matrix_(order(size)) {
    const int n = size.states;
    for (int k = 0; k < size.knots; ++k) {
      for (int a = 0; a < 2 * n; ++a) {  // Hessian of one knot, indefinite, and the barrier's diagonal
        for (int b = 0; b <= a; ++b) matrix_.add(variable(k, a), variable(k, b), normal());
        matrix_.add(variable(k, a), variable(k, a), sigma());
      }
      for (int b = 0; b < size.border; ++b) matrix_.add(border(b), variable(k, 0), normal());
      for (int r = 0; r < size.rows; ++r) {
        matrix_.add(slack(k, r), slack(k, r), sigma());
        matrix_.add(inequality(k, r), slack(k, r), -1.0);
        for (int a = 0; a < 2 * n; ++a) matrix_.add(inequality(k, r), variable(k, a), normal());
        matrix_.add(inequality(k, r), inequality(k, r), -delta);
      }
      for (int i = 0; i < n && k + 1 < size.knots; ++i) {
        matrix_.add(dynamics(k, i), variable(k, i), -1.0);
        matrix_.add(dynamics(k, i), variable(k + 1, i), 1.0);
        matrix_.add(dynamics(k, i), variable(k, n + i), -0.1);
        for (int b = 0; b < size.border; ++b) matrix_.add(dynamics(k, i), border(b), normal());
        matrix_.add(dynamics(k, i), dynamics(k, i), -delta);
      }
    }
    for (int b = 0; b < size.border; ++b) matrix_.add(border(b), border(b), sigma());
  }
  Symmetric& matrix() { return matrix_; }
  int constraints() const {
    return size_.knots * size_.rows + (size_.knots - 1) * size_.states;
  }
  int variable(int k, int a) const { return k * 2 * size_.states + a; }
  int border(int b) const { return size_.knots * 2 * size_.states + b; }
  int slack(int k, int r) const { return border(size_.border) + k * size_.rows + r; }
  int inequality(int k, int r) const { return slack(size_.knots, 0) + k * size_.rows + r; }
  int dynamics(int k, int i) const { return inequality(size_.knots, 0) + k * size_.states + i; }

 private:
  static int order(const ChainSize& s) {
    return s.knots * 2 * s.states + s.border + 2 * s.knots * s.rows + (s.knots - 1) * s.states;
  }
  double normal() { return std::normal_distribution<>(0.0, 1.0)(random_); }
  /// What a barrier makes of the distance to a bound: from nearly nothing to very much.
  double sigma() {
    return barrier_ * std::pow(10.0, std::uniform_real_distribution<>(-8.0, 6.0)(random_));
  }

  ChainSize size_;
  std::mt19937& random_;
  double barrier_;
  Symmetric matrix_;
};

/// Negative eigenvalues of a matrix, and how far the nearest eigenvalue is from zero, after bringing all rows near one
/// (a congruence, which keeps the signs): without, eigenvalues of 1e-8 beside 1e6 would be rounding.
struct Inertia {
  int negative = 0;
  double nearest = 0.0;
};
Inertia inertia_of(MatrixXd a) {
  for (int sweep = 0; sweep < 8; ++sweep) {
    const VectorXd s = a.cwiseAbs().rowwise().maxCoeff().cwiseSqrt().cwiseInverse();
    a = s.asDiagonal() * a * s.asDiagonal();
  }
  const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(a).eigenvalues();
  return {static_cast<int>((values.array() < 0.0).count()), values.cwiseAbs().minCoeff()};
}

ChainLdl analysed(const Symmetric& m) {
  return ChainLdl(static_cast<int>(m.dense.rows()), m.row, m.column, m.value.data());
}

/// Componentwise backward error, as LAPACK defines it: |b - A x| against |A| |x| + |b|.
double backward_error(const MatrixXd& a, const VectorXd& x, const VectorXd& b) {
  const VectorXd residual = (b - a * x).cwiseAbs();
  const VectorXd size = a.cwiseAbs() * x.cwiseAbs() + b.cwiseAbs();
  return residual.cwiseQuotient(size).maxCoeff();
}

TEST(ChainLdl, InertiaAndSolutionOfRandomChains) {
  std::mt19937 random(1);
  int delayed = 0, pairs = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const ChainSize size{2 + trial % 11, 1 + trial % 4, trial % 3, trial % 4};
    ChainKkt kkt(size, random, trial % 2 == 0 ? 0.0 : 1e-8);
    const Symmetric& m = kkt.matrix();
    ChainLdl ldl = analysed(m);
    const Inertia truth = inertia_of(m.dense);
    // the dense eigenvalues' own signs are certain only well above rounding
    if (truth.nearest < 1e-11) continue;
    ASSERT_EQ(ldl.factorise(m.value.data(), 1e-4), LdlOutcome::kRegular) << trial;
    EXPECT_EQ(ldl.statistics().negative, truth.negative) << trial << " nearest " << truth.nearest;
    delayed += ldl.statistics().delayed;
    pairs += ldl.statistics().pairs;
    const VectorXd b = VectorXd::Random(m.dense.rows());
    VectorXd x = b;
    ldl.solve(x.data());
    // one step of refinement, as Ipopt takes at least one
    VectorXd r = b - m.dense * x;
    ldl.solve(r.data());
    x += r;
    EXPECT_LT(backward_error(m.dense, x, b), 1e-9) << trial;
  }
  // the cases that make a symmetric indefinite solver hard were there
  EXPECT_GT(delayed, 0);
  EXPECT_GT(pairs, 0);
}

}  // namespace
}  // namespace sparflow
