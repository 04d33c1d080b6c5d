#pragma once
/// One law for suspect and reference logs together. Used by reference_comparison.cpp only.
#include <optional>

#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// The found effect with the nonlinear parameters, and the variant of its law, that explain all logs best with one size in all of them.
/// A search takes those that explain the suspect logs best. The references, with other motions, then show another size of this law for that
/// reason alone: a limit of the pump that is a little too low is broken in references that hardly reach it.
/// @param found index into the effects found
/// @return nothing for an effect without nonlinear parameters, and where that law does not act in the references, which tell nothing of it then
std::optional<FoundEffect> common_law(const Diagnosis& d, std::size_t found,
                                      const SearchOptions& options);

}  // namespace sparflow
