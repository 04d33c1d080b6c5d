#pragma once
/// Adds an effect to a model: its parameters by the diagnosis' regression, everything learned refitted jointly, and
/// the error before and after on logs that took no part. `improve` repeats until nothing is missing.
#include "identification/diagnose.h"
#include "identification/fit.h"

namespace sparflow {

struct ExtendStep {
  std::string added;  ///< "coulomb_friction:boom"
  AppliedEffect effect;
  CompareResult before, after;         ///< on the test logs, else on held-out motions (`judged_on`)
  std::string judged_on;               ///< "test logs" or "held-out motions"
  std::optional<Diagnosis> diagnosis;  ///< that asked for it; absent when the user did
};

struct ExtendResult {
  CraneModel model;  ///< with the effects and the steps
  std::vector<ExtendStep> steps;
  std::string stopped_because;
  std::optional<Diagnosis> last;  ///< of `improve`: the diagnosis that found nothing more

  std::string table() const;  ///< one screen: error falling step by step
  std::string json() const;
};

struct ExtendOptions {
  FitOptions fit;
  DiagnoseOptions diagnose;
  int max_steps = 6;
};

/// @param add effects in the order they are added
ExtendResult extend(const CraneModel& model, const std::vector<EffectAt>& add,
                    const std::vector<Log>& logs, const std::vector<Log>& tests,
                    const ExtendOptions& options = {}, const SearchProgress& progress = {});

ExtendResult improve(const CraneModel& model, const std::vector<Log>& logs,
                     const std::vector<Log>& references, const std::vector<Log>& tests,
                     const ExtendOptions& options = {}, const SearchProgress& progress = {});

/// Takes an added effect back out and refits. @throws InputError when the model does not have it
ExtendResult take_back(const CraneModel& model, const EffectAt& effect,
                       const std::vector<Log>& logs, const std::vector<Log>& tests,
                       const ExtendOptions& options = {});

}  // namespace sparflow
