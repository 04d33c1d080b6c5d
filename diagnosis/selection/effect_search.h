#pragma once
/// Searches the catalogue for what explains the evidence: forward selection by profile likelihood, a gate with
/// controlled false alarm, held-out proof, drop and swap moves, indistinguishable sets. docs/diagnose.md has the
/// method and what each number was measured to be worth.
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct SearchOptions {
  double false_alarm = 0.05;  ///< of the whole search on logs with nothing missing
  int max_effects = 8;
  int simulations = 300;  ///< of the null, for the gate
  /// An effect smaller than this share of its channel's noise is not worth a name, however significant.
  double smallest_effect = 0.15;
  /// A further effect smaller than this many times what the others' laws may be wrong by (EffectAction::over_form)
  /// only mends their form.
  double smallest_over_form = 1.5;
  double largest_absorbed =
      0.9;  ///< an effect that learned laws imitate to more than this share is not named
  /// [nats] beyond its price that an effect must gain, whatever the gate allows: the gate simulates the noise's law,
  /// and what that law misses is worth some nats in long logs. Effects that are there gain tens.
  double least_gain = 10.0;
  double same_nats = 4.0;  ///< effects whose likelihoods differ by less cannot be told apart
  int folds = 5;
  unsigned seed = 1;
};

/// One effect judged missing.
struct FoundEffect {
  EffectDesign design;
  double gain =
      0.0;  ///< [nats] penalised log likelihood with all found - the same without this one
  double p_value = 1.0;   ///< of the gate it passed
  double size = 0.0;      ///< largest over channels: its size where it acts / the channel's noise
  double absorbed = 0.0;  ///< share of its action that the learned baselines imitate
  double absorbed_where_seen = 1.0;  ///< the same in the channel in which most of it is left
  double held_out = 0.0,
         held_out_error = 0.0;  ///< [nats] over motions left out, and standard error
  double held_out_share = 0.0;  ///< of the parts left out in turn that it improved
  double over_form =
      1e9;  ///< its size / what the other effects' laws may be wrong by where it acts
  /// The joint 95 % region (sampling error alone) of its linear parameters holds zero, or, where the effect refines a
  /// plainer one, the interval of a nonlinear parameter does: the plainer effect, or none, would do.
  bool could_be_nothing = false;
  bool at_bound = false;  ///< a parameter rests on the edge of what is plausible
  std::vector<double> values, lower95, upper95;  ///< [SI] by parameter
  /// Others that could stand in its place, best first, with how much worse they are. [nats]
  std::vector<std::pair<EffectAt, double>> alternatives;
};

struct SearchResult {
  std::vector<FoundEffect> found;  ///< in the order found
  /// Beyond the gate, but only with parameters that no machine has: something is there, and not this.
  std::vector<FoundEffect> unnamed;
  /// Nothing passed the gate, but this gains far too much for noise: it shows in one place (incident.h).
  std::optional<EffectDesign> once;
  EffectFit null, final;  ///< without and with them
  /// The evidence that `found` and `final` belong to, where what was found changes who leads a pump
  /// (Evidence::led_by); else nothing: the one given.
  std::optional<Evidence> led;
  double p_value = 1.0;    ///< of the first gate
  double threshold = 0.0;  ///< [nats] of the first gate
  /// Best penalised gain of every candidate in the first step.
  std::vector<std::pair<EffectAt, double>> ranking;
  std::vector<std::string> notes;
};

using SearchProgress = std::function<void(double share, const std::string& what)>;

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options = {}, const SearchProgress& progress = {});

}  // namespace sparflow
