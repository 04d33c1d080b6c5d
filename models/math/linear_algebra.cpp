#include "models/math/linear_algebra.h"

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
using Qr = Eigen::ColPivHouseholderQR<MatrixXd>;
}

MatrixXd product(const MatrixIn& a, const MatrixIn& b) { return a * b; }

MatrixXd transposed_product(const MatrixIn& a, const MatrixIn& b) { return a.transpose() * b; }

MatrixXd gram_of_rows(const MatrixIn& a) {
  MatrixXd gram = MatrixXd::Zero(a.rows(), a.rows());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(a);
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  return gram;
}

MatrixXd weighted_gram(const MatrixIn& a, const VectorIn& weight) {
  return a.transpose() * weight.asDiagonal() * a;
}

VectorXd solve_symmetric(const MatrixIn& a, const VectorIn& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

MatrixXd solve_symmetric_columns(const MatrixIn& a, const MatrixIn& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

MatrixXd symmetric_inverse(const MatrixIn& a) {
  return Eigen::LDLT<MatrixXd>(a).solve(MatrixXd::Identity(a.rows(), a.rows()));
}

VectorXd least_squares(const MatrixIn& a, const VectorIn& b) { return Qr(a).solve(b); }

MatrixXd least_norm_columns(const MatrixIn& a, const MatrixIn& b) {
  if (a.cols() == 0) return MatrixXd::Zero(a.rows(), b.cols());  // Qr would read beyond its end.
  const Qr qr(a);                                                // A P = Q R: X = Q R^-T P^T B
  const Eigen::Index m = a.cols();
  MatrixXd x = MatrixXd::Zero(a.rows(), b.cols());
  x.topRows(m) = qr.colsPermutation().transpose() * b;
  MatrixXd head = x.topRows(m);
  qr.matrixQR().topRows(m).triangularView<Eigen::Upper>().transpose().solveInPlace(head);
  x.topRows(m) = head;
  x.applyOnTheLeft(qr.householderQ());
  return x;
}

VectorXd least_squares_of_least_norm(const MatrixIn& a, const VectorIn& b) {
  const Qr qr(a);  // A P = Q R; the first rows of R, as many as the rank, are equations for P^T x
  const Eigen::Index r = qr.rank();
  MatrixXd right = b;
  right.applyOnTheLeft(qr.householderQ().adjoint());
  MatrixXd equations = MatrixXd::Zero(a.cols(), r);
  for (Eigen::Index i = 0; i < r; ++i) {
    equations.col(i).tail(a.cols() - i) = qr.matrixQR().row(i).tail(a.cols() - i).transpose();
  }
  return qr.colsPermutation() * least_norm_columns(equations, right.topRows(r));
}

namespace {

/// B S = Q U with scaled columns, orthonormal Q and upper triangular U, by two Cholesky factorisations (Yamamoto, Nakatsukasa,
/// Yanagisawa, Fukaya 2015, Electron. Trans. Numer. Anal. 44, 306). It consists of matrix products and takes a fraction of the
/// time of a QR factorisation with pivots.
struct CholeskyQr {
  MatrixXd q, u;
  VectorXd scale;

  /// @return false where the columns are nearly dependent, for which it is not accurate
  bool compute(const MatrixIn& b) {
    // The error of one step grows with the square of the condition number; from 1e6 on the second step may not repair it.
    constexpr double kLeastPivot = 1e-6;  // no threshold: rounding of the first step
    if (b.cols() == 0 || b.rows() < b.cols()) return false;
    scale = b.colwise().norm().transpose();
    if (!(scale.minCoeff() > 0.0)) return false;
    scale = scale.cwiseInverse();
    q = b * scale.asDiagonal();
    for (int step = 0; step < 2; ++step) {
      const Eigen::LLT<MatrixXd> factor(MatrixXd(q.transpose() * q));
      if (factor.info() != Eigen::Success) return false;
      const MatrixXd upper = factor.matrixU();
      if (!(upper.diagonal().minCoeff() > kLeastPivot)) return false;
      upper.triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(q);
      u = step == 0 ? upper : MatrixXd(upper * u);
    }
    return true;
  }
};

}  // namespace

Projection::Projection(const MatrixIn& b) {
  CholeskyQr fast;
  if (!fast.compute(b)) {
    b_ = b;
    return;
  }
  q_ = std::move(fast.q);
  u_ = std::move(fast.u);
  scale_ = std::move(fast.scale);
}

MatrixXd Projection::without(const MatrixIn& a, MatrixXd* coefficients) const {
  if (b_.cols() > 0) {
    MatrixXd x = Qr(b_).solve(a);
    MatrixXd left = a - b_ * x;
    if (coefficients != nullptr) *coefficients = std::move(x);
    return left;
  }
  if (q_.cols() == 0) {
    if (coefficients != nullptr) coefficients->resize(0, a.cols());
    return a;
  }
  const MatrixXd on_basis = q_.transpose() * a;
  if (coefficients != nullptr)
    *coefficients = scale_.asDiagonal() * u_.triangularView<Eigen::Upper>().solve(on_basis);
  return a - q_ * on_basis;
}

MatrixXd without_projection(const MatrixIn& a, const MatrixIn& b, MatrixXd* coefficients) {
  return Projection(b).without(a, coefficients);
}

MatrixXd span_of(const MatrixIn& a) {
  if (a.cols() == 0 || a.rows() == 0) return MatrixXd(a.rows(), 0);
  const VectorXd scale = a.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Qr qr(a * scale.asDiagonal());
  return qr.householderQ() * MatrixXd::Identity(a.rows(), qr.rank());
}

MatrixXd complement_of(const MatrixIn& a, double threshold) {
  Qr qr(a);
  qr.setThreshold(threshold);
  const MatrixXd q = qr.householderQ() * MatrixXd::Identity(a.rows(), a.rows());
  return q.rightCols(a.rows() - qr.rank());
}

Eigen::Index rank(const MatrixIn& a, double threshold) {
  return Qr(a).setThreshold(threshold).rank();
}

bool Cholesky::compute(const MatrixIn& a) {
  factor_.compute(a);
  return factor_.info() == Eigen::Success;
}

double Cholesky::log_det() const {
  return 2.0 * factor_.matrixLLT().diagonal().array().log().sum();
}

MatrixXd Cholesky::lower() const { return factor_.matrixL(); }

VectorXd Cholesky::solve(const VectorIn& b) const { return factor_.solve(b); }

MatrixXd Cholesky::solve_columns(const MatrixIn& b) const { return factor_.solve(b); }

void Cholesky::solve_lower(Eigen::Ref<MatrixXd> b) const { factor_.matrixL().solveInPlace(b); }

void Cholesky::solve_upper(Eigen::Ref<MatrixXd> b) const { factor_.matrixU().solveInPlace(b); }

}  // namespace sparflow
