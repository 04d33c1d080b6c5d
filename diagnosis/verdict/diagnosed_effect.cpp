#include "diagnosis/verdict/diagnosed_effect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/selection/leader_updates.h"
#include "diagnosis/verdict/residual_levels.h"
#include "identification/comparison/report_numbers.h"
#include "models/math/nan.h"

namespace sparflow {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// @param weights of the blocks' rows; empty: one
double weighed_rms(const Evidence& evidence, std::size_t channel, const VectorXd& residual,
                   const std::vector<double>& weights) {
  const EvidenceChannel& c = evidence.channels[channel];
  double squares = 0.0, rows = 0.0;
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    if (static_cast<std::size_t>(c.log[b]) >= evidence.suspects) continue;
    const Index length = c.blocks[b].last - c.blocks[b].first;
    const double weight = weights.empty() ? 1.0 : weights[b];
    squares += weight * residual.segment(c.blocks[b].first, length).squaredNorm();
    rows += weight * static_cast<double>(length);
  }
  return rows > 0.0 ? std::sqrt(squares / rows) : 0.0;
}

}  // namespace

double suspect_rms(const Evidence& evidence, std::size_t channel, const VectorXd& residual) {
  return weighed_rms(evidence, channel, residual, {});
}

std::vector<double> Diagnosis::block_weights(std::size_t channel) const {
  if (channel >= search.final.noise.size()) return {};
  std::vector<double> weights = search.final.noise[channel].block_scale;
  if (weights.size() != evidence.channels[channel].blocks.size()) return {};
  for (double& w : weights) w = 1.0 / (w * w);
  return weights;
}

double weighed_suspect_rms(const Diagnosis& d, std::size_t channel, const VectorXd& residual) {
  const std::vector<double> weights = d.block_weights(channel);
  return weights.empty() ? kNaN : weighed_rms(d.evidence, channel, residual, weights);
}

EffectFit fit_without(const Diagnosis& d, std::size_t index) {
  std::vector<EffectDesign> others;
  others.reserve(d.search.found.size());
  std::vector<AppliedEffect> acting;
  acting.reserve(d.search.found.size());
  for (std::size_t i = 0; i < d.search.found.size(); ++i) {
    if (i == index) continue;
    const FoundEffect& f = d.search.found[i];
    others.push_back(f.design);
    acting.push_back({f.design.effect.effect, f.design.effect.at, f.values, {}, {}});
  }
  // without this effect, the load-sensing leader may be another
  std::optional<Evidence> updated;
  if (d.search.updated_evidence && index < d.search.found.size())
    updated = d.evidence.with_leaders_of(acting);
  if (updated) others = rebuilt_designs(*updated, others);
  std::vector<const EffectDesign*> pointers;
  pointers.reserve(others.size());
  for (const EffectDesign& o : others) pointers.push_back(&o);
  FitControl control;
  control.keep_residuals = true;
  return fit_effects(updated ? *updated : d.evidence, pointers, nullptr, control);
}

double largest_reduction(const Diagnosis& d, std::size_t index) {
  const EffectFit without = fit_without(d, index);
  double most = 0.0;
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!d.search.found[index].design.touches(c)) continue;
    const std::vector<double> weights = d.block_weights(c);
    most = std::max(most, weighed_rms(d.evidence, c, without.residual[c], weights) /
                              weighed_rms(d.evidence, c, d.search.final.residual[c], weights));
  }
  return most;
}

namespace {

/// The errors of the channels that an effect improves, without and with it, in sentences.
std::vector<std::string> error_sentences(const Diagnosis& d, const DiagnosedEffect& e,
                                         const EffectFit& without) {
  std::vector<std::string> out;
  const auto rms = [&d](const ChannelGain& g, const VectorXd& residual) {
    return g.weighed() ? weighed_suspect_rms(d, g.channel, residual)
                       : suspect_rms(d.evidence, g.channel, residual);
  };
  for (const ChannelGain& g : e.channels) {
    const EvidenceChannel& c = d.evidence.channels[g.channel];
    if (g.before() < d.thresholds.least_reduction * g.after()) continue;
    const VectorXd before = settled(d, g.channel, without.residual[g.channel]);
    const VectorXd after = settled(d, g.channel, d.search.final.residual[g.channel]);
    const bool settles = d.search.final.noise[g.channel].transient != 1.0;
    out.push_back(fmt::format(
        "{}: error{} {} -> {} {}{}{}", c.text,
        g.weighed() ? ", weighed by the variance of each stretch of motion," : "",
        plain_number(g.before() / c.unit.si, 3), plain_number(g.after() / c.unit.si, 3),
        c.unit.name,
        std::isfinite(g.noise_floor)
            ? fmt::format(
                  " (sensor noise {}{})", plain_number(g.noise_floor / c.unit.si, 2),
                  std::isfinite(g.in_references)
                      ? ", the references leave " + plain_number(g.in_references / c.unit.si, 3)
                      : "")
            : "",
        settles ? fmt::format("; without starts and stops {} -> {} {}",
                              plain_number(rms(g, before) / c.unit.si, 3),
                              plain_number(rms(g, after) / c.unit.si, 3), c.unit.name)
                : ""));
    if (&g != &e.channels.front()) continue;
    if (const std::string left = left_beyond_references(d, g); !left.empty()) out.push_back(left);
  }
  return out;
}

}  // namespace

