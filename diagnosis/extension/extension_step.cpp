#include "diagnosis/extension/extension_step.h"

#include <fmt/format.h>

#include <algorithm>

namespace sparflow {
namespace {

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

std::string percent_text(double ratio) {
  return ratio <= 1.0 ? fmt::format("{:.1f} % smaller", 100.0 * (1.0 - ratio))
                      : fmt::format("{:.1f} % larger", 100.0 * (ratio - 1.0));
}

}  // namespace

std::vector<HarmedError> harmed_measured(const ExtendStep& step) {
  std::vector<HarmedError> out;
  for (const HarmedError& h : step.change.harmed) {
    const bool measured = h.stage == "force" || h.stage == "flow";
    const bool own_stage_alone = step.stage == "force" || step.stage == "flow";
    if (own_stage_alone ? h.stage == step.stage : measured) out.push_back(h);
  }
  return out;
}

void judge_step(const RefitContext& context, const EffectAt& e, const CompareResult& before,
                const CompareResult& after, ExtendStep& step) {
  const Machine& machine = context.machine();
  step.stage = effect_stage_name(e.effect->info().stage);
  step.before = before;
  step.after = after;
  step.judged_on = context.judged_on();
  step.change = error_change(machine, before, after, {{step.stage}, place_name(machine, e)},
                             context.options().change);
}

TriedStep try_adding(const RefitContext& context, const Judged& current, const EffectAt& add,
                     const SearchProgress& progress) {
  const Machine& machine = current.model.machine;
  const EffectInfo& info = add.effect->info();
  std::vector<EffectAt> effects = places_of(current.model.effects);
  effects.push_back(add);
  TriedStep tried;
  tried.next = context.with(current, effects, progress, &tried.notes);
  tried.step.added = effect_key(info, machine, add.at);
  tried.step.title = effect_title(info, machine, add.at);
  tried.step.effect = tried.next.model.effects.back();
  judge_step(context, add, current.error, tried.next.error, tried.step);
  return tried;
}

TriedStep try_removing(const RefitContext& context, const Judged& current, const EffectAt& effect,
                       const SearchProgress& progress) {
  std::vector<EffectAt> rest = places_of(current.model.effects);
  const auto at = std::find(rest.begin(), rest.end(), effect);
  TriedStep tried;
  tried.step.effect = current.model.effects[static_cast<std::size_t>(at - rest.begin())];
  rest.erase(at);
  tried.next = context.with(current, rest, progress, &tried.notes);
  tried.step.removed = effect_key(effect.effect->info(), current.model.machine, effect.at);
  tried.step.title =
      effect_title(effect.effect->info(), current.model.machine, effect.at) + " removed";
  judge_step(context, effect, current.error, tried.next.error, tried.step);
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

void finish(Judged current, StepClock::time_point start, ExtendResult& result) {
  result.model = std::move(current.model);
  if (!result.model.steps.empty() && (!result.steps.empty()))
    result.model.steps.back().stopped_because = result.stopped_because;
  result.seconds = std::chrono::duration<double>(StepClock::now() - start).count();
}

bool contradicted(const ExtendStep& step, const ExtendOptions& options) {
  return step.change.own > options.change.largest_own || !harmed_measured(step).empty();
}

std::string against(const ExtendStep& step, const ExtendOptions& options) {
  if (!step.determined)
    return "estimated together with the other effects, its 95 % interval contains zero";
  const std::string error = fmt::format("with it, the error on the {} is {} where it acts",
                                        step.judged_on, percent_text(step.change.own));
  if (step.change.own > options.change.largest_own) return error;
  std::vector<std::string> harm;
  for (const HarmedError& h : harmed_measured(step)) harm.push_back(h.sentence);
  if (!harm.empty()) return fmt::format("on the {} {}", step.judged_on, fmt::join(harm, ", "));
  return error + ", no more than learning anew may change it";
}

}  // namespace sparflow
