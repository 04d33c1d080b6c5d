#pragma once
/// Logs, tests and options of one extension: learns models with other effects and judges them. Used by extend.cpp
/// only.
#include <string>
#include <vector>

#include "identification/extend.h"

namespace sparflow {

/// Where a model's effects sit, in its order.
std::vector<EffectAt> places_of(const std::vector<AppliedEffect>& effects);

/// A model with the error it makes on what it is judged by.
struct Judged {
  CraneModel model;
  CompareResult error;
};

class Workshop {
 public:
  /// @param references empty: everything is learned again for each model; else only effects are
  Workshop(const CraneModel& model, const std::vector<Log>& logs,
           const std::vector<Log>& references, const std::vector<Log>& tests,
           const ExtendOptions& options);

  const std::string& judged_on() const { return judged_on_; }

  /// What a step is to be compared with: the model as it is, where it was learned from these very logs and test
  /// logs judge it, or where it stays (references). Else the model learned from them with the effects it has: what
  /// other logs or other samples change is no gain of an effect.
  /// @param notes gets a sentence when it had to be learned again
  Judged as_it_is(const CraneModel& model, std::vector<std::string>& notes,
                  const SearchProgress& progress) const;

  /// Estimates these effects and learns everything around them. What the logs do not show stays as in `from`.
  /// @param notes of the estimate; may be null
  Judged with(const CraneModel& from, const std::vector<EffectAt>& effects,
              const SearchProgress& progress, std::vector<std::string>* notes = nullptr) const;

  /// Logs learned and judged on, for the record.
  std::vector<DataSource> data() const;

 private:
  bool knows_logs(const CraneModel& model) const;
  CompareOptions compare_options() const;
  CompareResult judge(const CraneModel& model) const;

  const Machine& machine_;
  const std::vector<Log>& logs_;
  const std::vector<Log>& tests_;
  const ExtendOptions& options_;
  std::vector<MachineSignals> signals_, references_, test_signals_;
  std::vector<Mask> held_;  // by log; empty: nothing is held out
  std::string judged_on_;
};

}  // namespace sparflow
