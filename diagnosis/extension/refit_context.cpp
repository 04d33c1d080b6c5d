#include "diagnosis/extension/refit_context.h"

#include <fmt/format.h>

#include <algorithm>

#include "diagnosis/evidence/left_out_rows.h"
#include "identification/data_checks/set_aside.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

/// Signals of these logs without what is faulty in them, jumps excepted, and sentences about that.
std::vector<MachineSignals> signals_of(const Machine& machine, const std::vector<Log>& logs,
                                       const FitOptions& options, std::vector<std::string>& notes) {
  std::vector<MachineSignals> out;
  out.reserve(logs.size());
  for (const Log& log : logs) {
    const Staying staying = options.check_data ? Staying::kJumps : Staying::kAll;
    CheckedSignals one = checked_signals(machine, log, options.signals, options.bad_data, staying);
    out.push_back(std::move(one.signals));
    for (const BadChannel& b : one.bad)
      if (!stays(b, staying))
        notes.push_back(fmt::format("set aside: {}: {}", log.file, bad_channel_sentence(b)));
  }
  return out;
}

/// Copies from `old` what a refit could not learn because the logs do not show it.
void keep_what_was_learned(const CraneModel& old, CraneModel& model) {
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    CylinderModel& c = model.cylinders[i];
    const CylinderModel& was = old.cylinders[i];
    if (c.extend.empty()) c.extend = was.extend;
    if (c.retract.empty()) c.retract = was.retract;
    if (c.margin == 0.0) c.margin = was.margin;
    if (c.valve_gain_extend == 0.0) c.valve_gain_extend = was.valve_gain_extend;
    if (c.valve_gain_retract == 0.0) c.valve_gain_retract = was.valve_gain_retract;
  }
}

/// Those of the effects that show in a quantity in which a changed one shows, or another one of these.
std::vector<EffectAt> connected(std::vector<EffectAt> effects,
                                const std::vector<EffectAt>& changed) {
  std::vector<EvidenceKind> kinds;
  const auto add = [&](const EffectAt& e) {
    const std::vector<EvidenceKind> more = e.effect->shows_in();
    kinds.insert(kinds.end(), more.begin(), more.end());
  };
  for (const EffectAt& e : changed) add(e);
  const auto shows = [&](const EffectAt& e) {
    const std::vector<EvidenceKind> in = e.effect->shows_in();
    return std::find_first_of(in.begin(), in.end(), kinds.begin(), kinds.end()) != in.end();
  };
  std::vector<EffectAt> out;
  for (bool more = true; more;) {
    const auto rest = std::stable_partition(effects.begin(), effects.end(), shows);
    more = rest != effects.begin();
    std::for_each(effects.begin(), rest, add);
    out.insert(out.end(), effects.begin(), rest);
    effects.erase(effects.begin(), rest);
  }
  return out;
}

bool learned_from(const CraneModel& model, const Log& log) {
  return std::any_of(model.data.begin(), model.data.end(), [&](const DataSource& d) {
    return d.use == "train" && d.sha256 == log.sha256;
  });
}

}  // namespace

std::vector<EffectAt> places_of(const std::vector<AppliedEffect>& effects) {
  std::vector<EffectAt> out;
  out.reserve(effects.size());
  for (const AppliedEffect& e : effects) out.push_back({e.effect, e.at});
  return out;
}

RefitContext::RefitContext(const CraneModel& model, const ExtendLogs& logs,
                           const ExtendOptions& options)
    : machine_(model.machine), logs_(logs), options_(options) {
  if (logs.suspects.empty()) throw InputError({}, "log", "no log to learn from; give at least one");
  signals_ = signals_of(machine_, logs.suspects, options.fit, set_aside_);
  references_ = signals_of(machine_, logs.references, options.fit, set_aside_);
  if (!logs.references.empty()) in_references_ = effects_in_references(model, references_);
  test_signals_ = signals_of(machine_, logs.tests, options.fit, set_aside_);
  folds_ = held_out_folds(signals_, options.fit, options.folds);
  if (!logs.tests.empty()) {
    judged_on_ = "test logs";
    return;
  }
  held_ = held_out_samples(signals_, options.fit);
  const bool any = std::any_of(held_.begin(), held_.end(), [](const Mask& m) { return m.any(); });
  judged_on_ = any ? "held-out motions" : "training logs";
  if (!any) held_.clear();
}

