#include "diagnosis/selection/effect_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/selection/acceptance_tests.h"
#include "diagnosis/selection/effect_intervals.h"
#include "diagnosis/selection/leader_updates.h"
#include "diagnosis/selection/search_choice.h"
#include "diagnosis/selection/search_moves.h"
#include "diagnosis/selection/search_state.h"

namespace sparflow {
namespace {

class Search {
 public:
  /// @param follows whether to stop, with `updated_evidence` set, when a found effect changes the load-sensing leader
  Search(const Evidence& evidence, const std::vector<EffectAt>& effects,
         const SearchOptions& options, const SearchProgress& progress, bool follows)
      : search_(evidence, effects, options, progress), follows_(follows) {
    std::mt19937_64 random(options.seed);
    null_.emplace(evidence, options.simulations, random);
  }

  SearchResult run() {
    SearchResult result;
    EffectFit current = search_.fit({});
    result.null = current;
    std::vector<FoundEffect> found;
    for (int round = 0; round < search_.options.rounds; ++round) {
      select(found, current, result);
      if (result.updated_evidence) return result;
      bool reshaped = false;
      for (std::size_t i = 0; i < found.size(); ++i) {
        reshaped = exchange(search_, found, i, current) || reshaped;
        reshaped = reshape(search_, found, i, current) || reshaped;
      }
      relinearise(found, current);
      while (search_.mechanisms().enabled(Mechanism::kMerge) && merge(search_, found, current)) {
      }
      if (reshaped) {
        for (std::size_t i = 0; i < found.size(); ++i) search_.judge(found, i, current);
      }
      finish(found, current);
      estimate_intervals(search_.evidence, found);
      if (!drop_failing(found, current, result)) break;
    }
    estimate_intervals(search_.evidence, found);
    result.final = current;
    result.found = std::move(found);
    return result;
  }

 private:
  bool lets(Mechanism m, bool decides) const { return search_.mechanisms().act(m, decides); }

  /// Records the optional parameters of what is significant.
  void record_optional_of(const std::vector<CandidateScore>& scores, const NullDistribution& null) {
    for (const CandidateScore& s : scores) {
      if (null.p_value(s.gain, s.candidate) < search_.options.false_alarm)
        record_optional(search_, s);
    }
  }

  /// Largest gain when no more is missing than `base`; simulated again for the candidates whose context has changed.
  NullDistribution null_distribution(const std::vector<const EffectDesign*>& base,
                                     const EffectFit& current) {
    std::vector<NullCandidate> candidates;
    std::vector<bool> unchanged;
    candidates.reserve(search_.candidates.size());
    unchanged.reserve(search_.candidates.size());
    null_contexts_.resize(search_.candidates.size());
    for (std::size_t k = 0; k < search_.candidates.size(); ++k) {
      const SearchCandidate& c = search_.candidates[k];
      candidates.push_back({&c.designs, c.penalty, c.optional_penalty, c.optional_shape_penalty});
      std::vector<GainContext> now = search_.scores.contexts(base, current, k);
      unchanged.push_back(same_contexts(now, null_contexts_[k]));
      if (!unchanged.back()) null_contexts_[k] = std::move(now);
    }
    return null_->distribution({search_.evidence, current, base}, candidates,
                               search_.options.regression, unchanged);
  }

  /// Adds the best candidate while one passes the threshold and the acceptance tests.
  void select(std::vector<FoundEffect>& found, EffectFit& current, SearchResult& result) {
    const int most_steps = search_.options.steps_per_effect * search_.options.max_effects;
    for (int step = 0;
         static_cast<int>(found.size()) < search_.options.max_effects && step < most_steps;) {
      search_.report(found.size(), "searching");
      const std::vector<const EffectDesign*> base = designs_of(found);
      std::vector<CandidateScore> scores =
          search_.scores.beside(base, current, search_.skipped(found));
      if (scores.empty()) break;
      if (result.ranking.empty()) {
        for (const CandidateScore& s : scores)
          result.ranking.emplace_back(search_.candidates[s.candidate].effect, s.gain);
      }
      const NullDistribution null = null_distribution(base, current);
      record_optional_of(scores, null);
      const double level = search_.options.false_alarm;
      const CandidateScore best = chosen(search_, scores, null, level, base);
      const double p = null.p_value(best.gain, best.candidate);
      if (tracing()) trace_scores(search_, step, scores, null);
      ++step;
      if (found.empty() && result.threshold == 0.0) {
        result.threshold = null.threshold(level);
        result.p_value = p;
        result.simulations = search_.options.simulations;
      }
      if (p >= level || lets(Mechanism::kLeastGain, best.gain < search_.options.least_gain)) {
        if (lets(Mechanism::kOnce, found.empty() && best.gain > search_.options.surely_something *
                                                                    search_.options.least_gain))
          result.once = search_.scores.refined(base, best, current);
        break;
      }
      FoundEffect f;
      f.design = search_.scores.refined(base, best, current);
      f.p_value = p;
      found.push_back(std::move(f));
      EffectFit next = search_.fit(designs_of(found));
      fix_share_at_one(found, next, best.gain);
      if (follows_ && search_.mechanisms().enabled(Mechanism::kLeaders) &&
          (result.updated_evidence = with_leaders_of_found(search_, found, next))) {
        lets(Mechanism::kLeaders, true);
        return;
      }
      search_.judge(found, found.size() - 1, next);
      if (tracing()) trace_found(search_, found, next);
      found.back().gain = best.gain;
      std::string why = why_not_named(found.back(), search_.options, search_.mechanisms());
      if (why.empty()) why = compensates_model_form(found, found.size() - 1, next);
      if (!why.empty()) {
        result.notes.push_back(fmt::format("{} fits best but is not named: {}",
                                           search_.key(found.back().design.effect), why));
        if (tracing()) fmt::print(stderr, "  refused: {}\n", result.notes.back());
        if (found.back().at_bound && found.back().size >= search_.options.smallest_effect &&
            best.gain > search_.options.surely_something * search_.options.least_gain) {
          result.unnamed.push_back(found.back());
        }
        const FoundEffect refused = std::move(found.back());
        found.pop_back();
        search_.refuse(best.candidate, refused, found,
                       passes_without_form_error(refused, search_.options, search_.mechanisms()));
        continue;
      }
      current = next;
    }
  }

