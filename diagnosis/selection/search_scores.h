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

class SearchScores {
 public:
  /// All must outlive this.
  SearchScores(const Evidence& evidence, const std::vector<SearchCandidate>& candidates,
               const SearchOptions& options)
      : evidence_(evidence), candidates_(candidates), options_(options) {}

  /// Every candidate added to `base`, best first.
  /// @param current fit of `base`  @param skip by candidate: whether to leave it out
  std::vector<CandidateScore> beside(const std::vector<const EffectDesign*>& base,
                                     const EffectFit& current, const std::vector<bool>& skip) const;

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
  std::vector<bool> connected(const std::vector<const EffectDesign*>& designs,
                              const EffectDesign& d) const;
  bool may_hide(const EffectFit& current, const EffectDesign& design) const;
  std::vector<bool> touched_by(const EffectDesign& design) const;

  const Evidence& evidence_;
  const std::vector<SearchCandidate>& candidates_;
  const SearchOptions& options_;
};

}  // namespace sparflow
