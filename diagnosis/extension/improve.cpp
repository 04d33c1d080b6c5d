#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "diagnosis/extension/extension_step.h"
#include "diagnosis/extension/improve_round.h"
#include "diagnosis/extension/improvement.h"
#include "models/effects/registry.h"
#include "models/math/error.h"
#include "models/math/interruption.h"

namespace sparflow {
namespace {

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

}  // namespace

ExtendResult improve(const CraneModel& model, const ExtendLogs& logs, const ExtendOptions& options,
                     const SearchProgress& progress) {
  const auto start = StepClock::now();
  // the machine stays while effects come, so what is seen of the logs and their faults serves every diagnosis
  const DiagnosisSignals signals =
      diagnosis_signals(model.machine, logs.suspects, logs.references, options.diagnose);
  const RefitContext context(model, logs, options);
  // the number of rounds is unknown, so each advances by a share of the remaining progress
  double done = 0.0;
  const auto part = [&](double width) {
    return [&progress, &done, width](double share, const std::string& what) {
      if (progress) progress(done + (1.0 - done) * width * share, what);
    };
  };
  ExtendResult result;
  result.notes = context.set_aside();
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
    improvement.add_to_pressures(part(0.4));
    done += (1.0 - done) * 0.4;
    improvement.exchange(part(0.6));
    done += (1.0 - done) * 0.6;
    improvement.test_again(part(1.0));
  } catch (const Interruption&) {  // what was kept so far stays
    result.interrupted = true;
    result.reason = "it was interrupted";
  }
  name_rejected(options, result);
  finish(std::move(current), start, result);
  return result;
}

}  // namespace sparflow
