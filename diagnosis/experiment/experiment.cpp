#include "diagnosis/experiment/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/experiment/effect_power.h"
#include "diagnosis/selection/search_candidates.h"

namespace sparflow {
namespace {

/// [s] Motions are synthesised for a minute; the operator is asked for a multiple of it.
constexpr double kMinute = 60.0;
constexpr unsigned kSeed = 1;  ///< of the noise draws, so that results repeat

/// The found effect on this evidence; no columns where it does not act.
EffectDesign design_of(const Evidence& evidence, const AppliedEffect& found,
                       Eigen::VectorXd& theta) {
  const auto& parameters = found.effect->info().parameters;
  std::vector<double> linear, shape;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    (parameters[p].linear ? linear : shape).push_back(found.values[p]);
  theta =
      Eigen::Map<const Eigen::VectorXd>(linear.data(), static_cast<Eigen::Index>(linear.size()));
  return make_design(evidence, {found.effect, found.at}, std::move(shape));
}

/// By rival: gain of the found effect over it on this evidence if the found effect is the true one. [nats]
std::vector<double> separations(const Evidence& evidence, const EffectFit& fit,
                                const IndistinguishableSet& set, const PowerOptions& options) {
  const std::vector<EffectAt>& rivals = set.rivals;
  std::vector<double> nats(rivals.size(), 0.0);
  Eigen::VectorXd theta;
  const EffectDesign design = design_of(evidence, set.found, theta);
  if (!design.acts()) return nats;
  const PowerStudy study(evidence, fit, kSeed, options);
  const Signature truth = signature(study.project(design), theta);
  for (std::size_t r = 0; r < rivals.size(); ++r) {
    nats[r] = study.gain(truth);  // for a rival that does not act on this evidence
    for (const SearchCandidate& c : search_candidates(evidence, {rivals[r]})) {
      for (const EffectDesign& d : c.designs)
        nats[r] = std::min(nats[r], study.gain(left_by(truth, study.project(d))));
    }
  }
  return nats;
}

/// The noise models of the same channels in the user's logs; channels that are not measured there are dropped.
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
                           const IndistinguishableSet& set, const ExperimentOptions& options) {
  const std::vector<EffectAt>& rivals = set.rivals;
  BetterMotion best;
  if (rivals.empty()) return best;
  double heaviest = 0.0, minutes = 0.0;
  for (std::size_t k = 0; k < evidence.suspects; ++k) {
    const MachineSeries& s = evidence.series[k];
    for (const double p : s.payload)
      if (p > heaviest) heaviest = p;  // false for NaN
    minutes += s.step * static_cast<double>(s.samples()) / 60.0;
  }
  if (heaviest < options.lightest_load) heaviest = options.fallback_load;
  const std::vector<MotionRecipe> menu = motion_menu(model.machine, heaviest, options.motion);
  CraneModel plain = model;  // the machine of the file, without effects
  plain.effects.clear();
  SignalOptions signals;
  signals.smoothing.window_s = evidence.window;
  std::vector<std::vector<double>> nats(menu.size());  // [motions][rivals] a minute
  for (std::size_t m = 0; m < menu.size(); ++m) {
    nats[m].assign(rivals.size(), 0.0);
    Evidence motion;
    try {
      motion = collect_evidence(
          plain,
          {make_signals(
              plain.machine,
              synthesise_motion(plain, menu[m], evidence.series[0].step, kMinute, options.motion),
              signals)},
          {}, nullptr, evidence.options);
    } catch (const std::domain_error&) {
      continue;  // the motion has poses that the machine cannot take
    }
    const EffectFit noise = noise_of(motion, evidence, fit);
    if (!motion.channels.empty()) nats[m] = separations(motion, noise, set, options.power);
  }
  std::vector<double> here = separations(evidence, fit, set, options.power);
  for (double& h : here) h /= std::max(minutes, 1e-3);
  const auto worth = [&](std::size_t m, std::size_t r) {
    return nats[m][r] >= options.least_nats_per_minute &&
           nats[m][r] >= options.better_than_here * here[r];
  };
  // rivals that no motion distinguishes are left out; the best motion is that with the largest least gain of the others
  std::vector<std::size_t> open;
  for (std::size_t r = 0; r < rivals.size(); ++r) {
    for (std::size_t m = 0; m < menu.size(); ++m) {
      if (!worth(m, r)) continue;
      open.push_back(r);
      break;
    }
  }
  for (std::size_t m = 0; m < menu.size() && !open.empty(); ++m) {
    double least = nats[m][open.front()], least_here = here[open.front()];
    std::vector<EffectAt> apart;
    for (const std::size_t r : open) {
      least = std::min(least, nats[m][r]);
      least_here = std::min(least_here, here[r]);
      if (worth(m, r)) apart.push_back(rivals[r]);
    }
    const bool more = apart.size() > best.apart.size();
    if (apart.empty() || apart.size() < best.apart.size()) continue;
    if (!more && least <= best.nats_per_minute) continue;
    best = {menu[m].words, least, least_here, std::move(apart)};
  }
  if (best.words.empty() && !here.empty())
    best.nats_here = *std::min_element(here.begin(), here.end());
  return best;
}

std::string Experiment::sentence() const {
  if (!(nats_per_minute > 0.0)) return fmt::format("to distinguish them, record: {}", motion);
  const double minutes = std::max(1.0, std::ceil(decisive_nats / nats_per_minute));
  return fmt::format("record {:.0f} minute{} of: {} ({})", minutes, minutes > 1.0 ? "s" : "",
                     motion, reason);
}

Experiment next_experiment(const CraneModel& model, const Evidence& evidence, const EffectFit& fit,
                           const IndistinguishableSet& set, const ExperimentOptions& options) {
  const AppliedEffect& found = set.found;
  const auto name = [&](const Effect& effect, int at) {
    return effect_key(effect.info(), model.machine, at);
  };
  const BetterMotion motion = better_motion(model, evidence, fit, set, options);
  std::vector<std::string> apart;
  for (const EffectAt& e : motion.words.empty() ? set.rivals : motion.apart)
    apart.push_back(name(*e.effect, e.at));
  const std::string reason = fmt::format("distinguishes {} from {}", name(*found.effect, found.at),
                                         fmt::join(apart, ", "));
  if (motion.words.empty()) return {reason, found.effect->info().separated_by, 0.0, 0.0};
  return {reason, motion.words, motion.nats_per_minute, motion.nats_here};
}

}  // namespace sparflow
