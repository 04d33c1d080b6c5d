#include "identification/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "identification/effect_estimate.h"
#include "identification/effect_proof.h"
#include "identification/experiment.h"
#include "identification/incident.h"
#include "identification/robust.h"
#include "identification/search_leaders.h"
#include "identification/unexplained.h"
#include "models/effects/hydraulics.h"
#include "models/error.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Residual rows of suspect logs.
double suspect_rms(const Evidence& evidence, std::size_t channel, const VectorXd& residual) {
  const EvidenceChannel& c = evidence.channels[channel];
  double squares = 0.0, n = 0.0;
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    if (static_cast<std::size_t>(c.log[b]) >= evidence.suspects) continue;
    const Index length = c.blocks[b].last - c.blocks[b].first;
    squares += residual.segment(c.blocks[b].first, length).squaredNorm();
    n += static_cast<double>(length);
  }
  return n > 0.0 ? std::sqrt(squares / n) : 0.0;
}

/// @param index of a found effect; their number: all of them
EffectFit fit_without(const Diagnosis& d, std::size_t index) {
  std::vector<EffectDesign> others;
  std::vector<AppliedEffect> acting;
  for (std::size_t i = 0; i < d.search.found.size(); ++i) {
    if (i == index) continue;
    const FoundEffect& f = d.search.found[i];
    others.push_back(f.design);
    acting.push_back({f.design.effect.effect, f.design.effect.at, f.values, {}, {}});
  }
  // without it, others may lead a pump
  std::optional<Evidence> led;
  if (d.search.led && index < d.search.found.size()) led = d.evidence.led_by(acting);
  if (led) others = remade(*led, others);
  std::vector<const EffectDesign*> pointers;
  pointers.reserve(others.size());
  for (const EffectDesign& o : others) pointers.push_back(&o);
  FitControl control;
  control.keep_residuals = true;
  return fit_effects(led ? *led : d.evidence, pointers, nullptr, control);
}

/// What another power of the laws of what was found explains (a cushion that grows with x^2.5) is no riddle.
EffectFit fit_with_other_powers(const Diagnosis& d) {
  std::vector<EffectDesign> powers;
  powers.reserve(d.search.found.size());
  std::vector<const EffectDesign*> designs;
  designs.reserve(2 * d.search.found.size());
  Index first = 0;
  for (const FoundEffect& f : d.search.found) {
    designs.push_back(&f.design);
    powers.push_back(other_power(f.design, d.search.final.theta.segment(first, f.design.linear)));
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

/// Whether the model and what was found follow a pump's steps down to what they leave elsewhere: then it is the pump
/// that is late or at its limit, no sensor that jumps.
bool follows_steps(const Diagnosis& d, const EffectFit& fit, const BadChannel& bad,
                   std::size_t log) {
  constexpr double kAlike = 3.0;  // standard deviations of the rest
  // a jump that is shorter than the filter is hardly seen behind it
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
    return n > 0.0 && std::sqrt(squares / n) < kAlike * robust_std(fit.residual[i]);
  }
  return false;
}

/// Takes out the jumps that are physics.
void keep_what_is_no_physics(const Diagnosis& d, const std::vector<std::size_t>& log_of,
                             std::vector<BadChannel>& bad) {
  const EffectFit fit = fit_without(d, d.search.found.size());
  std::vector<BadChannel> kept;
  kept.reserve(bad.size());
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (!follows_steps(d, fit, bad[i], log_of[i])) kept.push_back(std::move(bad[i]));
  }
  bad = std::move(kept);
}

/// Difference in evidence below which two effects are the same on these logs: what a law's own form is wrong by makes
/// that share, squared, of its gain. [nats]
double same_within(const FoundEffect& found, double same_nats) {
  const double form = form_share(*found.design.effect.effect);
  return std::max(same_nats, form * form * found.gain);
}

