#include "identification/extend.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "identification/extend_workshop.h"
#include "models/error.h"

namespace sparflow {
namespace {

using Clock = std::chrono::steady_clock;

/// Refitting with other data around moves centres and length-scales, and with them errors by some tenths of a
/// percent, up or down.
constexpr double kRefitMoves = 1.005;

bool same(const EffectAt& a, const EffectAt& b) { return a.effect == b.effect && a.at == b.at; }

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
