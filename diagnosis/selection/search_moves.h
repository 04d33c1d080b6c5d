#pragma once
/// Moves that correct choices which forward selection made too early: merging, and changing the variant of a law; and the
/// rivals of what was found. Used by effect_search.cpp only. `current` is the fit of all found effects, before and after.
#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// Replaces two effects by one that explains as much. The first effect of such a pair was chosen while it explained
/// two causes at once, and the second compensated its error for one of them. @return whether a pair was replaced
bool merge(const SearchState& search, std::vector<FoundEffect>& found, EffectFit& current);

/// Replaces an effect by another variant of it (the other sensor, the other law) that explains more now that others
/// were found; one of those may become superfluous. @return whether found[i] was replaced
bool reshape(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
             EffectFit& current);

/// Replaces an effect by one that explains more and had been refused only beside the model-form error of an effect that is no
/// longer found. @return whether found[i] was replaced
bool exchange(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
              EffectFit& current);

/// Lists the rivals of found[i] in FoundEffect::alternatives.
void list_rivals(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
                 const EffectFit& current);

}  // namespace sparflow
