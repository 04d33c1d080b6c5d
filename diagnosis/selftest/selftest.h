#pragma once
/// Which effects a user's own logs could reveal: for every effect of the catalogue the statistical power on the logs'
/// motions and noise, at its typical size and others. The power is computed, and checked by injecting some effects into
/// simulated noise and running the search.
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/experiment/experiment.h"
#include "diagnosis/selection/effect_search.h"

namespace sparflow {

enum class Visibility {
  kSeen,       ///< named at its typical size, alone or in an indistinguishable set
  kOnlyLarge,  ///< named only if it is larger than typical
  kNever       ///< not named from these logs; the reason says why
};
const char* visibility_name(Visibility visibility);  ///< "seen" "only_large" "never"

/// A parameter's value as reports show it.
struct ShownValue {
  std::string name, unit;
  double value = 0.0;
};

/// A rival of an effect.
struct Confusion {
  std::string key;
  double nats = 0.0;   ///< gain of the true effect over the rival
  double share = 0.0;  ///< 0..1 share of the effect's signature that the rival explains
};

struct InjectedEffect {
  EffectAt effect;
  std::string id, at, stage;  ///< at "" for the whole machine
  Visibility visibility = Visibility::kNever;
  std::string reason;               ///< why never or only large, as a phrase; "" when seen
  std::vector<ShownValue> typical;  ///< parameters at the typical size
  double gain = 0.0;                ///< [nats] expected at the typical size, without penalty
  double power = 0.0;               ///< 0..1 probability to be named at the typical size
  /// Multiples of the typical size from which the power is 80 % and 95 %; infinity = at no plausible size.
  double times80 = std::numeric_limits<double>::infinity();
  double times95 = std::numeric_limits<double>::infinity();
  std::vector<ShownValue> smallest;      ///< parameters at `times80`; empty = never
  double size = 0.0;                     ///< [-] EffectAction::size at the typical size
  double absorbed = 0.0;                 ///< 0..1 absorbed share, with the references given
  double absorbed_alone = 0.0;           ///< 0..1 absorbed share without references
  std::vector<Confusion> confused_with;  ///< rivals within SearchOptions::same_nats, closest first
  std::string separated_by;              ///< motion that distinguishes it from rivals, in general

  std::string key() const { return at.empty() ? id : id + ":" + at; }
};

/// An effect added to simulated noise, and the result of the search.
struct InjectionCheck {
  std::string key, stage;
  double power = 0.0;      ///< 0..1 predicted
  bool predicted = false;  ///< whether it is predicted to be named
  bool named = false;      ///< whether it was named, alone or in an indistinguishable set
  std::string answer;      ///< effects that were named, "" = none
  bool as_predicted() const { return predicted == named; }
};

/// Number of indistinguishable sets that get an experiment and that the table shows.
inline constexpr std::size_t kSetsWithMotion = 6;

struct Selftest {
  std::vector<InjectedEffect> effects;  ///< in the catalogue's order, by stage
  std::vector<InjectionCheck> checks;
  std::vector<std::vector<std::string>> sets;  ///< keys of indistinguishable sets
  std::vector<Experiment> experiments;  ///< what to record for the first kSetsWithMotion sets
  double threshold = 0.0;               ///< [nats] threshold of the penalised gain
  double false_alarm = 0.05;
  double least_gain = 10.0;              ///< [nats] SearchOptions::least_gain
  double samples = 0.0, duration = 0.0;  ///< of the logs, [s]
  std::size_t logs = 0, references = 0;
  /// Largest residual of a channel over its noise floor, where it is so large that effects are probably missing already
  /// (SelftestOptions::suspicious_noise); 0 = none is.
  double residual_over_noise = 0.0;
  std::vector<std::string> notes;
  double seconds = 0.0;

  int count(Visibility visibility) const;
  std::string headline() const;  ///< one sentence
  std::string table() const;     ///< one screen for a terminal
  std::string json() const;
};

struct SelftestOptions {
  SignalOptions signals;
  EvidenceOptions evidence;
  SearchOptions search;
  ExperimentOptions experiment;
  int check = 6;  ///< number of effects checked by injection
  /// Probability to be named at its typical size from which an effect counts as seen.
  /// @threshold [1] 0..1; chosen: the usual power of a test that is planned, four of five.
  double power_seen = 0.8;
  /// Quantile of the normal distribution for that power, for the condition that the estimated size
  /// exceeds the smallest that is named.
  /// @threshold [1] -3..3; derived: normal quantile of power_seen, 0.8416.
  double quantile_seen = 0.84;
  /// Probability to be named for which the second size is given.
  /// @threshold [1] 0..1; chosen: nineteen of twenty, the other usual power.
  double power_sure = 0.95;
  /// Quantile of the normal distribution for that power.
  /// @threshold [1] -3..3; derived: normal quantile of power_sure, 1.645.
  double quantile_sure = 1.64;
  /// Largest multiple of the typical size that is looked at where an effect has no bound.
  /// @threshold [1] 1..; chosen: a thousand times the typical size is plausible for no effect.
  double largest_times = 1e3;
  /// Share of an effect's signature that a candidate must explain to be a rival.
  /// @threshold [1] 0..1; chosen: where it explains less, the rest of a significant gain exceeds
  /// SearchOptions::same_nats.
  double least_confusion = 0.2;
  /// Residual over noise floor from which a note says that an effect is probably missing already.
  /// @threshold [1] 1..; chosen: three times the sensors' noise, a ninth of the power of the
  /// residual.
  double suspicious_noise = 3.0;
  /// Power above which an effect may be drawn for a check as one that should be named.
  /// @threshold [1] 0..1; chosen: six effects of such power are all named with a probability above
  /// 0.83.
  double clearly_seen = 0.97;
  /// Multiple of the typical size with power_sure up to which it may be drawn so.
  /// @threshold [1] 0..; chosen: a fifth of reserve in the size, as the power is computed for a
  /// noise model that is known.
  double clearly_seen_times = 0.8;
  /// Power below which an effect may be drawn for a check as one that should not be named.
  /// @threshold [1] 0..1; chosen: the counterpart of clearly_seen.
  double clearly_unseen = 0.03;
  /// Number of checks up to which only effects are drawn that should be named.
  /// @threshold [1] 0..; chosen: few checks are better spent on what can be named.
  int checks_of_seen_only = 3;
  /// Largest number of effects that the search of a check may find.
  /// @threshold [effects] 1..; chosen: it may need three steps to replace a plainer effect by its
  /// refinement.
  int most_effects = 3;
  /// Candidate effects; empty = the whole catalogue on this machine except those of the model.
  std::vector<EffectAt> candidates;
};

/// @param model its effects count as known  @param references reference logs; may be empty
/// @throws InputError when there is no log
Selftest selftest(const CraneModel& model, const std::vector<Log>& logs,
                  const std::vector<Log>& references = {}, const SelftestOptions& options = {},
                  const SearchProgress& progress = {});

/// An effect that is added to simulated noise.
struct Injection {
  const EffectDesign& design;
  Eigen::VectorXd theta;  ///< [SI] its linear parameters
  unsigned seed = 0;      ///< of the noise draw
};

/// In the channels where the design acts, y is a random draw from the noise models of `fit` plus the design's action; the
/// search then runs over all candidates.
InjectionCheck inject_and_search(const Evidence& evidence, const EffectFit& fit,
                                 const Injection& injection,
                                 const std::vector<EffectAt>& candidates,
                                 const SelftestOptions& options);

}  // namespace sparflow
