#include "diagnosis/verdict/diagnosed_riddles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/residual/incident.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "identification/comparison/report_numbers.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

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

}  // namespace

double leftover_share(const Diagnosis& d, const Leftover& left) {
  const double before = suspect_rms(d.evidence, left.channel, d.search.null.residual[left.channel]);
  const double after = suspect_rms(d.evidence, left.channel, d.search.final.residual[left.channel]);
  const double catalogue = std::max(0.0, before * before - after * after);
  // a swing that comes and goes is measured where it is: over the whole log it cannot be more than all that is left
  const double flexible = std::min(left.rms * left.rms, after * after);
  return flexible / std::max(catalogue + flexible, 1e-300);
}

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

double explained_share(const Diagnosis& d, const DiagnosedEffect& e) {
  constexpr double kFarAbove = 5.0;  // times the sensors' noise
  const ChannelGain& g = e.channels.front();
  if (!(g.rmse_after > kFarAbove * g.noise_floor)) return 1.0;
  const double before = suspect_rms(d.evidence, g.channel, d.search.null.residual[g.channel]);
  const double noise = g.noise_floor * g.noise_floor;
  return (before * before - g.rmse_after * g.rmse_after) / (before * before - noise);
}

bool is_a_trifle(const Diagnosis& d, const DiagnosedEffect& e) {
  constexpr double kMost = 0.8;
  return explained_share(d, e) < kMost;
}

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

Unexplained describe_leftover(const Evidence& evidence, const Leftover& left) {
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

}  // namespace sparflow
