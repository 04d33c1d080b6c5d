#pragma once
/// Sizes of an effect. Most effects are proportional to their linear parameters. The size of a lag, a delay or a limit
/// is a nonlinear parameter, and its linear parameter is a share near one.
#include <vector>

#include "diagnosis/selection/search_candidates.h"

namespace sparflow {

/// A grid point of the nonlinear parameter that is the size.
struct SizeLevel {
  std::size_t design = 0;  ///< index into the candidate's designs
  double value = 0.0;      ///< [SI] nonlinear parameter
  double times = 0.0;      ///< [-] multiple of the typical size
};

struct EffectSize {
  std::size_t typical = 0;        ///< design nearest to the typical nonlinear parameters
  Eigen::VectorXd theta;          ///< [SI] typical linear parameters
  double largest = 1.0;           ///< [-] largest plausible multiple of `theta`
  std::vector<SizeLevel> levels;  ///< weakest first; empty: the effect is proportional to theta
};

/// @param machine its masses and areas bound the size (models/effects/plausible.h), as they do in a diagnosis
/// @param largest_times [-] largest multiple of the typical size where the effect has no bound
EffectSize size_effect(const Machine& machine, const SearchCandidate& candidate,
                       double largest_times);

}  // namespace sparflow
