#pragma once
/// The figures of a comparison: curves over time, residuals against signals, error over the working area.
#include <string>
#include <utility>
#include <vector>

#include "apps/report/page/page.h"
#include "identification/comparison/compare.h"

namespace sparflow {

/// One compared quantity over all logs that measure it.
struct ComparedQuantity {
  std::string stage, at;
  std::string words;  ///< "force of boom"
  FieldUnit unit;     ///< to draw it in: kN where its own would need five digits
  /// The log and its curves, both owned by the result.
  std::vector<std::pair<const LogComparison*, const ComparedSeries*>> logs;
};

/// In the order of the stages, those without a single compared sample left out. The result must outlive them.
std::vector<ComparedQuantity> compared_quantities(const CompareResult& result);

/// With a capital letter, for titles.
std::string capitalised(std::string text);

/// "force of boom", "working pressure of boom", "pressure of pump main"
std::string quantity_words(const std::string& stage, const std::string& at);

/// Measured and predicted over time, a section a log; the worst regions' times are shaded.
void add_compared_curves(Page& page, const Machine& machine, const CompareResult& result,
                         const std::string& heading_prefix);

/// Residual against the signals that explain most of it, the quantity (stage, at) first and with more of them.
void add_residuals(Page& page, const Machine& machine, const CompareResult& result,
                   const std::string& stage, const std::string& at);

/// A section of RMS residuals over the tip's positions, the crane drawn where they are largest. Nothing where it
/// moves along a line only.
void add_working_area(Page& page, const Machine& machine, const CompareResult& result,
                      const std::string& heading_prefix);

/// Share of the variance of `y` that the means of equally filled bins of `x` explain, corrected for the
/// number of bins (0 expected from noise; Ezekiel's adjusted R^2), 0..1. Samples with a NaN are left out; 0
/// with fewer than 40 of them.
double share_explained(const Eigen::VectorXd& x, const Eigen::VectorXd& y);

}  // namespace sparflow
