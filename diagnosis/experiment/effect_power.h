#pragma once
/// Statistical power for an effect on given evidence, without simulating a search: the gain of its signature under a
/// channel's noise, the probability that a gain passes a threshold, and the part of an effect that another cannot
/// explain. Noise parameters are estimated with every gain, so a signature that resembles noise gains little.
#include <random>
#include <vector>

#include "diagnosis/experiment/experiment_options.h"
#include "diagnosis/selection/search_candidates.h"

namespace sparflow {

/// Probability that chi-square with `freedom` degrees of freedom and noncentrality `lambda` exceeds x.
/// Source: Johnson, Kotz, Balakrishnan (1995), Continuous Univariate Distributions 2, ch. 29 (Poisson mixture).
double chance_above(double x, int freedom, double lambda);
/// The noncentrality at which half a chi-square exceeds `nats` with probability `power`.
double noncentrality_for(double nats, double power, int freedom);

/// Random draw from a noise model: an autoregression with random offsets of the blocks. [rows]
Eigen::VectorXd draw_noise(const NoiseModel& noise, const NoiseRows& of, Eigen::Index rows,
                           std::mt19937_64& random);

/// Columns of a design orthogonal to the baseline, by channel; no columns where the effect does not act.
struct ProjectedDesign {
  const EffectDesign* design = nullptr;
  std::vector<Eigen::MatrixXd> white;  ///< whitened: independent rows of unit variance
  std::vector<Eigen::MatrixXd> plain;  ///< [SI of the channel / SI of the parameter]
  Eigen::MatrixXd gram;                ///< Gram matrix of the white columns of all channels
};

/// What an effect adds to the evidence, orthogonal to the baseline, by channel; no rows where it does not act.
struct Signature {
  std::vector<Eigen::VectorXd> white, plain;  ///< as in ProjectedDesign
  double squares() const;  ///< sum of squares of `white`: twice the gain [nats] for known noise
};
/// @param theta linear parameters [SI]
Signature signature(const ProjectedDesign& design, const Eigen::VectorXd& theta);
/// The part of `effect` that `rival` cannot explain after its linear parameters are fitted inside their bounds. As in
/// the search, it is taken over the channels in which the effect acts.
Signature left_by(const Signature& effect, const ProjectedDesign& rival);

/// Expected gains of signatures on given evidence, by Monte Carlo over its noise models.
class PowerStudy {
 public:
  /// @param evidence must outlive this  @param fit with the noise models of the channels
  PowerStudy(const Evidence& evidence, const EffectFit& fit, unsigned seed,
             const PowerOptions& options = {});

  ProjectedDesign project(const EffectDesign& design) const;
  /// Mean gain [nats] of `times` the signature; the noise model is estimated without and with it.
  double gain(const Signature& s, double times = 1.0) const;

 private:
  double log_likelihood(std::size_t channel, const Eigen::VectorXd& residual) const;

  const Evidence& evidence_;
  std::vector<NoiseModel> noise_;
  std::vector<std::vector<Eigen::VectorXd>> drawn_;  // [draws][channels]
  std::vector<std::vector<double>> drawn_likelihood_;
};

}  // namespace sparflow
