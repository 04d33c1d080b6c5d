#include "diagnosis/verdict/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "diagnosis/experiment/experiment.h"
#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/residual/residual_model.h"
#include "diagnosis/selection/effect_estimate.h"
#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/reference_comparison.h"
#include "diagnosis/verdict/residual_levels.h"
#include "diagnosis/verdict/unmodelled_structure.h"
#include "identification/data_checks/set_aside.h"
#include "models/effects/plausible.h"
#include "models/math/error.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Fit in which the laws of the found effects may have another exponent (a cushion with x^2.5): what that explains is
/// model-form error and no unmodelled structure.
EffectFit fit_with_other_powers(const Diagnosis& d, const RegressionOptions& options) {
  std::vector<EffectDesign> powers;
  powers.reserve(d.search.found.size());
  std::vector<const EffectDesign*> designs;
  designs.reserve(2 * d.search.found.size());
  Index first = 0;
  for (const FoundEffect& f : d.search.found) {
    designs.push_back(&f.design);
    powers.push_back(
        other_power(f.design, d.search.final.theta.segment(first, f.design.linear), options));
    first += f.design.linear;
  }
  for (const EffectDesign& p : powers) {
    if (p.acts()) designs.push_back(&p);
  }
  if (designs.size() == d.search.found.size()) return d.search.final;
  FitControl control;
  control.keep_residuals = true;
  return fit_effects(d.evidence, designs, &d.search.final, control);
}

/// Whether model and found effects explain the jumps of a pump pressure as well as the rest of it. The pump is then
/// late or at its limit, and the sensor is not faulty.
bool follows_steps(const Diagnosis& d, const EffectFit& fit, const BadChannel& bad,
                   std::size_t log) {
  // a jump that is shorter than the filter is hardly visible after it
  const bool brief = std::any_of(bad.stretches.begin(), bad.stretches.end(), [&](const auto& jump) {
    return jump.second - jump.first < d.evidence.window;
  });
  if (brief) return false;
  for (std::size_t i = 0; i < d.evidence.channels.size(); ++i) {
    const EvidenceChannel& c = d.evidence.channels[i];
    if (c.kind != EvidenceKind::kPump || "p_" + c.at != bad.channel) continue;
    const VectorXd& time = d.evidence.series[log].time;
    double squares = 0.0, n = 0.0;
    for (std::size_t b = 0; b < c.blocks.size(); ++b) {
      if (static_cast<std::size_t>(c.log[b]) != log) continue;
      for (Index row = c.blocks[b].first; row < c.blocks[b].last; ++row) {
        const double t = time[c.sample[static_cast<std::size_t>(row)]];
        const bool inside =
            std::any_of(bad.stretches.begin(), bad.stretches.end(),
                        [&](const auto& jump) { return t > jump.first && t < jump.second; });
        if (!inside) continue;
        squares += std::pow(fit.residual[i][row], 2);
        n += 1.0;
      }
    }
    return n > 0.0 &&
           std::sqrt(squares / n) < d.thresholds.largest_in_jumps * robust_std(fit.residual[i]);
  }
  return false;
}

/// The faulty channels whose jumps known physics does not explain.
std::vector<LogFault> sensor_faults(const Diagnosis& d, const std::vector<LogFault>& faults) {
  std::vector<LogFault> out;
  if (faults.empty()) return out;
  const EffectFit fit = fit_without(d, d.search.found.size());
  for (const LogFault& f : faults) {
    if (!follows_steps(d, fit, f.channel, f.log)) out.push_back(f);
  }
  return out;
}