Judged RefitContext::as_it_is(const CraneModel& model, std::vector<std::string>& notes,
                              const SearchProgress& progress) const {
  if (!references_.empty()) return as_references_say(model, notes, progress);
  const bool knows = std::all_of(logs_.suspects.begin(), logs_.suspects.end(),
                                 [&](const Log& log) { return learned_from(model, log); });
  if (held_.empty() && knows) return {model, judge(model), model.effects};
  if (!knows) {
    notes.push_back(
        "the model was not learned from these logs; \"before\" is the model learned again from "
        "them without the effect, so that the change shown is due to the effect alone");
  }
  Judged again = with({model, {}, model.effects}, places_of(model.effects), progress);
  return {model, std::move(again.error), std::move(again.effects_held_out)};
}

Judged RefitContext::as_references_say(const CraneModel& model, std::vector<std::string>& notes,
                                       const SearchProgress& progress) const {
  const auto knows = [&](const Log& log) { return learned_from(model, log); };
  Judged out{model, {}, model.effects};
  if (!std::all_of(logs_.references.begin(), logs_.references.end(), knows) ||
      std::any_of(logs_.suspects.begin(), logs_.suspects.end(), knows)) {
    notes.push_back(
        "the model was not learned from the reference logs alone: pressures, margins and gains are "
        "learned from them first");
    FitOptions fit_options = options_.fit;
    fit_options.effects = model.effects;
    fit_options.hold_out_every = 0;
    out.model = fit(machine_, logs_.references, {}, fit_options, progress).model;
    out.model.steps = model.steps;
    keep_what_was_learned(model, out.model);
  }
  out.error = held_.empty() ? judge(out.model)
                            : compare_signals(out.model, signals_, held_, compare_options());
  return out;
}

EffectEstimate RefitContext::estimate(CraneModel base, const EffectSet& effects,
                                      const std::vector<Mask>& leave_out,
                                      const SearchProgress& progress) const {
  const auto in = [](const auto& list, const auto& e) {
    return std::any_of(list.begin(), list.end(),
                       [&](const auto& o) { return o.effect == e.effect && o.at == e.at; });
  };
  std::erase_if(base.effects, [&](const AppliedEffect& k) { return !in(effects.all, k); });
  std::vector<AppliedEffect> in_references = in_references_;
  std::erase_if(in_references, [&](const AppliedEffect& k) { return !in(effects.all, k); });
  std::vector<EffectAt> wanted = effects.estimated;
  std::erase_if(wanted, [&](const EffectAt& e) { return in(in_references, e); });
  EstimateOptions how;
  how.evidence = options_.diagnose.evidence;
  EffectEstimate estimate = estimate_effects(
      base, wanted, {signals_, references_, leave_out, std::move(in_references)}, progress, how);
  // an effect that only the samples left out show is not known to a model of the others
  std::erase_if(base.effects,
                [&](const AppliedEffect& k) { return in(wanted, k) && !in(estimate.effects, k); });
  std::vector<AppliedEffect> all;
  for (const EffectAt& e : effects.all) {
    for (const auto* list : {&estimate.effects, &base.effects}) {
      const auto it = std::find_if(list->begin(), list->end(), [&](const AppliedEffect& a) {
        return a.effect == e.effect && a.at == e.at;
      });
      if (it == list->end()) continue;
      all.push_back(*it);
      break;
    }
  }
  estimate.effects = std::move(all);
  return estimate;
}

CraneModel RefitContext::estimated(CraneModel model, const std::vector<EffectAt>& effects,
                                   const SearchProgress& progress) const {
  model.effects = estimate(model, {effects, effects}, {}, progress).effects;
  return model;
}

Judged RefitContext::with(const Judged& from, const std::vector<EffectAt>& effects,
                          const SearchProgress& progress, std::vector<std::string>* notes) const {
  const auto part = [&](double first, double width) {
    return [&progress, first, width](double share, const std::string& what) {
      if (progress) progress(first + width * share, what);
    };
  };
  EffectEstimate all = estimate(from.model, {effects, effects}, {}, part(0.0, 0.4));
  Judged out;
  out.effects_held_out = all.effects;
  if (!held_.empty()) {
    CraneModel base = from.model;
    base.effects = from.effects_held_out;
    out.effects_held_out =
        estimate(std::move(base), {effects, effects}, held_, part(0.4, 0.2)).effects;
  }
  if (notes != nullptr) *notes = all.notes;
  if (!references_.empty()) {
    out.model = from.model;
    out.model.effects = all.effects;
    if (held_.empty()) {
      out.error = judge(out.model);
    } else {
      CraneModel without = from.model;
      without.effects = out.effects_held_out;
      out.error = compare_signals(without, signals_, held_, compare_options());
    }
    return out;
  }
  FitOptions fit_options = options_.fit;
  fit_options.effects = all.effects;
  if (held_.empty()) {
    fit_options.hold_out_every = 0;
  } else {
    fit_options.effects_held_out = out.effects_held_out;
  }
  FitResult fitted = fit(machine_, logs_.suspects, logs_.tests, fit_options, part(0.6, 0.4));
  out.model = std::move(fitted.model);
  out.model.steps = from.model.steps;
  keep_what_was_learned(from.model, out.model);
  out.error = fitted.held_out ? std::move(*fitted.held_out) : judge(out.model);
  return out;
}

