#pragma once
/// Adds effects to a model: one regression on the logs estimates the parameters of all its effects, everything learned
/// is then fitted again with them, and the error is compared before and after on data that took no part. `improve`
/// repeats diagnosis and extension until no further effect is found. docs/diagnose.md describes the method.
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/verdict/diagnose.h"
#include "identification/comparison/error_change.h"
#include "identification/comparison/model_change.h"
#include "identification/learning/fit.h"
#include "models/math/journal.h"

namespace sparflow {

struct ExtendStep {
  std::string added;            ///< key of the effect added, "coulomb_friction:boom"
  std::string removed;          ///< key of the effect removed
  std::string title;            ///< "Coulomb friction, boom"
  std::string stage;            ///< force, flow, pressure, pump, sensor
  AppliedEffect effect;         ///< the effect as estimated in this step
  CompareResult before, after;  ///< errors on the data that `judged_on` names
  std::string judged_on;        ///< "test logs", "held-out motions" or "training logs"
  ErrorChange change;
  bool determined = true;  ///< false: its 95 % interval contains no effect at all; `improve` only
  /// The diagnosis that named it, shared by its steps; null when the user asked for the effect.
  std::shared_ptr<const Diagnosis> diagnosis;
};

struct ExtendResult {
  CraneModel model;  ///< with the effects, and with the steps as a record
  std::vector<ExtendStep> steps;
  std::vector<ExtendStep>
      rejected;  ///< steps tried by `improve` and not kept, because held-out errors rose
  std::string stopped_because;            ///< a phrase, with the effects tried and not kept
  std::string reason;                     ///< the same without these effects
  std::shared_ptr<const Diagnosis> last;  ///< the diagnosis after the last step; `improve` only
  std::vector<std::string> notes;         ///< whole sentences
  bool interrupted = false;               ///< `improve` ended early; the steps done are kept
  double seconds = 0.0;

  /// What all steps together did to each quantity; empty quantities where there is no step.
  ModelChange change() const;
  /// Good only when nothing became worse on logs that took no part in the estimate; of no step, good when none was rejected.
  Grade grade() const;
  std::string brief() const;  ///< one sentence, the headline of all outputs
  std::string table() const;  ///< one screen: error falling step by step
  std::string json() const;   ///< keys of the contract and more
};

/// The logs by which a model is extended, by what they are for.
struct ExtendLogs {
  /// With the effects: effects' parameters and everything learned come from them. What they do not show stays as it was
  /// learned before.
  std::vector<Log> suspects;
  /// Of the same machine without the effects: what the model has learned then stays as it is, and only the parameters of
  /// effects are estimated. May be empty.
  std::vector<Log> references = {};
  std::vector<Log> tests = {};  ///< test logs; without any, motions are held out of `suspects`
};

struct ExtendOptions {
  FitOptions fit;             ///< its `effects` are not used
  DiagnoseOptions diagnose;   ///< used by `improve` only
  ErrorChangeOptions change;  ///< whether a step is kept
  /// Largest number of steps that `improve` keeps.
  /// @threshold [steps] 0..; chosen: above the ten that stay on logs of a real crane with two cylinders before nothing more
  /// is found
  int max_steps = 12;
  /// Steps that `improve` may reject before it stops.
  /// @threshold [steps] 0..; chosen: as many as it may keep, because each may need another
  /// diagnosis.
  std::size_t most_rejected = 8;
  /// Change of an error's logarithm below which `improve` takes it that the motions do not show an
  /// effect at all.
  /// @threshold [1] 0..0.02; chosen: a twentieth of what learning anew may change
  /// (ErrorChangeOptions::refit_moves)
  double unmoved = 1e-3;
  /// Folds of the cross-validation by which `improve` judges effects.
  /// @threshold [folds] 2..10; chosen: with two, half of the motions of a few short logs did not
  /// determine a mass with its two moments, which all of them do
  int folds = 4;
  /// Keeps each round of `improve` that another one follows, so that a run that was ended can be resumed; null: none is kept.
  /// It must outlive the run, and belong to these options, this model and these logs.
  Journal* journal = nullptr;
  std::string date;  ///< "2025-03-14" for the record; empty = not recorded
};

/// @param add effects in the order they are added, one step each; none that the model has already
/// @throws InputError for an effect that the model has already, and for one that acts on no channel of the logs
ExtendResult extend(const CraneModel& model, const std::vector<EffectAt>& add,
                    const ExtendLogs& logs, const ExtendOptions& options = {},
                    const SearchProgress& progress = {});

/// Adds all effects that a diagnosis names and diagnoses again, until none is named, data is bad, or `max_steps` are done;
/// `stopped_because` says which. The effects of a diagnosis are estimated together. Then each of them is taken out of the
/// set in turn: it stays if it reduces the error where it acts, on data that took no part, by more than refitting alone
/// may, or if motions do not show it at all (a leak acts at rest), and if its interval excludes zero; that it is no chance
/// finding, the diagnosis has tested. The one that fails most is removed, and the rest is tested again (backward
/// elimination). At the end the effects of all rounds are tested once more beside each other. Pressures, margins and gains
/// are learned anew for each step. Effects not kept are excluded until another round keeps one.
/// @param progress may throw Interruption: then the steps kept so far are the result
ExtendResult improve(const CraneModel& model, const ExtendLogs& logs,
                     const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// Removes an effect and learns the rest again. @throws InputError when the model does not have it
ExtendResult take_back(const CraneModel& model, const EffectAt& effect, const ExtendLogs& logs,
                       const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// The headline of a diagnosis with what its effects did to the errors on test logs, for all outputs.
/// @param tested the effects found, added to the model and judged on test logs; may be null
std::string headline_on_tests(const Diagnosis& diagnosis, const ExtendResult* tested);

/// "Coulomb friction, boom"
std::string effect_title(const EffectInfo& info, const Machine& machine, int at);

}  // namespace sparflow
