#pragma once
/// Diagnoses which physical effect a model lacks: evidence from logs, a search with a controlled false-alarm rate, and
/// a verdict with its evidence. docs/diagnose.md describes the method; effect_search.h has the search, residual_model.h
/// the search for unmodelled structure in the residual.
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/experiment/experiment.h"
#include "diagnosis/residual/residual_options.h"
#include "diagnosis/selection/effect_search.h"
#include "identification/data_checks/bad_data.h"

namespace sparflow {

enum class Verdict { kMissing, kNone, kUnknown, kBadData };
const char* verdict_name(Verdict verdict);  ///< "missing" "none" "unknown" "bad_data"

/// A parameter as reports show it, with its 95 % interval.
struct ParameterEstimate {
  std::string name, unit, meaning;
  double value = 0.0, lower95 = 0.0, upper95 = 0.0;  ///< in `unit`
  bool determined =
      true;  ///< whether the logs determine it (is_determined); if not, no output shows its value
  std::string variant = {};  ///< of a choice: the variant of the law, in words (variant_text)
};

/// Error of one evidence channel without and with one effect; all other found effects are included in both.
struct ChannelGain {
  std::size_t channel = 0;                                        ///< index into Evidence::channels
  double rmse_before = 0.0, rmse_after = 0.0, noise_floor = 0.0;  ///< SI; floor NaN = not known
  /// The same errors with the squares of each stretch of motion weighed by the inverse of its variance, where the
  /// search gave the stretches variances of their own; else NaN. [SI]
  double weighed_before = std::numeric_limits<double>::quiet_NaN(), weighed_after = weighed_before;
  /// What the references leave at the loads and speeds of the suspect logs (expected_rms in residual_levels.h), weighed as `after`.
  /// [SI] NaN without references.
  double in_references = std::numeric_limits<double>::quiet_NaN();

  /// The errors by which the search judged the effect: weighed where stretches have variances of their own. [SI]
  bool weighed() const { return weighed_before == weighed_before; }
  double before() const { return weighed() ? weighed_before : rmse_before; }
  double after() const { return weighed() ? weighed_after : rmse_after; }
};

struct DiagnosedEffect {
  bool change =
      false;  ///< whether it is another value of an effect that the model or the references have
  EffectAt effect;
  std::string id, at, stage;     ///< at "" for the whole machine
  double probability = 0.0;      ///< 0..1 that it is this effect and neither chance nor a rival
  double set_probability = 0.0;  ///< 0..1 that it is this effect or one of its rivals
  std::vector<ParameterEstimate> parameters;
  AppliedEffect applied;              ///< the same in SI, ready for a model
  std::vector<ChannelGain> channels;  ///< largest improvement first
  double p_value = 1.0;               ///< by the null distribution of the largest gain
  double gain = 0.0;                  ///< [nats] penalised
  double held_out_gain = 0.0,
         held_out_error = 0.0;  ///< [nats] gain on motions left out, and its standard error
  double absorbed = 0.0;        ///< 0..1 absorbed share
  /// Keys of rivals, best first, with how much smaller their gain is [nats].
  std::vector<std::pair<std::string, double>> rivals;
  std::vector<std::string> evidence;  ///< whole sentences

