#pragma once
/// Searches the catalogue for the effects that explain the evidence: forward selection by profile likelihood, a
/// threshold of the gain with a controlled false-alarm rate, acceptance tests, drop and swap moves, indistinguishable
/// sets. docs/diagnose.md describes the method.
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct SearchOptions {
  double false_alarm = 0.05;  ///< 0..1 rate of the whole search on logs with nothing missing
  int max_effects = 8;        ///< largest number of effects found
  int simulations = 300;      ///< number of draws of the null distribution of the largest gain
  /// [-] an effect smaller than this multiple of its channel's noise is not named, however significant it is.
  double smallest_effect = 0.15;
  /// [-] a further effect smaller than this multiple of the other effects' model-form error (EffectAction::over_form)
  /// compensates that error and is not named.
  double smallest_over_form = 1.5;
  double largest_absorbed = 0.9;  ///< 0..1 an effect with a larger absorbed share is not named
  /// [nats] least penalised gain of an effect, even where the threshold is lower: the null distribution simulates the
  /// noise model, and the error of that model makes gains of a few nats in long logs. Present effects gain tens.
  double least_gain = 10.0;
  double same_nats = 4.0;  ///< [nats] effects whose gains differ by less are indistinguishable
  int folds = 5;           ///< of the cross-validation over motions
  unsigned seed = 1;       ///< of the null distribution
};

/// An effect that the search names as missing.
struct FoundEffect {
  EffectDesign design;
  double gain =
      0.0;  ///< [nats] penalised log-likelihood of all found effects less that without this one
  double p_value = 1.0;              ///< by the null distribution of the step that added it
  double size = 0.0;                 ///< [-] EffectAction::size
  double absorbed = 0.0;             ///< 0..1 absorbed share over all channels
  double absorbed_where_seen = 1.0;  ///< 0..1 EffectAction::absorbed_where_seen
  double held_out = 0.0,
         held_out_error = 0.0;  ///< [nats] gain on motions left out, and its standard error
  double held_out_share = 0.0;  ///< 0..1 share of the folds whose error it reduces
  double over_form = 1e9;       ///< [-] EffectAction::over_form
  /// Fails the joint significance test: the joint 95 % region (sampling error alone) of its linear parameters contains
  /// zero or, where it refines a plainer effect, the interval of a nonlinear parameter does.
  bool not_significant = false;
  bool at_bound = false;                         ///< a parameter lies on its bound
  std::vector<double> values, lower95, upper95;  ///< [SI] by parameter
  /// Other effects that could replace it, best first, with how much smaller their gain is. [nats]
  std::vector<std::pair<EffectAt, double>> alternatives;
};

struct SearchResult {
  std::vector<FoundEffect> found;  ///< in the order found
  /// Effects beyond the threshold whose parameters lie on their bounds: the evidence is significant, the cause unknown.
  std::vector<FoundEffect> unnamed;
  /// When nothing passed the threshold, an effect that gains too much for noise: an isolated event (isolated_event.h).
  std::optional<EffectDesign> once;
  EffectFit null, final;  ///< fits without any effect and with all found ones
  /// The evidence that `found` and `final` belong to, where the found effects change the load-sensing leader
  /// (Evidence::with_leaders_of); empty where they belong to the evidence given.
  std::optional<Evidence> updated_evidence;
  double p_value = 1.0;    ///< of the best candidate in the first step
  double threshold = 0.0;  ///< [nats] of the penalised gain in the first step
  int simulations = 0;     ///< of the null distribution: no p-value is below 1 / (simulations + 1)
  /// Best penalised gain of every candidate in the first step, best first. [nats]
  std::vector<std::pair<EffectAt, double>> ranking;
  std::vector<std::string> notes;  ///< which effects were not named, and why; whole sentences
};

/// Called with the share done (0..1) and a phrase for what is being done.
using SearchProgress = std::function<void(double share, const std::string& what)>;

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options = {}, const SearchProgress& progress = {});

}  // namespace sparflow
