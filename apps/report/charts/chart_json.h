#pragma once
/// Writes charts as the JSON that apps/report/assets/*.js draw. The keys are private to these files.
#include <nlohmann/json.hpp>

#include "apps/report/charts/charts.h"

namespace sparflow {

/// @param most_points largest number of rows of a line chart and of points of a scatter chart (decimate.h)
nlohmann::json chart_json(const LineChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const ScatterChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const BarChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const SankeyChart& chart, Eigen::Index most_points);
nlohmann::json chart_json(const HeatMap& chart, Eigen::Index most_points);
nlohmann::json chart_json(const CraneDrawing& chart, Eigen::Index most_points);

/// Rounds `value` to `digits` significant digits; null when it is not finite.
nlohmann::json number_json(double value, int digits);

}  // namespace sparflow