  std::string key() const { return at.empty() ? id : id + ":" + at; }
  /// The probability as reports show it: whole percent, rounded down, so that none that is short of certain shows 100. [%]
  double shown_probability() const;
};

/// A part of the residual that neither model nor catalogue explains.
struct Unexplained {
  std::string stage, at;
  std::vector<std::string>
      depends_on;      ///< signals, strongest first; "time, 1.13 Hz" for a periodic one
  double share = 0.0;  ///< 0..1 of the residual's variance at that place
  double rmse = 0.0, noise_floor = 0.0;  ///< SI
  FieldUnit unit;
  std::string sentence;  ///< where and how large it is
  bool few_places =
      false;  ///< whether it is an isolated event, which an effect would explain (isolated_event.h)
  std::size_t channel = 0;  ///< index into Evidence::channels
};

/// A channel in which the references differ more from the model than the suspect logs do (reference_faults.h).
struct ReferenceFault {
  std::string text;  ///< "force of boom"
  FieldUnit unit;
  double in_references = 0.0, in_log = 0.0;  ///< [SI] RMS of the model's residual
  std::string sentence() const;
};

/// Thresholds by which a verdict follows from effects found and unmodelled structure.
struct VerdictOptions {
  /// Unmodelled share of a channel (unmodelled_structure.h) above which a cause is not in the
  /// catalogue.
  /// @threshold [1] 0..1; chosen: a twentieth of the squared error that effects and residual model
  /// explain together, that is a fifth of its amplitude.
  double largest_unmodelled_share = 0.05;
  /// The same share for an isolated event.
  /// @threshold [1] 0..1; chosen: larger than for other structure, because the model-form error of
  /// an effect is also concentrated where the effect acts most.
  double largest_event_share = 0.25;
  /// Error at an effect's place over the sensors' noise there, above which the effect may be a
  /// minor one.
  /// @threshold [1] 1..; tuned: in 72 tuning logs with one or two effects (seeds from 700 on) no
  /// true effect leaves more than 4.6 times the noise, and the one name above five times was false
  /// (docs/history/diagnosis.md).
  double far_above_noise = 5.0;
  /// Share of the squared error beyond noise that all effects must explain where an effect's place
  /// keeps a large error, else the effect is a minor one, in logs without references. Beside references `least_excess_explained` counts.
  /// @threshold [1] 0..1; chosen: four fifths; what stays has less than half the amplitude of what
  /// was there. On the tuning logs no true effect comes as far as this test
  /// (docs/history/diagnosis.md).
  double least_explained_share = 0.8;
  /// RMS of a pump pressure's error inside its jumps over the robust standard deviation of the
  /// rest, up to which known physics explains the jumps and the sensor is not faulty.
  /// @threshold [1] 1..; chosen: three standard deviations of the rest, as chance alone exceeds them in 0.3 % of samples;
  /// it was not tuned.
  double largest_in_jumps = 3.0;
  /// Probability from which an effect is one to report by itself and to add to a model, and not
  /// only a member of a set.
  /// @threshold [1] 0..1; derived: more probable than chance and all rivals together.
  double least_probability = 0.5;
  /// Probability, over all channels together, with which equal residuals are taken for larger ones in the suspect logs
  /// than in the references (Welch's test on the levels of blocks, Bonferroni's bound over the channels), and, over all
  /// structures, unrelated ones for opposite ones (Student's test on the suspect logs' blocks). What is neither is no change.
  /// @threshold [1] 0..1; chosen: one log in a hundred
  double structure_false_alarm = 0.01;
  /// RMS of a channel's residual over that in the references, above which it is a difference although no effect and no signal
  /// explains it, of a structure in it over that of one in the references or over what they leave there beyond the sensors' noise,
  /// below which it may be shared, and of what an effect leaves over what the references leave, above which it may be a minor one.
  /// @threshold [1] 1..; chosen: other motions alone change it by half; of twice the error three quarters of the square are new
  double least_excess_ratio = 2.0;
  /// Probability, over all effects found together, with which an effect is taken for a change although its size differs
  /// from that in the references no more than from motion to motion; and with which its gains on motions left out are chance.
  /// @threshold [1] 0..1; chosen: one log in a hundred
  double difference_false_alarm = 0.01;
  /// The same probability for a difference that is a change by its size alone, whatever the residual says.
  /// @threshold [1] 0..1; tuned on seeds 14..21 of plant_verdicts: true changes behind large residuals have 0.0002 and less, untrue ones
  /// 0.0014 and more
  double difference_alone_false_alarm = 0.001;
  /// Chance of a residual that exceeds that of the references so far without a found effect, and of what the effect predicts of motions left
  /// out, from which on the effect is no change but a law that is not exact, and of a gain of each group's own law over the one law of all
  /// logs, from which on they are two. The effect has passed the test above already.
  /// @threshold [1] 0..0.5; chosen: one in twenty, in the effect's own channels
  double excess_false_alarm = 0.05;
  /// Share of the squared residual beyond that of the references which a found effect must explain in such a channel.
  /// @threshold [1] 0..1; chosen: half; the motions of a log alone can make its residual larger, with the effect and without it
  double least_excess_explained = 0.5;
  /// Absorbed share of an effect from which its size in single motions is not compared, but its parameters in all of them.
  /// @threshold [1] 0..1; chosen: more of it is learned than left
  double absorbed_by_learned_laws = 0.5;
  /// NoiseOptions::block_freedom in the second search of a comparison with references, where the first, with one variance for all
  /// blocks, names nothing: what a law lacks is rarely alike in all motions, and a few of large residuals would hide a change that all
  /// others show.
  /// @threshold [rows] 0..; chosen: a tenth of the rows of a stretch of motion, whose variance is then that of its own residual but for
  /// a tenth
  double block_freedom = 10.0;
  /// Searches in which an effect that the references share joins what acts in all logs.
  /// @threshold [1] 1..; chosen: each removes what the last one named in both; plants of the simulator need up to six
  int shared_turns = 10;
  /// Largest number of effects that references may show the model to lack, for each cylinder of the machine.
  /// @threshold [effects] 1..20; chosen: a guard, above what plants of the simulator need (seven: three of friction, the valve's dead
  /// band, lag and pressure drop, compressibility). With four the search ended before the dry friction of two cylinders, which was
  /// then noise of 4.4 kN beside a viscous friction of 2 kN
  int effects_lacking_by_cylinder = 10;
  /// Factor by which an effect must reduce a channel's error to be named, and for that to be stated as evidence.
  /// @threshold [1] 1..; chosen: two percent; less is no evidence to a reader, and true effects reduce more (docs/history/references.md).
  double least_reduction = 1.02;
  /// Absorbed share above which the table states it.
  /// @threshold [1] 0..1; chosen: a twentieth; the table states what matters.
  double least_absorbed_stated = 0.05;
};

struct Diagnosis {
  VerdictOptions thresholds;  ///< by which it was made
  Verdict verdict = Verdict::kNone;
  double p_value = 1.0;                  ///< of the best candidate if nothing is missing
  std::vector<DiagnosedEffect> effects;  ///< most probable first; all found, see `named`
  std::vector<std::vector<std::string>> indistinguishable;
  std::vector<Experiment> experiments;  ///< one for each of these sets
  std::optional<Unexplained> unexplained;
  /// What the model lacks in the references as in the suspect logs, so that it is no change: effects and structure.
  std::vector<DiagnosedEffect> lacking;
  std::vector<Unexplained> shared_structure;
  /// Of the channels in which a difference was found, or something stays unexplained; largest ratio first.
  std::vector<ReferenceFault> reference_faults;
  /// Largest unmodelled share (unmodelled_structure.h) of the channels in which a found effect acts. 0..1
  double unmodelled_share = 0.0;
  std::vector<BadChannel> set_aside;  ///< faulty channels and stretches, which took no part
  std::vector<std::pair<std::string, double>>
      ranking;  ///< first step: key, penalised gain [nats], best first
  std::vector<std::string> notes;
  /// Whether the search gave each stretch of motion a variance of its own (VerdictOptions::block_freedom).
  bool stretches_weighed = false;
  double seconds = 0.0;

