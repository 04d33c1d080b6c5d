#include "diagnosis/selection/leader_updates.h"

#include <algorithm>

#include "diagnosis/selection/effect_intervals.h"
#include "identification/signals/load_sensing_leader.h"

namespace sparflow {
namespace {

bool adds_demand(const Evidence& evidence, std::span<const AppliedEffect> effects) {
  const auto first = evidence.series.begin();
  return std::any_of(
      first, first + static_cast<std::ptrdiff_t>(evidence.suspects),
      [&](const MachineSeries& s) { return asked_by_effects(effects, s).rows() > 0; });
}

/// Whether a pump's pressure follows its demand by this effect.
bool is_pump_lag(const Evidence& evidence, const AppliedEffect& effect) {
  const std::vector<PumpSeries> pumps = pumps_with_lags_of({&effect, 1}, evidence.series[0]);
  return std::any_of(pumps.begin(), pumps.end(),
                     [](const PumpSeries& p) { return p.following.effect != nullptr; });
}

}  // namespace

bool adds_demand(const Evidence& evidence, const std::vector<FoundEffect>& found) {
  std::vector<AppliedEffect> acting;
  acting.reserve(found.size());
  for (const FoundEffect& f : found)
    acting.push_back({f.design.effect.effect, f.design.effect.at, f.values, {}, {}});
  return adds_demand(evidence, std::span<const AppliedEffect>(acting));
}

std::vector<EffectDesign> rebuilt_designs(const Evidence& evidence,
                                          const std::vector<EffectDesign>& designs) {
  std::vector<EffectDesign> out;
  out.reserve(designs.size());
  for (const EffectDesign& d : designs)
    out.push_back(make_design(evidence, d.effect, d.shape, d.about, d.optional));
  return out;
}

std::vector<AppliedEffect> applied_effects(const std::vector<EffectDesign>& designs,
                                           const Eigen::VectorXd& theta) {
  std::vector<AppliedEffect> out;
  out.reserve(designs.size());
  Eigen::Index first = 0;
  for (const EffectDesign& d : designs) {
    out.push_back({d.effect.effect,
                   d.effect.at,
                   parameter_values(*d.effect.effect, theta.segment(first, d.linear), d.shape),
                   {},
                   {}});
    first += d.linear;
  }
  return out;
}

std::optional<Evidence> with_leaders_of_found(const SearchState& search,
                                              const std::vector<FoundEffect>& found,
                                              const EffectFit& fit) {
  std::vector<EffectDesign> designs;
  designs.reserve(found.size());
  for (const FoundEffect& f : found) designs.push_back(f.design);
  std::vector<AppliedEffect> acting = applied_effects(designs, fit.theta);
  const Evidence& given = search.evidence;
  const std::span<const AppliedEffect> last(&acting.back(), 1);
  if (!adds_demand(given, last) && !is_pump_lag(given, acting.back())) return {};
  std::optional<Evidence> updated;
  double total = fit.total();
  for (int turn = 0; turn < kLeaderTurns; ++turn) {
    std::optional<Evidence> next = (updated ? *updated : given).with_leaders_of(acting);
    if (!next) break;
    updated = std::move(next);
    designs = rebuilt_designs(*updated, designs);
    std::vector<const EffectDesign*> pointers;
    pointers.reserve(designs.size());
    for (const EffectDesign& d : designs) pointers.push_back(&d);
    const EffectFit there = fit_effects(*updated, pointers, &fit);
    total = there.total();
    acting = applied_effects(designs, there.theta);
  }
  if (!updated || total < fit.total() + search.options.least_gain) return {};
  return updated;
}

}  // namespace sparflow