/// Drops effects that lower the error of no channel by as much as a report states as evidence: long logs prove what nobody can see, and
/// so small a part of a residual is as well one of a law that is not exact.
void drop_unseen_effects(Diagnosis& d) {
  if (!d.evidence.options.mechanisms.act(Mechanism::kSize)) return;
  std::vector<FoundEffect>& found = d.search.found;
  const std::size_t before = found.size();
  for (std::size_t i = found.size(); i-- > 0;) {
    const double reduction = largest_reduction(d, i);
    if (!(reduction < d.thresholds.least_reduction)) continue;
    const EffectAt& effect = found[i].design.effect;
    d.notes.push_back(
        fmt::format("{} is not named: it lowers no error by more than {:.1f} %",
                    effect_key(effect.effect->info(), *d.evidence.series[0].machine, effect.at),
                    100.0 * (1.0 - 1.0 / d.thresholds.least_reduction)));
    found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (found.size() < before) d.search.final = fit_without(d, found.size());
}

/// Drops minor effects when other effects remain; their error becomes `unexplained`.
/// @return whether there were any
bool drop_minor_effects(Diagnosis& d, const SearchOptions& options) {
  std::vector<DiagnosedEffect> all;
  all.reserve(d.search.found.size());
  for (std::size_t i = 0; i < d.search.found.size(); ++i)
    all.push_back(describe_effect(d, i, options));
  const auto minor = std::count_if(all.begin(), all.end(),
                                   [&](const DiagnosedEffect& e) { return is_minor_effect(d, e); });
  if (minor == 0 || minor == std::ssize(all)) return false;
  std::vector<FoundEffect> kept;
  kept.reserve(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const DiagnosedEffect& e = all[i];
    if (!is_minor_effect(d, e)) {
      kept.push_back(std::move(d.search.found[i]));
      continue;
    }
    d.notes.push_back(
        fmt::format("{} is a minor effect and not named: with it, {:.0f} % of the squared error "
                    "of the {} remain unexplained",
                    e.key(), 100.0 * (1.0 - explained_share(d, e)),
                    d.evidence.channels[e.channels.front().channel].text));
    if (!d.unexplained) d.unexplained = describe_minor_effect(d.evidence, e);
  }
  d.search.found = std::move(kept);
  d.search.final = fit_without(d, d.search.found.size());
  return true;
}

/// Replaces the values by a joint estimate of all effects, the one that an extension of the model gets. An effect that these values
/// make no finding is dropped, the last one found first, because others may hold part of it.
void set_joint_estimates(const CraneModel& model, const DiagnosisSignals& signals,
                         const EvidenceOptions& evidence, Diagnosis& d) {
  EstimateOptions options;
  options.evidence = evidence;
  options.differences = !signals.references.empty();
  std::vector<FoundEffect>& found = d.search.found;
  const std::size_t before = found.size();
  EffectEstimate all;
  while (!found.empty()) {
    std::vector<EffectAt> wanted;
    wanted.reserve(found.size());
    options.starts.clear();
    for (const FoundEffect& f : found) {
      wanted.push_back(f.design.effect);
      options.starts.push_back(f.design.shape);
    }
    all = estimate_effects(model, wanted,
                           {signals.suspects,
                            signals.references,
                            {},
                            effects_in_references(model, signals.references)},
                           {}, options);
    if (tracing())
      for (std::size_t k = 0; k < found.size(); ++k)
        fmt::print(stderr, "  together {}: {:.4g}, 95 % from {:.4g} to {:.4g}{}\n",
                   effect_key(wanted[k].effect->info(), model.machine, wanted[k].at),
                   fmt::join(all.effects[k].values, " "), fmt::join(all.effects[k].lower95, " "),
                   fmt::join(all.effects[k].upper95, " "),
                   all.significant[k] ? "" : ", not significant");
    std::ptrdiff_t at = std::ssize(found) - 1;
    std::string why;
    for (; at >= 0; --at) {
      const auto k = static_cast<std::size_t>(at);
      why = why_no_finding(all, found[k].design, k);
      if (!why.empty()) break;
    }
    if (at < 0) break;
    const EffectAt& dropped = wanted[static_cast<std::size_t>(at)];
    d.notes.push_back(fmt::format(
        "{} is not named: {}", effect_key(dropped.effect->info(), model.machine, dropped.at), why));
    found.erase(found.begin() + at);
  }
  if (found.size() < before) d.search.final = fit_without(d, found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i].values = all.effects[i].values;
    found[i].lower95 = all.effects[i].lower95;
    found[i].upper95 = all.effects[i].upper95;
    found[i].covariance = all.effects[i].covariance;
  }
}

/// The rivals that form an indistinguishable set with a found effect.
std::vector<EffectAt> rivals_of(const FoundEffect& found, const SearchOptions& options) {
  std::vector<EffectAt> rivals;
  for (const auto& [rival, worse] : found.alternatives) {
    if (worse < same_within(found, options)) rivals.push_back(rival);
  }
  return rivals;
}

