#include "diagnosis/extension/improvement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "diagnosis/selection/effect_intervals.h"
#include "diagnosis/selection/search_state.h"
#include "identification/comparison/error_change.h"
#include "models/effects/plausible.h"
#include "models/effects/registry.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

/// Whether the logs determine that an effect is there at all: the 95 % interval of one of the parameters to which it is
/// proportional excludes zero. True for an effect without such a parameter or without intervals.
bool acts_for_certain(const AppliedEffect& e) {
  if (e.lower95.size() != e.values.size()) return true;
  bool proportional = false;
  for (std::size_t k = 0; k < e.values.size(); ++k) {
    if (!e.effect->info().parameters[k].linear) continue;
    if (e.lower95[k] > 0.0 || e.upper95[k] < 0.0) return true;
    proportional = true;
  }
  return !proportional;
}

/// Whether the error of the quantity that an effect acts on grew significantly; of an effect at no single cylinder, that of
/// any quantity of its stage.
bool harms_its_own_place(const ExtendStep& step, const Machine& machine, const EffectAt& e) {
  const std::vector<HarmedError> harmed = harmed_measured(step);
  const bool one = e.at >= 0 && e.effect->info().place == EffectPlace::kCylinder;
  return std::any_of(harmed.begin(), harmed.end(), [&](const HarmedError& h) {
    return !one || h.at == machine.cylinders[static_cast<std::size_t>(e.at)].name;
  });
}

/// Effects on forces among these that are confused with one, as either of both says; two of single cylinders only of the same.
std::vector<EffectAt> confused_with(const std::vector<EffectAt>& among, const EffectAt& e) {
  const auto names = [](const EffectAt& by, const EffectAt& other) {
    const std::vector<std::string>& list = by.effect->info().confused_with;
    return std::find(list.begin(), list.end(), other.effect->info().id) != list.end();
  };
  std::vector<EffectAt> out;
  for (const EffectAt& c : among) {
    const bool force = c.effect->info().stage == EffectStage::kForce;
    const bool apart = c.at != e.at && c.effect->info().place == EffectPlace::kCylinder &&
                       e.effect->info().place == EffectPlace::kCylinder;
    if (force && !apart && (c.effect == e.effect ? c.at != e.at : names(e, c) || names(c, e)))
      out.push_back(c);
  }
  return out;
}

/// Whether an effect acts on quantities whose laws are learned.
bool acts_on_pressures(const EffectAt& e) {
  const EffectStage stage = e.effect->info().stage;
  return stage == EffectStage::kPressure || stage == EffectStage::kPump;
}

/// Whether the catalogue, which lists usual causes before unusual ones, has one effect before another.
bool stands_before(const EffectAt& a, const EffectAt& b) {
  for (const std::unique_ptr<Effect>& e : effect_catalogue()) {
    if (e.get() == b.effect) return false;
    if (e.get() == a.effect) return true;
  }
  return false;
}

/// Progress of the `done`-th of `count` equal parts of a task.
SearchProgress part_of(const SearchProgress& all, std::size_t done, std::size_t count,
                       const std::string& task) {
  if (!all) return {};
  return [=, &all](double share, const std::string&) {
    all((static_cast<double>(done) + share) / static_cast<double>(count), task);
  };
}

std::vector<EffectAt> without(std::vector<EffectAt> list, const EffectAt& e) {
  std::erase(list, e);
  return list;
}

}  // namespace

bool contains(const std::vector<EffectAt>& list, const EffectAt& e) {
  return std::find(list.begin(), list.end(), e) != list.end();
}

