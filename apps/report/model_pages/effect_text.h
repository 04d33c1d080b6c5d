#pragma once
/// Texts for effects, their parameters and errors.
#include <string>
#include <utility>
#include <vector>

#include "apps/report/charts/charts.h"
#include "diagnosis/extension/extend.h"

namespace sparflow {

/// Converts a value from SI to the unit that keeps it short, and names that unit: {20.3, "kN"}.
std::pair<double, std::string> readable_error(double si, const FieldUnit& unit);

/// "force 4.02 ± 0.11 kN"; an asymmetric interval is written out: "limit 41 (38 to 49) l/min".
std::string parameter_text(const ParameterEstimate& parameter);
/// Joins the texts of all parameters with commas; "" when there is none.
std::string parameters_text(const std::vector<ParameterEstimate>& parameters);
/// Makes the estimates of an effect in a model, whose intervals are NaN where the model has none.
std::vector<ParameterEstimate> estimates_of(const AppliedEffect& effect);

/// "12 % smaller", "3 % larger", "unchanged" from a ratio after / before.
std::string change_text(double ratio);

/// A stretch of one log.
struct Stretch {
  Eigen::Index first = 0, last = 0;  ///< samples [first, last)
};
/// Finds the stretch with the largest sum of `gain`.
/// @param gain by sample, squared residual before less after, any unit; NaN where nothing is compared
/// @param length [s] aimed at
Stretch best_stretch(const Eigen::VectorXd& time, const Eigen::VectorXd& gain, double length);

}  // namespace sparflow
