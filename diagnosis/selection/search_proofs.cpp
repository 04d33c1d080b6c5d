#include "diagnosis/selection/search_proofs.h"

#include <fmt/format.h>

#include "diagnosis/regression/effect_proof.h"

namespace sparflow {

using Eigen::Index;

void judge_effect(const Evidence& evidence, const SearchOptions& options, const EffectFit& fit,
                  const std::vector<const EffectDesign*>& designs, std::size_t index,
                  FoundEffect& found) {
  const EffectAction action = effect_action(evidence, designs, index, fit);
  found.size = action.size;
  found.absorbed = action.absorbed;
  found.absorbed_where_seen = action.absorbed_where_seen;
  found.over_form = action.over_form;
  Index first = 0;
  for (std::size_t i = 0; i < index; ++i) first += designs[i]->linear;
  found.at_bound = rests_on_bound(found.design, fit.theta.segment(first, found.design.linear));
  const HeldOutGain held = held_out_gain(evidence, designs, index, fit, options.folds);
  found.held_out = held.gain;
  found.held_out_error = held.error;
  found.held_out_share = held.improved;
}

std::string why_not_named(const FoundEffect& found, const SearchOptions& options) {
  const EffectStage stage = found.design.effect.effect->info().stage;
  const bool behind_process = stage == EffectStage::kPressure || stage == EffectStage::kPump;
  if (behind_process && found.absorbed_where_seen > options.largest_absorbed) {
    return fmt::format(
        "what is learned (pressures, margins, gains) can imitate {:.0f} % of it; a reference log "
        "would tell",
        100.0 * found.absorbed_where_seen);
  }
  if (found.size < options.smallest_effect) {
    return fmt::format("it is {:.2f} times the noise where it acts, too small to matter",
                       found.size);
  }
  if (found.at_bound) return "its parameter would lie at the edge of what is plausible";
  if (found.over_form < options.smallest_over_form) {
    return fmt::format(
        "it is {:.1f} times what the form of another effect in the same place may be wrong by",
        found.over_form);
  }
  // one standard error beyond zero, or (a few large steps carry all the evidence) better nearly everywhere
  if (found.held_out <= found.held_out_error &&
      !(found.held_out > 0.0 && found.held_out_share > 0.79)) {
    return fmt::format("on motions left out it gains {:.1f} +- {:.1f} nats, not proven",
                       found.held_out, found.held_out_error);
  }
  return {};
}

}  // namespace sparflow
