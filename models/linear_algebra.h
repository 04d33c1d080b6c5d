#pragma once
/// Dense linear algebra behind plain functions. Eigen's decompositions and matrix products are templates, compiled
/// again in every file that names them (some five seconds each); here they are compiled once.
#include <Eigen/Dense>

namespace sparflow {

using MatrixIn = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>;

/// A B, [rows of A x columns of B].
Eigen::MatrixXd product(const MatrixIn& a, const MatrixIn& b);
/// A^T B, [columns of A x columns of B].
Eigen::MatrixXd transposed_product(const MatrixIn& a, const MatrixIn& b);
/// A^T diag(weight) A.
Eigen::MatrixXd weighted_gram(const MatrixIn& a, const VectorIn& weight);

/// A^-1 b and A^-1 B of a symmetric positive semi-definite A, by LDL^T with pivots.
Eigen::VectorXd solve_symmetric(const MatrixIn& a, const VectorIn& b);
Eigen::MatrixXd solve_symmetric_columns(const MatrixIn& a, const MatrixIn& b);
/// A^-1 b of a symmetric positive definite A, by Cholesky.
Eigen::VectorXd solve_definite(const MatrixIn& a, const VectorIn& b);
/// A^-1 of a general square A.
Eigen::MatrixXd inverse(const MatrixIn& a);

/// argmin |A x - b| by QR with column pivots; A has full column rank.
Eigen::VectorXd least_squares(const MatrixIn& a, const VectorIn& b);
/// argmin |A x - b| of least |x|, for A of any rank.
Eigen::VectorXd least_squares_of_least_norm(const MatrixIn& a, const VectorIn& b);
/// Columns of A - B X with X their least-squares coefficients on B; `coefficients` takes X where it is not null.
Eigen::MatrixXd without_projection(const MatrixIn& a, const MatrixIn& b,
                                   Eigen::MatrixXd* coefficients = nullptr);

/// Q and R of the thin QR decomposition of A [n x m], n >= m: orthonormal columns [n x m], upper triangle [m x m].
struct ThinQr {
  Eigen::MatrixXd q, r;
};
ThinQr thin_qr(const MatrixIn& a);
/// R^-T B of an upper triangular R.
Eigen::MatrixXd solve_transposed_upper(const MatrixIn& r, const MatrixIn& b);
/// Orthonormal columns that span A's columns (scaled to one first) to within rounding.
Eigen::MatrixXd span_of(const MatrixIn& a);
/// Orthonormal columns normal to all columns of A, which are independent [n x (n - columns of A)].
Eigen::MatrixXd complement_of(const MatrixIn& a);
/// L of A = L L^T, A symmetric positive definite.
Eigen::MatrixXd cholesky_factor(const MatrixIn& a);

/// Eigenvalues of a symmetric A, ascending, and their unit vectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const MatrixIn& a);
/// Number of columns of a square A independent to within `threshold` (relative to the largest pivot).
Eigen::Index rank(const MatrixIn& a, double threshold);

}  // namespace sparflow
