#pragma once
/// Values of found effects and how sure they are: all effects together by ordinary least squares on every channel they
/// touch, sampling error robust against dependence inside motions, and what other laws of the same effect would
/// have given (EffectInfo::form_error).
#include <vector>

#include "identification/effect_search.h"

namespace sparflow {

/// Fills values, lower95, upper95 and could_be_nothing of each.
void estimate_intervals(const Evidence& evidence, std::vector<FoundEffect>& found);

/// Parameters in the order of info().parameters from the linear and the nonlinear ones. [SI]
std::vector<double> parameter_values(const Effect& effect, const Eigen::VectorXd& linear,
                                     const std::vector<double>& shape);

}  // namespace sparflow
