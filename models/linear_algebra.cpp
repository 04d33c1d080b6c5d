#include "models/linear_algebra.h"

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd product(const MatrixIn& a, const MatrixIn& b) { return a * b; }

MatrixXd transposed_product(const MatrixIn& a, const MatrixIn& b) { return a.transpose() * b; }

MatrixXd weighted_gram(const MatrixIn& a, const VectorIn& weight) {
  return a.transpose() * weight.asDiagonal() * a;
}

VectorXd solve_symmetric(const MatrixIn& a, const VectorIn& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

MatrixXd solve_symmetric_columns(const MatrixIn& a, const MatrixIn& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

VectorXd solve_definite(const MatrixIn& a, const VectorIn& b) {
  return Eigen::LLT<MatrixXd>(a).solve(b);
}

MatrixXd inverse(const MatrixIn& a) { return a.inverse(); }

VectorXd least_squares(const MatrixIn& a, const VectorIn& b) {
  return Eigen::ColPivHouseholderQR<MatrixXd>(a).solve(b);
}

VectorXd least_squares_of_least_norm(const MatrixIn& a, const VectorIn& b) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(a).solve(b);
}

MatrixXd without_projection(const MatrixIn& a, const MatrixIn& b, MatrixXd* coefficients) {
  MatrixXd x = Eigen::ColPivHouseholderQR<MatrixXd>(b).solve(a);
  MatrixXd left = a - b * x;
  if (coefficients != nullptr) *coefficients = std::move(x);
  return left;
}

ThinQr thin_qr(const MatrixIn& a) {
  const Eigen::HouseholderQR<MatrixXd> qr(a);
  return {qr.householderQ() * MatrixXd::Identity(a.rows(), a.cols()),
          qr.matrixQR().topRows(a.cols()).triangularView<Eigen::Upper>()};
}

MatrixXd solve_transposed_upper(const MatrixIn& r, const MatrixIn& b) {
  return r.triangularView<Eigen::Upper>().transpose().solve(b);
}

MatrixXd span_of(const MatrixIn& a) {
  if (a.cols() == 0 || a.rows() == 0) return MatrixXd(a.rows(), 0);
  const VectorXd scale = a.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(a * scale.asDiagonal());
  return qr.householderQ() * MatrixXd::Identity(a.rows(), qr.rank());
}

MatrixXd complement_of(const MatrixIn& a) {
  const MatrixXd q = Eigen::HouseholderQR<MatrixXd>(a).householderQ();
  return q.rightCols(a.rows() - a.cols());
}

MatrixXd cholesky_factor(const MatrixIn& a) { return Eigen::LLT<MatrixXd>(a).matrixL(); }

SymmetricEigen symmetric_eigen(const MatrixIn& a) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(a);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigen::Index rank(const MatrixIn& a, double threshold) {
  return Eigen::ColPivHouseholderQR<MatrixXd>(a).setThreshold(threshold).rank();
}

}  // namespace sparflow
