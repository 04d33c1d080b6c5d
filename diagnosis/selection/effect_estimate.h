#pragma once
/// Parameters of all effects of a model at once, from logs. Linear ones by the regression of effect_fit.h; the others
/// over their grid, then by golden section on the profile likelihood. Effects that are another machine (masses,
/// angles) are not quite linear: the regression is repeated with its error of linearisation added to the data.
/// Values and intervals are those of effect_intervals.h. Diagnosis and extension both end here, so that they print
/// the same figures for the same effects on the same logs.
#include <string>
#include <vector>

#include "diagnosis/selection/effect_search.h"

namespace sparflow {

struct EffectEstimate {
  std::vector<AppliedEffect> effects;  ///< in the order of `wanted`, with 95 % intervals
  std::vector<std::string> notes;      ///< parameters on their bounds; whole sentences
  double log_likelihood = 0.0;         ///< [nats]
};

/// @param model its margins start the pumps' demand; its effects are starting values of those that are wanted, and
///        stay as they are otherwise
/// @param wanted every effect to be estimated, once each
/// @param suspects logs with the effects  @param references of the same machine without them; may be empty
/// @param leave_out one mask a suspect log: samples that take no part; empty = none
/// @param in_references effects that the references have, none of them wanted; null: those of the model that are not
///        wanted
/// @throws InputError when the logs do not hold what one of the effects shows in
EffectEstimate estimate_effects(const CraneModel& model, const std::vector<EffectAt>& wanted,
                                const std::vector<MachineSignals>& suspects,
                                const std::vector<MachineSignals>& references = {},
                                const std::vector<Mask>& leave_out = {},
                                const SearchProgress& progress = {},
                                const std::vector<AppliedEffect>* in_references = nullptr);

}  // namespace sparflow
