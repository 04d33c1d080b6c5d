#include "diagnosis/verdict/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "diagnosis/experiment/experiment.h"
#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/residual/residual_model.h"
#include "diagnosis/selection/effect_estimate.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/unmodelled_structure.h"
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

/// Removes the channels whose jumps known physics explains.
void keep_sensor_faults(const Diagnosis& d, const std::vector<std::size_t>& log_of,
                        std::vector<BadChannel>& bad) {
  const EffectFit fit = fit_without(d, d.search.found.size());
  std::vector<BadChannel> kept;
  kept.reserve(bad.size());
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (!follows_steps(d, fit, bad[i], log_of[i])) kept.push_back(std::move(bad[i]));
  }
  bad = std::move(kept);
}

/// Drops minor effects when other effects remain; their error becomes `unexplained`.
void drop_minor_effects(Diagnosis& d, const SearchOptions& options) {
  std::vector<DiagnosedEffect> all;
  all.reserve(d.search.found.size());
  for (std::size_t i = 0; i < d.search.found.size(); ++i)
    all.push_back(describe_effect(d, i, options));
  const auto minor = std::count_if(all.begin(), all.end(),
                                   [&](const DiagnosedEffect& e) { return is_minor_effect(d, e); });
  if (minor == 0 || minor == std::ssize(all)) return;
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
}

/// Replaces the values by a joint estimate of all effects, the one that an extension of the model gets.
void set_joint_estimates(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                         const std::vector<MachineSignals>& references,
                         const EvidenceOptions& evidence, std::vector<FoundEffect>& found) {
  std::vector<EffectAt> wanted;
  wanted.reserve(found.size());
  for (const FoundEffect& f : found) wanted.push_back(f.design.effect);
  EstimateOptions options;
  options.evidence = evidence;
  const EffectEstimate all = estimate_effects(
      model, wanted, {suspects, references, {}, effects_in_references(model, references)}, {},
      options);
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i].values = all.effects[i].values;
    found[i].lower95 = all.effects[i].lower95;
    found[i].upper95 = all.effects[i].upper95;
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

}  // namespace

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

Diagnosis diagnose_signals(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                           const std::vector<MachineSignals>& references,
                           const DiagnoseOptions& options, const SearchProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  Diagnosis d;
  d.thresholds = options.verdict;
  if (progress) progress(0.02, "collecting the evidence");
  const std::vector<AppliedEffect> in_references = effects_in_references(model, references);
  d.evidence = collect_evidence(model, suspects, references, &in_references, options.evidence);
  d.notes = d.evidence.notes;
  std::vector<EffectAt> candidates_here = options.candidates;
  if (candidates_here.empty()) {
    for (const EffectAt& c : candidates(model.machine)) {
      const bool known =
          std::any_of(model.effects.begin(), model.effects.end(),
                      [&](const AppliedEffect& e) { return e.effect == c.effect && e.at == c.at; });
      if (!known) candidates_here.push_back(c);
    }
  }
  d.search = search_effects(d.evidence, candidates_here, options.search, progress);
  if (d.search.updated_evidence) d.evidence = *d.search.updated_evidence;
  d.notes.insert(d.notes.end(), d.search.notes.begin(), d.search.notes.end());
  d.p_value = d.search.p_value;
  for (const auto& [effect, gain] : d.search.ranking) {
    d.ranking.emplace_back(effect_key(effect.effect->info(), model.machine, effect.at), gain);
  }
  if (progress) progress(0.92, "searching for unmodelled structure in the residual");
  const std::vector<ResidualStructure> left = find_residual_structure(
      d.evidence, fit_with_other_powers(d, options.search.regression), options.residual);
  std::vector<ResidualStructure> unmodelled;
  bool in_touched = false;
  for (const ResidualStructure& l : left) {
    bool touched = d.search.found.empty();
    for (const FoundEffect& f : d.search.found) touched = touched || f.design.touches(l.channel);
    const double share = unmodelled_share(d, l);
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
    d.unexplained = describe_unnamed(d);
  }
  if (d.search.found.empty() && !d.unexplained && d.search.once)
    d.unexplained = describe_isolated_event(d, options.isolated_event);
  drop_minor_effects(d, options.search);
  if (!d.search.found.empty())
    set_joint_estimates(model, suspects, references, options.evidence, d.search.found);
  for (std::size_t i = 0; i < d.search.found.size(); ++i)
    d.effects.push_back(describe_effect(d, i, options.search));
  // One effect without unmodelled structure at its place is enough for a verdict of a missing effect.
  const bool unknown =
      (!unmodelled.empty() || !d.effects.empty()) &&
      std::all_of(d.effects.begin(), d.effects.end(), [&](const DiagnosedEffect& e) {
        return is_doubtful(d.evidence, e, unmodelled) || is_minor_effect(d, e);
      });
  if (unknown && !d.unexplained)
    d.unexplained = describe_minor_effect(d.evidence, d.effects.front());
  d.verdict = unknown              ? Verdict::kUnknown
              : !d.effects.empty() ? Verdict::kMissing
              : d.unexplained      ? Verdict::kUnknown
                                   : Verdict::kNone;
  for (std::size_t i = 0; i < d.effects.size(); ++i) {
    const DiagnosedEffect& e = d.effects[i];
    if (e.rivals.empty()) continue;
    if (progress) progress(0.95, "motions that would distinguish the effects");
    std::vector<std::string> set = {e.key()};
    for (const auto& [rival, worse] : e.rivals) set.push_back(rival);
    d.indistinguishable.push_back(std::move(set));
    d.experiments.push_back(next_experiment(model, d.evidence, d.search.final, e.applied,
                                            rivals_of(d.search.found[i], options.search),
                                            options.experiment));
    d.experiments.back().decisive_nats = options.search.same_nats;
  }
  // They stay in the order in which they were found, except that those that are not probable come last.
  std::stable_partition(d.effects.begin(), d.effects.end(),
                        [&](const DiagnosedEffect& e) { return d.probable(e); });
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (progress) progress(1.0, "done");
  return d;
}

