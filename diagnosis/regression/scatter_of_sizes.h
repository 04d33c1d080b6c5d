#pragma once
/// Mean of the sizes that an effect has in stretches of motion. They scatter more than the noise model says, for one of two reasons, of
/// which the more likely is taken: the law has another size in every motion (random effects of DerSimonian and Laird 1986, Control.
/// Clin. Trials 7, 177: a variance is added), or other structure disturbs the estimates (Birge 1932, Phys. Rev. 40, 207: all variances
/// have a common factor). Used inside diagnosis/regression only.
#include <vector>

namespace sparflow {

/// Size and information in one stretch of motion.
struct BlockSize {
  double size, information;
};

/// Variances of the sizes: factor / information + added.
struct Variation {
  double factor = 1.0, added = 0.0;
  double freedom = 0.0;  ///< degrees of freedom of the scatter that it was estimated from
  double variance(const BlockSize& b) const { return factor / b.information + added; }
};

/// In common for groups with means of their own.
Variation variation_of(const std::vector<const std::vector<BlockSize>*>& groups);

struct MeanSize {
  double size = 0.0;
  double standard_error = 0.0;  ///< zero without stretches
};
MeanSize mean_size(const std::vector<BlockSize>& blocks, const Variation& v);

}  // namespace sparflow
