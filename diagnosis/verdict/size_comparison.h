#pragma once
/// Size of a found effect in the suspect logs against that in the references. Used by reference_comparison.cpp only.
#include "diagnosis/verdict/reference_comparison.h"

namespace sparflow {

/// What a difference needs beside its size to be called a change.
enum class Proof {
  kNone,        ///< its size alone is enough
  kExcess,      ///< the residual without it exceeds that of the references in one of its channels
  kClearExcess  ///< the same by the test over all channels: it has no sizes that could be compared
};

struct SizeVerdict {
  InReferences in_references = InReferences::kAlike;
  Proof proof = Proof::kClearExcess;
};

/// Whether an estimate of a law agrees with a found one: the parameters that both have do not differ significantly, by the level of sizes
/// that differ and Bonferroni's bound over all effects found. Wald's test (1943, Trans. Am. Math. Soc. 54, 426) of all parameters together:
/// of a late law the product of share and time is known better than either, so that their single intervals hide a difference.
bool agree(const AppliedEffect& e, const Diagnosis& d, const FoundEffect& f);

/// Compares by a random-effects model, and beside it by the form error of the law. @param found index into the effects found
SizeVerdict by_size(const Diagnosis& d, std::size_t found, const SearchOptions& options);

}  // namespace sparflow
