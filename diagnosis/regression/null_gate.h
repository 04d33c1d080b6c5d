#pragma once
/// How large the best gain of a whole search gets when nothing is missing: covers the number of candidates, their
/// grids and their dependence on each other, on the user's own motions.
#include <random>
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct NullGate {
  std::vector<double> normal;  ///< [nats] simulated with independent normal innovations, sorted
  std::vector<double>
      flipped;  ///< [nats] the log's own residuals, signs of whole motions drawn at random, sorted
  /// By candidate: how many times larger its gains come out of the flipped residuals than of normal ones. A residual
  /// that still holds other effects, or whole motions that are off, makes large gains in the channels it stands in;
  /// divided by this, a candidate of another channel need not compete with those.
  std::vector<double> scale;
  std::vector<double> penalty;  ///< [nats] by candidate, as given

  /// What a scaled gain must reach, any candidate's. [nats]
  double threshold(double level) const;
  /// The larger of the two ways' p-values of a candidate's penalised gain [nats].
  double p_value(double gain, std::size_t candidate) const;
};

/// One candidate: its designs (grid) and its penalty.
struct GateCandidate {
  const std::vector<EffectDesign>* designs = nullptr;
  double penalty = 0.0;           ///< [nats]
  double optional_penalty = 0.0;  ///< [nats] besides, of designs with optional parameters
};

NullGate make_null_gate(const Evidence& evidence, const std::vector<GateCandidate>& candidates,
                        const std::vector<const EffectDesign*>& accepted, const EffectFit& fit,
                        int simulations, std::mt19937_64& random);

}  // namespace sparflow
