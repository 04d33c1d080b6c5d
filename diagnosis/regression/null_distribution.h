#pragma once
/// Null distribution of the largest gain: how large the best gain of a whole search gets when nothing is missing. It is
/// simulated on the log's own motions and accounts for the number of candidates, their grids and their correlation.
#include <random>
#include <vector>

#include "diagnosis/regression/effect_fit.h"
#include "diagnosis/regression/regression_options.h"

namespace sparflow {

struct NullDistribution {
  std::vector<double> normal;  ///< [nats] simulated with independent normal innovations, sorted
  std::vector<double>
      flipped;  ///< [nats] from the log's residuals with random signs of whole motions, sorted
  /// By candidate: ratio of its gains on flipped residuals to those on normal innovations, at least one. A residual
  /// that still contains other effects, or whole motions in error, makes large gains in its own channels; division by
  /// this ratio keeps them from raising the threshold of candidates in other channels.
  std::vector<double> scale;
  std::vector<double> penalty;  ///< [nats] by candidate, as given

  /// Threshold of the scaled, penalised gain for a false-alarm rate `level` (0..1). [nats]
  double threshold(double level) const;
  /// p-value of a candidate's penalised gain [nats]: the larger of those by `normal` and by `flipped`.
  double p_value(double gain, std::size_t candidate) const;
};

/// One candidate: its designs over the grid of nonlinear parameters, and its penalty.
struct NullCandidate {
  const std::vector<EffectDesign>* designs = nullptr;
  double penalty = 0.0;  ///< [nats]
  double optional_penalty =
      0.0;  ///< [nats] further penalty of designs with optional linear parameters
  double optional_shape_penalty = 0.0;  ///< [nats] further penalty of each optional nonlinear one
};

/// The log without what is missing: evidence, and what is known of it.
struct NullModel {
  const Evidence& evidence;
  const EffectFit& fit;  ///< with the noise models of the channels
  /// Effects already in the fit, to which the candidates' columns are made orthogonal.
  std::vector<const EffectDesign*> accepted = {};
};

/// Simulates the null distribution for one model after another of the same evidence, each time on the same random numbers.
class NullSimulator {
 public:
  /// @param simulations number of simulated residuals of either kind
  NullSimulator(const Evidence& evidence, int simulations, std::mt19937_64& random);

  /// @param unchanged by candidate: whether nothing that its gains depend on has changed since the last call; empty: all have
  NullDistribution distribution(const NullModel& null, const std::vector<NullCandidate>& candidates,
                                const RegressionOptions& options = {},
                                const std::vector<bool>& unchanged = {});

 private:
  int count_;
  // [channels]: [rows x simulations] normal innovations, the largest part of a diagnosis' memory, hence floats
  std::vector<Eigen::MatrixXf> noise_;
  std::vector<Eigen::MatrixXd> signs_;  // [channels]: [blocks x simulations] -1 or 1
  std::vector<Eigen::VectorXd>
      best_;  // [candidates]: [2 x simulations, nats] largest gain of its designs
};

/// @param simulations number of simulated residuals of either kind
NullDistribution simulate_null_distribution(const NullModel& null,
                                            const std::vector<NullCandidate>& candidates,
                                            int simulations, std::mt19937_64& random,
                                            const RegressionOptions& options = {});

}  // namespace sparflow
