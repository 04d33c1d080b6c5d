#pragma once
/// Updates of the evidence where an effect changes the load-sensing leader or the pump's lag. Used by the search and its parts only.
#include <optional>
#include <vector>

#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// Updates of leaders and values in turn. A third of the error remains each time where half of the rows change.
inline constexpr int kLeaderTurns = 5;

/// Evidence with the load-sensing leaders and the pumps' lags that follow from the found effects, iterated with their values. Made
/// only when the last effect adds to a cylinder's demand or is such a lag, and the log-likelihood rises by SearchOptions::least_gain or more.
/// @param fit of all found  @return nothing when the leaders stay
std::optional<Evidence> with_leaders_of_found(const SearchState& search,
                                              const std::vector<FoundEffect>& found,
                                              const EffectFit& fit);

/// Whether any of the effects adds to a cylinder's demand on its pump in the suspect logs.
bool adds_demand(const Evidence& evidence, const std::vector<FoundEffect>& found);

/// The same effects and nonlinear parameters as designs on other evidence of the same logs and channels.
std::vector<EffectDesign> rebuilt_designs(const Evidence& evidence,
                                          const std::vector<EffectDesign>& designs);

/// Effects with the nonlinear parameters of their designs and the linear ones of a fit of these. [SI]
std::vector<AppliedEffect> applied_effects(const std::vector<EffectDesign>& designs,
                                           const Eigen::VectorXd& theta);

}  // namespace sparflow
