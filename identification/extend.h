#pragma once
/// Adds effects to a model: the parameters of all its effects by one regression on the logs, everything learned
/// fitted again around them, and the error before and after on data that took no part. `improve` repeats diagnosis
/// and extension until nothing more is found. docs/diagnose.md has the method.
#include <memory>
#include <string>
#include <vector>

#include "identification/diagnose.h"
#include "identification/fit.h"

namespace sparflow {

/// How much a change moved the error: geometric means of RMS error after / before over everything compared, weighted
/// with the number of samples. 1 = nothing changed, below 1 = better.
struct ErrorChange {
  double overall = 1.0;
  double own_stage = 1.0;  ///< of the stage the change belongs to; of a sensor's, as overall
  /// Beyond what refitting alone moves.
  bool worse() const;
};

struct ExtendStep {
  std::string added;            ///< "coulomb_friction:boom"
  std::string removed;          ///< the same of an effect taken back
  std::string title;            ///< "Coulomb friction of boom"
  std::string stage;            ///< force, flow, pressure, pump, sensor
  AppliedEffect effect;         ///< as it was estimated in this step
  CompareResult before, after;  ///< what they compare: `judged_on`
  std::string judged_on;  ///< "test logs", "held-out motions" or "the logs it was learned from"
  ErrorChange change;
  /// That asked for it; absent when the user did. Steps of one diagnosis share it.
  std::shared_ptr<const Diagnosis> diagnosis;
};

struct ExtendResult {
  CraneModel model;  ///< with the effects, and the steps as a record
  std::vector<ExtendStep> steps;
  std::vector<ExtendStep> rejected;  ///< tried by `improve`, not kept: they made the error worse
  std::string stopped_because;
  std::shared_ptr<const Diagnosis> last;  ///< of `improve`: the diagnosis after the last step
  std::vector<std::string> notes;         ///< whole sentences
  double seconds = 0.0;

  std::string brief() const;  ///< one sentence
  std::string table() const;  ///< one screen: error falling step by step
  std::string json() const;   ///< keys of the contract and more
};

struct ExtendOptions {
  FitOptions fit;            ///< its effects are not looked at
  DiagnoseOptions diagnose;  ///< of `improve`
  /// Logs of the same machine without the effects: what the model has learned then stays as it is and only effects'
  /// parameters are estimated. `improve` has a parameter of its own for them.
  std::vector<Log> references;
  int max_steps = 6;  ///< of `improve`
  std::string date;   ///< "2025-03-14" for the record; empty = not recorded
};

/// @param add effects in the order they are added, one step each; none that the model has already
/// @param logs with the effects: parameters and everything learned come from them. What they do not show stays as it
///        was learned before.
/// @param tests logs to judge the error on; without any, motions are held out of `logs`
/// @throws InputError for an effect that the model has, and when the logs do not show it
ExtendResult extend(const CraneModel& model, const std::vector<EffectAt>& add,
                    const std::vector<Log>& logs, const std::vector<Log>& tests,
                    const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// Adds what `diagnose` finds and diagnoses again, until it finds nothing more, a change makes the error worse
/// (that one is not kept), data is bad, or `max_steps` are done; `stopped_because` says which.
/// @param references as in ExtendOptions
ExtendResult improve(const CraneModel& model, const std::vector<Log>& logs,
                     const std::vector<Log>& references, const std::vector<Log>& tests,
                     const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// Takes an effect back out and learns the rest again. @throws InputError when the model does not have it
ExtendResult take_back(const CraneModel& model, const EffectAt& effect,
                       const std::vector<Log>& logs, const std::vector<Log>& tests,
                       const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// @param stage of the change: force, flow, pressure, pump; else only `overall` is told apart
ErrorChange error_change(const CompareResult& before, const CompareResult& after,
                         const std::string& stage);

/// "Coulomb friction of boom"
std::string effect_title(const EffectInfo& info, const Machine& machine, int at);

}  // namespace sparflow
