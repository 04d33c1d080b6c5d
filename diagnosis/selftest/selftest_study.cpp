#include "diagnosis/selftest/selftest_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/selection/effect_intervals.h"
#include "models/math/parallel.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallestTimes = 1e-4;  ///< [-] where bisection for a size starts

std::vector<ShownValue> shown(const EffectInfo& info, const std::vector<double>& values) {
  std::vector<ShownValue> out;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const EffectParameter& p = info.parameters[k];
    out.push_back({p.name, p.unit, values[k] / p.si});
  }
  return out;
}

EffectFit noise_only(const EffectFit& fit, const VectorXd& theta) {
  EffectFit out;
  out.noise = fit.noise;
  out.theta = theta;
  return out;
}

/// Whether too few motions excite an effect for the acceptance test on motions left out: that test's rule, applied to
/// the expected gains of the folds without noise.
bool in_too_few_motions(const Evidence& evidence, const Signature& s,
                        const SearchOptions& options) {
  constexpr double kNothing = 1e-6;  // a share of the gain that is rounding
  const int folds = options.folds;
  VectorXd gains = VectorXd::Zero(folds);
  for (std::size_t c = 0; c < s.white.size(); ++c) {
    if (s.white[c].size() == 0) continue;
    const std::vector<NoiseBlock>& blocks = evidence.channels[c].blocks;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      gains[static_cast<Index>(b) % folds] +=
          s.white[c].segment(blocks[b].first, blocks[b].last - blocks[b].first).squaredNorm();
    }
  }
  const double n = folds,
               error = std::sqrt((gains.array() - gains.mean()).square().sum() * n / (n - 1.0));
  const auto positive = (gains.array() > kNothing * gains.sum()).count();
  return gains.sum() <= options.held_out_errors * error &&
         static_cast<double>(positive) < options.improved_share * n;
}

}  // namespace

bool behind_learned_law(EffectStage stage) {
  return stage == EffectStage::kPressure || stage == EffectStage::kPump;
}

SelftestStudy::SelftestStudy(const Machine& machine, const SelftestEvidence& logs,
                             std::vector<SearchCandidate> candidates, NullDistribution null,
                             const SelftestOptions& options)
    : machine_(machine),
      evidence_(logs.evidence),
      alone_(logs.alone),
      fit_(logs.fit),
      options_(options),
      search_(options.search),
      null_(std::move(null)),
      threshold_(std::max(null_.threshold(options.search.false_alarm), options.search.least_gain)),
      power_(evidence_, fit_, options.search.seed, options.experiment.power),
      candidates_(std::move(candidates)),
      sizes_(candidates_.size()),
      projected_(candidates_.size()),
      result_(candidates_.size()) {
  parallel(candidates_.size(), [&](std::size_t i) {
    sizes_[i] = size_effect(machine_, candidates_[i], options.largest_times);
    for (const EffectDesign& d : candidates_[i].designs) projected_[i].push_back(power_.project(d));
  });
}

std::vector<InjectedEffect> SelftestStudy::run() {
  parallel(candidates_.size(), [&](std::size_t i) { see(i); });
  parallel(candidates_.size(), [&](std::size_t i) { confuse(i); });
  return result_;
}
Signature SelftestStudy::typical_signature(std::size_t i) const {
  return signature(projected_[i][sizes_[i].typical], sizes_[i].theta);
}

double SelftestStudy::least_gain_of(std::size_t i) const {
  return null_.scale[i] * (threshold_ + candidates_[i].penalty);
}

/// Probability that a gain with this mean passes the threshold.
double SelftestStudy::chance(std::size_t i, double gain) const {
  const SearchCandidate& c = candidates_[i];
  return chance_above(2.0 * least_gain_of(i), c.linear, 2.0 * gain);
}