DiagnosedEffect describe(const Diagnosis& d, std::size_t index, const SearchOptions& options) {
  const FoundEffect& f = d.search.found[index];
  const Machine& machine = *d.evidence.series[0].machine;
  const EffectInfo& info = f.design.effect.effect->info();
  DiagnosedEffect e;
  e.effect = f.design.effect;
  e.id = info.id;
  const std::string key = effect_key(info, machine, e.effect.at);
  e.at = key.size() > info.id.size() ? key.substr(info.id.size() + 1) : "";
  e.stage = effect_stage_name(info.stage);
  e.applied = {e.effect.effect, e.effect.at, f.values, f.lower95, f.upper95};
  for (std::size_t k = 0; k < info.parameters.size(); ++k) {
    const EffectParameter& p = info.parameters[k];
    e.parameters.push_back(
        {p.name, p.unit, p.meaning, f.values[k] / p.si, f.lower95[k] / p.si, f.upper95[k] / p.si});
  }
  e.p_value = f.p_value;
  e.gain = f.gain;
  e.held_out_gain = f.held_out;
  e.held_out_error = f.held_out_error;
  e.absorbed = f.absorbed;
  double odds = 0.0;
  const double same = same_within(f, options.same_nats);
  for (const auto& [rival, worse] : f.alternatives) {
    odds += std::exp(-std::max(0.0, worse) * options.same_nats / same);
    if (worse < same)
      e.rivals.emplace_back(effect_key(rival.effect->info(), machine, rival.at), worse);
  }
  e.probability = (1.0 - f.p_value) / (1.0 + odds);

  const EffectFit without = fit_without(d, index);
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!f.design.touches(c)) continue;
    e.channels.push_back({c, suspect_rms(d.evidence, c, without.residual[c]),
                          suspect_rms(d.evidence, c, d.search.final.residual[c]),
                          d.evidence.channels[c].noise_floor});
  }
  std::sort(e.channels.begin(), e.channels.end(), [](const ChannelGain& a, const ChannelGain& b) {
    return a.rmse_before / a.rmse_after > b.rmse_before / b.rmse_after;
  });
  for (const ChannelGain& g : e.channels) {
    const EvidenceChannel& c = d.evidence.channels[g.channel];
    if (g.rmse_before < 1.02 * g.rmse_after) continue;
    e.evidence.push_back(fmt::format(
        "{}: error {} -> {} {}{}", c.text, plain_number(g.rmse_before / c.unit.si, 3),
        plain_number(g.rmse_after / c.unit.si, 3), c.unit.name,
        std::isfinite(g.noise_floor)
            ? fmt::format(" (sensor noise {})", plain_number(g.noise_floor / c.unit.si, 2))
            : ""));
  }
  e.evidence.push_back(
      fmt::format("estimated on some motions, it predicts the others better: in {:.0f} % of the "
                  "parts left out, "
                  "by {:.1f} standard errors",
                  100.0 * f.held_out_share, e.held_out_gain / std::max(e.held_out_error, 1e-300)));
  return e;
}

/// What the catalogue explained of a channel and what a flexible model explains beyond it, as variances.
double leftover_share(const Diagnosis& d, const Leftover& left) {
  const double before = suspect_rms(d.evidence, left.channel, d.search.null.residual[left.channel]);
  const double after = suspect_rms(d.evidence, left.channel, d.search.final.residual[left.channel]);
  const double catalogue = std::max(0.0, before * before - after * after);
  // a swing that comes and goes is measured where it is: over the whole log it cannot be more than all that is left
  const double flexible = std::min(left.rms * left.rms, after * after);
  return flexible / std::max(catalogue + flexible, 1e-300);
}

/// Whether a cause in channel `from` shows in `to` too: all that one cylinder's chamber sensors make, the demand they
/// are for its pump, and the flows that one pump shares out.
bool shows_too(const Machine& machine, const EvidenceChannel& from, const EvidenceChannel& to) {
  const auto of_chambers = [](const EvidenceChannel& c) {
    return c.kind != EvidenceKind::kFlow && c.kind != EvidenceKind::kPump;
  };
  if (from.kind == EvidenceKind::kFlow && to.kind == EvidenceKind::kFlow) {
    const int pump = machine.pump_of_cylinder(from.index);
    return pump >= 0 && machine.pump_of_cylinder(to.index) == pump;
  }
  if (!of_chambers(from)) return false;
  if (to.kind == EvidenceKind::kPump) return machine.pump_of_cylinder(from.index) == to.index;
  return of_chambers(to) && from.index == to.index;
}

/// A channel's value in what its neighbours by `shows_too` can be compared in: [Pa], of speeds [m^3/s].
double common_size(const Machine& machine, const EvidenceChannel& channel, double value) {
  if (channel.kind != EvidenceKind::kForce && channel.kind != EvidenceKind::kFlow) return value;
  const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(channel.index)];
  if (!cylinder.hydraulic()) return value;
  const double area = supply_area(cylinder, 1);
  return channel.kind == EvidenceKind::kForce ? value / area : value * area;
}

