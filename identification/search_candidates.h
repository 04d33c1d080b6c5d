#pragma once
/// The effects a search chooses among on given evidence: each over its grid, with its price.
#include <vector>

#include "identification/effect_fit.h"

namespace sparflow {

struct SearchCandidate {
  EffectAt effect;
  std::vector<EffectDesign> designs;  ///< one a point of its grid that acts on this evidence
  int linear = 1;                     ///< linear parameters with independent columns
  double penalty = 0.0;               ///< [nats] its gain must exceed
};

/// Candidates that act somewhere in the evidence, in the order given; the others are left out.
/// Penalty: Schwarz (1978), half a log of the rows for each parameter that does something.
std::vector<SearchCandidate> search_candidates(const Evidence& evidence,
                                               const std::vector<EffectAt>& effects);

}  // namespace sparflow
