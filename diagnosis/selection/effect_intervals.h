#pragma once
/// Parameters of found effects with 95 % intervals: all effects together by ordinary least squares on every channel in
/// which they act. In 95 of 100 machines the interval contains the value that the effect's law needs to reproduce the
/// machine:
///   half width = 1.96 sqrt(sampling variance + (form_error value)^2)
/// The sampling variance is robust against dependence inside motions. form_error (EffectInfo) is the model-form error:
/// the relative standard deviation of the parameter between published laws of the same effect fitted to the same data.
/// It does not shrink with the length of the log.
#include <vector>

#include "diagnosis/selection/effect_search.h"

namespace sparflow {

/// Fills in values, lower95, upper95, covariance [SI] and not_significant of each effect.
void estimate_intervals(const Evidence& evidence, std::vector<FoundEffect>& found);

/// Whether the logs determine the value of parameter `p` of an effect (is_determined); true where it has no interval.
bool value_is_determined(const AppliedEffect& effect, std::size_t p);

/// Whether a value lies on a bound of its parameter's plausible range.
bool lies_on_bound(const EffectParameter& parameter, double value);

/// All parameters in the order of info().parameters, from the linear and the nonlinear (`shape`) ones. [SI]
std::vector<double> parameter_values(const Effect& effect, const Eigen::VectorXd& linear,
                                     const std::vector<double>& shape);

}  // namespace sparflow
