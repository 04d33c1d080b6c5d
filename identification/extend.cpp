#include "identification/extend.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "identification/effect_estimate.h"
#include "models/error.h"

namespace sparflow {
namespace {

using Clock = std::chrono::steady_clock;

/// Refitting with other data around moves centres and length-scales, and with them errors by some tenths of a
/// percent, up or down.
constexpr double kRefitMoves = 1.005;

std::vector<EffectAt> places_of(const std::vector<AppliedEffect>& effects) {
  std::vector<EffectAt> out;
  out.reserve(effects.size());
  for (const AppliedEffect& e : effects) out.push_back({e.effect, e.at});
  return out;
}

bool same(const EffectAt& a, const EffectAt& b) { return a.effect == b.effect && a.at == b.at; }

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

/// A model with the error it makes on what it is judged by.
struct Judged {
  CraneModel model;
  CompareResult error;
};

/// Logs, tests and options of one call; learns and judges models with other effects.
class Workshop {
 public:
  /// @param references empty: everything is learned again for each model; else only effects are
  Workshop(const CraneModel& model, const std::vector<Log>& logs,
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

  const std::string& judged_on() const { return judged_on_; }
  const std::vector<Log>& logs() const { return logs_; }

  /// What a step is to be compared with: the model as it is, where it was learned from these very logs and test
  /// logs judge it, or where it stays (references). Else the model learned from them with the effects it has: what
  /// other logs or other samples change is no gain of an effect.
  Judged as_it_is(const CraneModel& model, std::vector<std::string>& notes,
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

  /// Estimates these effects and learns everything around them.
  Judged with(const CraneModel& from, const std::vector<EffectAt>& effects,
              const SearchProgress& progress, std::vector<std::string>* notes = nullptr) const {
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

  std::vector<DataSource> data() const {
    std::vector<DataSource> out;
    for (const Log& l : logs_) out.push_back({l.file, l.sha256, l.samples(), "train"});
    for (const Log& l : tests_) out.push_back({l.file, l.sha256, l.samples(), "test"});
    return out;
  }

 private:
  bool knows_logs(const CraneModel& model) const {
    return std::all_of(logs_.begin(), logs_.end(), [&](const Log& log) {
      return std::any_of(model.data.begin(), model.data.end(), [&](const DataSource& d) {
        return d.use == "train" && d.sha256 == log.sha256;
      });
    });
  }
  CompareOptions compare_options() const {
    CompareOptions o;
    o.signals = options_.fit.signals;
    o.find_regions = false;
    return o;
  }
  CompareResult judge(const CraneModel& model) const {
    return compare_signals(model, tests_.empty() ? signals_ : test_signals_, {}, compare_options());
  }

  const Machine& machine_;
  const std::vector<Log>& logs_;
  const std::vector<Log>& tests_;
  const ExtendOptions& options_;
  std::vector<MachineSignals> signals_, references_, test_signals_;
  std::vector<Mask> held_;  // by log; empty: nothing is held out
  std::string judged_on_;
};

ModelStep record_of(const ExtendStep& step, const Workshop& workshop, const std::string& date) {
  ModelStep record;
  record.added = step.added;
  record.removed = step.removed;
  record.date = date;
  record.data = workshop.data();
  const AppliedEffect& e = step.effect;
  for (std::size_t p = 0; step.removed.empty() && p < e.values.size(); ++p) {
    const EffectParameter& parameter = e.effect->info().parameters[p];
    StepParameter out{parameter.name, parameter.unit, e.values[p]};
    if (p < e.lower95.size()) out.lower95 = e.lower95[p];
    if (p < e.upper95.size()) out.upper95 = e.upper95[p];
    record.parameters.push_back(std::move(out));
  }
  const std::string data = step.judged_on == "test logs"          ? "test"
                           : step.judged_on == "held-out motions" ? "held out"
                                                                  : "train";
  record.before = stage_quality(step.before, data);
  record.after = stage_quality(step.after, data);
  return record;
}

/// Adds one effect to `current`. @return the step and the model with it, which the caller may keep or not
std::pair<ExtendStep, Judged> one_step(const Workshop& workshop, const Judged& current,
                                       const EffectAt& add, std::vector<std::string>& notes,
                                       const SearchProgress& progress) {
  const Machine& machine = current.model.machine;
  const EffectInfo& info = add.effect->info();
  std::vector<EffectAt> effects = places_of(current.model.effects);
  effects.push_back(add);
  Judged next = workshop.with(current.model, effects, progress, &notes);
  ExtendStep step;
  step.added = effect_key(info, machine, add.at);
  step.title = effect_title(info, machine, add.at);
  step.stage = effect_stage_name(info.stage);
  step.effect = next.model.effects.back();
  step.before = current.error;
  step.after = next.error;
  step.judged_on = workshop.judged_on();
  step.change = error_change(step.before, step.after, step.stage);
  return {std::move(step), std::move(next)};
}

void keep(ExtendStep step, Judged next, const Workshop& workshop, const std::string& date,
          Judged& current, ExtendResult& result) {
  next.model.steps.push_back(record_of(step, workshop, date));
  current = std::move(next);
  result.steps.push_back(std::move(step));
}

void add_notes(std::vector<std::string> notes, ExtendResult& result) {
  for (std::string& n : notes) {
    if (std::find(result.notes.begin(), result.notes.end(), n) == result.notes.end())
      result.notes.push_back(std::move(n));
  }
}

void finish(Judged current, Clock::time_point start, ExtendResult& result) {
  result.model = std::move(current.model);
  if (!result.model.steps.empty() && (!result.steps.empty()))
    result.model.steps.back().stopped_because = result.stopped_because;
  result.seconds = std::chrono::duration<double>(Clock::now() - start).count();
}

std::string percent_text(double ratio) {
  return ratio <= 1.0 ? fmt::format("{:.1f} % smaller", 100.0 * (1.0 - ratio))
                      : fmt::format("{:.1f} % larger", 100.0 * (ratio - 1.0));
}

/// A diagnosis together with the model it speaks of: its evidence refers to that model's machine.
std::shared_ptr<const Diagnosis> diagnose_kept(const CraneModel& model,
                                               const std::vector<Log>& logs,
                                               const std::vector<Log>& references,
                                               const DiagnoseOptions& options,
                                               const SearchProgress& progress) {
  struct Kept {
    CraneModel model;
    Diagnosis diagnosis;
  };
  const auto kept = std::make_shared<Kept>();
  kept->model = model;
  kept->diagnosis = diagnose(kept->model, logs, references, options, progress);
  return {kept, &kept->diagnosis};
}

/// What a diagnosis asks for, that which explains most first. Where logs cannot tell several effects apart, the
/// one that explains them best stands for all.
std::vector<const DiagnosedEffect*> to_add(const Diagnosis& d, const CraneModel& model) {
  std::vector<const DiagnosedEffect*> out;
  if (d.verdict == Verdict::kBadData || d.verdict == Verdict::kNone) return out;
  for (const DiagnosedEffect& e : d.effects) {
    const bool has = std::any_of(model.effects.begin(), model.effects.end(), [&](const auto& o) {
      return o.effect == e.effect.effect && o.at == e.effect.at;
    });
    if (!has && (d.verdict == Verdict::kMissing || e.probability >= 0.5)) out.push_back(&e);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto* a, const auto* b) { return a->gain > b->gain; });
  return out;
}

std::string stands_for(const DiagnosedEffect& e) {
  std::string rivals;
  for (const auto& [key, worse] : e.rivals) rivals += (rivals.empty() ? "" : ", ") + key;
  return fmt::format("{} stands for a set that these logs cannot tell apart: {} would do as well",
                     e.key(), rivals);
}

/// Why a diagnosis leads no further.
std::string why_stopped(const Diagnosis& d) {
  switch (d.verdict) {
    case Verdict::kNone:
      return "nothing more is missing that these logs could show";
    case Verdict::kUnknown:
      return "what is left is not in the catalogue" +
             (d.unexplained ? ": " + d.unexplained->sentence : std::string());
    case Verdict::kBadData:
      return "data is bad: " +
             (d.bad.empty() ? std::string() : bad_channel_sentence(d.bad.front()));
    case Verdict::kMissing:
      return "what the diagnosis names is in the model already";
  }
  return {};
}

}  // namespace

bool ErrorChange::worse() const { return overall > kRefitMoves || own_stage > kRefitMoves; }

ErrorChange error_change(const CompareResult& before, const CompareResult& after,
                         const std::string& stage) {
  double all = 0.0, all_n = 0.0, own = 0.0, own_n = 0.0;
  for (const StageScore& b : before.scores) {
    const StageScore* a = after.find(b.stage, b.at, b.regime);
    if (a == nullptr || a->n == 0 || b.n == 0 || !(b.rmse > 0.0) || !(a->rmse > 0.0)) continue;
    const double n = 0.5 * static_cast<double>(a->n + b.n);
    const double change = std::log(a->rmse / b.rmse);
    all += n * change;
    all_n += n;
    if (b.stage != stage) continue;
    own += n * change;
    own_n += n;
  }
  ErrorChange out;
  if (all_n > 0.0) out.overall = std::exp(all / all_n);
  out.own_stage = own_n > 0.0 ? std::exp(own / own_n) : out.overall;
  return out;
}

std::string effect_title(const EffectInfo& info, const Machine& machine, int at) {
  const auto i = static_cast<std::size_t>(at);
  switch (info.place) {
    case EffectPlace::kMachine:
      break;
    case EffectPlace::kJoint:
      return info.title + " of " + machine.joints[i].name;
    case EffectPlace::kCylinder:
      if (at >= 0) return info.title + " of " + machine.cylinders[i].name;
      break;
    case EffectPlace::kPump:
      return info.title + " of pump " + machine.pumps[i].name;
  }
  return info.title;
}

ExtendResult extend(const CraneModel& model, const std::vector<EffectAt>& add,
                    const std::vector<Log>& logs, const std::vector<Log>& tests,
                    const ExtendOptions& options, const SearchProgress& progress) {
  const auto start = Clock::now();
  std::vector<EffectAt> all = places_of(model.effects);
  for (const EffectAt& e : add) {
    if (std::any_of(all.begin(), all.end(), [&](const EffectAt& o) { return same(o, e); })) {
      throw InputError({}, effect_key(e.effect->info(), model.machine, e.at),
                       "the model has this effect already; take it back first to learn it anew");
    }
    all.push_back(e);
  }
  const Workshop workshop(model, logs, options.references, tests, options);
  const double parts = static_cast<double>(add.size()) + 1.0;
  const auto part = [&](std::size_t i) {
    return [&progress, i, parts](double share, const std::string& what) {
      if (progress) progress((static_cast<double>(i) + share) / parts, what);
    };
  };
  ExtendResult result;
  Judged current = workshop.as_it_is(model, result.notes, part(0));
  for (std::size_t i = 0; i < add.size(); ++i) {
    std::vector<std::string> notes;
    auto [step, next] = one_step(workshop, current, add[i], notes, part(i + 1));
    add_notes(std::move(notes), result);
    if (step.change.worse()) {
      result.notes.push_back(fmt::format(
          "{} makes the error on the {} {}: it is in the model as asked, but the data speak "
          "against it",
          step.title, step.judged_on,
          percent_text(std::max(step.change.overall, step.change.own_stage))));
    }
    keep(std::move(step), std::move(next), workshop, options.date, current, result);
  }
  result.stopped_because = "all effects asked for were added";
  finish(std::move(current), start, result);
  return result;
}

ExtendResult take_back(const CraneModel& model, const EffectAt& effect,
                       const std::vector<Log>& logs, const std::vector<Log>& tests,
                       const ExtendOptions& options, const SearchProgress& progress) {
  const auto start = Clock::now();
  const std::string key = effect_key(effect.effect->info(), model.machine, effect.at);
  std::vector<EffectAt> rest = places_of(model.effects);
  const auto at =
      std::find_if(rest.begin(), rest.end(), [&](const EffectAt& e) { return same(e, effect); });
  if (at == rest.end()) {
    std::string has;
    for (const AppliedEffect& e : model.effects)
      has += (has.empty() ? "" : ", ") + e.key(model.machine);
    throw InputError({}, key,
                     has.empty() ? "the model has no effects to take back"
                                 : "the model does not have this effect; it has " + has);
  }
  const AppliedEffect was = model.effects[static_cast<std::size_t>(at - rest.begin())];
  rest.erase(at);
  const Workshop workshop(model, logs, options.references, tests, options);
  const auto part = [&](double first) {
    return [&progress, first](double share, const std::string& what) {
      if (progress) progress(first + 0.5 * share, what);
    };
  };
  ExtendResult result;
  const Judged current = workshop.as_it_is(model, result.notes, part(0.0));
  std::vector<std::string> notes;
  Judged next = workshop.with(model, rest, part(0.5), &notes);
  add_notes(std::move(notes), result);
  ExtendStep step;
  step.removed = key;
  step.title = effect_title(effect.effect->info(), model.machine, effect.at) + " taken back";
  step.stage = effect_stage_name(effect.effect->info().stage);
  step.effect = was;
  step.before = current.error;
  step.after = next.error;
  step.judged_on = workshop.judged_on();
  step.change = error_change(step.before, step.after, step.stage);
  Judged kept = current;
  keep(std::move(step), std::move(next), workshop, options.date, kept, result);
  result.stopped_because = "the effect was taken back as asked";
  finish(std::move(kept), start, result);
  return result;
}

ExtendResult improve(const CraneModel& model, const std::vector<Log>& logs,
                     const std::vector<Log>& references, const std::vector<Log>& tests,
                     const ExtendOptions& options, const SearchProgress& progress) {
  const auto start = Clock::now();
  const Workshop workshop(model, logs, references, tests, options);
  // nobody knows how many rounds there will be: each fills half of what is left
  double done = 0.0;
  const auto round = [&](double width) {
    return [&progress, &done, width](double share, const std::string& what) {
      if (progress) progress(done + (1.0 - done) * width * share, what);
    };
  };
  ExtendResult result;
  Judged current = workshop.as_it_is(model, result.notes, round(0.05));
  done = 0.05;
  const auto steps_left = [&] { return static_cast<int>(result.steps.size()) < options.max_steps; };
  while (result.stopped_because.empty()) {
    const std::shared_ptr<const Diagnosis> diagnosis =
        diagnose_kept(current.model, logs, references, options.diagnose, round(0.4));
    done += (1.0 - done) * 0.4;
    result.last = diagnosis;
    const std::vector<const DiagnosedEffect*> wanted = to_add(*diagnosis, current.model);
    if (wanted.empty()) result.stopped_because = why_stopped(*diagnosis);
    for (const DiagnosedEffect* e : wanted) {
      if (!steps_left()) {
        result.stopped_because =
            fmt::format("the limit of {} steps is reached; {} would be next", options.max_steps,
                        effect_title(e->effect.effect->info(), model.machine, e->effect.at));
        break;
      }
      std::vector<std::string> notes;
      auto [step, next] = one_step(workshop, current, e->effect, notes, round(0.2));
      done += (1.0 - done) * 0.2;
      step.diagnosis = diagnosis;
      if (step.change.worse()) {
        result.stopped_because +=
            fmt::format("{}{} was tried and not kept: it made the error on the {} {}",
                        result.stopped_because.empty() ? "" : "; ", step.title, step.judged_on,
                        percent_text(std::max(step.change.overall, step.change.own_stage)));
        result.rejected.push_back(std::move(step));
        continue;
      }
      if (!e->rivals.empty()) notes.push_back(stands_for(*e));
      add_notes(std::move(notes), result);
      keep(std::move(step), std::move(next), workshop, options.date, current, result);
    }
  }
  finish(std::move(current), start, result);
  return result;
}

}  // namespace sparflow
