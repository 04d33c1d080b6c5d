#pragma once
/// Errors of the machine that was found on rows that took no part.
#include "identification/machine_from_log/load_fit.h"

namespace sparflow::from_log {

struct FoundLoads {
  const LoadFit& fit;
  const Eigen::VectorXd& masses;  ///< by unknown, as they stand in the file
};

/// @param linkage whether the cylinder's linkage is known  @param load rows held out; null: forces are not judged
HeldOutError held_out_error(const Known& known, int cylinder, bool linkage, const LoadRows* load,
                            const FoundLoads& found);

}  // namespace sparflow::from_log
