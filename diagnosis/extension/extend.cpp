#include "diagnosis/extension/extend.h"

#include <fmt/format.h>

#include <algorithm>

#include "diagnosis/extension/extension_step.h"
#include "models/math/error.h"

namespace sparflow {

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
  const auto start = StepClock::now();
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
  result.notes = context.set_aside();
  Judged current = context.as_it_is(model, result.notes, part(0));
  for (std::size_t i = 0; i < add.size(); ++i) {
    TriedStep tried = try_adding(context, current, add[i], part(i + 1));
    if (contradicted(tried.step, options)) {
      tried.notes.push_back(
          fmt::format("{} is in the model as asked, but the data contradict it: {}",
                      tried.step.title, against(tried.step, options)));
    }
    keep(std::move(tried), context, current, result);
  }
  result.stopped_because = result.reason = "all effects asked for were added";
  finish(std::move(current), start, result);
  return result;
}

ExtendResult take_back(const CraneModel& model, const EffectAt& effect, const ExtendLogs& logs,
                       const ExtendOptions& options, const SearchProgress& progress) {
  const auto start = StepClock::now();
  const std::string key = effect_key(effect.effect->info(), model.machine, effect.at);
  const std::vector<EffectAt> all = places_of(model.effects);
  if (std::find(all.begin(), all.end(), effect) == all.end()) {
    std::string has;
    for (const AppliedEffect& e : model.effects)
      has += (has.empty() ? "" : ", ") + e.key(model.machine);
    throw InputError({}, key,
                     has.empty() ? "the model has no effects to remove"
                                 : "the model does not have this effect; it has " + has);
  }
  const RefitContext context(model, logs, options);
  const auto part = [&](double first) {
    return [&progress, first](double share, const std::string& what) {
      if (progress) progress(first + 0.5 * share, what);
    };
  };
  ExtendResult result;
  result.notes = context.set_aside();
  Judged current = context.as_it_is(model, result.notes, part(0.0));
  TriedStep tried = try_removing(context, current, effect, part(0.5));
  keep(std::move(tried), context, current, result);
  result.stopped_because = result.reason = "the effect was removed as asked";
  finish(std::move(current), start, result);
  return result;
}

}  // namespace sparflow