/// RMS of what an effect takes away where it does most.
double size_of(const DiagnosedEffect& e) {
  const ChannelGain& g = e.channels.front();
  return std::sqrt(std::max(0.0, g.rmse_before * g.rmse_before - g.rmse_after * g.rmse_after));
}

/// Whether riddles leave open that the effect is what it is called: one in its own channel, or a larger one in a
/// channel that shows it too, of which the effect may be the smaller half. A sensor's error is one and the same
/// wherever its reading goes: for it a riddle in one place is one in all.
bool is_doubtful(const Evidence& evidence, const DiagnosedEffect& e,
                 const std::vector<Leftover>& riddles) {
  const Machine& machine = *evidence.series[0].machine;
  const bool sensor = e.effect.effect->info().stage == EffectStage::kSensor;
  return std::any_of(riddles.begin(), riddles.end(), [&](const Leftover& r) {
    const auto own = [&](const ChannelGain& g) { return g.channel == r.channel; };
    if (own(e.channels.front())) return true;
    if (sensor && std::any_of(e.channels.begin(), e.channels.end(), own)) return true;
    const EvidenceChannel &there = evidence.channels[r.channel],
                          &here = evidence.channels[e.channels.front().channel];
    return shows_too(machine, there, here) &&
           common_size(machine, there, r.rms) > common_size(machine, here, size_of(e));
  });
}

/// Share of the squared error beyond the sensors' noise that all that was found explains where the effect shows best;
/// one where what is left is not far above that noise.
double explained_share(const Diagnosis& d, const DiagnosedEffect& e) {
  constexpr double kFarAbove = 5.0;  // times the sensors' noise
  const ChannelGain& g = e.channels.front();
  if (!(g.rmse_after > kFarAbove * g.noise_floor)) return 1.0;
  const double before = suspect_rms(d.evidence, g.channel, d.search.null.residual[g.channel]);
  const double noise = g.noise_floor * g.noise_floor;
  return (before * before - g.rmse_after * g.rmse_after) / (before * before - noise);
}

/// Whether a large error stays that the effect hardly touches: what makes it is not known, and some of it looks like
/// the effect. True effects leave no errors of that size where they show best (docs/diagnose.md, section 7).
bool is_a_trifle(const Diagnosis& d, const DiagnosedEffect& e) {
  constexpr double kMost = 0.8;
  return explained_share(d, e) < kMost;
}

/// An error without a name and without signals: how large it is and where.
Unexplained describe_trifle(const Evidence& evidence, const DiagnosedEffect& e) {
  const ChannelGain& g = e.channels.front();
  const EvidenceChannel& c = evidence.channels[g.channel];
  Unexplained u;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = {"no single signal"};
  u.rmse = g.rmse_after;
  u.noise_floor = g.noise_floor;
  u.unit = c.unit;
  u.share = 1.0 - std::min(1.0, std::pow(g.noise_floor / g.rmse_after, 2));
  u.sentence = fmt::format(
      "{}: {} {} (RMS), {:.0f} times the sensors' noise, that follow no single signal; {} would "
      "explain {:.0f} % of them",
      c.text, plain_number(g.rmse_after / c.unit.si, 2), c.unit.name, g.rmse_after / g.noise_floor,
      e.key(), 100.0 * std::max(0.0, 1.0 - std::pow(g.rmse_after / g.rmse_before, 2)));
  return u;
}

Unexplained describe(const Evidence& evidence, const Leftover& left) {
  const EvidenceChannel& c = evidence.channels[left.channel];
  Unexplained u;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = left.depends_on;
  u.share = left.explained;
  u.rmse = left.rms;
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.sentence = fmt::format(
      "{}: {} {} (RMS) that follow {} and that nothing in the catalogue explains", c.text,
      plain_number(left.rms / c.unit.si, 2), c.unit.name, fmt::join(left.depends_on, ", "));
  return u;
}

