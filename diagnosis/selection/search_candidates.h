#pragma once
/// The effects that a search chooses from on given evidence: the designs over each one's grid, and its penalty.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct SearchCandidate {
  EffectAt effect;
  std::vector<EffectDesign>
      designs;           ///< one for each grid point that acts on this evidence, and another with
                         ///< the optional parameters where their columns are independent
  int linear = 1;        ///< number of linear parameters with independent columns, not optional
  double penalty = 0.0;  ///< [nats] subtracted from its gain
  double optional_penalty = 0.0;  ///< [nats] further penalty of its optional linear parameters
  double optional_shape_penalty = 0.0;  ///< [nats] further penalty of each optional nonlinear one

  double penalty_of(const EffectDesign& design) const {
    return penalty + (design.optional ? optional_penalty : 0.0) +
           optional_shape_penalty * optional_shapes(design);
  }
};

/// Width of its interval, as share of the value, at which the golden-section search of a nonlinear parameter ends, in the
/// search of effects and in the estimate of their values alike.
/// @threshold [1] 1e-5..0.1; chosen: the search of effects and the estimate had 0.2 % and about 1 %; the finer of both,
/// because a value is reported with three digits. Half of it takes one or two more fits in each search
inline constexpr double kShapeWidth = 2e-3;
/// Largest number of sections of that search.
/// @threshold [sections] 5..50; numerical: a thousandth of the bracket is left, which ends the search of a value near zero
inline constexpr int kMostShapeSections = 14;

/// Factor up to which a nonlinear parameter is searched beyond the only value of its grid.
/// @threshold [1] 2..100; chosen: a damping ratio between a hundredth and a half
inline constexpr double kShapeReach = 8.0;
/// Largest number of searches along every nonlinear parameter in turn, where an effect has two or more: the best value of one
/// depends on the others.
/// @threshold [1] 2..10; chosen: the third changes a rope's length by less than its interval
inline constexpr int kShapeSweeps = 3;

/// The log on which the grids of nonlinear parameters are made: the longest suspect log, because grids of limits (a
/// cushion's length, a pump's flow) depend on the range that a log covers.
const MachineSeries& grid_log(const Evidence& evidence);

/// The candidates that act on some channel of the evidence, in the order given.
/// Penalty: Schwarz (1978), half the logarithm of the number of rows for each parameter with an independent column and for each
/// nonlinear one that has a scale; the logarithm of their number for variants of a law.
std::vector<SearchCandidate> search_candidates(const Evidence& evidence,
                                               const std::vector<EffectAt>& effects);

}  // namespace sparflow