CraneModel RefitContext::measured_model(const CraneModel& from, const EffectSet& effects,
                                        const std::vector<Mask>& left_out,
                                        const SearchProgress& progress) const {
  FitOptions how = options_.fit;
  how.effects = estimate(from, effects, left_out, progress).effects;
  if (references_.empty()) return fit_forces_and_flows(machine_, signals_, left_out, how);
  CraneModel model = from;  // with references everything learned is theirs and stays
  model.effects = how.effects;
  return model;
}

const std::vector<Mask>& RefitContext::fold(std::size_t f) const {
  static const std::vector<Mask> kNone;
  return folds_.empty() ? kNone : folds_[f];
}

CompareResult RefitContext::errors_on_folds(const std::vector<CraneModel>& models) const {
  if (folds_.empty()) return judge(models.front());
  std::vector<CompareResult> parts;
  for (std::size_t f = 0; f < folds_.size(); ++f)
    parts.push_back(compare_signals(models[f], signals_, folds_[f], compare_options()));
  return join_results(machine_, std::move(parts));
}

CrossValidated RefitContext::cross_validated(const CraneModel& from,
                                             const std::vector<EffectAt>& effects,
                                             const SearchProgress& progress) const {
  CrossValidated out;
  for (std::size_t f = 0; f < fold_count(); ++f)
    out.models.push_back(measured_model(from, {effects, effects}, fold(f), progress));
  out.errors = errors_on_folds(out.models);
  return out;
}

CrossValidated RefitContext::cross_validated(const CrossValidated& was,
                                             const std::vector<EffectAt>& effects,
                                             const std::vector<EffectAt>& changed,
                                             const SearchProgress& progress) const {
  const std::vector<EffectAt> again = connected(effects, changed);
  CrossValidated out;
  for (std::size_t f = 0; f < fold_count(); ++f)
    out.models.push_back(measured_model(was.models[f], {effects, again}, fold(f), progress));
  out.errors = errors_on_folds(out.models);
  return out;
}

Evidence RefitContext::evidence_on_fold(std::size_t f, const EffectAt& effect, CraneModel from,
                                        const std::vector<AppliedEffect>& effects) const {
  from.effects = effects;
  EvidenceOptions how = options_.diagnose.evidence;
  how.kinds = effect.effect->shows_in();
  std::vector<AppliedEffect> in_references = in_references_;
  std::erase_if(in_references, [&](const AppliedEffect& k) {
    return std::none_of(effects.begin(), effects.end(), [&](const AppliedEffect& e) {
      return e.effect == k.effect && e.at == k.at;
    });
  });
  Evidence evidence = collect_evidence(from, signals_, references_, &in_references, how);
  std::vector<Mask> others;
  for (const Mask& held : fold(f)) others.push_back(!held);
  for (EvidenceChannel& c : evidence.channels) c = without_rows(c, others);
  std::erase_if(evidence.channels, [](const EvidenceChannel& c) { return c.rows() == 0; });
  return evidence;
}

PressureChange RefitContext::pressure_change(const EffectAt& effect, const CraneModel& from,
                                             const CrossValidated& before,
                                             const CrossValidated& after) const {
  PressureErrors errors;
  for (std::size_t f = 0; f < fold_count(); ++f) {
    errors.add(errors_beside_laws(evidence_on_fold(f, effect, from, before.models[f].effects),
                                  evidence_on_fold(f, effect, from, after.models[f].effects),
                                  options_.change.blocks.longest_s));
  }
  return errors.change(options_.change.acts_share);
}

std::optional<CompareResult> RefitContext::tested_errors(const CraneModel& from,
                                                         const std::vector<EffectAt>& effects,
                                                         const SearchProgress& progress) const {
  if (logs_.tests.empty()) return std::nullopt;
  return judge(measured_model(from, {effects, effects}, {}, progress));
}

std::vector<DataSource> RefitContext::data() const {
  std::vector<DataSource> out;
  for (const Log& l : logs_.suspects) out.push_back({l.file, l.sha256, l.samples(), "train"});
  for (const Log& l : logs_.tests) out.push_back({l.file, l.sha256, l.samples(), "test"});
  return out;
}

CompareOptions RefitContext::compare_options() const {
  CompareOptions o;
  o.signals = options_.fit.signals;
  o.find_regions = false;
  return o;
}

CompareResult RefitContext::judge(const CraneModel& model) const {
  return compare_signals(model, logs_.tests.empty() ? signals_ : test_signals_, {},
                         compare_options());
}

}  // namespace sparflow
