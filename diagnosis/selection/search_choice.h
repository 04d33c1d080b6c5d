#pragma once
/// Which of several effects that all pass the gate is taken up. Used by effect_search.cpp and its parts only.
#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// The most likely candidate that passes the gate (the best of all if none does), another one that passes and leaves
/// significantly less where every row counts the same, or the plainer effect that the choice contains when that
/// explains most of the same: what is left then decides whether the refinement is needed, and `prune` drops whichever
/// becomes superfluous.
CandidateScore chosen(const SearchState& search, const std::vector<CandidateScore>& scores,
                      const NullGate& gate, double level,
                      const std::vector<const EffectDesign*>& base);

/// Whether `one` leaves significantly less than `other` where every row counts the same.
bool ordinarily_better(const SearchState& search, const std::vector<const EffectDesign*>& base,
                       const EffectDesign& one, const EffectDesign& other);

}  // namespace sparflow
