#pragma once
/// Charts as the JSON that apps/report/assets/*.js draw. The keys are private to these files.
#include <nlohmann/json.hpp>

#include "apps/report/charts/charts.h"

namespace sparflow {

/// @param most_points rows a line chart, points a scatter chart may have (apps/report/charts/decimate.h)
nlohmann::json chart_json(const LineChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const ScatterChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const BarChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const HeatMap& chart, Eigen::Index most_points);
nlohmann::json chart_json(const CraneDrawing& chart, Eigen::Index most_points);

/// `value` to `digits` significant digits; null when it is not finite.
nlohmann::json number_json(double value, int digits);

}  // namespace sparflow
