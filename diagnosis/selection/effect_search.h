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
#include "diagnosis/regression/regression_options.h"

namespace sparflow {

/// Sizes are those of EffectAction, gains are penalised ones.
struct SearchOptions {
  RegressionOptions regression;

  /// Rate at which a search on logs with nothing missing names an effect.
  /// @threshold [1] 0..1; chosen: the usual 5 % of a test
  double false_alarm = 0.05;
  /// Largest number of effects found.
  /// @threshold [effects] 1..; chosen: stands for several faults of one machine at once; ends the
  /// search
  int max_effects = 8;
  /// Steps of the search for each of max_effects, added or refused, after which it ends.
  /// @threshold [steps] 1..; chosen: bounds the time of a search that refuses one effect after
  /// another
  int steps_per_effect = 3;
  /// Rounds of adding, exchanging and dropping after which a search ends; each drops one effect.
  /// @threshold [rounds] 1..; chosen: a guard, ends a search in which an effect is added and dropped in turn. References of a machine
  /// of three cylinders need up to four; with three the effects that the last drop makes way for were never tried
  int rounds = 10;
  /// Further searches on evidence with the load-sensing leaders that the last search implies.
  /// @threshold [searches] 0..; chosen: ends a search in which two leaders alternate
  int leader_searches = 3;
  /// Number of draws of the null distribution of the largest gain.
  /// @threshold [draws] 20..; derived: a p-value of 5 % then has a standard error of 1.3 %
  int simulations = 300;
  /// Size below which an effect is not named, as a multiple of its channel's noise, however
  /// significant it is.
  /// @threshold [1] 0..; chosen: significance grows with the length of the log, importance does not
  double smallest_effect = 0.15;
  /// Size below which a further effect is not named, as a multiple of the other effects' model-form
  /// error (EffectAction::over_form).
  /// @threshold [1] 0..; derived: twice the standard deviation of what that error makes of the effect, 95 % of a normal distribution
  double smallest_over_form = 2.0;
  /// Absorbed share of a pressure or pump effect above which it is not named.
  /// @threshold [1] 0..1; chosen: learning the pressure models again would take over all but a
  /// tenth
  double largest_absorbed = 0.9;
  /// Least gain of an effect, even where the threshold of the null distribution is lower. Present
  /// effects gain tens.
  /// @threshold [nat] 0..; tuned: without it more than 5 % of fresh logs with nothing missing
  /// passed (docs/history/diagnosis.md). The null distribution simulates the noise model, and the
  /// error of that model makes gains of a few nats in long logs
  double least_gain = 10.0;
  /// Multiple of least_gain beyond which evidence counts as significant although no effect is named
  /// for it: one that fits only with implausible parameters, or an isolated event.
  /// @threshold [1] 1..; tuned: the largest gain that is not significant is 5.6 nats in 60 logs
  /// with nothing missing (docs/history/diagnosis.md)
  double surely_something = 3.0;
  /// Difference of gains below which two effects are indistinguishable.
  /// @threshold [nat] 0..; derived: odds of e^4 = 55
  double same_nats = 4.0;
  /// Difference of gains above which another variant of a law replaces a found effect.
  /// @threshold [nat] 0..; chosen: a smaller one would exchange equals, back and forth
  double least_reshape_gain = 1.0;
  /// Difference of gains up to which a rival is listed in FoundEffect::alternatives; indistinguishable ones
  /// (same_within) are listed whatever it is. It is another question than same_nats: how far a rival still lowers an
  /// effect's probability.
  /// @threshold [nat] 0..; derived: a rival that is worse by 50 nats has odds of e^-50 = 2e-22
  double largest_alternative_loss = 50.0;
  /// Share of a refining effect's gain above which the plainer effect is chosen first.
  /// @threshold [1] 0..1; chosen: it then explains most of the same; later steps decide whether the
  /// refinement is needed
  double plainer_share = 0.5;
  /// Share of a pair's gain that one effect must have at a grid point, else it is not tried
  /// instead.
  /// @threshold [1] 0..1; chosen: refining its nonlinear parameters may add the rest
  double merge_share = 0.9;
  /// Share, or its inverse, beyond which it is tried whether a share of one explains as much.
  /// @threshold [1] 0..1; chosen: laws with shares within a third of one have not been seen to be undetermined
  double share_near_one = 0.72;
  /// Loss of log-likelihood up to which a share is fixed at one (fix_share_at_one in
  /// effect_search.cpp).
  /// @threshold [nat] 0..; chosen: below same_nats, so that both laws are indistinguishable
  double share_at_one_loss = 3.0;
  /// The same as a share of the effect's gain; the larger of both counts.
  /// @threshold [1] 0..1; chosen: a large effect reveals the error of its law's form, which is no
  /// statement about the share
  double share_at_one_loss_share = 0.05;
  /// Number of folds of the cross-validation over motions.
  /// @threshold [folds] 2..; chosen: each fit keeps four fifths of the motions
  int folds = 5;
  /// Gain on motions left out that an effect must exceed, in its standard errors over folds.
  /// @threshold [1] 0..; chosen: a mild test of an effect that has passed the threshold already
  double held_out_errors = 1.0;
  /// Share of the folds beyond which a positive gain on motions left out is enough.
  /// @threshold [1] 0..1; derived: four of five folds less rounding. A few large steps may carry
  /// all evidence, and the gains of the folds then differ widely
  double improved_share = 0.79;
  /// Variance of the block offsets, as a share of the noise's variance, above which the noise model
  /// may contain a slow effect. The effect is then also fitted from white noise.
  /// @threshold [1] 0..1; chosen: an effect that offsets could imitate must show in them
  double hiding_offsets = 0.2;
  /// Correlation of neighbouring rows above which the noise model may contain a slow effect, too.
  /// @threshold [1] 0..1; chosen: such noise changes as slowly as a motion does
  double hiding_correlation = 0.85;
  unsigned seed = 1;  ///< of the null distribution
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
         held_out_error = 0.0;   ///< [nats] gain on motions left out, and its standard error
  double held_out_chance = 1.0;  ///< 0..1 HeldOutGain::chance
  double held_out_share = 0.0;   ///< 0..1 share of the folds whose error it reduces
  double over_form = 1e9;        ///< [-] EffectAction::over_form
  /// Fails the joint significance test: the joint 95 % region (sampling error alone) of its linear parameters contains
  /// zero or, where it refines a plainer effect, the interval of a nonlinear parameter does.
  bool not_significant = false;
  bool at_bound = false;                         ///< a parameter lies on its bound
  std::vector<double> values, lower95, upper95;  ///< [SI] by parameter
  Eigen::MatrixXd covariance;                    ///< [SI] of the values
  /// Other effects that could replace it, best first, with how much smaller their gain is. [nats]
  std::vector<std::pair<EffectAt, double>> alternatives;
};

/// Difference in gain below which two effects are indistinguishable on these logs: at least `same_nats`, and at least
/// the gain that model-form error makes, which is the squared form_share of the effect's gain. [nats]
double same_within(const FoundEffect& found, const SearchOptions& options);

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
