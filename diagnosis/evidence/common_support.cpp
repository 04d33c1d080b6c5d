#include "diagnosis/evidence/common_support.h"

#include <algorithm>
#include <cmath>

#include "models/math/nan.h"

namespace sparflow {

using Eigen::Index;

CommonSupport::CommonSupport(const Eigen::MatrixXd& rows) {
  if (rows.rows() == 0) return;
  least_ = rows.colwise().minCoeff();
  largest_ = rows.colwise().maxCoeff();
  decomposition_.compute(rows.transpose() * rows);
  for (Index k = 0; k < rows.rows(); ++k)
    largest_leverage_ = std::max(largest_leverage_, leverage(rows.row(k)));
}

void CommonSupport::limit(const Eigen::MatrixXd& base, Eigen::VectorXd& values) const {
  if (least_.size() == 0) return;
  for (Index k = 0; k < values.size(); ++k) {
    if (std::isfinite(values[k]) && !contains(base.row(k))) values[k] = kNaN;
  }
}

double CommonSupport::leverage(const Eigen::RowVectorXd& row) const {
  return row.dot(decomposition_.solve(row.transpose()));
}

bool CommonSupport::contains(const Eigen::RowVectorXd& row) const {
  return (row.array() >= least_.array()).all() && (row.array() <= largest_.array()).all() &&
         leverage(row) <= largest_leverage_;
}

}  // namespace sparflow