  Evidence evidence;    ///< for the charts of pages
  SearchResult search;  ///< raw numbers; `final.residual` belongs to `evidence.channels`

  /// Whether an effect is probable enough to be reported by itself.
  bool probable(const DiagnosedEffect& e) const {
    return e.set_probability >= thresholds.least_probability;
  }
  /// Whether headline and `effects` in JSON name an effect: it is probable, and the verdict is that something is missing.
  bool named(const DiagnosedEffect& e) const;
  const char* standing(const DiagnosedEffect& e) const;  ///< "named", or why it is not
  std::string headline() const;                          ///< one sentence
  /// The p-value in words: "0.02", or "below 0.0033" where the number of simulations allows no smaller one.
  std::string p_value_text() const;
  /// Weight of the rows of each block of a channel as the final fit weighs them: the inverse of the block's own variance, relative
  /// to the channel's. [blocks] Empty where all blocks have one variance.
  std::vector<double> block_weights(std::size_t channel) const;
  /// What a search with variances of the stretches of motion means for the reader; "" for a search without.
  std::string weighing_text() const;
  /// Why nothing is named, in a sentence: there is only noise, or what is more than noise is no difference, or no effect passes the
  /// tests. For the verdict none.
  std::string none_text() const;
  /// One screen for a terminal. @param first_line in place of the headline; empty = the headline
  std::string table(const std::string& first_line = "") const;
  std::string json() const;  ///< keys of the contract and more

