#pragma once
/// Noise model of a residual in blocks (stretches of motion): an autoregression of order two inside each block plus a
/// random offset of each block. Residuals of machines are never independent; tests that assume independence report
/// effects where none are missing (98 % false alarms with such a criterion on logs with nothing missing).
/// Source: Box, Jenkins, Reinsel (2008), ch. 3 (Levinson recursion); Laird & Ware (1982), random intercepts.
#include <Eigen/Dense>
#include <array>
#include <vector>

#include "diagnosis/evidence/evidence_options.h"

namespace sparflow {

/// Rows [first, last) of a series, evenly spaced in time.
struct NoiseBlock {
  Eigen::Index first = 0, last = 0;
};

/// The time since a command of the machine changed, by row, and what every fit needs of it.
class SettlingTimes {
 public:
  /// Times in one class: each is half as wide again as the one before, and the last one has no end.
  static constexpr int kClasses = 14;

  SettlingTimes() = default;
  /// @param since [rows, s] infinite where no command changed before; no rows: not known
  explicit SettlingTimes(const Eigen::VectorXd& since, const NoiseOptions& options = {});

  /// Of these rows, in this order.
  SettlingTimes of_rows(const std::vector<Eigen::Index>& rows) const;
  bool known() const { return !class_of_.empty(); }
  /// Class of a row's time, from 0 to kClasses - 1.
  std::size_t class_of(Eigen::Index row) const { return class_of_[static_cast<std::size_t>(row)]; }
  /// [s] middle of a class; infinite for the last one
  static double time(int k);
  /// A law s(t) that is tried, at the middle of every class.
  struct Law {
    double ratio = 1.0, settling = 1.0;  ///< NoiseModel::transient, NoiseModel::settling
    std::array<double, kClasses> inverse_squares{}, logs{};
  };
  const std::vector<Law>& laws() const { return laws_; }
  /// exp(-t / settling) of every row. @param settling one of NoiseOptions::settling [s]
  const Eigen::VectorXd& decay(double settling) const;

 private:
  std::vector<unsigned char> class_of_;  // [rows]
  std::vector<double> settling_;         // [s]
  std::vector<Eigen::VectorXd> decay_;   // [settling][rows]
  std::vector<Law> laws_;
};

/// The rows of a channel: its blocks, and the time since a command of the machine changed.
struct NoiseRows {
  const std::vector<NoiseBlock>& blocks;
  const SettlingTimes* since_change = nullptr;  ///< null: not known

  NoiseRows(const std::vector<NoiseBlock>& all) : blocks(all) {}
  NoiseRows(const std::vector<NoiseBlock>& all, const SettlingTimes& since)
      : blocks(all), since_change(since.known() ? &since : nullptr) {}
};

/// The autoregression and the offsets are those of y / s(t), s(t) = 1 + (transient - 1) exp(-t / settling), with t the time since the
/// machine began to settle: pumps, spools, columns of oil and a bouncing boom settle, and what a model lacks of that must not count as
/// noise of steady motion. They are also relative to the blocks' deviations, where these differ (NoiseOptions::block_freedom): a law
/// that is not exact leaves more in some motions than in others.
struct NoiseModel {
  double phi1 = 0.0, phi2 = 0.0;  ///< y_t = phi1 y_{t-1} + phi2 y_{t-2} + e_t; stationary
  double variance = 1.0;          ///< [unit^2 of the series] variance of e_t
  double offset_variance = 0.0;   ///< [unit^2 of the series] variance of the block offsets
  double transient =
      1.0;  ///< [-] deviation right after a change of a command over that in steady motion, >= 1
  double settling = 1.0;  ///< [s] time constant with which it settles
  /// [blocks] deviation of each block over that of the model; empty: one in all of them
  std::vector<double> block_scale;
  double block_freedom = 0.0;  ///< [rows] that the prior of a block's variance is worth

  /// Moment estimates from residuals: autocovariances are pooled over blocks about the blocks' shrunken means; the
  /// offset variance is the variance of block means beyond what the autoregression explains.
  /// @param offsets whether blocks may have offsets
  static NoiseModel estimate(const Eigen::Ref<const Eigen::VectorXd>& residual,
                             const NoiseRows& rows, bool offsets = true,
                             const NoiseOptions& options = {});

  /// White noise of unit variance whose deviation settles after commands as that of the values does.
  static NoiseModel settling_of(const Eigen::Ref<const Eigen::VectorXd>& values,
                                const NoiseRows& rows, const NoiseOptions& options);

  /// Log-likelihood up to a constant, with both variances scaled by their most likely common factor. [nats]
  double log_likelihood(const Eigen::Ref<const Eigen::VectorXd>& residual,
                        const NoiseRows& rows) const;

  /// This model with both variances scaled by their most likely common factor.
  NoiseModel scaled_to(const Eigen::Ref<const Eigen::VectorXd>& residual,
                       const NoiseRows& rows) const;

  /// Makes rows independent with variance `variance`, by the exact inverse square root of the covariance of each block.
  /// @param columns [rows x any], in place
  /// @return log-determinant of the transformation and log_prior(), to be added to a log-likelihood
  double whiten(const NoiseRows& rows, Eigen::Ref<Eigen::MatrixXd> columns) const;

  /// Logarithm of the prior density of the blocks' deviations over that of equal ones. [nats]
  double log_prior() const;

  /// White noise of the variance of `values`, beside the blocks' own deviations.
  static NoiseModel white_of(const Eigen::Ref<const Eigen::VectorXd>& values, const NoiseRows& rows,
                             const NoiseOptions& options);

  /// s(t) of every row; empty where it is one. [rows]
  Eigen::VectorXd scale_of(const NoiseRows& rows) const;

  /// Standard deviation of one steady value, of autoregression and offset together. [unit of the series]
  double deviation() const;
};

}  // namespace sparflow
