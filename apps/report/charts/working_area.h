#pragma once
/// A residual over the crane's working area, to show at which tip positions a model fails.
#include <vector>

#include "apps/report/charts/charts.h"

namespace sparflow {

/// Root mean square of `residual` over square cells of tip positions; samples with a NaN are left out.
/// Cells are 0.05, 0.1, 0.2, 0.5 ... m wide, about `cells` along the longer side. Title, note and quantities
/// of the result are the caller's to fill in.
/// @param tip positions in the drawing's plane [m]  @param residual one for each position, any unit
/// @param least_samples cells with fewer stay empty, since single samples are no evidence
HeatMap rms_over_working_area(const std::vector<Eigen::Vector2d>& tip,
                              const Eigen::VectorXd& residual, int cells = 40,
                              int least_samples = 3);

}  // namespace sparflow
