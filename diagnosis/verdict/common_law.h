#pragma once
/// One law for suspect and reference logs together. Used by reference_comparison.cpp only.
#include <optional>

#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// The law of a found effect whose nonlinear parameters, and variant, explain all logs best with one size in all of them.
struct CommonLaw {
  FoundEffect law;  ///< the found effect with this law's signature in the suspect logs
  bool acts_in_references = false;
  /// 0..1 Probability that laws of their own, the found one in the suspect logs and the same with another size in the references, explain
  /// the stretches of motion better by chance (Vuong 1989, Econometrica 57, 307, with stretches in place of rows).
  double chance = 1.0;
};

/// A search takes the nonlinear parameters that explain the suspect logs best. The references, with other motions, then show another size of
/// this law for that reason alone: a dead band that vanishes at full opening looks like one that does not in a log of small openings.
/// @param found index into the effects found  @return nothing for an effect without nonlinear parameters
std::optional<CommonLaw> common_law(const Diagnosis& d, std::size_t found,
                                    const SearchOptions& options);

}  // namespace sparflow