Diagnosis diagnose(const CraneModel& model, const std::vector<Log>& logs,
                   const std::vector<Log>& references, const DiagnoseOptions& options,
                   const SearchProgress& progress) {
  if (logs.empty())
    throw InputError({}, "logs", "no log to diagnose: give at least one with --log");
  std::vector<MachineSignals> suspects, pinned;
  std::vector<BadChannel> bad;
  std::vector<std::size_t> log_of;  // log of each bad channel
  for (const Log& log : logs) {
    suspects.push_back(make_signals(model.machine, log, options.signals));
    if (!options.check_data) continue;
    for (BadChannel& b : find_bad_channels(model.machine, log, suspects.back(), options.bad_data))
      bad.push_back(std::move(b));
    log_of.resize(bad.size(), suspects.size() - 1);
  }
  for (const Log& log : references)
    pinned.push_back(make_signals(model.machine, log, options.signals));
  // Jumps in a single channel may come from its sensor or from a late pump. They are physics when an effect explains
  // them, so the diagnosis runs first; with any other fault the data cannot be diagnosed.
  const bool surely_bad = std::any_of(
      bad.begin(), bad.end(), [](const BadChannel& b) { return b.kind != BadDataKind::kJumping; });
  if (!surely_bad) {
    Diagnosis d = diagnose_signals(model, suspects, pinned, options, progress);
    if (!bad.empty()) keep_sensor_faults(d, log_of, bad);
    if (!bad.empty() && d.verdict != Verdict::kMissing) d.verdict = Verdict::kBadData;
    d.bad = std::move(bad);
    return d;
  }
  Diagnosis d;
  d.thresholds = options.verdict;
  d.verdict = Verdict::kBadData;
  d.evidence = collect_evidence(model, suspects, pinned, nullptr, options.evidence);
  d.notes = d.evidence.notes;
  d.bad = std::move(bad);
  return d;
}

Diagnosis::Diagnosis() = default;
Diagnosis::Diagnosis(const Diagnosis&) = default;
Diagnosis::Diagnosis(Diagnosis&&) noexcept = default;
Diagnosis& Diagnosis::operator=(const Diagnosis&) = default;
Diagnosis& Diagnosis::operator=(Diagnosis&&) noexcept = default;
Diagnosis::~Diagnosis() = default;

}  // namespace sparflow