/// The candidates of a search: those asked for, else the catalogue. With references, another value of an effect that the
/// model has is a change, too.
std::vector<EffectAt> searched_for(const CraneModel& model, const DiagnoseOptions& options,
                                   bool has_reference) {
  if (!options.candidates.empty()) return options.candidates;
  return has_reference ? candidates(model.machine) : effects_not_in(model);
}

/// Searches for the effects that explain the evidence.
void search(const CraneModel& model, const DiagnoseOptions& options, const SearchProgress& progress,
            Diagnosis& d) {
  d.search = search_effects(d.evidence, searched_for(model, options, d.evidence.has_reference()),
                            options.search, progress);
  if (d.search.updated_evidence) d.evidence = *d.search.updated_evidence;
  d.notes.insert(d.notes.end(), d.search.notes.begin(), d.search.notes.end());
  d.p_value = d.search.p_value;
  for (const auto& [effect, gain] : d.search.ranking) {
    d.ranking.emplace_back(effect_key(effect.effect->info(), model.machine, effect.at), gain);
  }
}

/// Whether references cannot tell if the suspect logs differ there, so that it is a note and no change.
bool noted_as_untold(Diagnosis& d, const Unexplained& left) {
  if (!d.evidence.has_reference() || chance_beyond_references(d, left.channel)) return false;
  d.notes.push_back(left.sentence +
                    "; the references have too few motions there to tell whether that has changed");
  return true;
}

/// Finds the structure that the effects leave in the residual and tells the worst of it.
/// @return the structure above the share from which it counts
std::vector<ResidualStructure> find_unmodelled(const DiagnoseOptions& options, Diagnosis& d) {
  const std::vector<ResidualStructure> left = find_residual_structure(
      d.evidence, fit_with_other_powers(d, options.search.regression), options.residual);
  const std::vector<BesideReferences> beside = beside_references(d, left, options);
  std::vector<ResidualStructure> unmodelled;
  bool in_touched = false;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const ResidualStructure& l = left[i];
    bool touched = d.search.found.empty();
    for (const FoundEffect& f : d.search.found) touched = touched || f.design.touches(l.channel);
    if (beside[i] == BesideReferences::kShared) {
      d.shared_structure.push_back(describe_residual_structure(d.evidence, l));
      continue;
    }
    if (noted_as_untold(d, describe_residual_structure(d.evidence, l))) continue;
    const double share = unmodelled_share(d, l, beside[i]);
    if (touched) d.unmodelled_share = std::max(d.unmodelled_share, share);
    if (share <
        (l.event ? d.thresholds.largest_event_share : d.thresholds.largest_unmodelled_share))
      continue;
    if (l.event && !d.evidence.options.mechanisms.act(Mechanism::kEvent)) continue;
    if (!d.unexplained || (touched && !in_touched))
      d.unexplained = describe_residual_structure(d.evidence, l);
    in_touched = in_touched || touched;
    unmodelled.push_back(l);
  }
  if (d.search.found.empty() && !d.unexplained && !d.search.unnamed.empty()) {
    // what both logs lack may gain most, and another one in another channel be the change
    std::optional<Unexplained> shared;
    for (const FoundEffect& f : d.search.unnamed) {
      Unexplained unnamed = describe_unnamed(d, f);
      if (noted_as_untold(d, unnamed)) continue;
      std::optional<Unexplained>& where =
          exceeds_references(d, unnamed.channel) ? d.unexplained : shared;
      if (!where) where = std::move(unnamed);
      if (d.unexplained) break;
    }
    if (!d.unexplained && shared) d.shared_structure.push_back(std::move(*shared));
  }
  if (d.search.found.empty() && !d.unexplained && d.search.once) {
    Unexplained event = describe_isolated_event(d, options.isolated_event);
    if (!noted_as_untold(d, event)) {
      if (exceeds_references(d, event.channel))
        d.unexplained = std::move(event);
      else
        d.shared_structure.push_back(std::move(event));
    }
  }
  if (d.search.found.empty() && !d.unexplained) {
    if (const std::optional<std::size_t> channel = channel_beyond_references(d))
      d.unexplained = describe_beyond_references(d, *channel);
  }
  return unmodelled;
}