/// Least multiple of the typical size with this mean gain, and the parameter values there [SI].
std::pair<double, std::vector<double>> SelftestStudy::times_for(std::size_t i,
                                                                const Signature& typical,
                                                                double gain) const {
  const EffectSize& s = sizes_[i];
  const SearchCandidate& c = candidates_[i];
  if (s.levels.empty()) {
    double lo = std::log(kSmallestTimes), hi = std::log(s.largest);
    if (power_.gain(typical, s.largest) < gain) return {kInfinity, {}};
    for (int k = 0; k < 22; ++k) {  // to 3e-6 of the range of logarithms
      const double middle = 0.5 * (lo + hi);
      (power_.gain(typical, std::exp(middle)) < gain ? lo : hi) = middle;
    }
    const double times = std::exp(hi);
    return {times, parameter_values(*c.effect.effect, times * s.theta, c.designs[s.typical].shape)};
  }
  // from the weakest to the strongest grid point, interpolated between two
  double before_gain = 0.0, before_value = 0.0, before_times = 0.0;
  for (std::size_t k = 0; k < s.levels.size(); ++k) {
    const SizeLevel& level = s.levels[k];
    const double g = power_.gain(signature(projected_[i][level.design], s.theta));
    if (g < gain) {
      before_gain = g, before_value = level.value, before_times = level.times;
      continue;
    }
    std::vector<double> shape = c.designs[level.design].shape;
    double times = level.times;
    if (k > 0 && g > before_gain) {
      const double t =
          (std::sqrt(gain) - std::sqrt(before_gain)) / (std::sqrt(g) - std::sqrt(before_gain));
      shape[0] = before_value + t * (level.value - before_value);
      times = before_times + t * (level.times - before_times);
    }
    return {times, parameter_values(*c.effect.effect, s.theta, shape)};
  }
  return {kInfinity, {}};
}

double SelftestStudy::absorbed_alone(const SearchCandidate& c, const EffectSize& s) const {
  const EffectDesign d = make_design(*alone_, c.effect, c.designs[s.typical].shape);
  EffectFit fit;
  fit.theta = s.theta;
  for (const EvidenceChannel& channel : alone_->channels) {
    fit.noise.emplace_back();
    for (std::size_t k = 0; k < evidence_.channels.size(); ++k) {
      if (evidence_.channels[k].kind == channel.kind &&
          evidence_.channels[k].index == channel.index)
        fit.noise.back() = fit_.noise[k];
    }
  }
  return d.acts() ? effect_action(*alone_, {&d}, 0, fit, search_.regression).absorbed : 1.0;
}

void SelftestStudy::see(std::size_t i) {
  const SearchCandidate& c = candidates_[i];
  const EffectSize& s = sizes_[i];
  const EffectDesign& design = c.designs[s.typical];
  const EffectInfo& info = c.effect.effect->info();
  InjectedEffect& out = result_[i];
  out.effect = c.effect;
  out.id = info.id;
  const std::string key = effect_key(info, machine_, c.effect.at);
  out.at = key.size() > info.id.size() ? key.substr(info.id.size() + 1) : "";
  out.stage = effect_stage_name(info.stage);
  out.separated_by = info.separated_by;
  out.typical = shown(info, parameter_values(*c.effect.effect, s.theta, design.shape));
  const EffectAction action =
      effect_action(evidence_, {&design}, 0, noise_only(fit_, s.theta), search_.regression);
  out.size = action.size;
  out.absorbed = out.absorbed_alone = action.absorbed;
  if (alone_) out.absorbed_alone = absorbed_alone(c, s);
  const Signature typical = typical_signature(i);
  out.gain = power_.gain(typical);
  if (behind_learned_law(info.stage) && out.absorbed > search_.largest_absorbed) {
    out.reason =
        fmt::format("the absorbed share is {:.0f} %; {}", 100.0 * out.absorbed,
                    evidence_.has_reference() ? "the reference logs cover too few flows and loads"
                                              : "give a log without it as --reference");
    return;
  }
  if (in_too_few_motions(evidence_, typical, search_)) {
    out.reason = "too few motions excite it: repeat them";
    return;
  }
  const double nats = least_gain_of(i);
  const auto [t80, v80] =
      times_for(i, typical, 0.5 * noncentrality_for(nats, options_.power_seen, c.linear));
  const auto [t95, v95] =
      times_for(i, typical, 0.5 * noncentrality_for(nats, options_.power_sure, c.linear));
  out.times80 = t80;
  out.times95 = t95;
  std::vector<double> values = v80;
  // the estimated size must also exceed the smallest that is named; its relative error is that for known noise
  const double squares = typical.squares();
  const double deviation = squares > 0.0 ? 1.0 / std::sqrt(squares) : kInfinity;
  const auto large_enough = [&](double quantile) {
    return search_.smallest_effect / std::max(out.size, 1e-12) + quantile * deviation;
  };
  if (s.levels.empty()) {
    if (large_enough(options_.quantile_seen) > out.times80) {
      out.times80 = large_enough(options_.quantile_seen);
      values = parameter_values(*c.effect.effect, out.times80 * s.theta, design.shape);
    }
    out.times95 = std::max(out.times95, large_enough(options_.quantile_sure));
    if (out.times80 > s.largest) out.times80 = kInfinity;
    if (out.times95 > s.largest) out.times95 = kInfinity;
  }
  out.power = chance(i, out.gain);
  if (std::isfinite(deviation)) {
    const double beyond = (1.0 - search_.smallest_effect / std::max(out.size, 1e-12)) / deviation;
    out.power *= 0.5 * std::erfc(-beyond / std::sqrt(2.0));
  }
  out.visibility = out.power >= options_.power_seen ? Visibility::kSeen
                   : std::isfinite(out.times80)     ? Visibility::kOnlyLarge
                                                    : Visibility::kNever;
  if (std::isfinite(out.times80)) out.smallest = shown(info, values);
  if (out.visibility == Visibility::kOnlyLarge)
    out.reason = fmt::format("{:.2f} times the noise where it acts", out.size);
  if (out.visibility == Visibility::kNever) out.reason = never_reason(i);
}

