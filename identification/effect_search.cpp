#include "identification/effect_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <thread>

#include "identification/effect_intervals.h"
#include "identification/effect_proof.h"
#include "identification/null_gate.h"
#include "identification/search_candidates.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Diagnosis of the diagnosis: SPARFLOW_TRACE=1 prints every step to stderr.
bool tracing() {
  static const bool on = std::getenv("SPARFLOW_TRACE") != nullptr;
  return on;
}

class Search {
 public:
  Search(const Evidence& evidence, const std::vector<EffectAt>& effects,
         const SearchOptions& options, const SearchProgress& progress)
      : evidence_(evidence),
        options_(options),
        progress_(progress),
        random_(options.seed),
        candidates_(search_candidates(evidence, effects)) {}

  SearchResult run() {
    SearchResult result;
    EffectFit current = fit_effects(evidence_, {}, nullptr, final_control());
    result.null = current;
    std::vector<FoundEffect> found;
    refused_.assign(candidates_.size(), false);
    for (int round = 0; round < 3; ++round) {
      select(found, current, result);
      prune(found, current);
      finish(found, current);
      estimate_intervals(evidence_, found);
      if (!drop_unproven(found, current, result)) break;
    }
    estimate_intervals(evidence_, found);
    result.final = current;
    result.found = std::move(found);
    return result;
  }

 private:
  struct Score {
    std::size_t candidate = 0;
    std::size_t design = 0;
    double gain = -1e300;  // penalised
  };

  /// Adds the best candidate while it passes the gate and its proofs.
  void select(std::vector<FoundEffect>& found, EffectFit& current, SearchResult& result) {
    for (int step = 0; static_cast<int>(found.size()) < options_.max_effects &&
                       step < 3 * options_.max_effects;) {
      report(found.size(), "searching");
      const std::vector<const EffectDesign*> base = designs_of(found);
      std::vector<Score> scores = score_all(base, current, found);
      if (scores.empty()) break;
      if (result.ranking.empty()) {
        for (const Score& s : scores)
          result.ranking.emplace_back(candidates_[s.candidate].effect, s.gain);
      }
      std::vector<GateCandidate> gated;
      for (const SearchCandidate& c : candidates_) gated.push_back({&c.designs, c.penalty});
      const NullGate gate =
          make_null_gate(evidence_, gated, base, current, options_.simulations, random_);
      const double level = found.empty() ? options_.false_alarm : 0.5 * options_.false_alarm;
      const Score& best = plainer(scores, gate, level);
      const double p = gate.p_value(best.gain, best.candidate);
      if (tracing()) trace_scores(step, scores, gate);
      ++step;
      if (found.empty() && result.threshold == 0.0) {
        result.threshold = gate.threshold(level);
        result.p_value = p;
      }
      if (p >= level) break;
      FoundEffect f;
      f.design = refined(base, candidates_[best.candidate], best.design, current);
      f.p_value = p;
      found.push_back(std::move(f));
      const EffectFit next = fit_effects(evidence_, designs_of(found), nullptr, final_control());
      judge(found.back(), found.size() - 1, found, next);
      if (tracing()) trace_found(found, next);
      const std::string why = why_not(found.back());
      if (!why.empty()) {
        result.notes.push_back(
            fmt::format("{} fits best but is not named: {}", key(found.back().design.effect), why));
        if (tracing()) fmt::print(stderr, "  refused: {}\n", result.notes.back());
        if (found.back().at_bound && found.back().size >= options_.smallest_effect) {
          result.unnamed.push_back(found.back());
        }
        found.pop_back();
        refused_[best.candidate] = true;
        continue;
      }
      current = next;
    }
  }

  /// The best candidate that passes the gate (the best of all if none does), or the plainer effect it contains when
  /// that explains most of the same: what is left then decides whether the refinement is needed, and `prune` drops
  /// whichever becomes superfluous.
  const Score& plainer(const std::vector<Score>& scores, const NullGate& gate, double level) const {
    const Score* first = &scores.front();
    for (const Score& s : scores) {
      if (gate.p_value(s.gain, s.candidate) < level) {
        first = &s;
        break;
      }
    }
    const EffectAt& best = candidates_[first->candidate].effect;
    for (const Score& s : scores) {
      const EffectAt& e = candidates_[s.candidate].effect;
      if (e.at == best.at && e.effect->info().id == best.effect->info().refines &&
          s.gain > 0.5 * first->gain) {
        return s;
      }
    }
    return *first;
  }

