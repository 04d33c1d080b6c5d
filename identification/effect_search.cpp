#include "identification/effect_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "identification/effect_intervals.h"
#include "identification/effect_proof.h"
#include "identification/null_gate.h"
#include "identification/parallel.h"
#include "identification/search_proofs.h"
#include "identification/search_scores.h"

namespace sparflow {
namespace {

/// Times the least gain of a name: an effect that fits only with implausible parameters must be beyond doubt itself
/// before its absence of a name means something.
constexpr double kSurelySomething = 3.0;

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
        candidates_(search_candidates(evidence, effects)),
        scores_(evidence, candidates_) {}

  SearchResult run() {
    SearchResult result;
    EffectFit current = fit_effects(evidence_, {}, nullptr, final_control());
    result.null = current;
    std::vector<FoundEffect> found;
    refused_.assign(candidates_.size(), false);
    for (int round = 0; round < 3; ++round) {
      select(found, current, result);
      bool reshaped = false;
      for (std::size_t i = 0; i < found.size(); ++i)
        reshaped = reshape(found, i, current) || reshaped;
      settle_angles(found, current);
      prune(found, current);
      while (merge(found, current)) prune(found, current);
      if (reshaped) {
        for (std::size_t i = 0; i < found.size(); ++i) judge(found, i, current);
      }
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
  using Score = CandidateScore;

  /// Adds the best candidate while it passes the gate and its proofs.
  void select(std::vector<FoundEffect>& found, EffectFit& current, SearchResult& result) {
    for (int step = 0; static_cast<int>(found.size()) < options_.max_effects &&
                       step < 3 * options_.max_effects;) {
      report(found.size(), "searching");
      const std::vector<const EffectDesign*> base = designs_of(found);
      std::vector<Score> scores = scores_.beside(base, current, skipped(found));
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
      const Score best = chosen(scores, gate, level, base);
      const double p = gate.p_value(best.gain, best.candidate);
      if (tracing()) trace_scores(step, scores, gate);
      ++step;
      if (found.empty() && result.threshold == 0.0) {
        result.threshold = gate.threshold(level);
        result.p_value = p;
      }
      if (p >= level || best.gain < options_.least_gain) {
        if (found.empty() && best.gain > kSurelySomething * options_.least_gain)
          result.once.push_back(scores_.refined(base, best, current));
        break;
      }
      FoundEffect f;
      f.design = scores_.refined(base, best, current);
      f.p_value = p;
      found.push_back(std::move(f));
      EffectFit next = fit_effects(evidence_, designs_of(found), nullptr, final_control());
      whole_share(found, next, best.gain);
      judge(found, found.size() - 1, next);
      if (tracing()) trace_found(found, next);
      found.back().gain = best.gain;
      std::string why = why_not_named(found.back(), options_);
      if (why.empty()) why = only_mends(found, found.size() - 1, next);
      if (!why.empty()) {
        result.notes.push_back(
            fmt::format("{} fits best but is not named: {}", key(found.back().design.effect), why));
        if (tracing()) fmt::print(stderr, "  refused: {}\n", result.notes.back());
        if (found.back().at_bound && found.back().size >= options_.smallest_effect &&
            best.gain > kSurelySomething * options_.least_gain) {
          result.unnamed.push_back(found.back());
        }
        found.pop_back();
        refused_[best.candidate] = true;
        continue;
      }
      current = next;
    }
  }

  /// A tilt of three degrees takes a thousandth off every weight, which its slope at rest does not know: what is left
  /// would be named as a mass or another angle. Chords up to what was found.
  void settle_angles(std::vector<FoundEffect>& found, EffectFit& fit) const {
    bool any = false;
    Eigen::Index first = 0;
    for (FoundEffect& f : found) {
      const double about = fit.theta[first];
      first += f.design.linear;
      if (!bends(*f.design.effect.effect)) continue;
      f.design = make_design(evidence_, f.design.effect, f.design.shape, {&about, 1});
      any = true;
    }
    if (any) fit = fit_effects(evidence_, designs_of(found), &fit, final_control());
  }

  /// A short lag shows by the product of its share and its time alone, a limit that is hardly reached by share and
  /// excess: where the share rests on its bound, the whole share with another time or limit says nearly the same and is
  /// plausible.
  void whole_share(std::vector<FoundEffect>& found, EffectFit& fit, double gain) const {
    constexpr double kSame = 3.0, kSameShare = 0.05;  // [nats]; of the gain
    constexpr double kReaches[] = {1.05, 1.2, 2.0};  // times; a limit beyond all flows says nothing
    constexpr int kHalvings = 9;
    EffectDesign& design = found.back().design;
    const EffectParameter& share = design.effect.effect->info().parameters.front();
    if (!share.linear || share.name != "share" || design.shape.empty() || design.linear != 1 ||
        !rests_on_bound(design, fit.theta.tail(1)))
      return;
    const EffectDesign before = design;
    const auto share_at = [&](double factor) {
      std::vector<double> shape = before.shape;
      shape[0] *= factor;
      design = make_design(evidence_, before.effect, std::move(shape));
      if (!design.acts()) return std::numeric_limits<double>::quiet_NaN();
      design.lower = {-std::numeric_limits<double>::max()};
      design.upper = {std::numeric_limits<double>::max()};
      FitControl control;
      control.noise_passes = 1;
      const EffectFit f = fit_effects(evidence_, designs_of(found), &fit, control);
      return f.theta[f.theta.size() - 1];
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
    design = make_design(evidence_, before.effect, std::move(shape));
    EffectFit whole = fit_effects(evidence_, designs_of(found), nullptr, final_control());
    const double least = fit.total() - std::max(kSame, kSameShare * gain);
    if (tracing()) {
      fmt::print(stderr, "  whole share at [{:.4g}]: {:.1f} nats\n", fmt::join(design.shape, " "),
                 whole.total() - fit.total());
    }
    if (whole.total() > least && !rests_on_bound(design, whole.theta.tail(1))) {
      fit = std::move(whole);
    } else {
      design = before;
    }
  }

  /// What the form of a law is wrong by leaves that share, squared, of the effect's own gain to whatever else acts in
  /// the same place; and what grows with another power than the law's leaves room for a smaller effect beside it.
  /// @param fit of all found  @return why found[index] is no more than that; empty: it is more
  std::string only_mends(const std::vector<FoundEffect>& found, std::size_t index,
                         const EffectFit& fit) const {
    const FoundEffect& one = found[index];
    const auto meets = [&](const EffectDesign& other) { return meet(other, one.design); };
    std::vector<EffectDesign> powers;
    std::vector<std::string> names;
    Eigen::Index first = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const FoundEffect& other = found[i];
      const Eigen::VectorXd theta = fit.theta.segment(first, other.design.linear);
      first += other.design.linear;
      if (i == index || other.gain < one.gain || !meets(other.design)) continue;
      const double form = form_share(*other.design.effect.effect);
      if (one.gain <= form * form * other.gain) {
        return fmt::format(
            "its gain of {:.0f} nats is what the form of {}, worth {:.0f}, may leave over",
            one.gain, key(other.design.effect), other.gain);
      }
      EffectDesign power = other_form(evidence_, other.design, theta);
      if (!power.acts() || !meets(power)) continue;
      powers.push_back(std::move(power));
      names.push_back(key(other.design.effect));
    }
    if (powers.empty()) return {};
    std::vector<const EffectDesign*> without = designs_of(found, index), with = designs_of(found);
    for (const EffectDesign& p : powers) {
      without.push_back(&p);
      with.push_back(&p);
    }
    const double gain = fit_effects(evidence_, with, &fit, final_control()).total() -
                        fit_effects(evidence_, without, &fit, final_control()).total() -
                        penalty_of(one.design.effect);
    if (tracing())
      fmt::print(stderr, "  {} beside other powers of {}: {:.1f} nats\n", key(one.design.effect),
                 fmt::join(names, ", "), gain);
    if (gain > options_.least_gain) return {};
    return fmt::format("a slightly different power in the law of {} does the same",
                       fmt::join(names, ", "));
  }

  /// Whether both show in one channel.
  bool meet(const EffectDesign& a, const EffectDesign& b) const {
    bool both = false;
    for (std::size_t c = 0; c < evidence_.channels.size(); ++c)
      both = both || (a.touches(c) && b.touches(c));
    return both;
  }

  /// Whether `one` leaves significantly less than `other` where every row counts the same.
  bool ordinarily_better(const std::vector<const EffectDesign*>& base, const EffectDesign& one,
                         const EffectDesign& other) const {
    return ordinary_advantage(evidence_, scores_.ordinary(base, one),
                              scores_.ordinary(base, other)) > 0.0;
  }

  /// That of `rivals` which is most of all better than `best` where every row counts the same, or `best`.
  const Score* ordinarily_best(const std::vector<const EffectDesign*>& base,
                               const std::vector<const Score*>& rivals,
                               const EffectDesign& best) const {
    const OrdinaryResidual one = scores_.ordinary(base, best);
    std::vector<double> advantage(rivals.size());
    parallel(rivals.size(), [&](std::size_t i) {
      const EffectDesign& d = design_of(*rivals[i]);
      if (meet(d, best))
        advantage[i] = ordinary_advantage(evidence_, scores_.ordinary(base, d), one);
    });
    const auto most = std::max_element(advantage.begin(), advantage.end());
    return most == advantage.end() || *most <= 0.0
               ? nullptr
               : rivals[static_cast<std::size_t>(most - advantage.begin())];
  }
  const EffectDesign& design_of(const Score& s) const {
    return candidates_[s.candidate].designs[s.design];
  }

  /// The most likely candidate that passes the gate (the best of all if none does), another one that passes and leaves
  /// significantly less where every row counts the same, or the plainer effect that the choice contains when that
  /// explains most of the same: what is left then decides whether the refinement is needed, and `prune` drops whichever
  /// becomes superfluous.
  Score chosen(const std::vector<Score>& scores, const NullGate& gate, double level,
               const std::vector<const EffectDesign*>& base) const {
    std::vector<const Score*> passing;
    for (const Score& s : scores) {
      if (gate.p_value(s.gain, s.candidate) < level) passing.push_back(&s);
    }
    if (passing.empty()) return scores.front();
    const Score* first = passing.front();
    const Score* larger = ordinarily_best(base, passing, design_of(*first));
    if (larger != nullptr) {
      if (tracing())
        fmt::print(stderr, "  {} leaves less than {}\n", key(candidates_[larger->candidate].effect),
                   key(candidates_[first->candidate].effect));
      first = larger;
    }
    const EffectAt& best = candidates_[first->candidate].effect;
    for (const Score* s : passing) {
      const EffectAt& e = candidates_[s->candidate].effect;
      if (e.at != best.at || e.effect->info().id != best.effect->info().refines) continue;
      if (s->gain > 0.5 * first->gain ||
          !ordinarily_better(base, design_of(*first), design_of(*s))) {
        return shaped(base, *s);
      }
    }
    return shaped(base, *first);
  }

  /// The same candidate with those nonlinear parameters of its grid that leave significantly less where every row
  /// counts the same, if any do.
  Score shaped(const std::vector<const EffectDesign*>& base, const Score& score) const {
    std::vector<Score> others;
    for (std::size_t d = 0; d < candidates_[score.candidate].designs.size(); ++d) {
      if (d != score.design) others.push_back({score.candidate, d, score.gain});
    }
    std::vector<const Score*> pointers;
    pointers.reserve(others.size());
    for (const Score& o : others) pointers.push_back(&o);
    const Score* better = ordinarily_best(base, pointers, design_of(score));
    return better == nullptr ? score : *better;
  }

  /// What the later ones turned into a remnant. @return whether any was dropped
  bool drop_unproven(std::vector<FoundEffect>& found, EffectFit& current, SearchResult& result) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      std::string why = why_not_named(found[i], options_);
      if (why.empty()) why = only_mends(found, i, current);
      // of an effect of its own, motions left out may have shown what ordinary least squares leaves open
      const bool refinement = !found[i].design.effect.effect->info().refines.empty();
      const bool proven = !refinement && found[i].held_out > 2.0 * found[i].held_out_error;
      if (why.empty() && found[i].could_be_nothing && !proven) {
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
    c.noise_passes =
        12;  // to the end: what is left of the way would be taken for another effect's gain
    c.covariance = true;
    return c;
  }

  /// Refused before, or found already.
  std::vector<bool> skipped(const std::vector<FoundEffect>& found) const {
    std::vector<bool> skip = refused_;
    for (std::size_t k = 0; k < skip.size(); ++k)
      skip[k] = skip[k] || is_in(found, candidates_[k].effect);
    return skip;
  }

  void judge(std::vector<FoundEffect>& found, std::size_t index, const EffectFit& fit) const {
    judge_effect(evidence_, options_, fit, designs_of(found), index, found[index]);
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
        if (found[i].gain > options_.least_gain) continue;
        if (tracing())
          fmt::print(stderr, "  dropped {} ({:.1f})\n", key(found[i].design.effect), found[i].gain);
        found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
        current = without;
        changed = true;
        break;
      }
    }
  }

