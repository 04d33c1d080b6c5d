#pragma once
/// Noise of a residual series in blocks (stretches of motion): an autoregression of order two inside a block
/// and a random offset of each block. Residuals of machines are never independent: tests that take them so see
/// effects that are not there (false alarm 98 % with an iid criterion on logs with nothing missing).
/// Source: Box, Jenkins, Reinsel (2008), ch. 3 (Levinson recursion); Laird & Ware (1982), random intercepts.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

/// Rows [first, last) of a series, evenly spaced in time.
struct NoiseBlock {
  Eigen::Index first = 0, last = 0;
};

struct NoiseModel {
  double phi1 = 0.0, phi2 = 0.0;  ///< y_t = phi1 y_{t-1} + phi2 y_{t-2} + e_t; stationary
  double variance = 1.0;          ///< of e_t
  double offset_variance = 0.0;   ///< of a block's offset, same unit

  /// Moment estimates from residuals: autocovariances pooled over blocks (about the blocks' shrunken means), offset
  /// variance from the spread of block means beyond what the autoregression explains.
  /// @param offsets whether blocks may have offsets
  static NoiseModel estimate(const Eigen::Ref<const Eigen::VectorXd>& residual,
                             const std::vector<NoiseBlock>& blocks, bool offsets = true);

  /// Log likelihood of residuals but for a constant, both variances scaled together to their best. [nats]
  double log_likelihood(const Eigen::Ref<const Eigen::VectorXd>& residual,
                        const std::vector<NoiseBlock>& blocks) const;

  /// Both variances times the factor of largest likelihood.
  NoiseModel scaled_to(const Eigen::Ref<const Eigen::VectorXd>& residual,
                       const std::vector<NoiseBlock>& blocks) const;

  /// Makes rows independent with variance `variance`: the exact inverse square root of the covariance, block by block.
  /// @param columns [rows x any], in place
  /// @return log determinant of the transformation, to be added to a log likelihood
  double whiten(const std::vector<NoiseBlock>& blocks, Eigen::Ref<Eigen::MatrixXd> columns) const;

  /// Standard deviation of one value: autoregression and offset. [unit of the series]
  double deviation() const;
};

}  // namespace sparflow
