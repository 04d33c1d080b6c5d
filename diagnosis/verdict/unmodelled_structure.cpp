#include "diagnosis/verdict/unmodelled_structure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/residual/isolated_event.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/reference_comparison.h"
#include "diagnosis/verdict/residual_levels.h"
#include "identification/comparison/report_numbers.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Whether a cause in channel `from` can also show in `to`: both are computed from the chamber pressures of one
/// cylinder, `to` is the pump whose demand they determine, or both are speeds of cylinders on one pump.
bool shows_too(const Machine& machine, const EvidenceChannel& from, const EvidenceChannel& to) {
  const auto of_chambers = [](const EvidenceChannel& c) {
    return c.kind != EvidenceKind::kFlow && c.kind != EvidenceKind::kPump &&
           c.kind != EvidenceKind::kReturnLine;
  };
  if (from.kind == EvidenceKind::kFlow && to.kind == EvidenceKind::kFlow) {
    const int pump = machine.pump_of_cylinder(from.index);
    return pump >= 0 && machine.pump_of_cylinder(to.index) == pump;
  }
  if (!of_chambers(from)) return false;
  if (to.kind == EvidenceKind::kPump) return machine.pump_of_cylinder(from.index) == to.index;
  return of_chambers(to) && from.index == to.index;
}

/// A channel's value in a unit that channels related by `shows_too` share: pressure [Pa], or flow [m^3/s] for speeds.
double common_size(const Machine& machine, const EvidenceChannel& channel, double value) {
  if (channel.kind != EvidenceKind::kForce && channel.kind != EvidenceKind::kFlow) return value;
  const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(channel.index)];
  if (!cylinder.hydraulic()) return value;
  const double area = supply_area(cylinder, 1);
  return channel.kind == EvidenceKind::kForce ? value / area : value * area;
}

/// In logs alone, starts and stops count by the deviation that settles; beside references, what the model lacks of them is taken off
/// by what the references leave.
VectorXd weighed(const Diagnosis& d, std::size_t channel, const VectorXd& residual) {
  return d.evidence.has_reference() ? residual : settled(d, channel, residual);
}

/// RMS of what an effect explains in the channel that it improves most. [SI]
double size_of(const DiagnosedEffect& e) {
  const ChannelGain& g = e.channels.front();
  return std::sqrt(std::max(0.0, g.rmse_before * g.rmse_before - g.rmse_after * g.rmse_after));
}

}  // namespace

double unmodelled_share(const Diagnosis& d, const ResidualStructure& left,
                        BesideReferences beside) {
  const VectorXd final = weighed(d, left.channel, d.search.final.residual[left.channel]);
  const double before = suspect_rms(d.evidence, left.channel,
                                    weighed(d, left.channel, d.search.null.residual[left.channel]));
  const double after = suspect_rms(d.evidence, left.channel, final);
  const double catalogue = std::max(0.0, before * before - after * after);
  // an intermittent oscillation is measured where it occurs, so over the whole log it is limited by the residual
  const double floor = d.evidence.channels[left.channel].noise_floor;
  const double beyond_noise =
      std::max(0.0, after * after - (std::isfinite(floor) ? floor * floor : 0.0));
  double flexible = std::min(left.rms * left.rms, beyond_noise);
  const double there = expected_rms(d, left.channel, final);
  if (beside != BesideReferences::kOpposite && there > floor)
    flexible = std::max(0.0, flexible - (there * there - floor * floor));
  return flexible / std::max(catalogue + flexible, 1e-300);
}