  // Defaulted in diagnose.cpp, so that they are compiled only once.
  Diagnosis();
  Diagnosis(const Diagnosis&);
  Diagnosis(Diagnosis&&) noexcept;
  Diagnosis& operator=(const Diagnosis&);
  Diagnosis& operator=(Diagnosis&&) noexcept;
  ~Diagnosis();
};

struct DiagnoseOptions {
  SignalOptions signals;
  BadDataOptions bad_data;
  EvidenceOptions evidence;
  SearchOptions search;
  ResidualModelOptions residual;
  IsolatedEventOptions isolated_event;
  VerdictOptions verdict;
  ExperimentOptions experiment;
  bool check_data = true;
  /// Candidate effects; empty = the whole catalogue on this machine.
  std::vector<EffectAt> candidates;
};

/// @param model its effects count as known
/// @param logs suspect logs  @param references logs of the same machine without the missing effect; may be empty
/// @throws InputError when there is no log
Diagnosis diagnose(const CraneModel& model, const std::vector<Log>& logs,
                   const std::vector<Log>& references = {}, const DiagnoseOptions& options = {},
                   const SearchProgress& progress = {});

/// A channel of one suspect log, with its fault.
struct LogFault {
  std::size_t log = 0;  ///< index into DiagnosisSignals::suspects
  BadChannel channel;
};

/// Logs seen through a machine, with their faulty channels. Effects of a model change neither, so one value serves the
/// diagnoses of all models of the machine.
struct DiagnosisSignals {
  std::vector<MachineSignals> suspects;
  std::vector<MachineSignals> references = {};
  /// Faulty channels and stretches of the suspect logs, which `suspects` no longer contain.
  std::vector<LogFault> set_aside = {};
  /// The same of `references`.
  std::vector<BadChannel> set_aside_in_references = {};
  /// Jumps, which may be physics: in the order of the logs; and the logs without them, empty where a log has none.
  std::vector<LogFault> jumps = {};
  std::vector<MachineSignals> without_jumps = {};
};

/// @param logs, references as in `diagnose`  @throws InputError when there is no log
DiagnosisSignals diagnosis_signals(const Machine& machine, const std::vector<Log>& logs,
                                   const std::vector<Log>& references = {},
                                   const DiagnoseOptions& options = {});

/// The same as `diagnose` on signals already made. @param options its `signals`, `bad_data` and `check_data` are not used
Diagnosis diagnose_signals(const CraneModel& model, const DiagnosisSignals& signals,
                           const DiagnoseOptions& options = {},
                           const SearchProgress& progress = {});

}  // namespace sparflow
