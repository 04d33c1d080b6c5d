#include "identification/learning/gaussian_process/sparse_gp.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Added to the diagonal of Kuu, relative to the signal variance. It only covers rounding, since the choice by conditional
/// variance keeps inducing points apart.
constexpr double kJitter = 1e-9;

}  // namespace

InducingChoice choose_inducing(const ArrayXd& x1, const ArrayXd& x2, const GpHyper& hyper,
                               Index count, double tolerance) {
  const Index n = x1.size();
  const GpHyper unit(hyper[0], hyper[1], 0.0, 0.0);
  InducingChoice choice;
  ArrayXd left = ArrayXd::Ones(n);  // conditional variance
  count = std::min(count, n);
  MatrixXd rows(n, count);  // columns of the Cholesky factor
  for (Index m = 0; m < count; ++m) {
    Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    // Below a thousand times the jitter a further point adds rounding errors only.
    if (largest < 1e3 * kJitter || (m > 2 && left.mean() < tolerance)) break;
    const ArrayXd p1 = ArrayXd::Constant(1, x1[pivot]), p2 = ArrayXd::Constant(1, x2[pivot]);
    VectorXd column = kernel_matrix(x1, x2, p1, p2, unit);
    column.noalias() -= rows.leftCols(m) * rows.row(pivot).head(m).transpose();
    column /= std::sqrt(largest);
    rows.col(m) = column;
    left = (left - column.array().square()).max(0.0);
    left[pivot] = 0.0;
    choice.rows.push_back(pivot);
  }
  choice.mean_variance = left.mean();
  choice.max_variance = left.maxCoeff();
  return choice;
}

SparseGp::SparseGp(const GpPoints& points, const std::vector<Index>& inducing)
    : points_(points), z1_(points.x1(inducing)), z2_(points.x2(inducing)) {}

bool SparseGp::factorise(const GpHyper& hyper) {
  const double signal = std::exp(hyper[2]), noise = std::exp(hyper[3]);
  kuu_ = kernel_matrix(z1_, z2_, z1_, z2_, hyper);
  kuu_.diagonal().array() += kJitter * signal;
  if (!chol_uu_.compute(kuu_)) return false;
  kuf_ = kernel_matrix(z1_, z2_, points_.x1, points_.x2, hyper);
  v_ = kuf_;
  chol_uu_.solve_lower(v_);
  const Index m = z1_.size();
  MatrixXd b = gram_of_rows(v_) / noise;
  trace_v_ = noise * b.trace();
  b.diagonal().array() += 1.0;
  if (!chol_b_.compute(b)) return false;
  b_inverse_ = chol_b_.solve_columns(MatrixXd::Identity(m, m));
  vh_ = product(v_, points_.basis);
  vy_.noalias() = v_ * points_.y;
  const MatrixXd bh = chol_b_.solve_columns(vh_);
  MatrixXd a =
      (transposed_product(points_.basis, points_.basis) - transposed_product(vh_, bh) / noise) /
      noise;
  a.diagonal() += points_.basis_precision;
  if (!chol_a_.compute(a)) return false;
  beta_ =
      chol_a_.solve((points_.basis.transpose() * points_.y - bh.transpose() * vy_ / noise) / noise);
  return beta_.allFinite();
}