bool is_doubtful(const Evidence& evidence, const DiagnosedEffect& e,
                 const std::vector<ResidualStructure>& unmodelled) {
  const Machine& machine = *evidence.series[0].machine;
  const bool sensor = e.effect.effect->info().stage == EffectStage::kSensor;
  return std::any_of(unmodelled.begin(), unmodelled.end(), [&](const ResidualStructure& r) {
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
  const ChannelGain& g = e.channels.front();
  // what stays unexplained in the references as well is no sign against an effect
  const VectorXd final = weighed(d, g.channel, d.search.final.residual[g.channel]);
  const double shared = expected_rms(d, g.channel, final);
  const bool by_references = shared > g.noise_floor;
  const double floor = by_references ? shared : g.noise_floor;
  // the references' residual contains the model's errors already
  const double far = by_references ? d.thresholds.least_excess_ratio : d.thresholds.far_above_noise;
  const double after = suspect_rms(d.evidence, g.channel, final);
  if (!(after > far * floor)) return 1.0;
  const double before =
      suspect_rms(d.evidence, g.channel, weighed(d, g.channel, d.search.null.residual[g.channel]));
  const double noise = floor * floor;
  return (before * before - after * after) / (before * before - noise);
}

bool is_minor_effect(const Diagnosis& d, const DiagnosedEffect& e) {
  // Beside references it is part of the difference that the effect must explain, as in the comparison of the sizes.
  const double least = d.evidence.has_reference() ? d.thresholds.least_excess_explained
                                                  : d.thresholds.least_explained_share;
  return d.evidence.options.mechanisms.act(Mechanism::kMinor, explained_share(d, e) < least);
}

Unexplained describe_minor_effect(const Evidence& evidence, const DiagnosedEffect& e) {
  const ChannelGain& g = e.channels.front();
  const EvidenceChannel& c = evidence.channels[g.channel];
  Unexplained u;
  u.channel = g.channel;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = {"no single signal"};
  u.rmse = g.rmse_after;
  u.noise_floor = g.noise_floor;
  u.unit = c.unit;
  u.share = 1.0 - std::min(1.0, std::pow(g.noise_floor / g.rmse_after, 2));
  u.sentence = fmt::format(
      "{}: residual of {} {} (RMS), {:.0f} times the sensors' noise, depends on no single signal; "
      "{} would explain {:.0f} % of the squared error",
      c.text, plain_number(g.rmse_after / c.unit.si, 2), c.unit.name, g.rmse_after / g.noise_floor,
      e.key(), 100.0 * std::max(0.0, 1.0 - std::pow(g.rmse_after / g.rmse_before, 2)));
  return u;
}

Unexplained describe_residual_structure(const Evidence& evidence, const ResidualStructure& left) {
  const EvidenceChannel& c = evidence.channels[left.channel];
  Unexplained u;
  u.channel = left.channel;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = left.depends_on;
  u.share = left.explained;
  u.rmse = left.rms;
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.sentence = fmt::format(
      "{}: {} {} (RMS) of the residual depend on {}, and no effect explains them", c.text,
      plain_number(left.rms / c.unit.si, 2), c.unit.name, fmt::join(left.depends_on, ", "));
  return u;
}

Unexplained describe_unnamed(const Diagnosis& d, const FoundEffect& f) {
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
  u.channel = worst;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = f.design.effect.effect->info().signals;
  u.rmse = suspect_rms(d.evidence, worst, d.search.final.residual[worst]);
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.share = 1.0;
  u.sentence = fmt::format(
      "{}: residual of {} {} (RMS), more than noise; {} fits best, but only with implausible "
      "parameters",
      c.text, plain_number(u.rmse / c.unit.si, 2), c.unit.name, key);
  return u;
}

Unexplained describe_beyond_references(const Diagnosis& d, std::size_t channel) {
  const EvidenceChannel& c = d.evidence.channels[channel];
  const VectorXd& residual = d.search.final.residual[channel];
  Unexplained u;
  u.channel = channel;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = {"no single signal"};
  u.rmse = suspect_rms(d.evidence, channel, residual);
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.share = 1.0;
  std::size_t worst = c.blocks.size();
  double largest = -1.0;
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    if (static_cast<std::size_t>(c.log[b]) >= d.evidence.suspects) continue;
    const Index n = c.blocks[b].last - c.blocks[b].first;
    const double rms = residual.segment(c.blocks[b].first, n).norm() / std::sqrt(n);
    if (rms > largest) {
      largest = rms;
      worst = b;
    }
  }
  const auto log = static_cast<std::size_t>(c.log[worst]);
  const VectorXd& time = d.evidence.series[log].time;
  const auto at = [&](Index row) { return time[c.sample[static_cast<std::size_t>(row)]]; };
  u.sentence = fmt::format(
      "{}: residual of {} {} (RMS), in the references {}; largest between {:.1f} and {:.1f} s{}, "
      "{} "
      "{}, and no effect explains the difference",
      c.text, plain_number(u.rmse / c.unit.si, 2), c.unit.name,
      plain_number(reference_rms(d, channel) / c.unit.si, 2), at(c.blocks[worst].first),
      at(c.blocks[worst].last - 1),
      d.evidence.suspects > 1 ? fmt::format(" of log {}", log + 1) : "",
      plain_number(largest / c.unit.si, 2), c.unit.name);
  return u;
}

Unexplained describe_isolated_event(const Diagnosis& d, const IsolatedEventOptions& options) {
  const EffectDesign& design = *d.search.once;
  FitControl control;
  control.keep_residuals = true;
  const EffectFit with = fit_effects(d.evidence, {&design}, nullptr, control);
  const IsolatedEvent isolated_event =
      locate_isolated_event(d.evidence, d.search.null, with, options);
  const EvidenceChannel& c = d.evidence.channels[isolated_event.channel];
  Unexplained u;
  u.channel = isolated_event.channel;
  u.stage = evidence_stage(c.kind);
  u.at = c.at;
  u.depends_on = {"time"};
  u.rmse = suspect_rms(d.evidence, isolated_event.channel,
                       d.search.null.residual[isolated_event.channel]);
  u.noise_floor = c.noise_floor;
  u.unit = c.unit;
  u.share = isolated_event.share;
  u.few_places = true;
  u.sentence = isolated_event_sentence(
      d.evidence, isolated_event,
      effect_key(design.effect.effect->info(), *d.evidence.series[0].machine, design.effect.at));
  return u;
}

}  // namespace sparflow