  /// What the later ones turned into a remnant. @return whether any was dropped
  bool drop_unproven(std::vector<FoundEffect>& found, EffectFit& current, SearchResult& result) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      std::string why = why_not(found[i]);
      if (why.empty() && found[i].could_be_nothing) {
        why = "the interval of a parameter without which it is nothing holds zero";
      }
      if (why.empty()) continue;
      result.notes.push_back(fmt::format("{} is taken back: {}", key(found[i].design.effect), why));
      if (tracing()) fmt::print(stderr, "  {}\n", result.notes.back());
      for (std::size_t c = 0; c < candidates_.size(); ++c) {
        if (same(candidates_[c].effect, found[i].design.effect)) refused_[c] = true;
      }
      found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
      current = fit_effects(evidence_, designs_of(found), nullptr, final_control());
      return true;
    }
    return false;
  }

  template <class F>
  static void parallel(std::size_t count, const F& work) {
    const unsigned threads = std::max(1U, std::min(std::thread::hardware_concurrency(), 8U));
    std::vector<std::thread> pool;
    for (unsigned t = 0; t < threads; ++t) {
      pool.emplace_back([&, t] {
        for (std::size_t i = t; i < count; i += threads) work(i);
      });
    }
    for (std::thread& t : pool) t.join();
  }

  void report(std::size_t found, const std::string& what) const {
    if (progress_) progress_(std::min(0.9, 0.15 + 0.2 * static_cast<double>(found)), what);
  }
  std::string key(const EffectAt& e) const {
    return effect_key(e.effect->info(), *evidence_.series[0].machine, e.at);
  }
  static std::vector<const EffectDesign*> designs_of(
      const std::vector<FoundEffect>& found, std::size_t without = static_cast<std::size_t>(-1)) {
    std::vector<const EffectDesign*> d;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (i != without) d.push_back(&found[i].design);
    }
    return d;
  }
  static bool same(const EffectAt& a, const EffectAt& b) {
    return a.effect == b.effect && a.at == b.at;
  }
  static bool is_in(const std::vector<FoundEffect>& found, const EffectAt& e) {
    return std::any_of(found.begin(), found.end(),
                       [&](const FoundEffect& f) { return same(f.design.effect, e); });
  }
  static FitControl final_control() {
    FitControl c;
    c.keep_residuals = true;
    c.covariance = true;
    return c;
  }

  /// Channels a design touches, and all that share a parameter with them.
  std::vector<bool> connected(const std::vector<const EffectDesign*>& designs,
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

  /// Log likelihood with the design - of `current`, which has `base` (or base and a little more: swaps).
  double gain(const std::vector<const EffectDesign*>& base, const EffectDesign& d,
              const EffectFit& current, const std::vector<bool>& also = {},
              bool only_there = false) const {
    FitControl c;
    c.active = connected(base, d);
    for (std::size_t k = 0; k < also.size(); ++k) c.active[k] = c.active[k] || also[k];
    c.noise_passes = 2;
    std::vector<const EffectDesign*> with;
    for (const EffectDesign* b : base) {
      bool needed = false;
      for (std::size_t k = 0; k < c.active.size(); ++k)
        needed = needed || (b->touches(k) && c.active[k]);
      if (needed) with.push_back(b);
    }
    with.push_back(&d);
    const EffectFit fit = fit_effects(evidence_, with, &current, c);
    if (!only_there) return fit.total() - current.total();
    double sum = 0.0;  // a rival must explain the same evidence, not other evidence as much
    for (std::size_t k = 0; k < also.size(); ++k) {
      if (also[k]) sum += fit.log_likelihood[k] - current.log_likelihood[k];
    }
    return sum;
  }

  std::vector<Score> score_all(const std::vector<const EffectDesign*>& base,
                               const EffectFit& current,
                               const std::vector<FoundEffect>& found) const {
    std::vector<Score> scores(candidates_.size());
    parallel(candidates_.size(), [&](std::size_t i) {
      scores[i].candidate = i;
      if (refused_[i] || is_in(found, candidates_[i].effect)) return;
      for (std::size_t k = 0; k < candidates_[i].designs.size(); ++k) {
        const double g = gain(base, candidates_[i].designs[k], current) - candidates_[i].penalty;
        if (g > scores[i].gain) scores[i] = {i, k, g};
      }
    });
    std::erase_if(scores, [](const Score& s) { return s.gain <= -1e299; });
    std::sort(scores.begin(), scores.end(),
              [](const Score& a, const Score& b) { return a.gain > b.gain; });
    return scores;
  }

  /// Nonlinear parameters between grid points, by golden section in each in turn.
  EffectDesign refined(const std::vector<const EffectDesign*>& base,
                       const SearchCandidate& candidate, std::size_t best,
                       const EffectFit& current) const {
    EffectDesign d = candidate.designs[best];
    if (d.shape.empty()) return d;
    double at_best = gain(base, d, current);
    const std::vector<bool> choices = shape_choices(*d.effect.effect);
    for (std::size_t k = 0; k < d.shape.size(); ++k) {
      if (choices[k]) continue;
      std::vector<double> values;
      for (const EffectDesign& other : candidate.designs) values.push_back(other.shape[k]);
      std::sort(values.begin(), values.end());
      values.erase(std::unique(values.begin(), values.end()), values.end());
      const auto here = std::lower_bound(values.begin(), values.end(), d.shape[k] - 1e-12);
      if (here == values.end()) continue;
      double lo = here == values.begin() ? *here : *(here - 1);
      double hi = here + 1 == values.end() ? *here : *(here + 1);
      const double golden = 0.381966;
      for (int i = 0; i < 14 && hi - lo > 2e-3 * std::max(std::abs(hi), 1e-12); ++i) {
        const bool right = hi - d.shape[k] > d.shape[k] - lo;
        EffectDesign trial = d;
        const double x = right ? d.shape[k] + golden * (hi - d.shape[k])
                               : d.shape[k] - golden * (d.shape[k] - lo);
        std::vector<double> shape = d.shape;
        shape[k] = x;
        trial = make_design(evidence_, d.effect, shape);
        const double g = trial.acts() ? gain(base, trial, current) : -1e300;
        if (g > at_best) {
          (right ? lo : hi) = d.shape[k];
          d = std::move(trial);
          at_best = g;
        } else {
          (right ? hi : lo) = x;
        }
      }
    }
    return d;
  }

  void judge(FoundEffect& f, std::size_t index, const std::vector<FoundEffect>& found,
             const EffectFit& fit) const {
    const std::vector<const EffectDesign*> designs = designs_of(found);
    const EffectAction action = effect_action(evidence_, designs, index, fit);
    f.size = action.size;
    f.absorbed = action.absorbed;
    f.share = action.share;
    f.at_bound = false;
    Index first = 0;
    for (std::size_t i = 0; i < index; ++i) first += found[i].design.linear;
    for (Index k = 0; k < f.design.linear; ++k) {
      const double v = fit.theta[first + k], lo = f.design.lower[static_cast<std::size_t>(k)];
      const double hi = f.design.upper[static_cast<std::size_t>(k)];
      const double edge = 1e-6 * (hi - lo);
      f.at_bound = f.at_bound || v > hi - edge || (lo > 0.0 && v < lo + edge);
    }
    const HeldOutGain held = held_out_gain(evidence_, designs, index, fit, options_.folds);
    f.held_out = held.gain;
    f.held_out_error = held.error;
    f.held_out_share = held.improved;
  }

  std::string why_not(const FoundEffect& f) const {
    const EffectStage stage = f.design.effect.effect->info().stage;
    const bool behind_process = stage == EffectStage::kPressure || stage == EffectStage::kPump;
    if (behind_process && f.absorbed > options_.largest_absorbed) {
      return fmt::format(
          "what is learned (pressures, margins, gains) can imitate {:.0f} % of it; a reference log "
          "would tell",
          100.0 * f.absorbed);
    }
    if (f.size < options_.smallest_effect) {
      return fmt::format("it is {:.2f} times the noise where it acts, too small to matter", f.size);
    }
    if (f.at_bound) return "its parameter would lie at the edge of what is plausible";
    if (f.share < options_.smallest_share) {
      return fmt::format(
          "it is {:.0f} % of another effect in the same place: it only mends that one's form",
          100.0 * f.share);
    }
    // one standard error beyond zero, or (a few large steps carry all the evidence) better nearly everywhere
    if (f.held_out <= f.held_out_error && !(f.held_out > 0.0 && f.held_out_share > 0.79)) {
      return fmt::format("on motions left out it gains {:.1f} +- {:.1f} nats, not proven",
                         f.held_out, f.held_out_error);
    }
    return {};
  }

  double penalty_of(const EffectAt& e) const {
    for (const SearchCandidate& c : candidates_) {
      if (same(c.effect, e)) return c.penalty;
    }
    return 0.0;
  }

  /// Drop what the others made superfluous.
  void prune(std::vector<FoundEffect>& found, EffectFit& current) {
    for (bool changed = true; changed && found.size() > 1;) {
      changed = false;
      for (std::size_t i = 0; i < found.size(); ++i) {
        const EffectFit without =
            fit_effects(evidence_, designs_of(found, i), nullptr, final_control());
        found[i].gain = current.total() - without.total() - penalty_of(found[i].design.effect);
        if (found[i].gain > 3.0) continue;
        if (tracing())
          fmt::print(stderr, "  dropped {} ({:.1f})\n", key(found[i].design.effect), found[i].gain);
        found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
        current = without;
        changed = true;
        break;
      }
    }
  }

  /// Swap moves and indistinguishable alternatives, then intervals.
  void finish(std::vector<FoundEffect>& found, EffectFit& current) {
    for (int round = 0; round < 2; ++round) {
      bool swapped = false;
      for (std::size_t i = 0; i < found.size(); ++i) {
        report(found.size(), "telling " + key(found[i].design.effect) + " from its rivals");
        swapped = rivals(found, i, current) || swapped;
      }
      if (!swapped) break;
    }
    for (std::size_t i = 0; i < found.size(); ++i) judge(found[i], i, found, current);
  }

  /// @return whether a rival took the place of found[i]
  bool rivals(std::vector<FoundEffect>& found, std::size_t i, EffectFit& current) {
    FoundEffect& f = found[i];
    const std::vector<const EffectDesign*> others = designs_of(found, i);
    const EffectFit without = fit_effects(evidence_, others, &current, {});
    std::vector<bool> touched(evidence_.channels.size());
    for (std::size_t c = 0; c < touched.size(); ++c) touched[c] = f.design.touches(c);
    std::vector<Score> scores(candidates_.size());
    parallel(candidates_.size(), [&](std::size_t k) {
      scores[k].candidate = k;
      const SearchCandidate& c = candidates_[k];
      if (refused_[k] || is_in(found, c.effect)) return;
      for (std::size_t d = 0; d < c.designs.size(); ++d) {
        bool meets = false;
        for (std::size_t ch = 0; ch < touched.size(); ++ch)
          meets = meets || (touched[ch] && c.designs[d].touches(ch));
        if (!meets) return;
        const double g = gain(others, c.designs[d], without, touched, true) - c.penalty;
        if (g > scores[k].gain) scores[k] = {k, d, g};
      }
    });
    const double own = gain(others, f.design, without, touched, true) - penalty_of(f.design.effect);
    f.gain = own;
    std::sort(scores.begin(), scores.end(),
              [](const Score& a, const Score& b) { return a.gain > b.gain; });
    if (scores.front().gain > own + 1.0) {
      FoundEffect rival;
      rival.design =
          refined(others, candidates_[scores.front().candidate], scores.front().design, without);
      rival.p_value = f.p_value;
      std::vector<FoundEffect> trial = found;
      trial[i] = rival;
      const EffectFit fit = fit_effects(evidence_, designs_of(trial), nullptr, final_control());
      judge(trial[i], i, trial, fit);
      if (why_not(trial[i]).empty() && fit.total() > current.total()) {
        if (tracing())
          fmt::print(stderr, "  {} takes the place of {}\n", key(rival.design.effect),
                     key(f.design.effect));
        found = std::move(trial);
        current = fit;
        return true;
      }
    }
    f.alternatives.clear();
    for (const Score& s : scores) {
      if (s.gain < own - 50.0) break;
      f.alternatives.emplace_back(candidates_[s.candidate].effect, own - s.gain);
    }
    return false;
  }

  void trace_scores(int step, const std::vector<Score>& scores, const NullGate& gate) const {
    fmt::print(stderr, "step {} threshold {:.1f}\n", step, gate.threshold(options_.false_alarm));
    for (std::size_t i = 0; i < std::min<std::size_t>(8, scores.size()); ++i) {
      const SearchCandidate& c = candidates_[scores[i].candidate];
      fmt::print(stderr, "   {:28s} gain {:9.1f} shape [{:.4g}]\n", key(c.effect), scores[i].gain,
                 fmt::join(c.designs[scores[i].design].shape, " "));
    }
  }
  void trace_found(const std::vector<FoundEffect>& found, const EffectFit& fit) const {
    const FoundEffect& f = found.back();
    fmt::print(stderr,
               "  + {} shape [{:.4g}] theta [{:.5g}] size {:.2f} absorbed {:.2f} held out {:.1f} "
               "+- {:.1f}\n",
               key(f.design.effect), fmt::join(f.design.shape, " "),
               fmt::join(std::vector<double>(fit.theta.begin(), fit.theta.end()), " "), f.size,
               f.absorbed, f.held_out, f.held_out_error);
    for (std::size_t c = 0; c < evidence_.channels.size(); ++c) {
      const EvidenceChannel& ch = evidence_.channels[c];
      fmt::print(stderr,
                 "     {:40s} n {} sd {:.3g} floor {:.3g} {} phi {:.2f} {:.2f} off {:.3g}\n",
                 ch.text, ch.rows(), fit.noise[c].deviation() / ch.unit.si,
                 ch.noise_floor / ch.unit.si, ch.unit.name, fit.noise[c].phi1, fit.noise[c].phi2,
                 std::sqrt(fit.noise[c].offset_variance) / ch.unit.si);
    }
  }

  const Evidence& evidence_;
  const SearchOptions& options_;
  const SearchProgress& progress_;
  std::mt19937_64 random_;
  std::vector<SearchCandidate> candidates_;
  std::vector<bool> refused_;  // candidates that failed a proof in this search
};

}  // namespace

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options, const SearchProgress& progress) {
  return Search(evidence, candidates, options, progress).run();
}

}  // namespace sparflow
