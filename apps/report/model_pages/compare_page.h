#pragma once
/// Pages of compare and fit.
#include "apps/report/page/page.h"
#include "identification/learning/fit.h"

namespace sparflow {

/// Appends all results of `compare`: scores, worst regions in words, measured and predicted curves, residuals against
/// signals, error over the crane's working area.
/// @param heading_prefix put before each section's heading, e.g. "Held-out log: "
void add_comparison(Page& page, const CraneModel& model, const CompareResult& result,
                    const std::string& heading_prefix = "");

/// Makes a page of add_comparison() with a verdict.
Page compare_page(const CraneModel& model, const CompareResult& result);

/// Appends what was learned: pressure models with their data and noise, margins, valve gains, pressures over flow.
void add_fit(Page& page, const FitResult& result);
/// Makes a page of add_fit() and the comparison on test, held-out or training data, with a verdict.
Page fit_page(const FitResult& result);

}  // namespace sparflow
