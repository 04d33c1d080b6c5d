#include "diagnosis/selftest/selftest.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "diagnosis/regression/null_distribution.h"
#include "diagnosis/selftest/selftest_study.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

/// Result for an effect that acts on no channel of these logs: signals are missing, or no motion excites it.
InjectedEffect without_action(const Evidence& evidence, const Machine& machine,
                              const EffectAt& effect) {
  const EffectInfo& info = effect.effect->info();
  InjectedEffect out;
  out.effect = effect;
  out.id = info.id;
  const std::string key = effect_key(info, machine, effect.at);
  out.at = key.size() > info.id.size() ? key.substr(info.id.size() + 1) : "";
  out.stage = effect_stage_name(info.stage);
  out.separated_by = info.separated_by;
  const std::vector<EvidenceKind> kinds = effect.effect->shows_in();
  const bool placed = info.place == EffectPlace::kCylinder;
  const bool measured = std::any_of(
      evidence.channels.begin(), evidence.channels.end(), [&](const EvidenceChannel& c) {
        return std::find(kinds.begin(), kinds.end(), c.kind) != kinds.end() &&
               (!placed || c.kind == EvidenceKind::kPump || c.index == effect.at);
      });
  const bool oil = std::any_of(info.signals.begin(), info.signals.end(), [](const std::string& w) {
    return w.find("oil temperature") != std::string::npos;
  });
  const bool no_oil = std::all_of(evidence.series.begin(), evidence.series.end(),
                                  [](const MachineSeries& s) { return s.oil.size() == 0; });
  out.reason = oil && no_oil ? "not measured: it needs the oil temperature"
               : measured    ? "no motion of these logs excites it"
                          : fmt::format("not measured: it needs {}", fmt::join(info.signals, ", "));
  return out;
}

/// Indices of effects to inject, drawn at random from those with a clear prediction: the stages in turn, those that
/// should be named first.
std::vector<std::size_t> draw_checks(const std::vector<InjectedEffect>& effects,
                                     const SelftestOptions& options) {
  const int count = options.check;
  std::mt19937_64 random(options.search.seed);
  std::vector<std::vector<std::size_t>> groups;
  for (const bool seen : {true, false}) {
    for (const char* stage : {"force", "flow", "pressure", "pump", "sensor"}) {
      groups.emplace_back();
      for (std::size_t i = 0; i < effects.size(); ++i) {
        const InjectedEffect& e = effects[i];
        const bool clear =
            seen ? e.power > options.clearly_seen && e.times95 < options.clearly_seen_times
                 : e.power < options.clearly_unseen && !e.typical.empty();
        if (e.stage == stage && clear) groups.back().push_back(i);
      }
      std::shuffle(groups.back().begin(), groups.back().end(), random);
    }
  }
  std::vector<std::size_t> out;
  const auto take = [&](std::size_t group) {
    if (static_cast<int>(out.size()) >= count || groups[group].empty()) return false;
    out.push_back(groups[group].back());
    groups[group].pop_back();
    return true;
  };
  for (bool any = true; any;) {
    any = false;
    for (std::size_t p = 0; p < 5; ++p) any = take(p) || any;
    for (std::size_t p = 5; p < 10 && count > options.checks_of_seen_only;
         ++p) {  // in each round one that should not be named
      if (!take(p)) continue;
      any = true;
      break;
    }
  }
  return out;
}

std::vector<std::vector<std::string>> sets_of(const std::vector<InjectedEffect>& effects) {
  std::set<std::vector<std::string>> sets;
  for (const InjectedEffect& e : effects) {
    if (e.confused_with.empty()) continue;
    std::vector<std::string> keys = {e.key()};
    for (const Confusion& c : e.confused_with) keys.push_back(c.key);
    std::sort(keys.begin(), keys.end());
    sets.insert(std::move(keys));
  }
  std::vector<std::vector<std::string>> out;
  for (const auto& s : sets) {  // subsets of another set are left out
    const bool inside = std::any_of(sets.begin(), sets.end(), [&](const auto& other) {
      return other.size() > s.size() &&
             std::includes(other.begin(), other.end(), s.begin(), s.end());
    });
    if (!inside) out.push_back(s);
  }
  return out;
}

/// One of the effects of a set at its typical size, and the others as its rivals.
IndistinguishableSet as_set(const std::vector<std::string>& keys,
                            const std::vector<InjectedEffect>& effects) {
  const auto named = [&](const std::string& key) {
    return std::find_if(effects.begin(), effects.end(),
                        [&](const InjectedEffect& e) { return e.key() == key; });
  };
  // the effect that has all others as rivals, which need not hold for every member
  const auto whole = std::find_if(keys.begin(), keys.end(), [&](const std::string& key) {
    return named(key)->confused_with.size() + 1 == keys.size();
  });
  const InjectedEffect& first = *named(whole != keys.end() ? *whole : keys.front());
  IndistinguishableSet set{{first.effect.effect, first.effect.at, {}, {}, {}}, {}};
  for (std::size_t p = 0; p < first.typical.size(); ++p)
    set.found.values.push_back(first.typical[p].value *
                               first.effect.effect->info().parameters[p].si);
  for (const std::string& key : keys) {
    if (key != first.key()) set.rivals.push_back(named(key)->effect);
  }
  return set;
}

