#pragma once
/// Noise model of a residual in blocks (stretches of motion): an autoregression of order two inside each block plus a
/// random offset of each block. Residuals of machines are never independent; tests that assume independence report
/// effects where none are missing (98 % false alarms with such a criterion on logs with nothing missing).
/// Source: Box, Jenkins, Reinsel (2008), ch. 3 (Levinson recursion); Laird & Ware (1982), random intercepts.
#include <Eigen/Dense>
#include <vector>

#include "diagnosis/evidence/evidence_options.h"

namespace sparflow {

/// Rows [first, last) of a series, evenly spaced in time.
struct NoiseBlock {
  Eigen::Index first = 0, last = 0;
};

struct NoiseModel {
  double phi1 = 0.0, phi2 = 0.0;  ///< y_t = phi1 y_{t-1} + phi2 y_{t-2} + e_t; stationary
  double variance = 1.0;          ///< [unit^2 of the series] variance of e_t
  double offset_variance = 0.0;   ///< [unit^2 of the series] variance of the block offsets

  /// Moment estimates from residuals: autocovariances are pooled over blocks about the blocks' shrunken means; the
  /// offset variance is the variance of block means beyond what the autoregression explains.
  /// @param offsets whether blocks may have offsets
  static NoiseModel estimate(const Eigen::Ref<const Eigen::VectorXd>& residual,
                             const std::vector<NoiseBlock>& blocks, bool offsets = true,
                             const NoiseOptions& options = {});

  /// Log-likelihood up to a constant, with both variances scaled by their most likely common factor. [nats]
  double log_likelihood(const Eigen::Ref<const Eigen::VectorXd>& residual,
                        const std::vector<NoiseBlock>& blocks) const;

  /// This model with both variances scaled by their most likely common factor.
  NoiseModel scaled_to(const Eigen::Ref<const Eigen::VectorXd>& residual,
                       const std::vector<NoiseBlock>& blocks) const;

  /// Makes rows independent with variance `variance`, by the exact inverse square root of the covariance of each block.
  /// @param columns [rows x any], in place
  /// @return log-determinant of the transformation, to be added to a log-likelihood
  double whiten(const std::vector<NoiseBlock>& blocks, Eigen::Ref<Eigen::MatrixXd> columns) const;

  /// Standard deviation of one value, of autoregression and offset together. [unit of the series]
  double deviation() const;
};

}  // namespace sparflow
