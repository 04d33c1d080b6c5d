#include "identification/experiment.h"

#include <algorithm>
#include <cmath>

#include "identification/effect_power.h"
#include "identification/selftest_size.h"

namespace sparflow {
namespace {

/// Longer motions are what an operator is asked for; a minute shows what they are worth.
constexpr double kMinute = 60.0;
constexpr double kFallbackLoad = 500.0;  ///< [kg] when the logs carry none

/// What the wrong one of two effects would lose on this evidence, the smaller of both ways. [nats]
double separation(const Evidence& evidence, const EffectFit& fit, const EffectAt& one,
                  const EffectAt& other) {
  const std::vector<SearchCandidate> pair = search_candidates(evidence, {one, other});
  if (pair.empty()) return 0.0;
  const PowerStudy study(evidence, fit, 1);
  std::vector<std::vector<ProjectedDesign>> projected;
  for (const SearchCandidate& c : pair) {
    projected.emplace_back();
    for (const EffectDesign& d : c.designs) projected.back().push_back(study.project(d));
  }
  double least = 1e300;
  for (std::size_t i = 0; i < pair.size(); ++i) {
    const EffectSize size = size_effect(pair[i]);
    const Signature s = signature(projected[i][size.typical], size.theta);
    double best = study.gain(s);  // a rival without action here explains nothing
    for (std::size_t k = 0; k < pair.size(); ++k) {
      if (k == i) continue;
      for (const ProjectedDesign& p : projected[k])
        best = std::min(best, study.gain(left_by(s, p)));
    }
    least = std::min(least, best);
  }
  return least;
}

/// The noise of the same channels in the user's logs; a channel that is not measured there is dropped.
EffectFit noise_of(Evidence& motion, const Evidence& evidence, const EffectFit& fit) {
  EffectFit out;
  std::vector<EvidenceChannel> kept;
  for (EvidenceChannel& c : motion.channels) {
    for (std::size_t k = 0; k < evidence.channels.size(); ++k) {
      if (evidence.channels[k].kind != c.kind || evidence.channels[k].index != c.index) continue;
      out.noise.push_back(fit.noise[k]);
      kept.push_back(std::move(c));
      break;
    }
  }
  motion.channels = std::move(kept);
  return out;
}

}  // namespace

BetterMotion better_motion(const CraneModel& model, const Evidence& evidence, const EffectFit& fit,
                           const EffectAt& one, const EffectAt& other) {
  BetterMotion best;
  double heaviest = 0.0, minutes = 0.0;
  for (std::size_t k = 0; k < evidence.suspects; ++k) {
    const MachineSeries& s = evidence.series[k];
    for (const double p : s.payload)
      if (p > heaviest) heaviest = p;  // NaN never is
    minutes += s.step * static_cast<double>(s.samples()) / 60.0;
  }
  if (heaviest < 50.0) heaviest = kFallbackLoad;
  best.nats_here = separation(evidence, fit, one, other) / std::max(minutes, 1e-3);
  CraneModel plain =
      model;  // the motion is judged by what the two effects do beyond the machine file
  plain.effects.clear();
  SignalOptions options;
  options.smoothing.window_s = evidence.window;
  for (const MotionRecipe& recipe : motion_menu(model.machine, heaviest)) {
    Evidence motion;
    try {
      motion = collect_evidence(
          plain, {make_signals(plain.machine,
                               synthesise_motion(plain, recipe, evidence.series[0].step, kMinute),
                               options)});
    } catch (const std::domain_error&) {
      continue;  // leads through poses the machine cannot take
    }
    const EffectFit noise = noise_of(motion, evidence, fit);
    if (motion.channels.empty()) continue;
    const double nats = separation(motion, noise, one, other);
    if (nats <= best.nats_per_minute) continue;
    best.nats_per_minute = nats;
    best.words = recipe.words;
  }
  // less than what tells them apart in a quarter of an hour, or no better than what was recorded: no advice
  if (best.nats_per_minute < 0.3 || best.nats_per_minute < 1.5 * best.nats_here) best.words.clear();
  return best;
}

}  // namespace sparflow
