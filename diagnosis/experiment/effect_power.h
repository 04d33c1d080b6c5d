#pragma once
/// What evidence would say about an effect that were there, without simulating a search: likelihood gains of
/// signatures under a channel's noise, the chance that a gain passes a threshold, and what of an effect another could
/// not take over. All noise parameters count as unknown: a signature that looks like noise gains little.
#include <random>
#include <vector>

#include "diagnosis/selection/search_candidates.h"

namespace sparflow {

/// Chance that chi-square with `freedom` degrees and noncentrality `lambda` exceeds x.
/// Source: Johnson, Kotz, Balakrishnan (1995), Continuous Univariate Distributions 2, ch. 29 (Poisson mixture).
double chance_above(double x, int freedom, double lambda);
/// The noncentrality at which half a chi-square exceeds `nats` with probability `power`.
double noncentrality_for(double nats, double power, int freedom);

/// Noise as a model says it: an autoregression with random offsets of the blocks. [rows]
Eigen::VectorXd draw_noise(const NoiseModel& noise, const std::vector<NoiseBlock>& blocks,
                           Eigen::Index rows, std::mt19937_64& random);

/// Columns of a design as a regression sees them. By channel; no columns where it does not act.
struct ProjectedDesign {
  const EffectDesign* design = nullptr;
  std::vector<Eigen::MatrixXd> white;  ///< baseline taken out, independent rows of unit variance
  std::vector<Eigen::MatrixXd> plain;  ///< baseline taken out [unit of the channel / SI]
  Eigen::MatrixXd gram;                ///< of the white columns, all channels together
};

/// What an effect adds to the evidence, by channel; no rows where it does not act.
struct Signature {
  std::vector<Eigen::VectorXd> white, plain;
  double squares() const;  ///< of the white rows: twice the gain [nats] when the noise is known
};
Signature signature(const ProjectedDesign& design, const Eigen::VectorXd& theta);
/// What of `effect` the columns of `rival` leave, refitted inside their bounds on all channels they show in; counted,
/// as the search counts rivals, where the effect itself shows.
Signature left_by(const Signature& effect, const ProjectedDesign& rival);

/// Gains on evidence with known noise.
class PowerStudy {
 public:
  /// @param evidence must outlive this  @param fit gives the channels' noise
  PowerStudy(const Evidence& evidence, const EffectFit& fit, unsigned seed);

  ProjectedDesign project(const EffectDesign& design) const;
  /// Mean gain [nats] of adding `times` the signature to a model without it, the noise estimated anew both times.
  double gain(const Signature& s, double times = 1.0) const;

 private:
  double log_likelihood(std::size_t channel, const Eigen::VectorXd& residual) const;

  const Evidence& evidence_;
  std::vector<NoiseModel> noise_;
  std::vector<std::vector<Eigen::VectorXd>> drawn_;  // [draws][channels]
  std::vector<std::vector<double>> drawn_likelihood_;
};

}  // namespace sparflow