std::string SelftestStudy::never_reason(std::size_t i) const {
  const EffectDesign& design = candidates_[i].designs[sizes_[i].typical];
  double ratio = 0.0;  // of the residual to the sensors' noise, where the effect acts
  for (std::size_t c = 0; c < evidence_.channels.size(); ++c) {
    const double one = fit_.noise[c].deviation() / evidence_.channels[c].noise_floor;
    if (design.touches(c) && one > ratio) ratio = one;
  }
  // A residual that large is no noise: `diagnose` may find its cause in it, and this very effect may be the cause.
  if (ratio > options_.suspicious_noise)
    return "hidden by what the model leaves unexplained where it acts: run `diagnose` first, "
           "extend the model, and "
           "repeat the self-test";
  return "below the noise at any plausible size: stronger or more motions are needed";
}

/// Finds the rivals at the typical size or at the smallest that would be named, whichever is larger.
void SelftestStudy::confuse(std::size_t i) {
  InjectedEffect& out = result_[i];
  if (out.visibility == Visibility::kNever) return;
  Signature s = typical_signature(i);
  if (sizes_[i].levels.empty() && out.times80 > 1.0)
    s = signature(projected_[i][sizes_[i].typical], out.times80 * sizes_[i].theta);
  const double squares = s.squares();
  for (std::size_t k = 0; k < candidates_.size(); ++k) {
    if (k == i) continue;
    const EffectInfo& rival = candidates_[k].effect.effect->info();
    // an effect that fails the acceptance tests is no rival
    if (behind_learned_law(rival.stage) && result_[k].absorbed > search_.largest_absorbed) continue;
    Confusion worst{effect_key(rival, machine_, candidates_[k].effect.at), kInfinity, 0.0};
    Signature left;
    for (const ProjectedDesign& p : projected_[k]) {
      bool meets = false;
      for (std::size_t c = 0; c < p.white.size(); ++c)
        meets = meets || (p.white[c].cols() > 0 && s.white[c].size() > 0);
      if (!meets) break;
      Signature here = left_by(s, p);
      const double share = 1.0 - here.squares() / squares;
      if (share <= worst.share) continue;
      worst.share = share;
      left = std::move(here);
    }
    if (worst.share < options_.least_confusion) continue;
    worst.nats = std::min(power_.gain(left), 0.5 * left.squares());
    if (worst.nats < search_.same_nats) out.confused_with.push_back(std::move(worst));
  }
  std::sort(out.confused_with.begin(), out.confused_with.end(),
            [](const Confusion& a, const Confusion& b) { return a.nats < b.nats; });
}

}  // namespace sparflow