/// Decides between missing, none and unknown from the effects and the unmodelled structure.
void set_verdict(const std::vector<ResidualStructure>& unmodelled, Diagnosis& d) {
  // One effect without unmodelled structure at its place is enough for a verdict of a missing effect.
  const bool unknown =
      (!unmodelled.empty() || !d.effects.empty()) &&
      std::all_of(d.effects.begin(), d.effects.end(), [&](const DiagnosedEffect& e) {
        return is_doubtful(d.evidence, e, unmodelled) || is_minor_effect(d, e);
      });
  // What remains where effects were found comes before structure elsewhere.
  const bool elsewhere =
      d.unexplained &&
      std::none_of(d.search.found.begin(), d.search.found.end(),
                   [&](const FoundEffect& f) { return f.design.touches(d.unexplained->channel); });
  if (unknown && !d.effects.empty() && (!d.unexplained || elsewhere))
    d.unexplained = describe_minor_effect(d.evidence, d.effects.front());
  d.verdict = unknown              ? Verdict::kUnknown
              : !d.effects.empty() ? Verdict::kMissing
              : d.unexplained      ? Verdict::kUnknown
                                   : Verdict::kNone;
}

/// For each indistinguishable set the motion that would distinguish its effects.
void design_experiments(const CraneModel& model, const DiagnoseOptions& options,
                        const SearchProgress& progress, Diagnosis& d) {
  for (std::size_t i = 0; i < d.effects.size(); ++i) {
    const DiagnosedEffect& e = d.effects[i];
    if (e.rivals.empty()) continue;
    if (progress) progress(0.95, "motions that would distinguish the effects");
    std::vector<std::string> set = {e.key()};
    for (const auto& [rival, worse] : e.rivals) set.push_back(rival);
    d.indistinguishable.push_back(std::move(set));
    d.experiments.push_back(next_experiment(
        model, d.evidence, d.search.final,
        {e.applied, rivals_of(d.search.found[i], options.search)}, options.experiment));
    d.experiments.back().decisive_nats = options.search.same_nats;
  }
}

Diagnosis diagnose_once(const CraneModel& model, const DiagnosisSignals& signals,
                        const DiagnoseOptions& options, const SearchProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  Diagnosis d;
  d.thresholds = options.verdict;
  if (progress) progress(0.02, "collecting the evidence");
  const std::vector<AppliedEffect> in_references = effects_in_references(model, signals.references);
  d.evidence = collect_evidence(model, signals.suspects, signals.references, &in_references,
                                options.evidence);
  d.notes = d.evidence.notes;
  search(model, options, progress, d);
  drop_unseen_effects(d);
  set_joint_estimates(model, signals, options.evidence, d);
  if (progress) progress(0.92, "searching for unmodelled structure in the residual");
  // in the residual of the effects that are findings
  const std::vector<ResidualStructure> unmodelled = find_unmodelled(options, d);
  if (drop_minor_effects(d, options.search))
    set_joint_estimates(model, signals, options.evidence, d);
  for (std::size_t i = 0; i < d.search.found.size(); ++i)
    d.effects.push_back(describe_effect(d, i, options.search));
  set_verdict(unmodelled, d);
  design_experiments(model, options, progress, d);
  // They stay in the order in which they were found, except that those that are not probable come last.
  std::stable_partition(d.effects.begin(), d.effects.end(),
                        [&](const DiagnosedEffect& e) { return d.probable(e); });
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (progress) progress(1.0, "done");
  return d;
}

}  // namespace

Diagnosis diagnose_sound(const CraneModel& model, const DiagnosisSignals& signals,
                         const DiagnoseOptions& options, const SearchProgress& progress) {
  // An estimate beyond what masses and areas of the machine make plausible imitates another cause. It is no candidate then,
  // and the search is repeated without it.
  DiagnoseOptions allowed = options;
  std::vector<std::string> refused;
  for (;;) {
    Diagnosis d = diagnose_once(model, signals, allowed, progress);
    allowed.candidates = searched_for(model, allowed, d.evidence.has_reference());
    const std::size_t before = allowed.candidates.size();
    for (const DiagnosedEffect& e : d.effects) {
      const std::string why = beyond_plausible(model.machine, e.applied);
      if (why.empty()) continue;
      refused.push_back(why + "; it is not named");
      std::erase_if(allowed.candidates, [&](const EffectAt& c) {
        return c.effect == e.effect.effect && c.at == e.effect.at;
      });
    }
    if (!allowed.candidates.empty() && allowed.candidates.size() < before) continue;
    if (allowed.candidates.size() < before) {  // nothing is left to search for
      d.verdict = Verdict::kUnknown;
      if (!d.unexplained) d.unexplained = describe_minor_effect(d.evidence, d.effects.front());
    }
    d.notes.insert(d.notes.end(), refused.begin(), refused.end());
    return d;
  }
}

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kMissing:
      return "missing";
    case Verdict::kNone:
      return "none";
    case Verdict::kUnknown:
      return "unknown";
    case Verdict::kBadData:
      return "bad_data";
  }
  return "";
}

