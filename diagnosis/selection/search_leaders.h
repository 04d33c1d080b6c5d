#pragma once
/// What a search does where an effect changes who leads a pump. Used by effect_search.cpp only.
#include <optional>
#include <vector>

#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// Evidence with pumps led as the found effects make them at the values that fit it, where the last one found adds to a
/// cylinder's demand and that evidence is worth more than SearchOptions::least_gain. Nothing: as it is.
/// @param fit of all found
std::optional<Evidence> led_by_found(const SearchState& search,
                                     const std::vector<FoundEffect>& found, const EffectFit& fit);

/// Whether any of them adds to what a cylinder asks of its pump in the suspect logs.
bool adds_demand(const Evidence& evidence, const std::vector<FoundEffect>& found);

/// The same designs on other evidence of the same logs and channels.
std::vector<EffectDesign> remade(const Evidence& evidence,
                                 const std::vector<EffectDesign>& designs);

/// Effects with the values of their designs and a fit of these. [SI]
std::vector<AppliedEffect> applied_effects(const std::vector<EffectDesign>& designs,
                                           const Eigen::VectorXd& theta);

}  // namespace sparflow
