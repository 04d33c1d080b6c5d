#pragma once
/// Where references and suspect logs can be compared. Used by evidence_collector.cpp only.
#include <Eigen/QR>

namespace sparflow {

/// The region in which the references determine a channel's law: within the ranges of its regressors and the largest leverage of
/// their rows, which both contain the rows' convex hull. Beyond, the law is extrapolated (D. C. Montgomery, E. A. Peck, G. G.
/// Vining 2012, Introduction to Linear Regression Analysis, section 3.8, hidden extrapolation).
class CommonSupport {
 public:
  /// @param rows of the references' baseline [rows x columns]; none: everywhere
  explicit CommonSupport(const Eigen::MatrixXd& rows);
  /// Makes a suspect log's values missing outside. @param base its baseline [samples x columns]
  void limit(const Eigen::MatrixXd& base, Eigen::VectorXd& values) const;

 private:
  double leverage(const Eigen::RowVectorXd& row) const;
  bool contains(const Eigen::RowVectorXd& row) const;

  Eigen::RowVectorXd least_, largest_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition_;
  double largest_leverage_ = 0.0;
};

}  // namespace sparflow
