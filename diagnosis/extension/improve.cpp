#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "diagnosis/extension/extension_step.h"
#include "diagnosis/extension/improve_round.h"
#include "identification/data_checks/set_aside.h"
#include "models/effects/registry.h"
#include "models/math/error.h"
#include "models/math/interruption.h"

namespace sparflow {
namespace {

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

/// Whether an effect changes the valve opening on which other effects of the valve act (a lag after a dead band).
bool shapes_opening(const AppliedEffect& e) {
  const Eigen::VectorXd small = Eigen::Vector2d(1e-3, -1e-3);
  Eigen::VectorXd opening = small;
  e.effect->shape_opening(e.at, e.at, e.values, opening);
  return opening != small;
}

/// Makes `stopped_because` of the reason, with each effect that was not kept in the end, and why.
void name_rejected(const ExtendOptions& options, ExtendResult& result) {
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

bool contains(const std::vector<EffectAt>& list, const EffectAt& e) {
  return std::find(list.begin(), list.end(), e) != list.end();
}

std::vector<EffectAt> without(std::vector<EffectAt> list, const EffectAt& e) {
  std::erase(list, e);
  return list;
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

/// What one round adds of the effects that a diagnosis names, at most `most`. Where one of them shapes a valve's opening,
/// other effects on that cylinder's flow wait for the next diagnosis, because they act on the shaped opening.
std::vector<EffectAt> of_one_round(const std::vector<const DiagnosedEffect*>& named,
                                   std::size_t most) {
  std::vector<int> shaped;
  for (const DiagnosedEffect* e : named)
    if (shapes_opening(e->applied)) shaped.push_back(e->effect.at);
  std::vector<EffectAt> out;
  for (const DiagnosedEffect* e : named) {
    const bool waits = e->effect.effect->info().stage == EffectStage::kFlow &&
                       !shapes_opening(e->applied) &&
                       std::find(shaped.begin(), shaped.end(), e->effect.at) != shaped.end();
    if (!waits && out.size() < most) out.push_back(e->effect);
  }
  return out;
}

/// Repeated rounds of diagnosis, joint estimate and backward elimination.
class Improvement {
 public:
  Improvement(const RefitContext& context, ExtendResult& result, Judged& current)
      : context_(context), result_(result), current_(current) {}

  /// Estimates the effects of a round together with those of the model and removes what the data do not bear out. The round
  /// gets what was removed; of one that an earlier run has made, that is removed and nothing else is tested.
  /// @param diagnosis that named them; null in a round of an earlier run
  /// @return whether anything was kept
  bool add(ImproveRound& round, const std::shared_ptr<const Diagnosis>& diagnosis,
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

  /// Tests the effects of former rounds again beside those that came after them, and removes what has become useless.
  void test_again(const SearchProgress& progress) {
    if (rounds_ < 2) return;
    Trial trial{places_of(current_.model.effects), {}, nullptr};
    const std::vector<EffectAt> still = eliminate(trial, added_, progress);
    for (const EffectAt& e : added_) {
      if (!contains(still, e))
        keep(try_removing(context_, current_, e, progress), context_, current_, result_);
    }
    added_ = still;
  }

  /// Effects that the next diagnosis must not name.
  const std::vector<EffectAt>& excluded() const { return aside_; }
  std::size_t rejected() const { return rejected_; }
  std::size_t added() const { return added_.size(); }

 private:
  /// A set of effects, and what was removed from it.
  struct Trial {
    std::vector<EffectAt> effects;
    std::vector<ExtendStep> failures;
    std::shared_ptr<const Diagnosis> diagnosis;
  };

  /// A set of effects estimated together, with the errors by which each of them is judged.
  struct Joint {
    Judged judged;
    std::vector<EffectAt> all;
    CompareResult measured;
    std::optional<CompareResult> on_tests;
  };
  /// An effect taken out of a joint set, and whether the data bear it out.
  struct Tested {
    ExtendStep step;
    bool stays = false;
  };

  std::vector<EffectAt> places(const std::vector<std::string>& keys) const {
    std::vector<EffectAt> out;
    out.reserve(keys.size());
    for (const std::string& key : keys) out.push_back(parse_effect(key, context_.machine()));
    return out;
  }

  /// Backward elimination: removes from the set the one of `tested` that the data bear out least, until they bear out all.
  /// @return those of `tested` that stay
  std::vector<EffectAt> eliminate(Trial& trial, std::vector<EffectAt> tested,
                                  const SearchProgress& progress) const {
    while (!tested.empty()) {
      std::optional<ExtendStep> weakest = weakest_of(joint(trial, progress), tested, progress);
      if (!weakest) break;
      fail(std::move(*weakest), trial, tested);
    }
    return tested;
  }

  /// Removes these effects from the set, as an elimination did before. @return those of `tested` that stay
  std::vector<EffectAt> remove(Trial& trial, std::vector<EffectAt> tested,
                               const std::vector<EffectAt>& removed,
                               const SearchProgress& progress) const {
    for (const EffectAt& e : removed)
      fail(without_one(joint(trial, progress), e, progress).step, trial, tested);
    return tested;
  }

  static void fail(ExtendStep step, Trial& trial, std::vector<EffectAt>& tested) {
    const EffectAt e{step.effect.effect, step.effect.at};
    step.diagnosis = trial.diagnosis;
    trial.failures.push_back(std::move(step));
    std::erase(tested, e);
    std::erase(trial.effects, e);
  }

  Joint joint(const Trial& trial, const SearchProgress& progress) const {
    Joint j;
    j.judged = context_.with(current_, trial.effects, progress);
    j.all = places_of(j.judged.model.effects);
    j.measured = context_.measured_errors(j.judged.model, j.all, progress);
    j.on_tests = context_.tested_errors(j.judged.model, j.all, progress);
    return j;
  }

  /// The step that takes one effect out of a joint set. The errors of forces and flows are those of a cross-validation;
  /// effects on pressures alone are judged as a step is.
  Tested without_one(const Joint& joint, const EffectAt& e, const SearchProgress& progress) const {
    const ExtendOptions& options = context_.options();
    const CraneModel& model = joint.judged.model;
    const std::vector<EffectAt> rest = without(joint.all, e);
    const EffectStage stage = e.effect->info().stage;
    const bool learned = stage == EffectStage::kPressure || stage == EffectStage::kPump;
    Tested tested;
    ExtendStep& step = tested.step;
    step.added = effect_key(e.effect->info(), model.machine, e.at);
    step.title = effect_title(e.effect->info(), model.machine, e.at);
    step.effect = model.effects[static_cast<std::size_t>(
        std::find(joint.all.begin(), joint.all.end(), e) - joint.all.begin())];
    if (learned) {
      judge_step(context_, e, context_.with(joint.judged, rest, progress).error, joint.judged.error,
                 step);
    } else {
      judge_step(context_, e, context_.measured_errors(model, rest, progress), joint.measured,
                 step);
      step.judged_on = context_.measured_on();
    }
    step.determined = is_determined(step.effect);
    const bool falls = step.change.own * options.change.refit_moves < 1.0;
    // A leak acts at rest, where no error of a motion shows it; what the diagnosis saw there stands.
    const bool unseen = std::abs(std::log(step.change.own)) < options.unmoved;
    tested.stays = step.determined && (falls || unseen);
    if (!tested.stays || !joint.on_tests || learned) return tested;
    // Test logs do not choose an effect, but may contradict it.
    ExtendStep test = step;
    judge_step(context_, e, *context_.tested_errors(model, rest, progress), *joint.on_tests, test);
    tested.stays = !harms_its_own_place(test, model.machine, e);
    if (!tested.stays) step = std::move(test);
    return tested;
  }

  /// Of the tested effects the one that the data bear out least, if they do not bear out all.
  std::optional<ExtendStep> weakest_of(const Joint& joint, const std::vector<EffectAt>& tested,
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

  const RefitContext& context_;
  ExtendResult& result_;
  Judged& current_;
  std::vector<EffectAt> added_;  ///< by this call, and still there
  std::vector<EffectAt> aside_;  ///< not kept since the last round that kept one
  std::size_t rejected_ = 0;
  int rounds_ = 0;
};

}  // namespace

ExtendResult improve(const CraneModel& model, const ExtendLogs& logs, const ExtendOptions& options,
                     const SearchProgress& progress) {
  const auto start = StepClock::now();
  // the machine stays while effects come, so what is seen of the logs and their faults serves every diagnosis
  const DiagnosisSignals signals =
      diagnosis_signals(model.machine, logs.suspects, logs.references, options.diagnose);
  const ExtendLogs usable = without_faults(logs, signals.set_aside);
  const RefitContext context(model, usable, options);
  // the number of rounds is unknown, so each advances by a share of the remaining progress
  double done = 0.0;
  const auto part = [&](double width) {
    return [&progress, &done, width](double share, const std::string& what) {
      if (progress) progress(done + (1.0 - done) * width * share, what);
    };
  };
  ExtendResult result;
  for (const LogFault& f : signals.set_aside)
    result.notes.push_back("set aside: " + bad_channel_sentence(f.channel));
  Judged current = context.as_it_is(model, result.notes, part(0.05));
  done = 0.05;
  Improvement improvement(context, result, current);
  DiagnoseOptions diagnose_options = options.diagnose;
  const auto most = static_cast<std::size_t>(options.max_steps);
  try {
    int rounds = 0;
    for (; std::optional<ImproveRound> made = round_of(options.journal, rounds + 1); ++rounds) {
      improvement.add(*made, nullptr, part(0.3));
      add_notes(made->notes, result);
      done += (1.0 - done) * 0.5;
    }
    while (result.reason.empty()) {
      diagnose_options.candidates = choices(options, current.model, improvement.excluded());
      if (diagnose_options.candidates.empty()) {  // an empty list would mean the whole catalogue
        result.reason = "no other effect is left to try";
        break;
      }
      const std::shared_ptr<const Diagnosis> diagnosis = std::make_shared<const Diagnosis>(
          diagnose_signals(current.model, signals, diagnose_options, part(0.3)));
      done += (1.0 - done) * 0.3;
      result.last = diagnosis;
      const std::vector<const DiagnosedEffect*> named = to_add(*diagnosis, current.model);
      if (named.empty()) {
        result.reason = why_stopped(*diagnosis);
      } else if (improvement.added() >= most) {
        const EffectAt& next = named.front()->effect;
        result.reason =
            fmt::format("the limit of {} steps is reached; {} would be next", options.max_steps,
                        effect_title(next.effect->info(), model.machine, next.at));
      } else {
        ImproveRound round;
        for (const EffectAt& e : of_one_round(named, most - improvement.added()))
          round.wanted.push_back(effect_key(e.effect->info(), model.machine, e.at));
        if (improvement.add(round, diagnosis, part(0.3))) {
          for (const DiagnosedEffect* e : named)
            if (!e->rivals.empty() && contains(places_of(current.model.effects), e->effect))
              round.notes.push_back(stands_for(*e));
          add_notes(round.notes, result);
        }
        done += (1.0 - done) * 0.3;
        if (improvement.rejected() > options.most_rejected)
          result.reason = "the effects found do not improve data that took no part";
        // The result names the last diagnosis, so a round that none follows is made again.
        if (result.reason.empty() &&
            !choices(options, current.model, improvement.excluded()).empty())
          keep_round(options.journal, ++rounds, round);
      }
    }
    improvement.test_again(part(0.5));
  } catch (const Interruption&) {  // what was kept so far stays
    result.interrupted = true;
    result.reason = "it was interrupted";
  }
  name_rejected(options, result);
  finish(std::move(current), start, result);
  return result;
}

}  // namespace sparflow
