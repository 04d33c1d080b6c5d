#pragma once
/// Likelihood gains of candidates beside or in the place of effects already found. Used by effect_search.cpp only.
#include <vector>

#include "diagnosis/regression/ordinary_check.h"
#include "diagnosis/selection/search_candidates.h"

namespace sparflow {

/// One candidate's best design.
struct CandidateScore {
  std::size_t candidate = 0;
  std::size_t design = 0;
  double gain = -1e300;  ///< [nats] less the price of its parameters
};

class SearchScores {
 public:
  /// Both must outlive this.
  SearchScores(const Evidence& evidence, const std::vector<SearchCandidate>& candidates)
      : evidence_(evidence), candidates_(candidates) {}

  /// Every candidate beside `base`, best first. @param skip by candidate  @param current fit of `base`
  std::vector<CandidateScore> beside(const std::vector<const EffectDesign*>& base,
                                     const EffectFit& current, const std::vector<bool>& skip) const;

  /// Candidates that meet `place` in a channel, in its place beside `others`, best first; all are counted where
  /// `place` shows: a rival must explain the same evidence, not other evidence as much.
  /// @param without fit of `others`
  std::vector<CandidateScore> instead_of(const EffectDesign& place,
                                         const std::vector<const EffectDesign*>& others,
                                         const EffectFit& without,
                                         const std::vector<bool>& skip) const;

  /// Gain of one design in the place of `place` (itself, for its own), counted as in `instead_of`. [nats]
  double gain_instead(const EffectDesign& design, const EffectDesign& place,
                      const std::vector<const EffectDesign*>& others,
                      const EffectFit& without) const;

  /// What ordinary least squares leaves with `design` beside `base`.
  OrdinaryResidual ordinary(const std::vector<const EffectDesign*>& base,
                            const EffectDesign& design) const;

  /// Nonlinear parameters between grid points, by golden section in each in turn.
  EffectDesign refined(const std::vector<const EffectDesign*>& base, const CandidateScore& score,
                       const EffectFit& current) const;

  /// Log likelihood with `d` beside `base` - that of `current`, which has `base`. [nats]
  /// @param also channels to fit besides those that d and base meet in @param only_there count these alone
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
};

}  // namespace sparflow
