#include "identification/learning/gaussian_process/gp_likelihood.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "models/hydraulics/gp_kernel.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Matrices of the exact process at one set of hyperparameters.
struct ExactSystem {
  MatrixXd kernel;         ///< [n x n] without noise
  MatrixXd projection;     ///< P = Ky^-1 - Ky^-1 H A^-1 H^T Ky^-1
  MatrixXd inverse;        ///< Ky^-1
  MatrixXd inverse_basis;  ///< Ky^-1 H
  MatrixXd basis_inverse;  ///< A^-1 = (H^T Ky^-1 H)^-1
  double log_det_kernel = 0.0, log_det_basis = 0.0;
  bool ok = false;
};

ExactSystem exact_system(const GpPoints& p, const GpHyper& hyper) {
  ExactSystem s;
  const Index n = p.size();
  s.kernel = kernel_matrix(p.x1, p.x2, p.x1, p.x2, hyper);
  MatrixXd noisy = s.kernel;
  noisy.diagonal().array() += std::exp(hyper[3]);
  Cholesky factor;
  if (!factor.compute(noisy)) return s;
  s.log_det_kernel = factor.log_det();
  s.inverse = factor.solve_columns(MatrixXd::Identity(n, n));
  s.inverse_basis = product(s.inverse, p.basis);
  MatrixXd a = transposed_product(p.basis, s.inverse_basis);
  a.diagonal() += p.basis_precision;
  Cholesky basis_factor;
  if (!basis_factor.compute(a)) return s;
  s.log_det_basis = basis_factor.log_det();
  s.basis_inverse = basis_factor.solve_columns(MatrixXd::Identity(a.rows(), a.rows()));
  s.projection =
      s.inverse - product(product(s.inverse_basis, s.basis_inverse), s.inverse_basis.transpose());
  s.ok = s.projection.allFinite();
  return s;
}

}  // namespace

GpPoints GpPoints::select(const std::vector<Index>& rows) const {
  return {x1(rows), x2(rows), y(rows), basis(rows, Eigen::all), basis_precision};
}

double GpPoints::log_constant() const {
  double sum = -static_cast<double>(size()) * std::log(2.0 * std::numbers::pi);
  for (const double precision : basis_precision) {
    sum += precision > 0.0 ? std::log(precision) : std::log(2.0 * std::numbers::pi);
  }
  return 0.5 * sum;
}

MatrixXd kernel_matrix(const ArrayXd& a1, const ArrayXd& a2, const ArrayXd& b1, const ArrayXd& b2,
                       const GpHyper& hyper) {
  const double scale1 = std::exp(-hyper[0]), scale2 = std::exp(-hyper[1]);
  const Index n = a1.size();
  const Index rows = static_cast<Index>(kernel_padded(static_cast<std::size_t>(n)));
  ArrayXd x = ArrayXd::Zero(rows), y = ArrayXd::Zero(rows), column(rows);
  x.head(n) = a1 * scale1;
  y.head(n) = a2 * scale2;
  const KernelCentres centres{x.data(), y.data(), nullptr, static_cast<std::size_t>(rows)};
  const double signal = std::exp(hyper[2]);
  MatrixXd k(n, b1.size());
  for (Index j = 0; j < b1.size(); ++j) {
    kernel_vector(centres, b1[j] * scale1, b2[j] * scale2, column.data());
    k.col(j).array() = signal * column.head(n);
  }
  return k;
}

double exact_log_likelihood(const GpPoints& p, const GpHyper& hyper, GpHyper* gradient) {
  const ExactSystem s = exact_system(p, hyper);
  if (!s.ok) return -std::numeric_limits<double>::infinity();
  const Index n = p.size();
  const VectorXd py = s.projection * p.y;
  if (gradient != nullptr) {
    // d log p = 1/2 y^T P dK P y - 1/2 tr(P dK) = sum_ij G_ij dK_ij with G = 1/2 (Py (Py)^T - P).
    gradient->setZero();
    const double scale1 = std::exp(-2.0 * hyper[0]), scale2 = std::exp(-2.0 * hyper[1]);
    for (Index j = 0; j < n; ++j) {
      const ArrayXd g_k =
          0.5 * (py.array() * py[j] - s.projection.col(j).array()) * s.kernel.col(j).array();
      (*gradient)[0] += scale1 * (g_k * (p.x1 - p.x1[j]).square()).sum();
      (*gradient)[1] += scale2 * (g_k * (p.x2 - p.x2[j]).square()).sum();
      (*gradient)[2] += g_k.sum();
    }
    (*gradient)[3] = 0.5 * std::exp(hyper[3]) * (py.squaredNorm() - s.projection.trace());
  }
  return -0.5 * (p.y.dot(py) + s.log_det_kernel + s.log_det_basis) + p.log_constant();
}

GpPosterior exact_posterior(const GpPoints& p, const GpHyper& hyper) {
  const ExactSystem s = exact_system(p, hyper);
  SPARFLOW_CHECK(s.ok, "posterior requested at hyperparameters without a likelihood");
  const Index n = p.size(), b = p.basis.cols();
  GpPosterior out;
  out.x1 = p.x1;
  out.x2 = p.x2;
  out.beta = s.basis_inverse * (s.inverse_basis.transpose() * p.y);
  out.weight = s.projection * p.y;
  out.core = MatrixXd(n + b, n + b);
  out.core.topLeftCorner(n, n) = s.projection;
  out.core.topRightCorner(n, b) = product(s.inverse_basis, s.basis_inverse);
  out.core.bottomLeftCorner(b, n) = out.core.topRightCorner(n, b).transpose();
  out.core.bottomRightCorner(b, b) = -s.basis_inverse;
  return out;
}

VectorXd leave_one_out_residuals(const GpPoints& p, const GpHyper& hyper) {
  const ExactSystem s = exact_system(p, hyper);
  SPARFLOW_CHECK(s.ok, "residuals requested at hyperparameters without a likelihood");
  return -(s.projection * p.y).cwiseQuotient(s.projection.diagonal());
}

}  // namespace sparflow
