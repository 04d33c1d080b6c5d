#include "diagnosis/selection/search_scores.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/regression/acceptance_statistics.h"
#include "models/math/parallel.h"

namespace sparflow {
namespace {

/// Few, because every candidate is fitted in every step; the fits of found effects go to convergence.
constexpr int kPasses = 2;
constexpr double kGolden = 0.381966;  // share of the golden section

/// Description of nonlinear parameter `k`, counted among the nonlinear ones.
const EffectParameter& shape_parameter(const Effect& effect, std::size_t k) {
  const std::vector<EffectParameter>& all = effect.info().parameters;
  const auto linear = static_cast<std::size_t>(
      std::count_if(all.begin(), all.end(), [](const EffectParameter& p) { return p.linear; }));
  return all[linear + k];
}

std::vector<CandidateScore> sorted(std::vector<CandidateScore> scores) {
  std::erase_if(scores, [](const CandidateScore& s) { return s.gain <= -1e299; });
  std::sort(scores.begin(), scores.end(),
            [](const CandidateScore& a, const CandidateScore& b) { return a.gain > b.gain; });
  return scores;
}

}  // namespace

bool GainContext::same_as(const GainContext& other) const {
  // fits of the same designs end within their tolerance of each other
  constexpr double kSameFit = 1e-3;  // [nats]
  if (others != other.others || log_likelihood.size() != other.log_likelihood.size()) return false;
  for (std::size_t k = 0; k < log_likelihood.size(); ++k)
    if (!(std::abs(log_likelihood[k] - other.log_likelihood[k]) <= kSameFit)) return false;
  return true;
}

bool same_contexts(const std::vector<GainContext>& a, const std::vector<GainContext>& b) {
  return !a.empty() &&
         std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const GainContext& x, const GainContext& y) { return x.same_as(y); });
}

SearchScores::SearchScores(const Evidence& evidence, const std::vector<SearchCandidate>& candidates,
                           const SearchOptions& options)
    : evidence_(evidence),
      candidates_(candidates),
      options_(options),
      cold_(WhitenedChannels::cold(evidence)),
      known_(candidates.size()) {}

/// The channels in which a design acts, and all that share a parameter with them through other designs.
std::vector<bool> SearchScores::connected(const std::vector<const EffectDesign*>& designs,
                                          const EffectDesign& d) const {
  std::vector<bool> active(evidence_.channels.size());
  for (std::size_t c = 0; c < active.size(); ++c) active[c] = d.touches(c);
  for (bool grown = true; grown;) {
    grown = false;
    for (const EffectDesign* other : designs) {
      bool meets = false, outside = false;
      for (std::size_t c = 0; c < active.size(); ++c) {
        meets = meets || (other->touches(c) && active[c]);
        outside = outside || (other->touches(c) && !active[c]);
      }
      if (!meets || !outside) continue;
      grown = true;
      for (std::size_t c = 0; c < active.size(); ++c) active[c] = active[c] || other->touches(c);
    }
  }
  return active;
}

/// Whether a noise model that was fitted without an effect may contain that effect: a slow effect (oil that warms, a
/// wrong mass) can be explained as offsets of motions. The likelihood then has two maxima, and a fit that starts from
/// white noise finds the one with the effect.
bool SearchScores::may_hide(const EffectFit& current, const EffectDesign& d) const {
  for (std::size_t c = 0; c < current.noise.size(); ++c) {
    if (!d.touches(c)) continue;
    const NoiseModel& noise = current.noise[c];
    const double whole = noise.deviation() * noise.deviation();
    if (noise.offset_variance > options_.hiding_offsets * whole ||
        noise.phi1 > options_.hiding_correlation * (1.0 - noise.phi2))
      return true;
  }
  return false;
}

