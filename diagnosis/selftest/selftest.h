#pragma once
/// What a user's own logs could reveal: every effect of the catalogue injected into their motions and noise, at its
/// typical size and smaller. Power by formula, checked by really injecting some and running the search.
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/experiment/experiment.h"
#include "diagnosis/selection/effect_search.h"

namespace sparflow {

enum class Visibility {
  kSeen,       ///< at its typical size it would be named, alone or in a set
  kOnlyLarge,  ///< only if it were larger than typical
  kNever       ///< not from these logs; the reason says why
};
const char* visibility_name(Visibility visibility);  ///< "seen" "only_large" "never"

/// A parameter's value as users read it.
struct ShownValue {
  std::string name, unit;
  double value = 0.0;
};

/// What could stand in an effect's place.
struct Confusion {
  std::string key;
  double nats = 0.0;   ///< how much better the true effect would explain the logs
  double share = 0.0;  ///< of the effect's signature that the other one imitates, 0..1
};

struct InjectedEffect {
  EffectAt effect;
  std::string id, at, stage;  ///< at "" for the whole machine
  Visibility visibility = Visibility::kNever;
  std::string reason;               ///< why never, why only large: a phrase; "" when seen
  std::vector<ShownValue> typical;  ///< size injected
  double gain = 0.0;                ///< [nats] expected at the typical size, before the price
  double power = 0.0;               ///< chance to be named at the typical size
  /// Named with 80 % and 95 % power from this many times the typical size; infinity = at no plausible size.
  double times80 = std::numeric_limits<double>::infinity();
  double times95 = std::numeric_limits<double>::infinity();
  std::vector<ShownValue> smallest;  ///< parameters at `times80`; empty = never
  double size = 0.0;                 ///< typical size where it acts / noise of the channel
  double absorbed = 0.0;             ///< share that learned laws imitate, with the references given
  double absorbed_alone = 0.0;       ///< the same without references
  std::vector<Confusion> confused_with;  ///< below SearchOptions::same_nats, likest first
  std::string separated_by;              ///< motion that tells it from those

  std::string key() const { return at.empty() ? id : id + ":" + at; }
};

/// An effect really added to noise drawn anew, and what the search said.
struct InjectionCheck {
  std::string key, stage;
  double power = 0.0;      ///< predicted
  bool predicted = false;  ///< to be named
  bool named = false;      ///< alone or in a set
  std::string answer;      ///< what was named, "" = nothing
  bool as_predicted() const { return predicted == named; }
};

/// Sets for which the separating motion is looked for, and that a screen shows.
inline constexpr std::size_t kSetsWithMotion = 6;

struct Selftest {
  std::vector<InjectedEffect> effects;  ///< in the catalogue's order, by stage
  std::vector<InjectionCheck> checks;
  std::vector<std::vector<std::string>> sets;  ///< keys that these logs cannot tell apart
  std::vector<Experiment> experiments;  ///< what to record for the first kSetsWithMotion sets
  double threshold = 0.0;               ///< [nats] a gain beyond its price must reach
  double false_alarm = 0.05;
  double least_gain = 10.0;              ///< [nats], as SearchOptions has it
  double samples = 0.0, duration = 0.0;  ///< of the logs, [s]
  std::size_t logs = 0, references = 0;
  std::vector<std::string> notes;
  double seconds = 0.0;

  int count(Visibility visibility) const;
  std::string headline() const;  ///< one sentence
  std::string table() const;     ///< one screen for a terminal
  std::string json() const;
};

struct SelftestOptions {
  SignalOptions signals;
  SearchOptions search;
  int check = 6;  ///< effects that are really injected
  /// Effects; empty = the whole catalogue on this machine but what the model has.
  std::vector<EffectAt> candidates;
};

/// @param model its effects count as known  @param references logs that pin what is learned; may be empty
/// @throws InputError when there is no log
Selftest selftest(const CraneModel& model, const std::vector<Log>& logs,
                  const std::vector<Log>& references = {}, const SelftestOptions& options = {},
                  const SearchProgress& progress = {});

/// One injection: fresh noise as `fit` has it plus the design's action at `theta` in the channels it touches, searched
/// for everything that acts there.
InjectionCheck inject_and_search(const Evidence& evidence, const EffectFit& fit,
                                 const EffectDesign& design, const Eigen::VectorXd& theta,
                                 const std::vector<EffectAt>& candidates,
                                 const SearchOptions& options, unsigned seed);

}  // namespace sparflow
