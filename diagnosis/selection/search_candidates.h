#pragma once
/// The effects a search chooses among on given evidence: each over its grid, with its price.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct SearchCandidate {
  EffectAt effect;
  std::vector<EffectDesign>
      designs;           ///< one a point of its grid that acts on this evidence, and again with
                         ///< optional parameters where those say something of their own
  int linear = 1;        ///< linear parameters with independent columns, without optional ones
  double penalty = 0.0;  ///< [nats] its gain must exceed
  double optional_penalty = 0.0;  ///< [nats] and this besides for its optional parameters

  double price(const EffectDesign& design) const {
    return penalty + (design.optional ? optional_penalty : 0.0);
  }
};

/// Candidates that act somewhere in the evidence, in the order given; the others are left out.
/// Penalty: Schwarz (1978), half a log of the rows for each parameter that does something.
std::vector<SearchCandidate> search_candidates(const Evidence& evidence,
                                               const std::vector<EffectAt>& effects);

}  // namespace sparflow
