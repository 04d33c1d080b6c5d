#pragma once
/// Generalised least squares of effects on evidence: linear parameters of the effects, baselines and noise models of
/// all channels are estimated together by profile likelihood. Null distribution, ranking, intervals and power use it.
#include <cstdint>
#include <string>
#include <vector>

#include "diagnosis/evidence/evidence.h"
#include "models/math/linear_algebra.h"

namespace sparflow {

/// An effect at a place with given nonlinear parameters, and its signature in each channel.
struct EffectDesign {
  EffectAt effect;
  std::vector<double> shape;             ///< [SI] nonlinear parameters
  std::vector<double> about;             ///< [SI] see Evidence::columns
  std::vector<Eigen::MatrixXd> columns;  ///< [channels]: [rows x linear], or no columns
  std::vector<double> lower, upper;      ///< [SI] bounds of the linear parameters
  int linear = 0;                        ///< number of linear parameters
  bool optional = false;                 ///< whether an optional parameter has a column
  /// Number of the columns: designs of one number have the same columns; 0: not known.
  std::uint64_t number = 0;

  bool acts() const;
  /// Whether linear parameter k acts in any channel; what does not act is not determined by the data.
  bool parameter_acts(Eigen::Index k) const;
  bool touches(std::size_t channel) const { return columns[channel].cols() > 0; }
};

/// A linear parameter whose action is negligible (EvidenceOptions::negligible_action) gets columns of zeros.
/// @param shape nonlinear parameters [SI], each of them; std::invalid_argument otherwise  @param about see Evidence::columns
/// @param optional whether the optional parameters get columns
EffectDesign make_design(const Evidence& evidence, const EffectAt& effect,
                         std::vector<double> shape, std::span<const double> about = {},
                         bool optional = true);

/// Number of the optional nonlinear parameters that a design has.
int optional_shapes(const EffectDesign& design);

/// The same design with the columns of its optional parameters set to zero.
EffectDesign without_optional(EffectDesign design);

/// The columns of all designs in a channel side by side. [rows x columns]
Eigen::MatrixXd columns_of(const std::vector<const EffectDesign*>& designs, std::size_t channel,
                           Eigen::Index rows);

struct EffectFit {
  Eigen::VectorXd theta;          ///< [SI] linear parameters of all designs, in their order
  Eigen::MatrixXd covariance;     ///< covariance of theta, robust against dependence inside blocks
  std::vector<NoiseModel> noise;  ///< by channel
  std::vector<double> log_likelihood;  ///< [nats] by channel
  std::vector<Eigen::VectorXd>
      residual;           ///< by channel [rows, SI]; empty unless FitControl::keep_residuals
  bool at_bound = false;  ///< a parameter lies on its bound

  double total() const;  ///< [nats] log-likelihood of all channels
};

/// A channel's baseline and y, whitened by a noise model: what fits of many designs with that noise model have in common.
class WhitenedBaseline {
 public:
  /// @param channel must outlive this
  WhitenedBaseline(const EvidenceChannel& channel, const NoiseModel& noise);
  /// See whitened_rows.
  Eigen::MatrixXd rows(const Eigen::MatrixXd& columns,
                       Eigen::MatrixXd* baseline_coefficients = nullptr) const;
  double log_determinant() const { return log_determinant_; }

 private:
  const EvidenceChannel& channel_;
  NoiseModel noise_;
  Eigen::VectorXd y_;
  double log_determinant_ = 0.0;
  Projection baseline_;
};

/// Noise models of all channels with the baselines whitened by them.
struct WhitenedChannels {
  std::vector<NoiseModel> noise;
  std::vector<WhitenedBaseline> baseline;

  /// By the noise models with which a fit without a start begins, that is white noise.
  static WhitenedChannels cold(const Evidence& evidence);
  static WhitenedChannels by(const Evidence& evidence, std::vector<NoiseModel> noise);
};

struct FitControl {
  int noise_passes = 3;  ///< estimates of the noise models, each from the residuals of the last fit
  bool keep_residuals = false;
  bool covariance = false;
  /// Ordinary least squares, in which every row of steady motion has the same weight. Where model errors exceed the noise, a fit with
  /// autoregressive noise follows differences of neighbouring rows, that is the shape of the model error.
  bool ordinary = false;
  /// By channel; a channel that is not active keeps log-likelihood and noise of `start`. Empty = all are active.
  std::vector<bool> active;
  /// The noise models with which the fit begins, those of `start` if there is one, with whitened baselines; null: they are
  /// computed.
  const WhitenedChannels* first = nullptr;
};

/// @param start fit whose noise models are the initial guess; may be null
EffectFit fit_effects(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                      const EffectFit* start = nullptr, const FitControl& control = {});

/// [columns, y] whitened by a noise model and orthogonal to the whitened baseline. [rows x (columns + 1)]
Eigen::MatrixXd whitened_rows(const EvidenceChannel& channel, const NoiseModel& noise,
                              const Eigen::MatrixXd& columns, double* log_determinant = nullptr,
                              Eigen::MatrixXd* baseline_coefficients = nullptr);

}  // namespace sparflow