bool Improvement::add(ImproveRound& round, const std::shared_ptr<const Diagnosis>& diagnosis,
                      const SearchProgress& progress) {
  const std::vector<EffectAt> wanted = places(round.wanted);
  Trial trial{places_of(current_.model.effects), {}, diagnosis};
  trial.effects.insert(trial.effects.end(), wanted.begin(), wanted.end());
  const std::vector<EffectAt> kept = diagnosis == nullptr
                                         ? remove(trial, wanted, places(round.removed), progress)
                                         : eliminate(trial, wanted, progress);
  for (const EffectAt& e : kept) {
    TriedStep tried = try_adding(context_, current_, e, progress);
    tried.step.diagnosis = diagnosis;
    keep(std::move(tried), context_, current_, result_);
    added_.push_back(e);
  }
  ++rounds_;
  if (!kept.empty()) aside_.clear();
  round.removed.clear();
  for (ExtendStep& f : trial.failures) {
    round.removed.push_back(f.added);
    aside_.push_back({f.effect.effect, f.effect.at});
    ++rejected_;
    result_.rejected.push_back(std::move(f));
  }
  return !kept.empty();
}

void Improvement::test_again(const SearchProgress& progress) {
  if (rounds_ < 2) return;
  Trial trial{places_of(current_.model.effects), {}, nullptr};
  const std::vector<EffectAt> still = eliminate(trial, added_, progress);
  for (const EffectAt& e : added_) {
    if (!contains(still, e))
      keep(try_removing(context_, current_, e, progress), context_, current_, result_);
  }
  added_ = still;
}

std::optional<CompareResult> Improvement::errors_after(const Joint& joint, const Exchange& change,
                                                       const SearchProgress& progress) const try {
  std::vector<EffectAt> all = without(joint.all, change.out);
  all.push_back(change.in);
  return context_.cross_validated(joint.measured, all, {change.out, change.in}, progress).errors;
} catch (const InputError&) {
  return std::nullopt;
}

std::vector<Improvement::Exchange> Improvement::possible_exchanges(
    const Joint& joint, const SearchProgress& progress) const {
  const std::vector<EffectAt>& asked = context_.options().diagnose.candidates;
  const std::vector<EffectAt> among = asked.empty() ? candidates(context_.machine()) : asked;
  std::vector<Exchange> out;
  for (std::size_t i = 0; i < added_.size(); ++i) {
    const EffectAt& e = added_[i];
    if (e.effect->info().stage != EffectStage::kForce) continue;
    for (const EffectAt& rival : confused_with(among, e)) {
      if (contains(joint.all, rival)) continue;
      Exchange tried{e, rival};
      const std::optional<CompareResult> errors = errors_after(
          joint, tried, part_of(progress, i, added_.size(), "effects that are confused"));
      if (!errors) continue;
      const ErrorChange change = error_change(context_.machine(), joint.measured.errors, *errors,
                                              {{"force"}, ""}, context_.options().change);
      tried.own = change.own;
      tried.deviations = -std::log(change.overall) / change.overall_deviation;
      if (tracing())
        fmt::print(stderr, "exchange of {} for {}: force error {:.4f} times, {:.2f} deviations\n",
                   effect_key(e.effect->info(), context_.machine(), e.at),
                   effect_key(rival.effect->info(), context_.machine(), rival.at), tried.own,
                   tried.deviations);
      out.push_back(tried);
    }
  }
  return out;
}

bool Improvement::beyond_chance(double deviations, std::size_t tried) const {
  const auto tail = [](double z) { return std::erfc(z / std::numbers::sqrt2); };
  return static_cast<double>(tried) * tail(deviations) <
         tail(context_.options().change.standard_errors);
}

std::vector<EffectAt> Improvement::not_tested_on_pressures() const {
  const std::vector<EffectAt>& asked = context_.options().diagnose.candidates;
  std::vector<EffectAt> out = asked.empty() ? candidates(context_.machine()) : asked;
  const std::vector<EffectAt> has = places_of(current_.model.effects);
  std::erase_if(out, [&](const EffectAt& c) {
    const bool failed = std::any_of(
        result_.rejected.begin(), result_.rejected.end(),
        [&](const ExtendStep& r) { return r.effect.effect == c.effect && r.effect.at == c.at; });
    return !acts_on_pressures(c) || failed || contains(has, c);
  });
  return out;
}