/// The evidence of the logs; their number and length enter `out`.
SelftestEvidence evidence_of(const CraneModel& model, const std::vector<Log>& logs,
                             const std::vector<Log>& references, const SelftestOptions& options,
                             Selftest& out) {
  std::vector<MachineSignals> suspects, pinned;
  for (const Log& log : logs) {
    suspects.push_back(make_signals(model.machine, log, options.signals));
    out.samples += static_cast<double>(log.samples());
    out.duration += log.time.size() > 0 ? log.time[log.time.size() - 1] - log.time[0] : 0.0;
  }
  for (const Log& log : references)
    pinned.push_back(make_signals(model.machine, log, options.signals));
  out.logs = logs.size();
  out.references = references.size();
  SelftestEvidence seen;
  seen.evidence = collect_evidence(model, suspects, pinned, nullptr, options.evidence);
  if (!references.empty())
    seen.alone = collect_evidence(model, suspects, {}, nullptr, options.evidence);
  seen.fit = fit_effects(seen.evidence, {});
  return seen;
}

/// A sentence for each channel whose residual is so large that something is probably missing already.
void note_large_residuals(const SelftestEvidence& logs, const SelftestOptions& options,
                          Selftest& out) {
  for (std::size_t c = 0; c < logs.evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = logs.evidence.channels[c];
    const double ratio = logs.fit.noise[c].deviation() / channel.noise_floor;
    if (!(ratio > options.suspicious_noise)) continue;
    out.residual_over_noise = std::max(out.residual_over_noise, ratio);
    out.notes.push_back(fmt::format(
        "{}: the residual is {:.0f} times the noise floor and counts as noise here; `diagnose` may "
        "find its cause, and more effects can then be named",
        channel.text, ratio));
  }
}

/// The effects to be tested: those asked for, else the catalogue without the effects of the model.
std::vector<EffectAt> effects_to_inject(const CraneModel& model, const SelftestOptions& options) {
  return options.candidates.empty() ? effects_not_in(model) : options.candidates;
}

NullDistribution null_distribution_of(const std::vector<SearchCandidate>& all,
                                      const SelftestEvidence& logs, const SearchOptions& search) {
  std::vector<NullCandidate> null_candidates;
  null_candidates.reserve(all.size());
  for (const SearchCandidate& c : all)
    null_candidates.push_back(
        {&c.designs, c.penalty, c.optional_penalty, c.optional_shape_penalty});
  std::mt19937_64 random(search.seed);
  return simulate_null_distribution({logs.evidence, logs.fit}, null_candidates, search.simulations,
                                    random, search.regression);
}

/// Sorts effects into the order of `wanted`.
void sort_as(const std::vector<EffectAt>& wanted, std::vector<InjectedEffect>& effects) {
  const auto place = [&](const InjectedEffect& e) {
    return std::find_if(wanted.begin(), wanted.end(),
                        [&](const EffectAt& w) {
                          return w.effect == e.effect.effect && w.at == e.effect.at;
                        }) -
           wanted.begin();
  };
  std::sort(effects.begin(), effects.end(),
            [&](const auto& a, const auto& b) { return place(a) < place(b); });
}

}  // namespace

Selftest selftest(const CraneModel& model, const std::vector<Log>& logs,
                  const std::vector<Log>& references, const SelftestOptions& options,
                  const SearchProgress& progress) {
  if (logs.empty()) throw InputError({}, "logs", "no log to test: give at least one with --log");
  const auto start = std::chrono::steady_clock::now();
  const auto report = [&](double share, const std::string& what) {
    if (progress) progress(share, what);
  };
  Selftest out;
  report(0.02, "collecting the evidence");
  out.false_alarm = options.search.false_alarm;
  const SelftestEvidence seen = evidence_of(model, logs, references, options, out);
  out.notes = seen.evidence.notes;
  note_large_residuals(seen, options, out);
  report(0.1, "signatures of the effects");
  const std::vector<EffectAt> wanted = effects_to_inject(model, options);
  std::vector<SearchCandidate> all = search_candidates(seen.evidence, wanted);
  for (const EffectAt& w : wanted) {
    const bool acts = std::any_of(all.begin(), all.end(), [&](const SearchCandidate& c) {
      return c.effect.effect == w.effect && c.effect.at == w.at;
    });
    if (!acts) out.effects.push_back(without_action(seen.evidence, model.machine, w));
  }
  report(0.3, "null distribution of the largest gain");
  const NullDistribution null = null_distribution_of(all, seen, options.search);
  out.threshold = null.threshold(options.search.false_alarm);
  report(0.5, "power and rivals");
  SelftestStudy study(model.machine, seen, std::move(all), null, options);
  const std::vector<InjectedEffect> tested = study.run();

  const std::vector<std::size_t> drawn = draw_checks(tested, options);
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    const std::size_t i = drawn[k];
    report(0.6 + 0.35 * static_cast<double>(k) / static_cast<double>(drawn.size()),
           "injecting " + tested[i].key());
    InjectionCheck check =
        inject_and_search(seen.evidence, seen.fit,
                          {study.candidate(i).designs[study.size(i).typical], study.size(i).theta,
                           options.search.seed + static_cast<unsigned>(k)},
                          wanted, options);
    check.power = tested[i].power;
    check.predicted = tested[i].visibility == Visibility::kSeen;
    out.checks.push_back(std::move(check));
  }
  out.sets = sets_of(tested);
  report(0.97, "motions that would distinguish the effects");
  for (std::size_t k = 0; k < std::min(kSetsWithMotion, out.sets.size()); ++k) {
    out.experiments.push_back(next_experiment(model, seen.evidence, seen.fit,
                                              as_set(out.sets[k], tested), options.experiment));
    out.experiments.back().decisive_nats = options.search.same_nats;
  }
  out.effects.insert(out.effects.end(), tested.begin(), tested.end());
  sort_as(wanted, out.effects);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report(1.0, "done");
  return out;
}

}  // namespace sparflow