double DiagnosedEffect::shown_probability() const {
  constexpr double kRounding = 1e-9;  // 100 * 0.29 is less than 29
  return std::floor(100.0 * probability + kRounding);
}

DiagnosisSignals diagnosis_signals(const Machine& machine, const std::vector<Log>& logs,
                                   const std::vector<Log>& references,
                                   const DiagnoseOptions& options) {
  if (logs.empty())
    throw InputError({}, "logs", "no log to diagnose: give at least one with --log");
  DiagnosisSignals out;
  out.suspects.reserve(logs.size());
  out.references.reserve(references.size());
  for (std::size_t i = 0; i < logs.size(); ++i) {
    out.suspects.push_back(make_signals(machine, logs[i], options.signals));
    if (!options.check_data) continue;
    std::vector<BadChannel> faults, jumps;
    for (BadChannel& b : find_bad_channels(machine, logs[i], out.suspects[i], options.bad_data))
      (b.kind == BadDataKind::kJumping ? jumps : faults).push_back(std::move(b));
    if (faults.empty() && jumps.empty()) continue;
    const Log usable = without_bad_data(logs[i], faults);
    if (!faults.empty()) out.suspects[i] = make_signals(machine, usable, options.signals);
    for (const BadChannel& b : faults) out.set_aside.push_back({i, b});
    if (jumps.empty()) continue;
    out.without_jumps.resize(logs.size());
    out.without_jumps[i] = make_signals(machine, without_bad_data(usable, jumps), options.signals);
    for (BadChannel& b : jumps) out.jumps.push_back({i, std::move(b)});
  }
  for (const Log& log : references) {
    const Staying staying = options.check_data ? Staying::kJumps : Staying::kAll;
    CheckedSignals one = checked_signals(machine, log, options.signals, options.bad_data, staying);
    out.references.push_back(std::move(one.signals));
    for (BadChannel& b : one.bad)
      if (!stays(b, staying)) out.set_aside_in_references.push_back(std::move(b));
  }
  return out;
}

Diagnosis diagnose_signals(const CraneModel& model, const DiagnosisSignals& signals,
                           const DiagnoseOptions& options, const SearchProgress& progress) {
  const auto diagnosed = [&](const DiagnosisSignals& used) {
    return used.references.empty() ? diagnose_sound(model, used, options, progress)
                                   : diagnose_against_references(model, used, options, progress);
  };
  Diagnosis d = diagnosed(signals);
  // Jumps in a single channel may come from its sensor or from a late pump. They are physics when an effect explains
  // them, so the diagnosis ran with them first.
  const std::vector<LogFault> faults = sensor_faults(d, signals.jumps);
  if (!faults.empty()) {
    DiagnosisSignals used = signals;
    for (const LogFault& f : faults) used.suspects[f.log] = signals.without_jumps[f.log];
    d = diagnosed(used);
  }
  for (const auto* aside : {&signals.set_aside, &faults})
    for (const LogFault& f : *aside) d.set_aside.push_back(f.channel);
  for (const BadChannel& b : signals.set_aside_in_references) d.set_aside.push_back(b);
  if (d.evidence.channels.empty())
    d.verdict = d.set_aside.empty() ? Verdict::kUnknown : Verdict::kBadData;
  return d;
}

Diagnosis diagnose(const CraneModel& model, const std::vector<Log>& logs,
                   const std::vector<Log>& references, const DiagnoseOptions& options,
                   const SearchProgress& progress) {
  return diagnose_signals(model, diagnosis_signals(model.machine, logs, references, options),
                          options, progress);
}

Diagnosis::Diagnosis() = default;
Diagnosis::Diagnosis(const Diagnosis&) = default;
Diagnosis::Diagnosis(Diagnosis&&) noexcept = default;
Diagnosis& Diagnosis::operator=(const Diagnosis&) = default;
Diagnosis& Diagnosis::operator=(Diagnosis&&) noexcept = default;
Diagnosis::~Diagnosis() = default;

}  // namespace sparflow
