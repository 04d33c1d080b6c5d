#pragma once
/// Sizes of an effect. Most are proportional to their linear parameters; of a lag, a delay or a limit a nonlinear one
/// is the size, its linear one only a share about one.
#include <vector>

#include "diagnosis/selection/search_candidates.h"

namespace sparflow {

/// A point of the grid as a size.
struct Rung {
  std::size_t design = 0;  ///< index into the candidate's designs
  double value = 0.0;      ///< [SI] of the nonlinear parameter that is the size
  double times = 0.0;      ///< of the typical size
};

struct EffectSize {
  std::size_t typical = 0;  ///< design nearest to the typical nonlinear parameters
  Eigen::VectorXd theta;    ///< [SI] typical linear parameters
  double largest = 1.0;     ///< times `theta` that is still plausible
  std::vector<Rung> rungs;  ///< weakest first; empty: proportional to theta
};

EffectSize size_effect(const SearchCandidate& candidate);

}  // namespace sparflow
