#include "identification/extend_workshop.h"

#include <algorithm>

#include "identification/effect_estimate.h"
#include "models/error.h"

namespace sparflow {
namespace {

std::vector<MachineSignals> signals_of(const Machine& machine, const std::vector<Log>& logs,
                                       const SignalOptions& options) {
  std::vector<MachineSignals> out;
  out.reserve(logs.size());
  for (const Log& log : logs) out.push_back(make_signals(machine, log, options));
  return out;
}

/// What a refit could not learn because the logs do not show it stays as it was.
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

}  // namespace

std::vector<EffectAt> places_of(const std::vector<AppliedEffect>& effects) {
  std::vector<EffectAt> out;
  out.reserve(effects.size());
  for (const AppliedEffect& e : effects) out.push_back({e.effect, e.at});
  return out;
}

Workshop::Workshop(const CraneModel& model, const std::vector<Log>& logs,
                   const std::vector<Log>& references, const std::vector<Log>& tests,
                   const ExtendOptions& options)
    : machine_(model.machine), logs_(logs), tests_(tests), options_(options) {
  if (logs.empty()) throw InputError({}, "log", "no log to learn from; give at least one");
  const SignalOptions& how = options.fit.signals;
  signals_ = signals_of(machine_, logs, how);
  references_ = signals_of(machine_, references, how);
  test_signals_ = signals_of(machine_, tests, how);
  if (!tests.empty()) {
    judged_on_ = "test logs";
    return;
  }
  held_ = held_out_samples(signals_, options.fit);
  const bool any = std::any_of(held_.begin(), held_.end(), [](const Mask& m) { return m.any(); });
  judged_on_ = any ? "held-out motions" : "the logs it was learned from";
  if (!any) held_.clear();
}

Judged Workshop::as_it_is(const CraneModel& model, std::vector<std::string>& notes,
                          const SearchProgress& progress) const {
  const bool stays = !references_.empty();
  const bool knows = knows_logs(model);
  if (held_.empty() && (stays || knows)) return {model, judge(model)};
  if (!stays && !knows) {
    notes.push_back(
        "the model was not learned from these logs; \"before\" is the model learned again from "
        "them without the effect, so that the change shown is the effect's alone");
  }
  return {model, with(model, places_of(model.effects), progress).error};
}

Judged Workshop::with(const CraneModel& from, const std::vector<EffectAt>& effects,
                      const SearchProgress& progress, std::vector<std::string>* notes) const {
  const auto part = [&](double first, double width) {
    return [&progress, first, width](double share, const std::string& what) {
      if (progress) progress(first + width * share, what);
    };
  };
  EffectEstimate all = estimate_effects(from, effects, signals_, references_, {}, part(0.0, 0.4));
  EffectEstimate most;
  if (!held_.empty()) {
    most = estimate_effects(from, effects, signals_, references_, held_, part(0.4, 0.2));
  }
  if (notes != nullptr) *notes = all.notes;
  Judged out;
  if (!references_.empty()) {
    out.model = from;
    out.model.effects = all.effects;
    if (held_.empty()) {
      out.error = judge(out.model);
    } else {
      CraneModel without = from;
      without.effects = most.effects;
      out.error = compare_signals(without, signals_, held_, compare_options());
    }
    return out;
  }
  FitOptions fit_options = options_.fit;
  fit_options.effects = all.effects;
  fit_options.effects_held_out = most.effects;
  if (held_.empty()) fit_options.hold_out_every = 0;
  FitResult fitted = fit(machine_, logs_, tests_, fit_options, part(0.6, 0.4));
  out.model = std::move(fitted.model);
  out.model.steps = from.steps;
  keep_what_was_learned(from, out.model);
  out.error = fitted.held_out ? std::move(*fitted.held_out) : judge(out.model);
  return out;
}

std::vector<DataSource> Workshop::data() const {
  std::vector<DataSource> out;
  for (const Log& l : logs_) out.push_back({l.file, l.sha256, l.samples(), "train"});
  for (const Log& l : tests_) out.push_back({l.file, l.sha256, l.samples(), "test"});
  return out;
}

bool Workshop::knows_logs(const CraneModel& model) const {
  return std::all_of(logs_.begin(), logs_.end(), [&](const Log& log) {
    return std::any_of(model.data.begin(), model.data.end(), [&](const DataSource& d) {
      return d.use == "train" && d.sha256 == log.sha256;
    });
  });
}

CompareOptions Workshop::compare_options() const {
  CompareOptions o;
  o.signals = options_.fit.signals;
  o.find_regions = false;
  return o;
}

CompareResult Workshop::judge(const CraneModel& model) const {
  return compare_signals(model, tests_.empty() ? signals_ : test_signals_, {}, compare_options());
}

}  // namespace sparflow
