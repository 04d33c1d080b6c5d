#pragma once
/// Which physical effect is missing: evidence from logs, a search with controlled false alarm, a verdict with its
/// proofs. docs/diagnose.md tells the method; effect_search.h is the search, unexplained.h what is left over.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/experiment/experiment.h"
#include "diagnosis/selection/effect_search.h"
#include "identification/data_checks/bad_data.h"

namespace sparflow {

enum class Verdict { kMissing, kNone, kUnknown, kBadData };
const char* verdict_name(Verdict verdict);  ///< "missing" "none" "unknown" "bad_data"

/// A parameter as users read it.
struct ParameterEstimate {
  std::string name, unit, meaning;
  double value = 0.0, lower95 = 0.0, upper95 = 0.0;  ///< in `unit`
};

/// Error of one evidence channel without and with one effect, all others in.
struct ChannelGain {
  std::size_t channel = 0;                                        ///< index into Evidence::channels
  double rmse_before = 0.0, rmse_after = 0.0, noise_floor = 0.0;  ///< SI; floor NaN = not known
};

struct DiagnosedEffect {
  EffectAt effect;
  std::string id, at, stage;  ///< at "" for the whole machine
  double probability = 0.0;   ///< that it is this effect and not chance or one of its rivals
  std::vector<ParameterEstimate> parameters;
  AppliedEffect applied;              ///< the same in SI, ready for a model
  std::vector<ChannelGain> channels;  ///< most improved first
  double p_value = 1.0;               ///< of the gate
  double gain = 0.0;                  ///< [nats] of log likelihood
  double held_out_gain = 0.0,
         held_out_error = 0.0;  ///< [nats] and standard error, over motions left out
  double absorbed = 0.0;        ///< share that a refitted model would swallow
  /// Rivals that explain the same data as well, with how much worse they are [nats], best first.
  std::vector<std::pair<std::string, double>> rivals;
  std::vector<std::string> evidence;  ///< whole sentences

  std::string key() const { return at.empty() ? id : id + ":" + at; }
};

/// What neither model nor catalogue explains.
struct Unexplained {
  std::string stage, at;
  std::vector<std::string>
      depends_on;      ///< signals, strongest first; "time, 1.13 Hz" for something periodic
  double share = 0.0;  ///< of what can be explained at that place, not by the catalogue
  double rmse = 0.0, noise_floor = 0.0;  ///< SI
  FieldUnit unit;
  std::string sentence;  ///< where it is largest, in words
  bool few_places =
      false;  ///< an effect would explain it, but it happened in one place or few (incident.h)
};

struct Diagnosis {
  Verdict verdict = Verdict::kNone;
  double p_value = 1.0;                  ///< that nothing is missing
  std::vector<DiagnosedEffect> effects;  ///< most probable first; all found, see `named`
  std::vector<std::vector<std::string>> indistinguishable;
  std::vector<Experiment> experiments;  ///< one for each of these sets
  std::optional<Unexplained> unexplained;
  /// Largest share of what can be explained in a channel of a found effect that the catalogue does not explain.
  double leftover_share = 0.0;
  std::vector<BadChannel> bad;
  std::vector<std::pair<std::string, double>>
      ranking;  ///< first step: key, penalised gain [nats], best first
  std::vector<std::string> notes;
  double seconds = 0.0;

  Evidence evidence;    ///< what pages draw
  SearchResult search;  ///< raw numbers; `final.residual` belongs to `evidence.channels`

  std::string headline() const;  ///< one sentence
  std::string table() const;     ///< one screen for a terminal
  std::string json() const;      ///< keys of the contract and more

  // Defaulted where they are defined: compiled once, not in every file that copies one.
  Diagnosis();
  Diagnosis(const Diagnosis&);
  Diagnosis(Diagnosis&&) noexcept;
  Diagnosis& operator=(const Diagnosis&);
  Diagnosis& operator=(Diagnosis&&) noexcept;
  ~Diagnosis();
};

/// More than this share of what can be explained in a channel explained by signals and not by the catalogue: the
/// cause is not in the catalogue.
inline constexpr double kLargestLeftoverShare = 0.05;
/// The same of an event beside an effect: what the effect's form leaves is largest where it acts most, too.
inline constexpr double kLargestEventShare = 0.25;

struct DiagnoseOptions {
  SignalOptions signals;
  SearchOptions search;
  bool check_data = true;
  /// Candidates; empty = the whole catalogue on this machine.
  std::vector<EffectAt> candidates;
};

/// @param model its effects count as known
/// @param logs with what may be missing  @param references of the same machine without it; may be empty
/// @throws InputError when there is no log
Diagnosis diagnose(const CraneModel& model, const std::vector<Log>& logs,
                   const std::vector<Log>& references = {}, const DiagnoseOptions& options = {},
                   const SearchProgress& progress = {});

/// The same on signals already made, without looking for bad channels.
Diagnosis diagnose_signals(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                           const std::vector<MachineSignals>& references,
                           const DiagnoseOptions& options = {},
                           const SearchProgress& progress = {});

}  // namespace sparflow
