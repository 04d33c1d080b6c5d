#pragma once
/// Moves that put right what step by step selection took up too early: dropping, merging, reshaping, swapping. Used by
/// effect_search.cpp only. `current` is the fit of all found, before and after.
#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// Drop what the others made superfluous.
void prune(const SearchState& search, std::vector<FoundEffect>& found, EffectFit& current);

/// Two effects where one says as much: the first of a pair is chosen when it stands for two causes at once, and what it
/// says too much or too little of one of them then finds a second name. @return whether one took the place of two
bool merge(const SearchState& search, std::vector<FoundEffect>& found, EffectFit& current);

/// Another variant of the same effect (the other sensor, the other law) may serve better since others were found,
/// and make one of them superfluous. @return whether one took the place
bool reshape(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
             EffectFit& current);

/// @return whether a rival took the place of found[i]
bool rivals(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
            EffectFit& current);

}  // namespace sparflow