/// Effects beside others that are none: a large error stays where they show best, and they are no name for it.
void drop_trifles(Diagnosis& d, const SearchOptions& options) {
  std::vector<DiagnosedEffect> all;
  all.reserve(d.search.found.size());
  for (std::size_t i = 0; i < d.search.found.size(); ++i) all.push_back(describe(d, i, options));
  const auto trifles = std::count_if(all.begin(), all.end(),
                                     [&](const DiagnosedEffect& e) { return is_a_trifle(d, e); });
  if (trifles == 0 || trifles == std::ssize(all)) return;
  std::vector<FoundEffect> kept;
  kept.reserve(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const DiagnosedEffect& e = all[i];
    if (!is_a_trifle(d, e)) {
      kept.push_back(std::move(d.search.found[i]));
      continue;
    }
    d.notes.push_back(
        fmt::format("{} is not named: with it {:.0f} % of the error of the {} stay unexplained",
                    e.key(), 100.0 * (1.0 - explained_share(d, e)),
                    d.evidence.channels[e.channels.front().channel].text));
    if (!d.unexplained) d.unexplained = describe_trifle(d.evidence, e);
  }
  d.search.found = std::move(kept);
  d.search.final = fit_without(d, d.search.found.size());
}

/// Evidence that only an implausible effect would fit: place and size, without a name.
Unexplained describe_unnamed(const Diagnosis& d) {
  const FoundEffect& f = d.search.unnamed.front();
  const std::string key =
      effect_key(f.design.effect.effect->info(), *d.evidence.series[0].machine, f.design.effect.at);
  Unexplained u;
  std::size_t worst = 0;
  double ratio = -1.0;
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!f.design.touches(c)) continue;
    const double here = suspect_rms(d.evidence, c, d.search.final.residual[c]) /
                        std::max(d.evidence.channels[c].noise_floor, 1e-300);
    if (here > ratio) {
      ratio = here;
      worst = c;
    }
  }
  const EvidenceChannel& c = d.evidence.channels[worst];
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = f.design.effect.effect->info().signals;
  u.rmse = suspect_rms(d.evidence, worst, d.search.final.residual[worst]);
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.share = 1.0;
  u.sentence = fmt::format(
      "{}: {} {} (RMS) that are no noise; {} comes nearest, but only with implausible "
      "parameters",
      c.text, plain_number(u.rmse / c.unit.si, 2), c.unit.name, key);
  return u;
}

/// What happened once and that an effect would explain, though it proves none.
Unexplained describe_incident(const Diagnosis& d) {
  const EffectDesign& design = *d.search.once;
  FitControl control;
  control.keep_residuals = true;
  const EffectFit with = fit_effects(d.evidence, {&design}, nullptr, control);
  const Incident incident = where_it_shows(d.evidence, d.search.null, with);
  const EvidenceChannel& c = d.evidence.channels[incident.channel];
  Unexplained u;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = {"time"};
  u.rmse = suspect_rms(d.evidence, incident.channel, d.search.null.residual[incident.channel]);
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.share = incident.share;
  u.few_places = true;
  u.sentence = incident_sentence(
      d.evidence, incident,
      effect_key(design.effect.effect->info(), *d.evidence.series[0].machine, design.effect.at));
  return u;
}

/// Values as a model that is extended with the effects gets them: all together, where the search added one by one.
void settle_values(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                   const std::vector<MachineSignals>& references, std::vector<FoundEffect>& found) {
  std::vector<EffectAt> wanted;
  wanted.reserve(found.size());
  for (const FoundEffect& f : found) wanted.push_back(f.design.effect);
  const std::vector<AppliedEffect> in_references = effects_in_references(model, references);
  const EffectEstimate all =
      estimate_effects(model, wanted, suspects, references, {}, {}, &in_references);
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i].values = all.effects[i].values;
    found[i].lower95 = all.effects[i].lower95;
    found[i].upper95 = all.effects[i].upper95;
  }
}

/// Those that explain the same evidence as well.
std::vector<EffectAt> rivals_of(const FoundEffect& found, double same_nats) {
  std::vector<EffectAt> rivals;
  for (const auto& [rival, worse] : found.alternatives) {
    if (worse < same_within(found, same_nats)) rivals.push_back(rival);
  }
  return rivals;
}

}  // namespace

