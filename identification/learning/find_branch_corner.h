#pragma once
/// Finds the corner at which a supply pressure changes from the branch of the counterbalance valve to the static branch
/// (models/hydraulics/branch_corner.h).
#include "identification/learning/gaussian_process/learn_pressure.h"
#include "identification/learning/learning_options.h"
#include "models/hydraulics/branch_corner.h"
#include "models/machine/machine.h"

namespace sparflow {

/// Fits two planes over (Q, load), the static one with the slope of the force balance, the valve's with a smaller one, and
/// assigns each sample to the higher plane. Least squares and assignment alternate from several initial corners, and the
/// best fit is taken: R. E. Quandt (1958), J. Am. Stat. Assoc. 53, 873-880 (switching regressions).
/// @param side +1 extends, -1 retracts
/// @return no corner where the samples show one branch only, or a smooth law fits them as well
BranchCorner find_branch_corner(const GpDataset& samples, const Cylinder& cylinder, int side,
                                const BranchCornerOptions& options = {});

}  // namespace sparflow
