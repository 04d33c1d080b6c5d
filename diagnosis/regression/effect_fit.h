#pragma once
/// Generalised least squares of effects on evidence: effects' linear parameters, learned baselines and each
/// channel's noise together, by profile likelihood. The one regression behind gate, ranking, intervals, power.
#include <string>
#include <vector>

#include "diagnosis/evidence/evidence.h"

namespace sparflow {

/// An effect at a place with its nonlinear parameters, and what it adds to each channel.
struct EffectDesign {
  EffectAt effect;
  std::vector<double> shape;             ///< [SI]
  std::vector<Eigen::MatrixXd> columns;  ///< [channels]: [rows x linear], or no columns
  std::vector<double> lower, upper;      ///< [SI] bounds of the linear parameters
  int linear = 0;
  bool optional = false;  ///< an optional parameter acts too

  bool acts() const;
  bool touches(std::size_t channel) const { return columns[channel].cols() > 0; }
};

/// @param about as Evidence::columns has it  @param optional whether its optional parameters are to act
EffectDesign make_design(const Evidence& evidence, const EffectAt& effect,
                         std::vector<double> shape, std::span<const double> about = {},
                         bool optional = true);

/// The same without its optional parameters.
EffectDesign without_optional(EffectDesign design);

struct EffectFit {
  Eigen::VectorXd theta;               ///< [SI] linear parameters of all designs in turn
  Eigen::MatrixXd covariance;          ///< of theta, robust against dependence inside blocks
  std::vector<NoiseModel> noise;       ///< by channel
  std::vector<double> log_likelihood;  ///< by channel
  std::vector<Eigen::VectorXd>
      residual;           ///< by channel [rows]; empty where the fit was not asked for it
  bool at_bound = false;  ///< a parameter rests on its bound

  double total() const;
};

struct FitControl {
  int noise_passes = 3;
  bool keep_residuals = false;
  bool covariance = false;
  /// Ordinary least squares: every row counts the same. Where the model itself is wrong by more than noise, a fit that
  /// trusts differences between neighbouring rows (as autoregressive noise does) follows the error's shape.
  bool ordinary = false;
  /// By channel; a channel that is not active keeps likelihood and noise of `start`. Empty = all.
  std::vector<bool> active;
};

/// @param start noise to start from; may be null
EffectFit fit_effects(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                      const EffectFit* start = nullptr, const FitControl& control = {});

/// Rows whitened by a noise model with unit variance, baseline projected out: [designs' columns, y].
Eigen::MatrixXd whitened_rows(const EvidenceChannel& channel, const NoiseModel& noise,
                              const Eigen::MatrixXd& columns, double* log_determinant = nullptr,
                              Eigen::MatrixXd* baseline_coefficients = nullptr);

}  // namespace sparflow
