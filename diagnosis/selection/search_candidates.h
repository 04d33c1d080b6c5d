#pragma once
/// The effects that a search chooses from on given evidence: the designs over each one's grid, and its penalty.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct SearchCandidate {
  EffectAt effect;
  std::vector<EffectDesign>
      designs;           ///< one for each grid point that acts on this evidence, and another with
                         ///< the optional parameters where their columns are independent
  int linear = 1;        ///< number of linear parameters with independent columns, not optional
  double penalty = 0.0;  ///< [nats] subtracted from its gain
  double optional_penalty = 0.0;  ///< [nats] further penalty of its optional parameters

  double penalty_of(const EffectDesign& design) const {
    return penalty + (design.optional ? optional_penalty : 0.0);
  }
};

/// The candidates that act on some channel of the evidence, in the order given.
/// Penalty: Schwarz (1978), half the logarithm of the number of rows for each parameter with an independent column.
std::vector<SearchCandidate> search_candidates(const Evidence& evidence,
                                               const std::vector<EffectAt>& effects);

}  // namespace sparflow
