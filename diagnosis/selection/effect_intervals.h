#pragma once
/// Values of found effects and how sure they are: all effects together by ordinary least squares on every channel they
/// touch. The interval is to hold, in 95 of 100 machines, what the text-book law would have to be set to so that it
/// does what the machine does:
///   half width = 1.96 sqrt(sampling variance + (form_error value)^2)
/// The sampling variance is robust against dependence inside motions. form_error (EffectInfo) is the relative standard
/// deviation by which other published laws of the same effect come out when all are fitted to the same data; it does
/// not shrink with the log's length.
#include <vector>

#include "diagnosis/selection/effect_search.h"

namespace sparflow {

/// Fills values, lower95, upper95 and could_be_nothing of each.
void estimate_intervals(const Evidence& evidence, std::vector<FoundEffect>& found);

/// Parameters in the order of info().parameters from the linear and the nonlinear ones. [SI]
std::vector<double> parameter_values(const Effect& effect, const Eigen::VectorXd& linear,
                                     const std::vector<double>& shape);

}  // namespace sparflow
