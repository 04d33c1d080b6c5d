#pragma once
/// Which proofs a found effect passes, and in words why one is not named. Used by effect_search.cpp only.
#include <string>
#include <vector>

#include "diagnosis/selection/effect_search.h"

namespace sparflow {

/// Fills in size, absorbed share, held-out gain, whether a parameter rests on its bound. @param fit of all `found`
void judge_effect(const Evidence& evidence, const SearchOptions& options, const EffectFit& fit,
                  const std::vector<const EffectDesign*>& designs, std::size_t index,
                  FoundEffect& found);

/// @return empty when it passes all proofs
std::string why_not_named(const FoundEffect& found, const SearchOptions& options);

}  // namespace sparflow
