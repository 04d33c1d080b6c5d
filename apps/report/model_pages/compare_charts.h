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
  FieldUnit unit;     ///< of the charts: kN where N would need five digits
  /// The log and its curves, both owned by the result.
  std::vector<std::pair<const LogComparison*, const ComparedSeries*>> logs;
};

/// Lists the quantities in the order of the stages, without those that have no compared sample.
/// @param result must outlive the list, which points into it
std::vector<ComparedQuantity> compared_quantities(const CompareResult& result);

/// The sign of every error and residual on all pages, in the terminal and in JSON: positive where the model says too much.
inline constexpr const char* kErrorAxis = "predicted \u2212 measured";

/// Number of the colour of a cylinder or pump on every page: cylinders in the machine's order, then pumps.
int place_color(const Machine& machine, const std::string& stage, const std::string& at);

/// Colour of a grade: green, amber, red.
Tone tone_of(Grade grade);

/// Returns the text with a capital first letter, for titles.
std::string capitalised(std::string text);

/// Names a quantity: "force of boom", "working pressure of boom", "pressure of pump main".
std::string quantity_words(const std::string& stage, const std::string& at);

/// Appends measured and predicted curves over time, one section for each log; the worst regions are shaded.
void add_compared_curves(Page& page, const Machine& machine, const CompareResult& result,
                         const std::string& heading_prefix);

/// Appends residuals against the signals that explain most of them; the quantity (stage, at) comes first and has more
/// charts than the others.
void add_residuals(Page& page, const Machine& machine, const CompareResult& result,
                   const std::string& stage, const std::string& at);

/// Appends a section of RMS residuals over the tip's positions, with the crane drawn where they are largest. A quantity
/// whose tip positions lie on a line gets no map.
void add_working_area(Page& page, const Machine& machine, const CompareResult& result,
                      const std::string& heading_prefix);

/// Share (0..1) of the variance of `y` that the means of equally filled bins of `x` explain, corrected for the
/// number of bins (0 expected from noise; Ezekiel's adjusted R^2). Samples with a NaN are left out; 0
/// with fewer than 40 of them.
double share_explained(const Eigen::VectorXd& x, const Eigen::VectorXd& y);

}  // namespace sparflow