std::string plain_number(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  if (value == 0.0) return "0";
  const int before = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
  return fmt::format("{:.{}f}", value, std::clamp(digits - before, 0, 9));
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

Diagnosis diagnose_signals(const CraneModel& model, const std::vector<MachineSignals>& suspects,
                           const std::vector<MachineSignals>& references,
                           const DiagnoseOptions& options, const SearchProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  Diagnosis d;
  if (progress) progress(0.02, "arranging the evidence");
  const std::vector<AppliedEffect> in_references = effects_in_references(model, references);
  d.evidence = collect_evidence(model, suspects, references, &in_references);
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
  if (d.search.led) d.evidence = *d.search.led;
  d.notes.insert(d.notes.end(), d.search.notes.begin(), d.search.notes.end());
  d.p_value = d.search.p_value;
  for (const auto& [effect, gain] : d.search.ranking) {
    d.ranking.emplace_back(effect_key(effect.effect->info(), model.machine, effect.at), gain);
  }
  if (progress) progress(0.92, "looking at what is left");
  const std::vector<Leftover> left = find_leftovers(d.evidence, fit_with_other_powers(d));
  std::vector<Leftover> riddles;
  bool in_touched = false;
  for (const Leftover& l : left) {
    bool touched = d.search.found.empty();
    for (const FoundEffect& f : d.search.found) touched = touched || f.design.touches(l.channel);
    const double share = leftover_share(d, l);
    if (touched) d.leftover_share = std::max(d.leftover_share, share);
    if (share < (l.event ? kLargestEventShare : kLargestLeftoverShare)) continue;
    if (!d.unexplained || (touched && !in_touched)) d.unexplained = describe(d.evidence, l);
    in_touched = in_touched || touched;
    riddles.push_back(l);
  }
  if (d.search.found.empty() && !d.unexplained && !d.search.unnamed.empty()) {
    d.unexplained = describe_unnamed(d);
  }
  if (d.search.found.empty() && !d.unexplained && d.search.once)
    d.unexplained = describe_incident(d);
  drop_trifles(d, options.search);
  if (!d.search.found.empty()) settle_values(model, suspects, references, d.search.found);
  for (std::size_t i = 0; i < d.search.found.size(); ++i)
    d.effects.push_back(describe(d, i, options.search));
  // One effect proven where nothing is left over is a finding, whatever else goes on elsewhere.
  const bool unknown =
      (!riddles.empty() || !d.effects.empty()) &&
      std::all_of(d.effects.begin(), d.effects.end(), [&](const DiagnosedEffect& e) {
        return is_doubtful(d.evidence, e, riddles) || is_a_trifle(d, e);
      });
  if (unknown && !d.unexplained) d.unexplained = describe_trifle(d.evidence, d.effects.front());
  d.verdict = unknown              ? Verdict::kUnknown
              : !d.effects.empty() ? Verdict::kMissing
              : d.unexplained      ? Verdict::kUnknown
                                   : Verdict::kNone;
  for (std::size_t i = 0; i < d.effects.size(); ++i) {
    const DiagnosedEffect& e = d.effects[i];
    if (e.rivals.empty()) continue;
    if (progress) progress(0.95, "motions that would tell effects apart");
    std::vector<std::string> set = {e.key()};
    for (const auto& [rival, worse] : e.rivals) set.push_back(rival);
    d.indistinguishable.push_back(std::move(set));
    d.experiments.push_back(
        next_experiment(model, d.evidence, d.search.final, e.applied,
                        rivals_of(d.search.found[i], options.search.same_nats)));
  }
  // Found in the order of what they explain: that order stays; one of a set that is not even half sure goes last.
  std::stable_partition(d.effects.begin(), d.effects.end(),
                        [](const DiagnosedEffect& e) { return e.probability >= 0.5; });
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
  std::vector<std::size_t> log_of;  // each bad channel's
  for (const Log& log : logs) {
    suspects.push_back(make_signals(model.machine, log, options.signals));
    if (!options.check_data) continue;
    for (BadChannel& b : find_bad_channels(model.machine, log, suspects.back()))
      bad.push_back(std::move(b));
    log_of.resize(bad.size(), suspects.size() - 1);
  }
  for (const Log& log : references)
    pinned.push_back(make_signals(model.machine, log, options.signals));
  // Steps that no other channel shares may be a sensor's or a late pump's: where known physics explains the
  // channel down to its noise, they were physics. Other faults leave nothing to explain.
  const bool surely_bad = std::any_of(
      bad.begin(), bad.end(), [](const BadChannel& b) { return b.kind != BadDataKind::kJumping; });
  if (!surely_bad) {
    Diagnosis d = diagnose_signals(model, suspects, pinned, options, progress);
    if (!bad.empty()) keep_what_is_no_physics(d, log_of, bad);
    if (!bad.empty() && d.verdict != Verdict::kMissing) d.verdict = Verdict::kBadData;
    d.bad = std::move(bad);
    return d;
  }
  Diagnosis d;
  d.verdict = Verdict::kBadData;
  d.evidence = collect_evidence(model, suspects, pinned);
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
