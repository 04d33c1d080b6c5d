#include "diagnosis/extension/exchange_rivals.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/regression/acceptance_statistics.h"
#include "models/effects/registry.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

bool has(const std::vector<EffectAt>& list, const EffectAt& e) {
  return std::find(list.begin(), list.end(), e) != list.end();
}

/// Geometric mean of the ratios after / before of the RMS errors of one stage, weighted with the number of samples; 1 where
/// none is compared.
double error_ratio(const CompareResult& before, const CompareResult& after,
                   const std::string& stage) {
  double sum = 0.0, n = 0.0;
  for (const StageScore& b : before.scores) {
    const StageScore* a = after.find(b.stage, b.at, b.regime);
    if (b.stage != stage || a == nullptr || !(b.rmse > 0.0) || !(a->rmse > 0.0)) continue;
    sum += static_cast<double>(b.n) * std::log(a->rmse / b.rmse);
    n += static_cast<double>(b.n);
  }
  return n > 0.0 ? std::exp(sum / n) : 1.0;
}

/// Place in the catalogue; of one effect at several places the first place first.
std::pair<std::ptrdiff_t, int> rank(const EffectAt& e) {
  const auto& all = effect_catalogue();
  const auto at = std::find_if(all.begin(), all.end(),
                               [&](const auto& effect) { return effect.get() == e.effect; });
  return {at - all.begin(), e.at};
}

/// An effect in the place in question, with all effects of the model and their cross-validated errors.
struct Choice {
  EffectAt effect;
  double
      error;  ///< RMS error of the effect's stage over that with the effect that the diagnosis named
  std::vector<EffectAt> effects;
  CompareResult errors;
};

/// Whether the errors of `one` are hardly larger than those of the best, and no quantity's by more than chance between motions.
bool equals(const RefitContext& context, const Choice& best, const Choice& one,
            const std::string& stage) {
  if (one.error > context.options().equal_rivals * best.error) return false;
  if (one.effect == best.effect) return true;
  ErrorChangeOptions options = context.options().change;
  options.large_change = 1.0;  // any growth beyond chance
  const ErrorChange change =
      error_change(context.machine(), best.errors, one.errors, {{stage}, ""}, options);
  return std::none_of(change.harmed.begin(), change.harmed.end(),
                      [&](const HarmedError& h) { return h.stage == stage; });
}

/// Whether no parameter lies on a bound other than a zero, which means that the part is absent.
bool is_plausible(const AppliedEffect& e) {
  for (std::size_t k = 0; k < e.values.size(); ++k) {
    const EffectParameter& p = e.effect->info().parameters[k];
    if (p.choice) continue;
    const double edge = kOnBound * (p.upper - p.lower);
    if (e.values[k] > p.upper - edge || (p.lower != 0.0 && e.values[k] < p.lower + edge))
      return false;
  }
  return true;
}

}  // namespace

bool is_determined(const AppliedEffect& e) {
  if (e.lower95.size() != e.values.size()) return true;
  bool proportional = false;
  for (std::size_t k = 0; k < e.values.size(); ++k) {
    if (!e.effect->info().parameters[k].linear) continue;
    if (e.lower95[k] > 0.0 || e.upper95[k] < 0.0) return true;
    proportional = true;
  }
  return !proportional;
}

std::vector<EffectAt> close_rivals(const Diagnosis& diagnosis, const EffectAt& effect) {
  std::vector<EffectAt> out;
  for (const FoundEffect& f : diagnosis.search.found) {
    if (!(f.design.effect == effect)) continue;
    for (const auto& [rival, worse] : f.alternatives) out.push_back(rival);
  }
  return out;
}

EffectAt best_of_rivals(const RefitContext& context, const RivalTrial& trial,
                        const SearchProgress& progress) {
  const std::string stage = effect_stage_name(trial.effect.effect->info().stage);
  if (stage != "force" && stage != "flow") return trial.effect;
  const std::string other = stage == "force" ? "flow" : "force";
  const CompareResult own = context.measured_errors(trial.from, trial.effects, progress);
  std::vector<Choice> choices = {{trial.effect, 1.0, trial.effects, own}};
  for (const EffectAt& r : trial.rivals) {
    if (has(trial.effects, r)) continue;
    std::vector<EffectAt> with = trial.effects;
    std::replace(with.begin(), with.end(), trial.effect, r);
    try {
      CompareResult errors = context.measured_errors(trial.from, with, progress);
      if (error_ratio(own, errors, other) > context.options().change.refit_moves) continue;
      const double error = error_ratio(own, errors, stage);
      choices.push_back({r, error, std::move(with), std::move(errors)});
    } catch (const InputError&) {  // half of the logs do not show this rival
    }
  }
  const Choice best =
      *std::min_element(choices.begin(), choices.end(),
                        [](const Choice& a, const Choice& b) { return a.error < b.error; });
  std::stable_sort(choices.begin(), choices.end(), [](const Choice& a, const Choice& b) {
    return rank(a.effect) < rank(b.effect);
  });
  for (const Choice& c : choices) {
    if (!equals(context, best, c, stage)) continue;
    if (c.effect == trial.effect) return c.effect;
    const CraneModel model = context.estimated(trial.from, c.effects, progress);
    const auto it = std::find_if(
        model.effects.begin(), model.effects.end(),
        [&](const AppliedEffect& a) { return a.effect == c.effect.effect && a.at == c.effect.at; });
    if (it != model.effects.end() && is_determined(*it) && is_plausible(*it)) return c.effect;
  }
  return trial.effect;
}

}  // namespace sparflow
