#pragma once
/// Gains of candidates that are added to the effects already found or replace one of them. Used by the search only.
#include <vector>

#include "diagnosis/regression/least_squares_comparison.h"
#include "diagnosis/selection/effect_search.h"
#include "diagnosis/selection/search_candidates.h"

namespace sparflow {

/// The best design of one candidate.
struct CandidateScore {
  std::size_t candidate = 0;
  std::size_t design = 0;
  double gain = -1e300;  ///< [nats] penalised
};

/// What the gain of a design beside others depends on: those of the others that share a channel with it, directly or through
/// further ones, and the fit there.
struct GainContext {
  std::vector<std::uint64_t> others;   ///< EffectDesign::number
  std::vector<double> log_likelihood;  ///< [nats] of the fit in the channels that they share

  /// Whether a gain in one context is that in the other.
  bool same_as(const GainContext& other) const;
};

/// Whether all are known and the same.
bool same_contexts(const std::vector<GainContext>& a, const std::vector<GainContext>& b);

class SearchScores {
 public:
  /// All must outlive this.
  SearchScores(const Evidence& evidence, const std::vector<SearchCandidate>& candidates,
               const SearchOptions& options);

  /// Every candidate added to `base`, best first. What a candidate gained beside the same designs before is not computed
  /// again: an effect found in one cylinder changes nothing in the channels of another.
  /// @param current fit of `base`  @param skip by candidate: whether to leave it out
  std::vector<CandidateScore> beside(const std::vector<const EffectDesign*>& base,
                                     const EffectFit& current, const std::vector<bool>& skip) const;

  /// The context of every design of a candidate beside `base`; empty where it is not known.
  std::vector<GainContext> contexts(const std::vector<const EffectDesign*>& base,
                                    const EffectFit& current, std::size_t candidate) const;

  /// Candidates that share a channel with `place` and replace it beside `others`, best first. Gains are summed over the
  /// channels in which `place` acts, because a rival must explain the same evidence.
  /// @param without fit of `others`
  std::vector<CandidateScore> instead_of(const EffectDesign& place,
                                         const std::vector<const EffectDesign*>& others,
                                         const EffectFit& without,
                                         const std::vector<bool>& skip) const;

  /// Gain of one design that replaces `place` (or is `place`), summed as in `instead_of`, without penalty. [nats]
  double gain_instead(const EffectDesign& design, const EffectDesign& place,
                      const std::vector<const EffectDesign*>& others,
                      const EffectFit& without) const;

  /// Residual by ordinary least squares with `design` added to `base`.
  LeastSquaresResidual least_squares(const std::vector<const EffectDesign*>& base,
                                     const EffectDesign& design) const;

  /// The design with its nonlinear parameters refined between grid points, by a golden-section search in each in turn.
  EffectDesign refined(const std::vector<const EffectDesign*>& base, const CandidateScore& score,
                       const EffectFit& current) const;

  /// Log-likelihood with `d` added to `base`, less that of `current`, the fit of `base`. [nats]
  /// @param also channels to fit besides those that d and base share  @param only_there sums over `also` alone
  double gain(const std::vector<const EffectDesign*>& base, const EffectDesign& d,
              const EffectFit& current, const std::vector<bool>& also = {},
              bool only_there = false) const;

 private:
  /// The designs that a gain is computed beside, with their fit and the baselines whitened by its noise.
  struct Beside {
    const std::vector<const EffectDesign*>& base;
    const EffectFit& current;
    const WhitenedChannels* first = nullptr;
  };
  void refine_along(const Beside& beside, const SearchCandidate& candidate, std::size_t k,
                    EffectDesign& d, double& at_best) const;
  double gain_beside(const Beside& beside, const EffectDesign& d,
                     const std::vector<bool>& also = {}, bool only_there = false) const;
  std::vector<bool> connected(const std::vector<const EffectDesign*>& designs,
                              const EffectDesign& d) const;
  bool may_hide(const EffectFit& current, const EffectDesign& design) const;
  std::vector<bool> touched_by(const EffectDesign& design) const;

  struct KnownGain {
    std::vector<GainContext> contexts;  // by design
    CandidateScore score;
  };

  const Evidence& evidence_;
  const std::vector<SearchCandidate>& candidates_;
  const SearchOptions& options_;
  WhitenedChannels cold_;
  mutable std::vector<KnownGain> known_;  // by candidate; what `beside` has computed last
};

}  // namespace sparflow
