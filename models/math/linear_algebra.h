#pragma once
/// Dense linear algebra as plain functions. Eigen's decompositions and matrix products are templates that every file
/// would compile again (some five seconds each); here they are compiled once.
#include <Eigen/Dense>

namespace sparflow {

using MatrixIn = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>;

/// A B, [rows of A x columns of B].
Eigen::MatrixXd product(const MatrixIn& a, const MatrixIn& b);
/// A^T B, [columns of A x columns of B].
Eigen::MatrixXd transposed_product(const MatrixIn& a, const MatrixIn& b);
/// A A^T, [rows of A x rows of A], and A^T diag(weight) A.
Eigen::MatrixXd gram_of_rows(const MatrixIn& a);
Eigen::MatrixXd weighted_gram(const MatrixIn& a, const VectorIn& weight);

/// A^-1 b and A^-1 B of a symmetric positive semi-definite A, by LDL^T with pivots.
Eigen::VectorXd solve_symmetric(const MatrixIn& a, const VectorIn& b);
Eigen::MatrixXd solve_symmetric_columns(const MatrixIn& a, const MatrixIn& b);
/// A^-1 of a symmetric positive definite A.
Eigen::MatrixXd symmetric_inverse(const MatrixIn& a);

/// argmin |A x - b| by QR with column pivots; A has full column rank.
Eigen::VectorXd least_squares(const MatrixIn& a, const VectorIn& b);
/// The X of least norm with A^T X = B [rows of A x columns of B]; A has full column rank.
Eigen::MatrixXd least_norm_columns(const MatrixIn& a, const MatrixIn& b);
/// argmin |A x - b| of least |x|, for A of any rank.
Eigen::VectorXd least_squares_of_least_norm(const MatrixIn& a, const VectorIn& b);
/// Subtracts from columns what columns B explain, by least squares; for many A beside one B.
class Projection {
 public:
  explicit Projection(const MatrixIn& b);
  /// See without_projection.
  Eigen::MatrixXd without(const MatrixIn& a, Eigen::MatrixXd* coefficients = nullptr) const;

 private:
  Eigen::MatrixXd b_, q_, u_;  // b_ where q_ is not accurate; B diag(scale_) = q_ u_
  Eigen::VectorXd scale_;
};
/// Columns of A - B X with X their least-squares coefficients on B; `coefficients` takes X where it is not null.
Eigen::MatrixXd without_projection(const MatrixIn& a, const MatrixIn& b,
                                   Eigen::MatrixXd* coefficients = nullptr);

/// Orthonormal columns that span A's columns (scaled to one first) to within rounding.
Eigen::MatrixXd span_of(const MatrixIn& a);
/// Orthonormal columns normal to all columns of A [n x (n - rank)]; pivots below `threshold` times the
/// largest count as rounding.
Eigen::MatrixXd complement_of(const MatrixIn& a, double threshold = 1e-12);
/// A = L L^T of a symmetric positive definite A; only its lower triangle is read.
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(const MatrixIn& a) { compute(a); }
  /// @return false where A is not positive definite; the other members must not be called then
  bool compute(const MatrixIn& a);
  double log_det() const;                                  ///< of A
  Eigen::MatrixXd lower() const;                           ///< L
  Eigen::VectorXd solve(const VectorIn& b) const;          ///< A^-1 b
  Eigen::MatrixXd solve_columns(const MatrixIn& b) const;  ///< A^-1 B
  void solve_lower(Eigen::Ref<Eigen::MatrixXd> b) const;   ///< B becomes L^-1 B
  void solve_upper(Eigen::Ref<Eigen::MatrixXd> b) const;   ///< B becomes L^-T B

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

/// Number of columns of a square A independent to within `threshold` (relative to the largest pivot).
Eigen::Index rank(const MatrixIn& a, double threshold);

}  // namespace sparflow