  /// Two effects where one says as much: the first of a pair is chosen when it stands for two causes at once, and what it
  /// says too much or too little of one of them then finds a second name. @return whether one took the place of two
  bool merge(std::vector<FoundEffect>& found, EffectFit& current) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (std::size_t j = i + 1; j < found.size(); ++j) {
        if (meet(found[i].design, found[j].design) && merge(found, i, j, current)) return true;
      }
    }
    return false;
  }
  bool merge(std::vector<FoundEffect>& found, std::size_t i, std::size_t j, EffectFit& current) {
    constexpr double kBeforeRefined = 0.9;  // of the pair's gain, at the grid's parameters
    std::vector<FoundEffect> trial = found;
    trial.erase(trial.begin() + static_cast<std::ptrdiff_t>(j));
    trial.erase(trial.begin() + static_cast<std::ptrdiff_t>(i));
    const EffectFit without = fit_effects(evidence_, designs_of(trial), nullptr, final_control());
    const double price = penalty_of(found[i].design.effect) + penalty_of(found[j].design.effect);
    const double pair = current.total() - without.total() - price;
    const std::vector<Score> scores = scores_.beside(designs_of(trial), without, skipped(trial));
    if (scores.empty() || scores.front().gain < kBeforeRefined * pair) return false;
    FoundEffect one;
    one.design = scores_.refined(designs_of(trial), scores.front(), without);
    one.p_value = std::min(found[i].p_value, found[j].p_value);
    trial.push_back(one);
    EffectFit fit = fit_effects(evidence_, designs_of(trial), nullptr, final_control());
    const double gain = fit.total() - without.total() - penalty_of(one.design.effect);
    if (tracing())
      fmt::print(stderr, "  {} for {} and {}: {:.1f} against {:.1f} nats\n", key(one.design.effect),
                 key(found[i].design.effect), key(found[j].design.effect), gain, pair);
    if (gain < pair) return false;
    judge(trial, trial.size() - 1, fit);
    trial.back().gain = gain;
    if (!why_not_named(trial.back(), options_).empty()) return false;
    found = std::move(trial);
    current = std::move(fit);
    return true;
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
    for (std::size_t i = 0; i < found.size(); ++i) judge(found, i, current);
  }

  /// Another variant of the same effect (the other sensor, the other law) may serve better since others were found,
  /// and make one of them superfluous. @return whether one took the place
  bool reshape(std::vector<FoundEffect>& found, std::size_t i, EffectFit& current) {
    const std::vector<bool> choices = shape_choices(*found[i].design.effect.effect);
    if (std::find(choices.begin(), choices.end(), true) == choices.end()) return false;
    const std::vector<const EffectDesign*> others = designs_of(found, i);
    const EffectFit without = fit_effects(evidence_, others, &current, {});
    double most = scores_.gain(others, found[i].design, without) + 1.0;
    const Score* best = nullptr;
    std::vector<Score> variants;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (!same(candidates_[c].effect, found[i].design.effect)) continue;
      variants.reserve(candidates_[c].designs.size());
      for (std::size_t d = 0; d < candidates_[c].designs.size(); ++d) {
        const std::vector<double>& shape = candidates_[c].designs[d].shape;
        bool other = false;
        for (std::size_t k = 0; k < shape.size(); ++k)
          other = other || (choices[k] && shape[k] != found[i].design.shape[k]);
        if (other) variants.push_back({c, d, 0.0});
      }
    }
    for (Score& s : variants) {
      s.gain = scores_.gain(others, design_of(s), without);
      if (s.gain > most) most = s.gain, best = &s;
    }
    if (best == nullptr) return false;
    FoundEffect variant;
    variant.design = scores_.refined(others, *best, without);
    variant.p_value = found[i].p_value;
    if (tracing()) {
      fmt::print(stderr, "  {} changes shape [{:.4g}] -> [{:.4g}]\n", key(variant.design.effect),
                 fmt::join(found[i].design.shape, " "), fmt::join(variant.design.shape, " "));
    }
    found[i] = std::move(variant);
    current = fit_effects(evidence_, designs_of(found), nullptr, final_control());
    return true;
  }

  /// @return whether a rival took the place of found[i]
  bool rivals(std::vector<FoundEffect>& found, std::size_t i, EffectFit& current) {
    FoundEffect& f = found[i];
    const std::vector<const EffectDesign*> others = designs_of(found, i);
    const EffectFit without = fit_effects(evidence_, others, &current, {});
    const std::vector<Score> scores = scores_.instead_of(f.design, others, without, skipped(found));
    const double own =
        scores_.gain_instead(f.design, f.design, others, without) - penalty_of(f.design.effect);
    f.gain = own;
    const Score* challenger = nullptr;
    if (!scores.empty() && scores.front().gain > own + 1.0 &&
        !ordinarily_better(others, f.design, design_of(scores.front()))) {
      challenger = &scores.front();
    }
    if (challenger != nullptr) {
      FoundEffect rival;
      rival.design = scores_.refined(others, *challenger, without);
      rival.p_value = f.p_value;
      std::vector<FoundEffect> trial = found;
      trial[i] = rival;
      const EffectFit fit = fit_effects(evidence_, designs_of(trial), nullptr, final_control());
      judge(trial, i, fit);
      if (why_not_named(trial[i], options_).empty() && fit.total() > current.total()) {
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
  SearchScores scores_;
  std::vector<bool> refused_;  // candidates that failed a proof in this search
};

}  // namespace

SearchResult search_effects(const Evidence& evidence, const std::vector<EffectAt>& candidates,
                            const SearchOptions& options, const SearchProgress& progress) {
  return Search(evidence, candidates, options, progress).run();
}

}  // namespace sparflow
