#include <algorithm>

#include "diagnosis/experiment/effect_power.h"
#include "diagnosis/selftest/selftest.h"

namespace sparflow {

InjectionCheck inject_and_search(const Evidence& evidence, const EffectFit& fit,
                                 const Injection& injection,
                                 const std::vector<EffectAt>& candidates,
                                 const SelftestOptions& options) {
  const EffectDesign& design = injection.design;
  const Machine& machine = *evidence.series[0].machine;
  std::mt19937_64 random(injection.seed);
  Evidence injected = evidence;
  injected.channels.clear();
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!design.touches(c)) continue;
    EvidenceChannel channel = evidence.channels[c];
    channel.y = draw_noise(fit.noise[c], channel.noise_rows(), channel.rows(), random) +
                design.columns[c] * injection.theta;
    injected.channels.push_back(std::move(channel));
  }
  SearchOptions few = options.search;
  few.max_effects = options.most_effects;
  const SearchResult result = search_effects(injected, candidates, few);

  InjectionCheck check;
  const auto key_of = [&](const EffectAt& e) {
    return effect_key(e.effect->info(), machine, e.at);
  };
  check.key = key_of(design.effect);
  check.stage = effect_stage_name(design.effect.effect->info().stage);
  for (const FoundEffect& f : result.found) {
    const std::string key = key_of(f.design.effect);
    check.answer += (check.answer.empty() ? "" : ", ") + key;
    check.named = check.named || key == check.key;
    for (const auto& [rival, worse] : f.alternatives) {
      if (worse >= options.search.same_nats) continue;
      check.named = check.named || key_of(rival) == check.key;
      check.answer += " or " + key_of(rival);
    }
  }
  return check;
}

}  // namespace sparflow
