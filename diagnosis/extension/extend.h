#pragma once
/// Adds effects to a model: the parameters of all its effects by one regression on the logs, everything learned
/// fitted again around them, and the error before and after on data that took no part. `improve` repeats diagnosis
/// and extension until nothing more is found. docs/diagnose.md has the method.
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/verdict/diagnose.h"
#include "identification/comparison/error_change.h"
#include "identification/learning/fit.h"

namespace sparflow {

struct ExtendStep {
  std::string added;            ///< "coulomb_friction:boom"
  std::string removed;          ///< the same of an effect taken back
  std::string title;            ///< "Coulomb friction of boom"
  std::string stage;            ///< force, flow, pressure, pump, sensor
  AppliedEffect effect;         ///< as it was estimated in this step
  CompareResult before, after;  ///< what they compare: `judged_on`
  std::string judged_on;        ///< "test logs", "held-out motions" or "training logs"
  ErrorChange change;
  bool others_kept = false;  ///< the effects that were there before kept their values
  std::string same_as;  ///< title of an effect of the model that these logs cannot tell it from
  /// That asked for it; absent when the user did. Steps of one diagnosis share it.
  std::shared_ptr<const Diagnosis> diagnosis;
};

struct ExtendResult {
  CraneModel model;  ///< with the effects, and the steps as a record
  std::vector<ExtendStep> steps;
  std::vector<ExtendStep>
      rejected;  ///< tried by `improve`, not kept: data that took no part spoke against them
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
  int max_steps = 8;  ///< of `improve`
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

/// Adds what `diagnose` finds and diagnoses again, until it finds nothing more, data is bad, or `max_steps` are done;
/// `stopped_because` says which. Of several effects found the one that takes most of an error away comes first. A
/// step is kept when data that took no part is predicted better where the effect acts and nothing else worse
/// (error_change.h); if not, it is tried once more with the other effects as they are, for estimated anew
/// together they may give way to an error of one place at the cost of another. What is not kept is left aside until
/// another step is.
/// @param references as in ExtendOptions
ExtendResult improve(const CraneModel& model, const std::vector<Log>& logs,
                     const std::vector<Log>& references, const std::vector<Log>& tests,
                     const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// Takes an effect back out and learns the rest again. @throws InputError when the model does not have it
ExtendResult take_back(const CraneModel& model, const EffectAt& effect,
                       const std::vector<Log>& logs, const std::vector<Log>& tests,
                       const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// "Coulomb friction of boom"
std::string effect_title(const EffectInfo& info, const Machine& machine, int at);

}  // namespace sparflow
