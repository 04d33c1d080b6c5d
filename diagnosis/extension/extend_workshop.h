#pragma once
/// Logs, tests and options of one extension: learns models with other effects and judges them. Used by extend.cpp
/// only.
#include <string>
#include <vector>

#include "diagnosis/extension/extend.h"
#include "diagnosis/selection/effect_estimate.h"

namespace sparflow {

/// Where a model's effects sit, in its order.
std::vector<EffectAt> places_of(const std::vector<AppliedEffect>& effects);

/// A model with the error it makes on what it is judged by.
struct Judged {
  CraneModel model;
  CompareResult error;
  /// Its effects as estimated without the held-out motions; where nothing is held out, as in the model.
  std::vector<AppliedEffect> effects_held_out;
};

/// What happens to the effects a model has when one more comes in.
enum class Others { kEstimatedAnew, kKept };

class Workshop {
 public:
  /// @param references empty: everything is learned again for each model; else only effects are
  Workshop(const CraneModel& model, const std::vector<Log>& logs,
           const std::vector<Log>& references, const std::vector<Log>& tests,
           const ExtendOptions& options);

  const std::string& judged_on() const { return judged_on_; }

  /// What a step is to be compared with: the model as it is, where it was learned from these very logs and test
  /// logs judge it. Else the model learned from them with the effects it has: what other logs or other samples change
  /// is no gain of an effect. With references: the model as it is where it was learned from them and not from the logs
  /// with the effects, else as learned from them.
  /// @param notes gets a sentence when it had to be learned again
  Judged as_it_is(const CraneModel& model, std::vector<std::string>& notes,
                  const SearchProgress& progress) const;

  /// Estimates these effects and learns everything around them. What the logs do not show stays as in `from`.
  /// @param others kKept: only the last of `effects` is estimated, those before it are the model's and stay
  /// @param notes of the estimate; may be null
  Judged with(const Judged& from, const std::vector<EffectAt>& effects, Others others,
              const SearchProgress& progress, std::vector<std::string>* notes = nullptr) const;

  /// Logs learned and judged on, for the record.
  std::vector<DataSource> data() const;

 private:
  EffectEstimate estimate(const CraneModel& model, const std::vector<AppliedEffect>& known,
                          const std::vector<EffectAt>& effects, Others others,
                          const std::vector<Mask>& leave_out, const SearchProgress& progress) const;
  Judged as_references_say(const CraneModel& model, std::vector<std::string>& notes,
                           const SearchProgress& progress) const;
  CompareOptions compare_options() const;
  CompareResult judge(const CraneModel& model) const;

  const Machine& machine_;
  const std::vector<Log>& logs_;
  const std::vector<Log>& reference_logs_;
  const std::vector<Log>& tests_;
  const ExtendOptions& options_;
  std::vector<MachineSignals> signals_, references_, test_signals_;
  std::vector<AppliedEffect>
      in_references_;       // effects that the references have: they stay as they are
  std::vector<Mask> held_;  // by log; empty: nothing is held out
  std::string judged_on_;
};

}  // namespace sparflow