std::vector<GainContext> SearchScores::contexts(const std::vector<const EffectDesign*>& base,
                                                const EffectFit& current,
                                                std::size_t candidate) const {
  std::vector<GainContext> all;
  all.reserve(candidates_[candidate].designs.size());
  for (const EffectDesign& d : candidates_[candidate].designs) {
    const std::vector<bool> active = connected(base, d);
    GainContext context;
    for (const EffectDesign* b : base) {
      bool shares = false;
      for (std::size_t c = 0; c < active.size(); ++c)
        shares = shares || (active[c] && b->touches(c));
      if (!shares) continue;
      if (b->number == 0) return {};
      context.others.push_back(b->number);
    }
    std::sort(context.others.begin(), context.others.end());
    for (std::size_t c = 0; c < active.size(); ++c)
      if (active[c]) context.log_likelihood.push_back(current.log_likelihood[c]);
    all.push_back(std::move(context));
  }
  return all;
}

double SearchScores::gain(const std::vector<const EffectDesign*>& base, const EffectDesign& d,
                          const EffectFit& current, const std::vector<bool>& also,
                          bool only_there) const {
  return gain_beside({base, current}, d, also, only_there);
}

double SearchScores::gain_beside(const Beside& beside, const EffectDesign& d,
                                 const std::vector<bool>& also, bool only_there) const {
  const std::vector<const EffectDesign*>& base = beside.base;
  const EffectFit& current = beside.current;
  FitControl c;
  c.first = beside.first;
  c.active = connected(base, d);
  for (std::size_t k = 0; k < also.size(); ++k) c.active[k] = c.active[k] || also[k];
  c.noise_passes = kPasses;
  std::vector<const EffectDesign*> with;
  for (const EffectDesign* b : base) {
    bool needed = false;
    for (std::size_t k = 0; k < c.active.size(); ++k)
      needed = needed || (b->touches(k) && c.active[k]);
    if (needed) with.push_back(b);
  }
  with.push_back(&d);
  const auto gained = [&](const EffectFit& fit) {
    double sum = 0.0;
    for (std::size_t k = 0; k < c.active.size(); ++k) {
      // with only_there, a rival must explain the same evidence
      if (only_there ? also[k] : c.active[k])
        sum += fit.log_likelihood[k] - current.log_likelihood[k];
    }
    return sum;
  };
  const double from_current = gained(fit_effects(evidence_, with, &current, c));
  if (!may_hide(current, d)) return from_current;
  c.first = &cold_;
  return std::max(from_current, gained(fit_effects(evidence_, with, nullptr, c)));
}

std::vector<bool> SearchScores::touched_by(const EffectDesign& design) const {
  std::vector<bool> touched(evidence_.channels.size());
  for (std::size_t c = 0; c < touched.size(); ++c) touched[c] = design.touches(c);
  return touched;
}

std::vector<CandidateScore> SearchScores::beside(const std::vector<const EffectDesign*>& base,
                                                 const EffectFit& current,
                                                 const std::vector<bool>& skip) const {
  const WhitenedChannels first = WhitenedChannels::by(evidence_, current.noise);
  std::vector<CandidateScore> scores(candidates_.size());
  parallel(candidates_.size(), [&](std::size_t i) {
    if (skip[i]) return;
    std::vector<GainContext> context = contexts(base, current, i);
    KnownGain& known = known_[i];
    if (same_contexts(context, known.contexts)) {
      scores[i] = known.score;
      return;
    }
    for (std::size_t k = 0; k < candidates_[i].designs.size(); ++k) {
      const double g = gain_beside({base, current, &first}, candidates_[i].designs[k]) -
                       candidates_[i].penalty_of(candidates_[i].designs[k]);
      if (g > scores[i].gain) scores[i] = {i, k, g};
    }
    known = {std::move(context), scores[i]};
  });
  return sorted(std::move(scores));
}

