#include "diagnosis/extension/extend.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>

#include "diagnosis/extension/refit_context.h"
#include "identification/data_checks/set_aside.h"
#include "models/math/error.h"
#include "models/math/interruption.h"

namespace sparflow {
namespace {

using Clock = std::chrono::steady_clock;

ModelStep record_of(const ExtendStep& step, const RefitContext& context) {
  ModelStep record;
  record.added = step.added;
  record.removed = step.removed;
  record.date = context.options().date;
  record.data = context.data();
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

/// Name of the place of an effect in scores; empty: everywhere in its stage.
std::string place_name(const Machine& machine, const EffectAt& e) {
  const auto i = static_cast<std::size_t>(e.at);
  if (e.at < 0) return "";
  if (e.effect->info().place == EffectPlace::kCylinder) return machine.cylinders[i].name;
  if (e.effect->info().place == EffectPlace::kPump) return machine.pumps[i].name;
  return "";
}

/// A step with the model that it leads to, which the caller may keep or not.
struct TriedStep {
  ExtendStep step;
  Judged next;
  std::vector<std::string> notes;  ///< of the estimate
};

/// Compares the errors before and after an effect is added or removed.
void judge_step(const RefitContext& context, const EffectAt& e, const Judged& current,
                TriedStep& tried) {
  const Machine& machine = current.model.machine;
  ExtendStep& step = tried.step;
  step.stage = effect_stage_name(e.effect->info().stage);
  step.before = current.error;
  step.after = tried.next.error;
  step.judged_on = context.judged_on();
  step.change = error_change(machine, step.before, step.after,
                             {{step.stage}, place_name(machine, e)}, context.options().change);
}

/// Adds one effect to `current`.
TriedStep try_adding(const RefitContext& context, const Judged& current, const EffectAt& add,
                     Others others, const SearchProgress& progress) {
  const Machine& machine = current.model.machine;
  const EffectInfo& info = add.effect->info();
  std::vector<EffectAt> effects = places_of(current.model.effects);
  effects.push_back(add);
  TriedStep tried;
  tried.next = context.with(current, effects, others, progress, &tried.notes);
  tried.step.added = effect_key(info, machine, add.at);
  tried.step.title = effect_title(info, machine, add.at);
  tried.step.effect = tried.next.model.effects.back();
  tried.step.others_kept = others == Others::kKept;
  judge_step(context, add, current, tried);
  return tried;
}

void add_notes(std::vector<std::string> notes, ExtendResult& result) {
  for (std::string& n : notes) {
    if (std::find(result.notes.begin(), result.notes.end(), n) == result.notes.end())
      result.notes.push_back(std::move(n));
  }
}

void keep(TriedStep tried, const RefitContext& context, Judged& current, ExtendResult& result) {
  tried.next.model.steps.push_back(record_of(tried.step, context));
  current = std::move(tried.next);
  result.steps.push_back(std::move(tried.step));
  add_notes(std::move(tried.notes), result);
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

/// Title of an effect of the model from which the last one is indistinguishable; empty: none. Such an effect has a
/// parameter whose interval was smaller than its value and is now larger, and much wider than before.
/// @param times [-] by how much at least
std::string blurred_by_last(const CraneModel& before, const CraneModel& after, double times) {
  const auto half = [](const AppliedEffect& e, std::size_t k) {
    return 0.5 * (e.upper95[k] - e.lower95[k]);
  };
  for (std::size_t i = 0; i < before.effects.size(); ++i) {
    const AppliedEffect &was = before.effects[i], &is = after.effects[i];
    if (was.lower95.size() != was.values.size() || is.lower95.size() != is.values.size()) continue;
    for (std::size_t k = 0; k < was.values.size(); ++k) {
      const bool blurred = half(was, k) < std::abs(was.values[k]) &&
                           half(is, k) > std::abs(is.values[k]) &&
                           half(is, k) > times * half(was, k);
      if (blurred) return effect_title(was.effect->info(), after.machine, was.at);
    }
  }
  return {};
}

/// Whether the logs determine that an effect is there at all: the 95 % interval of one of the parameters to which it is
/// proportional excludes zero. True for an effect without such a parameter or without intervals.
bool is_determined(const AppliedEffect& e) {
  if (e.lower95.size() != e.values.size()) return true;
  bool proportional = false;
  for (std::size_t k = 0; k < e.values.size(); ++k) {
    if (!e.effect->info().parameters[k].linear) continue;
    if (e.lower95[k] > 0.0 || e.upper95[k] < 0.0) return true;
    proportional = true;
  }
  return !proportional;
}

/// Adds one effect; if the error rises, once more with the effects of the model as they are.
TriedStep try_beside_others(const RefitContext& context, const Judged& current, const EffectAt& add,
                            const SearchProgress& progress) {
  const ExtendOptions& options = context.options();
  TriedStep tried = try_adding(context, current, add, Others::kEstimatedAnew, progress);
  if (tried.step.change.worse(options.change) && !current.model.effects.empty())
    tried = try_adding(context, current, add, Others::kKept, progress);
  tried.step.same_as = blurred_by_last(current.model, tried.next.model, options.blurred);
  tried.step.determined = is_determined(tried.step.effect);
  return tried;
}

bool worth_keeping(const ExtendStep& step, const ErrorChangeOptions& options) {
  return !step.change.worse(options) && step.same_as.empty() && step.determined;
}

/// Whether a step that is not kept fails for the sake of other places alone.
bool helps_here_and_harms_elsewhere(const ExtendStep& step, const ErrorChangeOptions& options) {
  return step.change.own < options.largest_own && step.same_as.empty() && step.determined;
}

/// Why a step is not kept, as part of a sentence about it.
std::string against(const ExtendStep& step, const ErrorChangeOptions& options) {
  if (!step.same_as.empty())
    return fmt::format("on these logs it is indistinguishable from {}, which is in the model",
                       step.same_as);
  if (!step.determined)
    return "estimated together with the effects of the model, its 95 % interval contains zero";
  if (step.change.own > options.largest_own) {
    return fmt::format("with it, the error on the {} is {} where it acts", step.judged_on,
                       percent_text(step.change.own));
  }
  if (step.change.harmed.empty()) {
    return fmt::format("with it, the overall error on the {} is {}", step.judged_on,
                       percent_text(step.change.overall));
  }
  std::vector<std::string> harm;
  for (const HarmedError& h : step.change.harmed) harm.push_back(h.sentence);
  return fmt::format("on the {} {}", step.judged_on, fmt::join(harm, ", "));
}

/// Factor by which an effect reduces the error of the channel that it improves most, beside all others.
double times_smaller(const DiagnosedEffect& e) {
  double most = 1.0;
  for (const ChannelGain& c : e.channels)
    most = std::max(most, c.rmse_before / std::max(c.rmse_after, 1e-300));
  return most;
}

/// The effects of a diagnosis that the model does not have, in the order of the factor by which they reduce an error,
/// because the gain weights precise channels more than large errors. Of an indistinguishable set only the effect with
/// the largest gain is in it.
std::vector<const DiagnosedEffect*> to_add(const Diagnosis& d, const CraneModel& model) {
  std::vector<const DiagnosedEffect*> out;
  if (d.verdict == Verdict::kBadData || d.verdict == Verdict::kNone) return out;
  for (const DiagnosedEffect& e : d.effects) {
    const bool has = std::any_of(model.effects.begin(), model.effects.end(), [&](const auto& o) {
      return o.effect == e.effect.effect && o.at == e.effect.at;
    });
    if (!has && (d.verdict == Verdict::kMissing || d.probable(e))) out.push_back(&e);
  }
  std::stable_sort(out.begin(), out.end(), [](const auto* a, const auto* b) {
    return times_smaller(*a) > times_smaller(*b);
  });
  return out;
}

std::string stands_for(const DiagnosedEffect& e) {
  std::string rivals;
  for (const auto& [key, worse] : e.rivals) rivals += (rivals.empty() ? "" : ", ") + key;
  return fmt::format("{} is one of an indistinguishable set: {} explains these logs as well",
                     e.key(), rivals);
}

/// The logs without what the data checks set aside, which takes part in no estimate.
ExtendLogs without_faults(ExtendLogs logs, const std::vector<LogFault>& faults) {
  for (const LogFault& f : faults)
    logs.suspects[f.log] = without_bad_data(std::move(logs.suspects[f.log]), {f.channel});
  return logs;
}

/// Why no effect is added after a diagnosis, as a phrase.
std::string why_stopped(const Diagnosis& d) {
  switch (d.verdict) {
    case Verdict::kNone:
      return "nothing more is missing that these logs could show";
    case Verdict::kUnknown:
      if (d.unexplained && d.unexplained->few_places)
        return "an isolated event remains, on which no law can be tested: " +
               d.unexplained->sentence;
      return "unmodelled structure remains in the residual that is not in the catalogue" +
             (d.unexplained ? ": " + d.unexplained->sentence : std::string());
    case Verdict::kBadData:
      return "data is bad: " +
             (d.set_aside.empty() ? std::string() : bad_channel_sentence(d.set_aside.front()));
    case Verdict::kMissing:
      return "the effects that the diagnosis names are in the model already";
  }
  return {};
}

/// Adds the rivals of an effect to those set aside.
void add_indistinguishable(const Diagnosis& d, const EffectAt& effect,
                           std::vector<EffectAt>& aside) {
  for (const FoundEffect& f : d.search.found) {
    if (!(f.design.effect == effect)) continue;
    for (const auto& [rival, worse] : f.alternatives) aside.push_back(rival);
  }
}

/// Whether an effect changes the valve opening on which other effects of the valve act (a lag after a dead band). Their
/// signatures change once it is in the model, so the logs must be diagnosed again before another effect is added.
bool shapes_opening(const AppliedEffect& e) {
  const Eigen::VectorXd small = Eigen::Vector2d(1e-3, -1e-3);
  Eigen::VectorXd opening = small;
  e.effect->shape_opening(e.at, e.at, e.values, opening);
  return opening != small;
}

/// Makes `stopped_because` of the reason, with each effect that was not kept in the end, and why.
void name_rejected(const ErrorChangeOptions& options, ExtendResult& result) {
  std::erase_if(result.rejected, [&](const ExtendStep& r) {
    return std::any_of(result.steps.begin(), result.steps.end(),
                       [&](const ExtendStep& s) { return s.added == r.added; });
  });
  std::vector<ExtendStep> once;
  for (ExtendStep& r : result.rejected) {
    const auto had = std::find_if(once.begin(), once.end(),
                                  [&](const ExtendStep& o) { return o.added == r.added; });
    if (had == once.end()) {
      once.push_back(std::move(r));
    } else {
      *had = std::move(r);
    }
  }
  result.rejected = std::move(once);
  result.stopped_because = result.reason;
  for (const ExtendStep& r : result.rejected)
    result.stopped_because +=
        fmt::format("; {} was tried and not kept: {}", r.title, against(r, options));
}

/// Candidate effects: those in the options or the whole catalogue, without those set aside and those of the model.
std::vector<EffectAt> choices(const ExtendOptions& options, const CraneModel& model,
                              const std::vector<EffectAt>& aside) {
  std::vector<EffectAt> out =
      options.diagnose.candidates.empty() ? candidates(model.machine) : options.diagnose.candidates;
  std::erase_if(out, [&](const EffectAt& c) {
    const auto is_it = [&](const auto& o) { return o.effect == c.effect && o.at == c.at; };
    return std::any_of(aside.begin(), aside.end(), is_it) ||
           std::any_of(model.effects.begin(), model.effects.end(), is_it);
  });
  return out;
}

}  // namespace

std::string effect_title(const EffectInfo& info, const Machine& machine, int at) {
  const auto i = static_cast<std::size_t>(at);
  switch (info.place) {
    case EffectPlace::kMachine:
      break;
    case EffectPlace::kJoint:
      return info.title + ", " + machine.joints[i].name;
    case EffectPlace::kCylinder:
      if (at >= 0) return info.title + ", " + machine.cylinders[i].name;
      break;
    case EffectPlace::kPump:
      return info.title + ", pump " + machine.pumps[i].name;
  }
  return info.title;
}

ExtendResult extend(const CraneModel& model, const std::vector<EffectAt>& add,
                    const ExtendLogs& logs, const ExtendOptions& options,
                    const SearchProgress& progress) {
  const auto start = Clock::now();
  std::vector<EffectAt> all = places_of(model.effects);
  for (const EffectAt& e : add) {
    if (std::any_of(all.begin(), all.end(), [&](const EffectAt& o) { return o == e; })) {
      throw InputError({}, effect_key(e.effect->info(), model.machine, e.at),
                       "the model has this effect already; remove it first to estimate it again");
    }
    all.push_back(e);
  }
  const RefitContext context(model, logs, options);
  const double parts = static_cast<double>(add.size()) + 1.0;
  const auto part = [&](std::size_t i) {
    return [&progress, i, parts](double share, const std::string& what) {
      if (progress) progress((static_cast<double>(i) + share) / parts, what);
    };
  };
  ExtendResult result;
  Judged current = context.as_it_is(model, result.notes, part(0));
  for (std::size_t i = 0; i < add.size(); ++i) {
    TriedStep tried = try_adding(context, current, add[i], Others::kEstimatedAnew, part(i + 1));
    if (tried.step.change.worse(options.change)) {
      tried.notes.push_back(
          fmt::format("{} is in the model as asked, but the data contradict it: {}",
                      tried.step.title, against(tried.step, options.change)));
    }
    keep(std::move(tried), context, current, result);
  }
  result.stopped_because = result.reason = "all effects asked for were added";
  finish(std::move(current), start, result);
  return result;
}

ExtendResult take_back(const CraneModel& model, const EffectAt& effect, const ExtendLogs& logs,
                       const ExtendOptions& options, const SearchProgress& progress) {
  const auto start = Clock::now();
  const std::string key = effect_key(effect.effect->info(), model.machine, effect.at);
  std::vector<EffectAt> rest = places_of(model.effects);
  const auto at =
      std::find_if(rest.begin(), rest.end(), [&](const EffectAt& e) { return e == effect; });
  if (at == rest.end()) {
    std::string has;
    for (const AppliedEffect& e : model.effects)
      has += (has.empty() ? "" : ", ") + e.key(model.machine);
    throw InputError({}, key,
                     has.empty() ? "the model has no effects to remove"
                                 : "the model does not have this effect; it has " + has);
  }
  TriedStep tried;
  tried.step.effect = model.effects[static_cast<std::size_t>(at - rest.begin())];
  rest.erase(at);
  const RefitContext context(model, logs, options);
  const auto part = [&](double first) {
    return [&progress, first](double share, const std::string& what) {
      if (progress) progress(first + 0.5 * share, what);
    };
  };
  ExtendResult result;
  Judged current = context.as_it_is(model, result.notes, part(0.0));
  tried.next = context.with(current, rest, Others::kEstimatedAnew, part(0.5), &tried.notes);
  tried.step.removed = key;
  tried.step.title = effect_title(effect.effect->info(), model.machine, effect.at) + " removed";
  judge_step(context, effect, current, tried);
  keep(std::move(tried), context, current, result);
  result.stopped_because = result.reason = "the effect was removed as asked";
  finish(std::move(current), start, result);
  return result;
}

ExtendResult improve(const CraneModel& model, const ExtendLogs& logs, const ExtendOptions& options,
                     const SearchProgress& progress) {
  const auto start = Clock::now();
  // the machine stays while effects come, so what is seen of the logs and their faults serves every diagnosis
  const DiagnosisSignals signals =
      diagnosis_signals(model.machine, logs.suspects, logs.references, options.diagnose);
  const ExtendLogs usable = without_faults(logs, signals.set_aside);
  const RefitContext context(model, usable, options);
  // the number of rounds is unknown, so each advances by a share of the remaining progress
  double done = 0.0;
  const auto round = [&](double width) {
    return [&progress, &done, width](double share, const std::string& what) {
      if (progress) progress(done + (1.0 - done) * width * share, what);
    };
  };
  ExtendResult result;
  for (const LogFault& f : signals.set_aside)
    result.notes.push_back("set aside: " + bad_channel_sentence(f.channel));
  Judged current = context.as_it_is(model, result.notes, round(0.05));
  done = 0.05;
  const auto steps_left = [&] { return static_cast<int>(result.steps.size()) < options.max_steps; };
  std::vector<EffectAt> aside;  // effects not kept since the last step that was kept
  std::size_t rejected = 0;
  DiagnoseOptions diagnose_options = options.diagnose;
  try {
    while (result.reason.empty()) {
      diagnose_options.candidates = choices(options, current.model, aside);
      if (diagnose_options.candidates.empty()) {  // an empty list would mean the whole catalogue
        result.reason = "no other effect is left to try";
        break;
      }
      const std::shared_ptr<const Diagnosis> diagnosis = std::make_shared<const Diagnosis>(
          diagnose_signals(current.model, signals, diagnose_options, round(0.4)));
      done += (1.0 - done) * 0.4;
      result.last = diagnosis;
      const std::vector<const DiagnosedEffect*> wanted = to_add(*diagnosis, current.model);
      if (wanted.empty()) result.reason = why_stopped(*diagnosis);
      for (const DiagnosedEffect* e : wanted) {
        if (!steps_left()) {
          result.reason =
              fmt::format("the limit of {} steps is reached; {} would be next", options.max_steps,
                          effect_title(e->effect.effect->info(), model.machine, e->effect.at));
          break;
        }
        TriedStep tried = try_beside_others(context, current, e->effect, round(0.15));
        done += (1.0 - done) * 0.2;
        tried.step.diagnosis = diagnosis;
        if (!worth_keeping(tried.step, options.change)) {
          aside.push_back(e->effect);
          if (helps_here_and_harms_elsewhere(tried.step, options.change))
            add_indistinguishable(*diagnosis, e->effect, aside);  // they would do the same
          ++rejected;
          result.rejected.push_back(std::move(tried.step));
          continue;
        }
        aside.clear();
        if (!e->rivals.empty()) tried.notes.push_back(stands_for(*e));
        keep(std::move(tried), context, current, result);
        if (shapes_opening(current.model.effects.back())) break;
      }
      if (rejected > options.most_rejected && result.reason.empty())
        result.reason = "the effects found do not improve data that took no part";
    }
  } catch (const Interruption&) {  // what was kept so far stays
    result.interrupted = true;
    result.reason = "it was interrupted";
  }
  name_rejected(options.change, result);
  finish(std::move(current), start, result);
  return result;
}

}  // namespace sparflow