DiagnosedEffect describe_effect(const Diagnosis& d, std::size_t index,
                                const SearchOptions& options) {
  const FoundEffect& f = d.search.found[index];
  const Machine& machine = *d.evidence.series[0].machine;
  const EffectInfo& info = f.design.effect.effect->info();
  DiagnosedEffect e;
  e.effect = f.design.effect;
  e.id = info.id;
  const std::string key = effect_key(info, machine, e.effect.at);
  e.at = key.size() > info.id.size() ? key.substr(info.id.size() + 1) : "";
  e.stage = effect_stage_name(info.stage);
  e.applied = {e.effect.effect, e.effect.at, f.values, f.lower95, f.upper95, f.covariance};
  for (std::size_t k = 0; k < info.parameters.size(); ++k) {
    const EffectParameter& p = info.parameters[k];
    if (is_absent(p, f.values[k])) continue;
    e.parameters.push_back({p.name, p.unit, p.meaning, f.values[k] / p.si, f.lower95[k] / p.si,
                            f.upper95[k] / p.si,
                            is_determined(f.values[k], f.lower95[k], f.upper95[k], p.typical),
                            variant_text(p, f.values[k])});
  }
  e.p_value = f.p_value;
  e.gain = f.gain;
  e.held_out_gain = f.held_out;
  e.held_out_error = f.held_out_error;
  e.absorbed = f.absorbed;
  double odds = 0.0, odds_of_rivals = 0.0;
  const double same = same_within(f, options);
  for (const auto& [rival, worse] : f.alternatives) {
    const double one = std::exp(-std::max(0.0, worse) * options.same_nats / same);
    odds += one;
    if (worse < same) odds_of_rivals += one;
    if (worse < same)
      e.rivals.emplace_back(effect_key(rival.effect->info(), machine, rival.at), worse);
  }
  e.probability = (1.0 - f.p_value) / (1.0 + odds);
  e.set_probability = (1.0 - f.p_value) * (1.0 + odds_of_rivals) / (1.0 + odds);

  const EffectFit without = fit_without(d, index);
  for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
    if (!f.design.touches(c)) continue;
    e.channels.push_back(
        {c, suspect_rms(d.evidence, c, without.residual[c]),
         suspect_rms(d.evidence, c, d.search.final.residual[c]), d.evidence.channels[c].noise_floor,
         weighed_suspect_rms(d, c, without.residual[c]),
         weighed_suspect_rms(d, c, d.search.final.residual[c]),
         d.evidence.has_reference() && !d.stretches_weighed ? expected_rms(d, c) : kNaN});
  }
  std::sort(e.channels.begin(), e.channels.end(), [](const ChannelGain& a, const ChannelGain& b) {
    return a.before() / a.after() > b.before() / b.after();
  });
  e.evidence = error_sentences(d, e, without);
  e.evidence.push_back(
      fmt::format("it improves the prediction of motions left out of the estimate, in {:.0f} % of "
                  "the folds and by {:.1f} standard errors",
                  100.0 * f.held_out_share, e.held_out_gain / std::max(e.held_out_error, 1e-300)));
  if (const std::string partial = partial_law(e); !partial.empty())
    e.evidence.insert(e.evidence.begin(), partial);
  return e;
}

std::string left_beyond_references(const Diagnosis& d, const ChannelGain& g) {
  if (!(g.after() > d.thresholds.least_excess_ratio * g.in_references)) return {};  // NaN: ""
  return fmt::format(
      "what is left there is {:.1f} times what the references leave at the same loads and speeds: "
      "another form of this effect, or a second cause, acts as well",
      g.after() / g.in_references);
}

std::string partial_law(const DiagnosedEffect& e) {
  const auto share = std::find_if(e.parameters.begin(), e.parameters.end(),
                                  [](const ParameterEstimate& p) { return p.name == "share"; });
  if (share == e.parameters.end() || !share->determined ||
      (share->lower95 <= 1.0 && share->upper95 >= 1.0))
    return {};
  return fmt::format(
      "its share is {} ({} to {}), not one: the logs do not show this law as a whole, and another "
      "one may be the cause",
      plain_number(share->value, 3), plain_number(share->lower95, 3),
      plain_number(share->upper95, 3));
}

}  // namespace sparflow
