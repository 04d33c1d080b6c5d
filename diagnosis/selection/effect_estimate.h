#pragma once
/// Estimates the parameters of all effects of a model together, from logs. Linear parameters come from the regression
/// of effect_fit.h; nonlinear ones from their grid, then from a golden-section search on the profile likelihood.
/// Effects that change the machine (masses, angles) are not quite linear: the regression is repeated with the
/// linearisation error added to the data. Values and intervals are those of effect_intervals.h. Diagnosis and extension
/// both use this estimate, so that they report the same values for the same effects on the same logs.
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/selection/effect_search.h"

namespace sparflow {

/// The nonlinear parameters of an effect, in the order of its description. [SI]
std::vector<double> shape_of(const AppliedEffect& effect);

struct EstimateOptions {
  EvidenceOptions evidence;  ///< those of the diagnosis, so that both see the same rows
  /// Whether an effect that the model has is estimated as a difference to it, else anew.
  bool differences = false;
  /// Ratio of the sharpest window of a log to the search's below which values are estimated in it.
  /// @threshold [1] 0..1; chosen: a window that is hardly narrower discounts starts and stops alike
  /// and is noisier
  double much_sharper = 0.5;
  /// Factor by which a nonlinear parameter may leave its value on the grid, up or down.
  /// @threshold [1] 1..; chosen: limits it beyond the ends of the grid, where no neighbour does
  double largest_step = 2.0;
  /// Nonlinear parameters at which a search has found each effect of `wanted` [SI]; they are tried beside the grid. Empty: none.
  std::vector<std::vector<double>> starts = {};
};

/// The logs that effects are estimated from.
struct EstimateLogs {
  std::vector<MachineSignals> suspects;         ///< with the effects
  std::vector<MachineSignals> references = {};  ///< of the same machine without them; may be empty
  /// For each suspect log, a mask of samples that take no part; empty = none.
  std::vector<Mask> leave_out = {};
  /// Effects that act in the references, none of them estimated; absent: those of the model that are not estimated.
  std::optional<std::vector<AppliedEffect>> in_references = std::nullopt;
};

struct EffectEstimate {
  /// In the order of `wanted`, with 95 % intervals; without those that only samples left out show.
  std::vector<AppliedEffect> effects;
  std::vector<bool>
      significant;  ///< of each: its joint 95 % region (sampling error alone) excludes zero
  std::vector<std::string> notes;  ///< which parameters lie on their bounds; whole sentences
  double log_likelihood = 0.0;     ///< [nats]
};

/// @param model its margins give the first estimate of pump demand; its effects are initial values of those in `wanted`
///        and are kept as they are otherwise
/// @param wanted every effect to be estimated, once each
/// @throws InputError when one of the effects does not act on any channel of the logs, none of whose samples are left out
EffectEstimate estimate_effects(const CraneModel& model, const std::vector<EffectAt>& wanted,
                                EstimateLogs logs, const SearchProgress& progress = {},
                                const EstimateOptions& options = {});

/// @param design of the estimate's effect `i`  @return why it is no finding by the estimated values, as part of a sentence; empty: it
///   is one
std::string why_no_finding(const EffectEstimate& all, const EffectDesign& design, std::size_t i);

}  // namespace sparflow