void Improvement::add_to_pressures(const SearchProgress& progress) {
  const double refit_moves = context_.options().change.refit_moves;
  std::vector<EffectAt> open = not_tested_on_pressures();
  while (!open.empty() && added_.size() < static_cast<std::size_t>(context_.options().max_steps)) {
    const Joint j = joint({places_of(current_.model.effects), {}, nullptr}, progress);
    std::optional<EffectAt> best;
    double least = 1.0 / refit_moves;
    for (std::size_t i = 0; i < open.size(); ++i) {
      const EffectAt& e = open[i];
      const PressureChange change = change_with(
          j, e, part_of(progress, i, open.size(), "effects on pressures that are not named"));
      if (tracing() && change.ratio != 1.0)
        fmt::print(stderr, "with {}: pressure error {:.4f} times, {:.2f} deviations\n",
                   effect_key(e.effect->info(), context_.machine(), e.at), change.ratio,
                   change.deviations);
      if (change.ratio < least) best = e, least = change.ratio;
    }
    if (!best) return;
    open = without(std::move(open), *best);
    TriedStep tried = try_adding(context_, current_, *best, progress);
    if (!is_sound(tried.step.effect)) continue;
    keep(std::move(tried), context_, current_, result_);
    added_.push_back(*best);
  }
}

PressureChange Improvement::change_with(const Joint& joint, const EffectAt& e,
                                        const SearchProgress& progress) const try {
  std::vector<EffectAt> all = joint.all;
  all.push_back(e);
  return context_.pressure_change(e, joint.model, joint.measured,
                                  context_.cross_validated(joint.measured, all, {e}, progress));
} catch (const InputError&) {  // these logs do not show it
  return {};
}

bool Improvement::is_sound(const AppliedEffect& e) const {
  const std::vector<EffectParameter>& parameters = e.effect->info().parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    if (!parameters[p].choice && !is_absent(parameters[p], e.values[p]) &&
        lies_on_bound(parameters[p], e.values[p]))
      return false;
  }
  return acts_for_certain(e) && beyond_plausible(context_.machine(), e).empty();
}

std::optional<Improvement::Exchange> Improvement::best_exchange(
    const Joint& joint, const SearchProgress& progress) const {
  const ErrorChangeOptions& options = context_.options().change;
  const std::vector<Exchange> tried = possible_exchanges(joint, progress);
  std::optional<Exchange> best;
  for (const Exchange& t : tried) {
    const bool better =
        t.own * options.refit_moves < 1.0 && beyond_chance(t.deviations, tried.size());
    // Where chance may have decided, the usual cause stays, so that the last digit of a log does not choose.
    const bool usual = t.own <= 1.0 && stands_before(t.in, t.out);
    if ((better || usual) && (!best || t.own < best->own)) best = t;
  }
  return best;
}

void Improvement::exchange(const SearchProgress& progress) {
  const std::size_t most = added_.size();  // as many as there are effects, so that it ends
  for (std::size_t turn = 0; turn < most; ++turn) {
    const Trial trial{places_of(current_.model.effects), {}, nullptr};
    const std::optional<Exchange> best = best_exchange(joint(trial, progress), progress);
    if (!best) return;
    TriedStep removed = try_removing(context_, current_, best->out, progress);
    TriedStep added = try_adding(context_, removed.next, best->in, progress);
    if (!acts_for_certain(added.step.effect)) return;
    keep(std::move(removed), context_, current_, result_);
    keep(std::move(added), context_, current_, result_);
    added_ = without(std::move(added_), best->out);
    added_.push_back(best->in);
  }
}

std::vector<EffectAt> Improvement::places(const std::vector<std::string>& keys) const {
  std::vector<EffectAt> out;
  out.reserve(keys.size());
  for (const std::string& key : keys) out.push_back(parse_effect(key, context_.machine()));
  return out;
}

std::vector<EffectAt> Improvement::eliminate(Trial& trial, std::vector<EffectAt> tested,
                                             const SearchProgress& progress) const {
  while (!tested.empty()) {
    std::optional<ExtendStep> weakest = weakest_of(joint(trial, progress), tested, progress);
    if (!weakest) break;
    fail(std::move(*weakest), trial, tested);
  }
  return tested;
}

