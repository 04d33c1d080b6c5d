#include "diagnosis/selection/acceptance_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/selection/search_state.h"

namespace sparflow {

using Eigen::Index;

void judge_effect(const Evidence& evidence, const SearchOptions& options, const EffectFit& fit,
                  std::vector<FoundEffect>& found, std::size_t index) {
  const std::vector<const EffectDesign*> designs = designs_of(found);
  FoundEffect& judged = found[index];
  const EffectAction action = effect_action(evidence, designs, index, fit, options.regression);
  judged.size = action.size;
  judged.absorbed = action.absorbed;
  judged.absorbed_where_seen = action.absorbed_where_seen;
  judged.over_form = action.over_form;
  Index first = 0;
  for (std::size_t i = 0; i < index; ++i) first += designs[i]->linear;
  judged.at_bound = rests_on_bound(judged.design, fit.theta.segment(first, judged.design.linear));
  const HeldOutGain held = held_out_gain(evidence, designs, index, fit, options.folds);
  judged.held_out_chance = held.chance;
  judged.held_out = held.gain;
  judged.held_out_error = held.error;
  judged.held_out_share = held.improved;
}

double same_within(const FoundEffect& found, const SearchOptions& options) {
  const double form = form_share(*found.design.effect.effect, options.regression);
  return std::max(options.same_nats, form * form * found.gain);
}

std::string why_not_named(const FoundEffect& found, const SearchOptions& options,
                          const Mechanisms& mechanisms) {
  const EffectStage stage = found.design.effect.effect->info().stage;
  const bool behind_process = stage == EffectStage::kPressure || stage == EffectStage::kPump;
  if (mechanisms.act(Mechanism::kAbsorbed,
                     behind_process && found.absorbed_where_seen > options.largest_absorbed)) {
    return fmt::format(
        "its absorbed share is {:.0f} % (learning pressure models, margins and gains again would "
        "take that part over); a reference log of the same motions would decide",
        100.0 * found.absorbed_where_seen);
  }
  if (mechanisms.act(Mechanism::kSize, found.size < options.smallest_effect)) {
    return fmt::format("where it acts it is {:.2f} times the noise, too small to be named",
                       found.size);
  }
  if (mechanisms.act(Mechanism::kBound, found.at_bound))
    return "a parameter lies on the bound of its plausible range";
  if (mechanisms.act(Mechanism::kFormSize, found.over_form < options.smallest_over_form)) {
    return fmt::format(
        "it compensates model-form error: it is only {:.1f} times that of the other effects there",
        found.over_form);
  }
  const bool predicts = found.held_out > options.held_out_errors * found.held_out_error ||
                        (found.held_out > 0.0 && found.held_out_share > options.improved_share);
  if (mechanisms.act(Mechanism::kHeldOut, !predicts)) {
    return fmt::format("its gain on motions left out, {:.1f} +- {:.1f} nats, is not significant",
                       found.held_out, found.held_out_error);
  }
  return {};
}

bool passes_without_form_error(FoundEffect found, const SearchOptions& options,
                               const Mechanisms& mechanisms) {
  found.over_form = std::numeric_limits<double>::max();
  return why_not_named(found, options, mechanisms).empty();
}

}  // namespace sparflow
