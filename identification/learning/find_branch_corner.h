#pragma once
/// Finds where a supply pressure goes from the counterbalance valve's branch to the static one (models/hydraulics/branch_corner.h).
#include "identification/learning/gaussian_process/learn_pressure.h"
#include "models/hydraulics/branch_corner.h"
#include "models/machine/machine.h"

namespace sparflow {

/// Two planes over (Q, load), the static one with the slope that the balance of forces gives, the valve's with a smaller
/// one; samples belong to the higher. Least squares of each, samples assigned anew, from several first corners, the best kept:
/// R. E. Quandt (1958), J. Am. Stat. Assoc. 53, 873-880 (switching regressions).
/// @param side +1 extends, -1 retracts
/// @return no corner where the samples hold one branch only, or a smooth law explains them as well
BranchCorner find_branch_corner(const GpDataset& samples, const Cylinder& cylinder, int side);

}  // namespace sparflow
