#pragma once
/// Searches the catalogue for what explains the evidence: forward selection by profile likelihood, a gate with
/// controlled false alarm, drop and swap moves, indistinguishable sets. docs/diagnose.md has the method.
#include <functional>
#include <random>

#include "identification/effect_fit.h"

namespace sparflow {

struct SearchOptions {
  double false_alarm = 0.05;  ///< of the whole search on logs with nothing missing
  int max_effects = 5;
  int simulations = 300;  ///< of the null, for the gate
  /// An effect that explains less than this share of a channel's noise is not worth a name, however significant.
  double smallest_effect = 0.15;
  double same_nats = 4.0;  ///< effects whose likelihoods differ by less cannot be told apart
  unsigned seed = 1;
};

/// One effect judged missing.
struct FoundEffect {
  EffectDesign design;
  double gain = 0.0;     ///< [nats] log likelihood without it - with it, all others refitted
  double p_value = 1.0;  ///< of the gate it passed
  double size = 0.0;  ///< largest over channels: its RMS over its own samples / the channel's noise
  double absorbed = 0.0;  ///< share of its action that the learned baselines imitate
  std::vector<double> values, lower95, upper95;  ///< [SI] by parameter
  /// Others that explain as much, best first, with how much worse they are. [nats]
  std::vector<std::pair<EffectAt, double>> alternatives;
};

struct SearchResult {
  std::vector<FoundEffect> found;  ///< in the order found
  EffectFit null, final;           ///< without and with them
  double p_value = 1.0;            ///< of the first gate
  double threshold = 0.0;          ///< [nats] of the first gate
  /// Best gain of every candidate in the first step: the ranking's raw numbers.
  std::vector<std::pair<EffectAt, double>> ranking;
  std::vector<std::string> notes;
};

using SearchProgress = std::function<void(double share, const std::string& what)>;

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options = {}, const SearchProgress& progress = {});

}  // namespace sparflow
