#pragma once
/// Effects, their parameters and errors as readers see them.
#include <string>
#include <utility>
#include <vector>

#include "apps/report/charts/charts.h"
#include "diagnosis/extension/extend.h"

namespace sparflow {

/// Value in the unit it reads best in, that unit's name: {20.3, "kN"}.
std::pair<double, std::string> readable_error(double si, const FieldUnit& unit);

/// "force 4.02 ± 0.11 kN"; an interval that is not even is written out: "limit 41 (38 to 49) l/min".
std::string parameter_text(const ParameterEstimate& parameter);
/// All of them, with commas; "" when there is none.
std::string parameters_text(const std::vector<ParameterEstimate>& parameters);
/// The same from a model's effect.
std::vector<ParameterEstimate> estimates_of(const AppliedEffect& effect);

/// "12 % smaller", "3 % larger", "unchanged" from a ratio after / before.
std::string change_text(double ratio);

/// A stretch of one log over which a change shows best.
struct Stretch {
  Eigen::Index first = 0, last = 0;  ///< samples [first, last)
};
/// @param gain by sample: how much better the second model is there; NaN where nothing is compared
/// @param length [s] aimed at
Stretch best_stretch(const Eigen::VectorXd& time, const Eigen::VectorXd& gain, double length);

}  // namespace sparflow