std::vector<EffectAt> Improvement::remove(Trial& trial, std::vector<EffectAt> tested,
                                          const std::vector<EffectAt>& removed,
                                          const SearchProgress& progress) const {
  for (const EffectAt& e : removed)
    fail(without_one(joint(trial, progress), e, progress).step, trial, tested);
  return tested;
}

void Improvement::fail(ExtendStep step, Trial& trial, std::vector<EffectAt>& tested) {
  const EffectAt e{step.effect.effect, step.effect.at};
  step.diagnosis = trial.diagnosis;
  trial.failures.push_back(std::move(step));
  std::erase(tested, e);
  std::erase(trial.effects, e);
}

Improvement::Joint Improvement::joint(const Trial& trial, const SearchProgress& progress) const {
  Joint j;
  j.model = context_.estimated(current_.model, trial.effects, progress);
  j.all = places_of(j.model.effects);
  j.measured = context_.cross_validated(j.model, j.all, progress);
  j.on_tests = context_.tested_errors(j.model, j.all, progress);
  return j;
}

Improvement::Tested Improvement::without_one(const Joint& joint, const EffectAt& e,
                                             const SearchProgress& progress) const {
  const ExtendOptions& options = context_.options();
  const CraneModel& model = joint.model;
  const std::vector<EffectAt> rest = without(joint.all, e);
  const bool learned = acts_on_pressures(e);
  Tested tested;
  ExtendStep& step = tested.step;
  step.added = effect_key(e.effect->info(), model.machine, e.at);
  step.title = effect_title(e.effect->info(), model.machine, e.at);
  step.effect = model.effects[static_cast<std::size_t>(
      std::find(joint.all.begin(), joint.all.end(), e) - joint.all.begin())];
  const CrossValidated others = context_.cross_validated(joint.measured, rest, {e}, progress);
  judge_step(context_, e, others.errors, joint.measured.errors, step);
  step.judged_on = context_.measured_on();
  if (learned)
    step.change.own = step.change.own_steady =
        context_.pressure_change(e, model, others, joint.measured).ratio;
  if (tracing())
    fmt::print(stderr, "without {}: error {:.4f} times, steady {:.4f}{}\n", step.added,
               1.0 / step.change.own, 1.0 / step.change.own_steady,
               acts_for_certain(step.effect) ? "" : ", not determined");
  step.determined = acts_for_certain(step.effect);
  const double change = std::min(step.change.own, step.change.own_steady);
  const bool falls = change * options.change.refit_moves < 1.0;
  // A leak acts at rest, where no error of a motion shows it; what the diagnosis saw there stands.
  const bool unseen = !learned && std::abs(std::log(step.change.own)) < options.unmoved;
  tested.stays = step.determined && (falls || unseen);
  if (!tested.stays || !joint.on_tests || learned) return tested;
  // Test logs do not choose an effect, but may contradict it.
  ExtendStep test = step;
  judge_step(context_, e, *context_.tested_errors(model, rest, progress), *joint.on_tests, test);
  tested.stays = !harms_its_own_place(test, model.machine, e);
  if (!tested.stays) step = std::move(test);
  return tested;
}

std::optional<ExtendStep> Improvement::weakest_of(const Joint& joint,
                                                  const std::vector<EffectAt>& tested,
                                                  const SearchProgress& progress) const {
  std::optional<ExtendStep> weakest;
  double least = 0.0;
  for (const EffectAt& e : tested) {
    Tested one = without_one(joint, e, progress);
    if (one.stays) continue;
    // an effect that the logs do not determine at all goes first
    const double worth =
        one.step.determined ? -one.step.change.own : -std::numeric_limits<double>::infinity();
    if (weakest && worth >= least) continue;
    least = worth;
    weakest = std::move(one.step);
  }
  return weakest;
}

}  // namespace sparflow
