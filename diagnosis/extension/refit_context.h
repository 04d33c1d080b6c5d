#pragma once
/// The refit context: logs, options and held-out motions of one extension, on which models with other effects are
/// learned and judged. Used in diagnosis/extension only.
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/extension/error_beside_laws.h"
#include "diagnosis/extension/extend.h"
#include "diagnosis/selection/effect_estimate.h"

namespace sparflow {

/// The model's effects without their values, in its order.
std::vector<EffectAt> places_of(const std::vector<AppliedEffect>& effects);

/// A model with its error on the data it is judged by.
struct Judged {
  CraneModel model;
  CompareResult error;
  /// Its effects estimated without the held-out motions; as in the model where nothing is held out.
  std::vector<AppliedEffect> effects_held_out;
};

/// Models of one set of effects, each of which was estimated without one fold of the motions, and their errors there.
struct CrossValidated {
  std::vector<CraneModel>
      models;  ///< by fold; forces, flows and effects only. One of all rows where nothing is held out.
  CompareResult errors;  ///< of forces and flows
};

class RefitContext {
 public:
  /// Without references everything is learned again for each model, with them only the effects' parameters are.
  /// @param model, logs, options must outlive this
  RefitContext(const CraneModel& model, const ExtendLogs& logs, const ExtendOptions& options);

  const std::string& judged_on() const { return judged_on_; }
  /// What the data checks set aside, a sentence for each channel.
  const std::vector<std::string>& set_aside() const { return set_aside_; }
  const ExtendOptions& options() const { return options_; }
  const Machine& machine() const { return machine_; }

  /// The model that a first step is compared with. It is the model as it is when it was learned from these logs and
  /// test logs judge it, else the model learned again from them with its own effects, so that a change of logs does not
  /// count as an improvement by an effect. With references, it is the model as it is when it was learned from them and
  /// not from the logs with the effects, else the model learned from the references.
  /// @param notes gets a sentence when the model had to be learned again
  Judged as_it_is(const CraneModel& model, std::vector<std::string>& notes,
                  const SearchProgress& progress) const;

  /// Estimates these effects together and learns everything else with them. What the logs do not show stays as in `from`.
  /// @param notes gets those of the estimate; may be null
  Judged with(const Judged& from, const std::vector<EffectAt>& effects,
              const SearchProgress& progress, std::vector<std::string>* notes = nullptr) const;

  /// The model with these effects, estimated together; what is learned stays.
  CraneModel estimated(CraneModel model, const std::vector<EffectAt>& effects,
                       const SearchProgress& progress) const;

  /// The effects estimated, and the valve gains learned, without the motions that they are judged on. Pressures take no
  /// part, so that this takes a fraction of the time of `with`.
  CrossValidated cross_validated(const CraneModel& from, const std::vector<EffectAt>& effects,
                                 const SearchProgress& progress) const;
  /// The same with other effects. Only those are estimated anew that show in the quantities in which a changed one
  /// shows, directly or through others; the rest does not depend on it.
  /// @param changed effects that `was` has and `effects` does not, or the other way round
  CrossValidated cross_validated(const CrossValidated& was, const std::vector<EffectAt>& effects,
                                 const std::vector<EffectAt>& changed,
                                 const SearchProgress& progress) const;

  /// Change of the error of the pressures in which an effect shows: `after` has the effect, `before` does not. Both are
  /// counted on the motions left out, beside laws that are fitted to these.
  PressureChange pressure_change(const EffectAt& effect, const CraneModel& from,
                                 const CrossValidated& before, const CrossValidated& after) const;

  /// Errors of forces and flows on the test logs, which may contradict an effect; without test logs empty.
  std::optional<CompareResult> tested_errors(const CraneModel& from,
                                             const std::vector<EffectAt>& effects,
                                             const SearchProgress& progress) const;

  /// Data on which a cross-validation judges, as `judged_on` names it.
  std::string measured_on() const { return folds_.empty() ? judged_on_ : "held-out motions"; }

  /// Training and test logs, for the record.
  std::vector<DataSource> data() const;

 private:
  /// A set of effects, and those of them that are estimated; the others keep their values.
  struct EffectSet {
    const std::vector<EffectAt>& all;
    const std::vector<EffectAt>& estimated;
  };
  /// @param base its effects that are not in the set are left out  @param leave_out [logs] masks; empty = none
  EffectEstimate estimate(CraneModel base, const EffectSet& effects,
                          const std::vector<Mask>& leave_out, const SearchProgress& progress) const;
  /// The model of forces and flows with these effects, estimated and learned without some samples.
  /// @param left_out [logs] masks of these samples; empty = none
  CraneModel measured_model(const CraneModel& from, const EffectSet& effects,
                            const std::vector<Mask>& left_out,
                            const SearchProgress& progress) const;
  /// Folds of the cross-validation; where nothing is held out a single one without samples.
  std::size_t fold_count() const { return std::max<std::size_t>(1, folds_.size()); }
  const std::vector<Mask>& fold(std::size_t f) const;
  /// Joint errors of one model for each fold, on that fold's samples.
  CompareResult errors_on_folds(const std::vector<CraneModel>& models) const;
  /// Evidence of the channels in which an effect shows, on the samples of one fold alone.
  /// @param effects of the model  @param from gives the pump's margins
  Evidence evidence_on_fold(std::size_t f, const EffectAt& effect, CraneModel from,
                            const std::vector<AppliedEffect>& effects) const;
  Judged as_references_say(const CraneModel& model, std::vector<std::string>& notes,
                           const SearchProgress& progress) const;
  CompareOptions compare_options() const;
  CompareResult judge(const CraneModel& model) const;

  const Machine& machine_;
  const ExtendLogs& logs_;
  const ExtendOptions& options_;
  std::vector<MachineSignals> signals_, references_, test_signals_;
  std::vector<AppliedEffect>
      in_references_;                     // effects that act in the references, whose values stay
  std::vector<Mask> held_;                // held-out samples, by log; empty: nothing is held out
  std::vector<std::vector<Mask>> folds_;  // of a cross-validation; empty: nothing is held out
  std::string judged_on_;
  std::vector<std::string> set_aside_;
};

}  // namespace sparflow