std::vector<CandidateScore> SearchScores::instead_of(const EffectDesign& place,
                                                     const std::vector<const EffectDesign*>& others,
                                                     const EffectFit& without,
                                                     const std::vector<bool>& skip) const {
  const std::vector<bool> touched = touched_by(place);
  const WhitenedChannels first = WhitenedChannels::by(evidence_, without.noise);
  std::vector<CandidateScore> scores(candidates_.size());
  parallel(candidates_.size(), [&](std::size_t k) {
    const SearchCandidate& c = candidates_[k];
    if (skip[k]) return;
    for (std::size_t d = 0; d < c.designs.size(); ++d) {
      bool meets = false;
      for (std::size_t ch = 0; ch < touched.size(); ++ch)
        meets = meets || (touched[ch] && c.designs[d].touches(ch));
      if (!meets) return;
      const double g = gain_beside({others, without, &first}, c.designs[d], touched, true) -
                       c.penalty_of(c.designs[d]);
      if (g > scores[k].gain) scores[k] = {k, d, g};
    }
  });
  return sorted(std::move(scores));
}

double SearchScores::gain_instead(const EffectDesign& design, const EffectDesign& place,
                                  const std::vector<const EffectDesign*>& others,
                                  const EffectFit& without) const {
  return gain(others, design, without, touched_by(place), true);
}

LeastSquaresResidual SearchScores::least_squares(const std::vector<const EffectDesign*>& base,
                                                 const EffectDesign& design) const {
  return least_squares_residual(evidence_, base, design, connected(base, design));
}

/// Golden sections along one nonlinear parameter, between its neighbours on the grid, or between a share and a multiple of the grid's
/// only value.
void SearchScores::refine_along(const Beside& beside, const SearchCandidate& candidate,
                                std::size_t k, EffectDesign& d, double& at_best) const {
  const EffectParameter& parameter = shape_parameter(*d.effect.effect, k);
  std::vector<double> values;
  for (const EffectDesign& other : candidate.designs) {
    if (!is_absent(parameter, other.shape[k])) values.push_back(other.shape[k]);
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  double lo = d.shape[k], hi = d.shape[k];
  if (values.size() == 1) {
    lo = std::max(parameter.lower, values.front() / kShapeReach);
    hi = std::min(parameter.upper, values.front() * kShapeReach);
  } else {
    for (const double v : values) {
      if (v < d.shape[k] - 1e-12) lo = v;
      if (v > d.shape[k] + 1e-12) {
        hi = v;
        break;
      }
    }
  }
  for (int i = 0; i < kMostShapeSections && hi - lo > kShapeWidth * std::max(std::abs(hi), 1e-12);
       ++i) {
    const bool right = hi - d.shape[k] > d.shape[k] - lo;
    const double x =
        right ? d.shape[k] + kGolden * (hi - d.shape[k]) : d.shape[k] - kGolden * (d.shape[k] - lo);
    std::vector<double> shape = d.shape;
    shape[k] = x;
    EffectDesign trial = make_design(evidence_, d.effect, shape, {}, d.optional);
    const double g = trial.acts() ? gain_beside(beside, trial) : -1e300;
    if (g > at_best) {
      (right ? lo : hi) = d.shape[k];
      d = std::move(trial);
      at_best = g;
    } else {
      (right ? hi : lo) = x;
    }
  }
}

EffectDesign SearchScores::refined(const std::vector<const EffectDesign*>& base,
                                   const CandidateScore& score, const EffectFit& current) const {
  const SearchCandidate& candidate = candidates_[score.candidate];
  EffectDesign d = candidate.designs[score.design];
  if (d.shape.empty()) return d;
  const WhitenedChannels first = WhitenedChannels::by(evidence_, current.noise);
  const Beside beside{base, current, &first};
  double at_best = gain_beside(beside, d);
  const std::vector<bool> choices = shape_choices(*d.effect.effect, d.shape);
  const auto free = std::count(choices.begin(), choices.end(), false);
  for (int sweep = 0; sweep < (free > 1 ? kShapeSweeps : 1); ++sweep) {
    const double before = at_best;
    for (std::size_t k = 0; k < d.shape.size(); ++k)
      if (!choices[k]) refine_along(beside, candidate, k, d, at_best);
    if (at_best < before + options_.least_reshape_gain) break;
  }
  return d;
}

}  // namespace sparflow
