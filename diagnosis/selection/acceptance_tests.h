#pragma once
/// Acceptance tests of a found effect, and in words which of them it fails. Used by the search only.
#include <string>
#include <vector>

#include "diagnosis/selection/effect_search.h"

namespace sparflow {

/// Fills in size, absorbed share, held-out gain and whether a parameter of `found[index]` lies on its bound.
/// @param fit of all `found`
void judge_effect(const Evidence& evidence, const SearchOptions& options, const EffectFit& fit,
                  std::vector<FoundEffect>& found, std::size_t index);

/// @return the reason why an effect is not named, as part of a sentence; empty when it passes all acceptance tests
std::string why_not_named(const FoundEffect& found, const SearchOptions& options,
                          const Mechanisms& mechanisms);

/// Whether an effect would pass all acceptance tests if the laws of the others had no model-form error.
bool passes_without_form_error(FoundEffect found, const SearchOptions& options,
                               const Mechanisms& mechanisms);

}  // namespace sparflow