  /// Linearises by the secant up to the values found. A tilt of three degrees reduces every weight by a thousandth, which a
  /// linearisation at zero does not contain; the error would be named as a mass or another angle.
  void relinearise(std::vector<FoundEffect>& found, EffectFit& fit) const {
    bool any = false;
    Eigen::Index first = 0;
    for (FoundEffect& f : found) {
      const std::span<const double> about(fit.theta.data() + first,
                                          static_cast<std::size_t>(f.design.linear));
      first += f.design.linear;
      if (!is_linearised(*f.design.effect.effect) || !lets(Mechanism::kAngles, true)) continue;
      f.design =
          make_design(search_.evidence, f.design.effect, f.design.shape, about, f.design.optional);
      any = true;
    }
    if (lets(Mechanism::kAngles, any)) fit = search_.fit(designs_of(found), &fit);
  }

  /// Fixes a share at one where the log does not determine it. Only the product of share and time of a short lag is
  /// observable, and likewise share and excess of a limit that is hardly reached. Where the share is far from one, a
  /// share of one with another time or limit explains nearly the same and is plausible.
  void fix_share_at_one(std::vector<FoundEffect>& found, EffectFit& fit, double gain) const {
    // factors within which the share may cross one, and halvings of that interval; a limit beyond all flows has no effect
    constexpr double kReaches[] = {1.05, 1.2, 2.0};
    constexpr int kHalvings = 9;
    EffectDesign& design = found.back().design;
    const EffectParameter& share = design.effect.effect->info().parameters.front();
    if (!search_.mechanisms().enabled(Mechanism::kShareAtOne) || !share.linear ||
        share.name != "share" || design.shape.empty())
      return;
    const double found_share = fit.theta[fit.theta.size() - design.linear];
    if (found_share > search_.options.share_near_one &&
        found_share < 1.0 / search_.options.share_near_one)
      return;
    const EffectDesign before = design;
    const auto share_at = [&](double factor) {
      std::vector<double> shape = before.shape;
      shape[0] *= factor;
      design = make_design(search_.evidence, before.effect, std::move(shape), {}, before.optional);
      if (!design.acts()) return std::numeric_limits<double>::quiet_NaN();
      design.lower[0] = -std::numeric_limits<double>::max();
      design.upper[0] = std::numeric_limits<double>::max();
      FitControl control;
      control.noise_passes = 1;
      const EffectFit f = fit_effects(search_.evidence, designs_of(found), &fit, control);
      return f.theta[f.theta.size() - design.linear];
    };
    const double at_one = share_at(1.0);
    double a = 1.0, b = 1.0;  // the share crosses one between these factors
    for (const double reach : kReaches) {
      for (const double factor : {1.0 / reach, reach}) {
        if (b == 1.0 && (share_at(factor) - 1.0) * (at_one - 1.0) < 0.0) b = factor;
      }
    }
    for (int k = 0; k < kHalvings && b != 1.0; ++k) {
      const double middle = std::sqrt(a * b);
      ((share_at(middle) - 1.0) * (at_one - 1.0) > 0.0 ? a : b) = middle;
    }
    std::vector<double> shape = before.shape;
    shape[0] *= std::sqrt(a * b);
    design = make_design(search_.evidence, before.effect, std::move(shape), {}, before.optional);
    EffectFit whole = search_.fit(designs_of(found));
    const double least = fit.total() - std::max(search_.options.share_at_one_loss,
                                                search_.options.share_at_one_loss_share * gain);
    if (tracing()) {
      fmt::print(stderr, "  share fixed at one with [{:.4g}]: {:.1f} nats\n",
                 fmt::join(design.shape, " "), whole.total() - fit.total());
    }
    if (lets(Mechanism::kShareAtOne,
             whole.total() > least && !rests_on_bound(design, whole.theta.tail(design.linear)))) {
      fit = std::move(whole);
    } else {
      design = before;
    }
  }