double SparseGp::bound(const GpHyper& hyper, GpHyper* gradient) {
  constexpr double kMinusInfinity = -std::numeric_limits<double>::infinity();
  if (!factorise(hyper)) return kMinusInfinity;
  const double signal = std::exp(hyper[2]), noise = std::exp(hyper[3]);
  const Index count = points_.size(), m = z1_.size();
  const double n = static_cast<double>(count);
  const VectorXd residual = points_.y - points_.basis * beta_;
  const VectorXd v_residual = vy_ - vh_ * beta_;
  // gamma = Sigma^-1 (y - H beta), Sigma = V^T V + noise I, by the inversion lemma.
  const VectorXd b_v_residual = chol_b_.solve(v_residual);
  VectorXd gamma = residual;
  gamma.noalias() -= v_.transpose() * b_v_residual / noise;
  gamma /= noise;
  const double lost_trace = n * signal - trace_v_;  // tr(Kff - Qff)
  // With a prior on beta, y^T P y is residual^T gamma plus the prior's quadratic form of beta.
  const double quadratic = residual.dot(gamma) + beta_.cwiseAbs2().dot(points_.basis_precision);
  const double value =
      points_.log_constant() -
      0.5 * (quadratic + n * hyper[3] + chol_b_.log_det() + chol_a_.log_det() + lost_trace / noise);
  if (!std::isfinite(value)) return kMinusInfinity;
  if (gradient == nullptr) return value;

  // E = Sigma^-1 H A^(-T/2), so that P = Sigma^-1 - E E^T. With respect to Qff the bound has the gradient
  // 1/2 [gamma gamma^T + V^T B^-1 V / noise^2 + E E^T] (the identities cancel against the trace term),
  // which W = Kuu^-1 Kuf turns into gradients with respect to Kuf (2 T) and Kuu (-S).
  MatrixXd et =
      (points_.basis - transposed_product(v_, chol_b_.solve_columns(vh_)) / noise).transpose();
  et /= noise;
  chol_a_.solve_lower(et);
  const MatrixXd e = et.transpose();
  const MatrixXd shrink = (MatrixXd::Identity(m, m) - b_inverse_) / noise;
  MatrixXd t = product(shrink, v_);
  const VectorXd v_gamma = v_ * gamma;
  t.noalias() += v_gamma * gamma.transpose();
  t += product(product(v_, e), e.transpose());
  t *= 0.5;
  MatrixXd s = product(t, v_.transpose());  // L^T S L
  chol_uu_.solve_upper(t);
  chol_uu_.solve_upper(s);
  s.transposeInPlace();
  chol_uu_.solve_upper(s);  // symmetric again: X L^-1 = (L^-T X^T)^T

  gradient->setZero();
  for (Index j = 0; j < count; ++j) {
    const ArrayXd tk = 2.0 * t.col(j).array() * kuf_.col(j).array();
    (*gradient)[0] += (tk * (z1_ - points_.x1[j]).square()).sum();
    (*gradient)[1] += (tk * (z2_ - points_.x2[j]).square()).sum();
    (*gradient)[2] += tk.sum();
  }
  for (Index j = 0; j < m; ++j) {
    const ArrayXd sk = s.col(j).array() * kuu_.col(j).array();
    (*gradient)[0] -= (sk * (z1_ - z1_[j]).square()).sum();
    (*gradient)[1] -= (sk * (z2_ - z2_[j]).square()).sum();
    (*gradient)[2] -= sk.sum();
  }
  (*gradient)[0] *= std::exp(-2.0 * hyper[0]);
  (*gradient)[1] *= std::exp(-2.0 * hyper[1]);
  (*gradient)[2] -= 0.5 * n * signal / noise;
  const double trace_p =
      (n - static_cast<double>(m) + b_inverse_.trace()) / noise - e.squaredNorm();
  (*gradient)[3] = 0.5 * noise * (gamma.squaredNorm() - trace_p) + 0.5 * lost_trace / noise;
  return value;
}

GpPosterior SparseGp::posterior(const GpHyper& hyper) {
  SPARFLOW_CHECK(factorise(hyper), "posterior requested at hyperparameters without a bound");
  const double noise = std::exp(hyper[3]);
  const Index m = z1_.size(), b = points_.basis.cols();
  GpPosterior out;
  out.x1 = z1_;
  out.x2 = z2_;
  out.beta = beta_;
  out.weight = chol_b_.solve(vy_ - vh_ * beta_) / noise;
  chol_uu_.solve_upper(out.weight);
  // With a = L^-1 k: variance = s^2 - a^T (I - B^-1) a + r^T A^-1 r, r = h - G a, G = (V H)^T B^-1 / noise.
  const MatrixXd g = (chol_b_.solve_columns(vh_) / noise).transpose();
  const MatrixXd a_inverse = chol_a_.solve_columns(MatrixXd::Identity(b, b));
  MatrixXd kh = transposed_product(g, a_inverse);
  MatrixXd kk = MatrixXd::Identity(m, m) - b_inverse_ - product(kh, g);
  chol_uu_.solve_upper(kk);
  kk.transposeInPlace();
  chol_uu_.solve_upper(kk);
  chol_uu_.solve_upper(kh);
  out.core = MatrixXd(m + b, m + b);
  out.core.topLeftCorner(m, m) = 0.5 * (kk + kk.transpose());
  out.core.topRightCorner(m, b) = kh;
  out.core.bottomLeftCorner(b, m) = kh.transpose();
  out.core.bottomRightCorner(b, b) = -a_inverse;
  return out;
}

}  // namespace sparflow