  /// Whether found[index] compensates model-form error of a larger effect in the same channel. A form error of a share
  /// s leaves s^2 of that effect's gain to others, and its law with another exponent may explain what a smaller effect
  /// does. @param fit of all found  @return the reason, as part of a sentence; empty when it does not
  std::string compensates_model_form(const std::vector<FoundEffect>& found, std::size_t index,
                                     const EffectFit& fit) const {
    const FoundEffect& one = found[index];
    const auto meets = [&](const EffectDesign& other) { return search_.meet(other, one.design); };
    std::vector<EffectDesign> powers;
    std::vector<std::string> names;
    Eigen::Index first = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const FoundEffect& other = found[i];
      const Eigen::VectorXd theta = fit.theta.segment(first, other.design.linear);
      first += other.design.linear;
      if (i == index || other.gain < one.gain || !meets(other.design)) continue;
      const double form = form_share(*other.design.effect.effect, search_.options.regression);
      if (lets(Mechanism::kFormGain, one.gain <= form * form * other.gain)) {
        return fmt::format(
            "its gain of {:.0f} nats compensates model-form error of {}, whose gain is {:.0f}",
            one.gain, search_.key(other.design.effect), other.gain);
      }
      EffectDesign power = other_power(other.design, theta, search_.options.regression);
      if (!power.acts() || !meets(power)) continue;
      powers.push_back(std::move(power));
      names.push_back(search_.key(other.design.effect));
    }
    if (powers.empty() || !search_.mechanisms().enabled(Mechanism::kFormPower)) return {};
    std::vector<const EffectDesign*> without = designs_of(found, index), with = designs_of(found);
    for (const EffectDesign& p : powers) {
      without.push_back(&p);
      with.push_back(&p);
    }
    // The likelihood has more than one maximum: what is found may pass into the noise. Of nested designs that would make gains negative.
    const auto most = [&](const std::vector<const EffectDesign*>& designs) {
      return std::max(search_.fit(designs, &fit).total(), search_.fit(designs).total());
    };
    const double gain = most(with) - most(without) - search_.penalty_of(one.design);
    if (tracing())
      fmt::print(stderr, "  {} beside other powers of {}: {:.1f} nats\n",
                 search_.key(one.design.effect), fmt::join(names, ", "), gain);
    if (!lets(Mechanism::kFormPower, gain <= search_.options.least_gain)) return {};
    return fmt::format("a slightly different exponent in the law of {} explains the same",
                       fmt::join(names, ", "));
  }

  /// Drops an effect that fails an acceptance test since later effects were found. @return whether one was dropped
  bool drop_failing(std::vector<FoundEffect>& found, EffectFit& current, SearchResult& result) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      std::string why = why_not_named(found[i], search_.options, search_.mechanisms());
      if (why.empty()) why = compensates_model_form(found, i, current);
      if (why.empty() && found[i].not_significant && lets(Mechanism::kJoint, true)) {
        why = "it fails the joint significance test: its 95 % region contains zero";
      }
      if (why.empty()) continue;
      result.notes.push_back(
          fmt::format("{} is removed again: {}", search_.key(found[i].design.effect), why));
      if (tracing()) fmt::print(stderr, "  {}\n", result.notes.back());
      search_.drop(found, i);
      current = search_.fit(designs_of(found));
      return true;
    }
    return false;
  }

  /// Rivals and indistinguishable sets, then the statistics of the acceptance tests.
  void finish(std::vector<FoundEffect>& found, EffectFit& current) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      search_.report(found.size(),
                     "comparing " + search_.key(found[i].design.effect) + " with its rivals");
      list_rivals(search_, found, i, current);
    }
    for (std::size_t i = 0; i < found.size(); ++i) search_.judge(found, i, current);
  }

  SearchState search_;
  std::optional<NullSimulator> null_;
  std::vector<std::vector<GainContext>> null_contexts_;  // by candidate, of its last simulation
  bool follows_;
};

}  // namespace

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options, const SearchProgress& progress) {
  SearchResult result, first;
  std::optional<Evidence> updated;
  for (int turn = 0; turn <= options.leader_searches; ++turn) {
    result = Search(updated ? *updated : evidence, candidates, options, progress,
                    turn < options.leader_searches)
                 .run();
    if (turn == 0) first = result;
    if (!result.updated_evidence) break;
    if (tracing()) fmt::print(stderr, "  the found effects change the load-sensing leader\n");
    updated = std::move(result.updated_evidence);
  }
  // no effect that changes the leader passed the acceptance tests: search again with the former leaders
  if (updated && !adds_demand(*updated, result.found)) {
    updated.reset();
    result = Search(evidence, candidates, options, progress, false).run();
  }
  if (updated) {
    result.null = std::move(first.null);
    result.ranking = std::move(first.ranking);
    result.p_value = first.p_value;
    result.threshold = first.threshold;
    result.simulations = first.simulations;
    result.updated_evidence = std::move(updated);
  }
  return result;
}

}  // namespace sparflow
