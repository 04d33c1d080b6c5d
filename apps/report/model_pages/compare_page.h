#pragma once
/// Pages about a model and its measurements.
#include "apps/report/page/page.h"
#include "identification/learning/fit.h"

namespace sparflow {

/// Appends everything `compare` found: scores, worst regions in words, measured and predicted curves,
/// residuals against each signal, error over the crane's working area.
/// @param heading_prefix put before each section's heading, e.g. "Held-out log: "
void add_comparison(Page& page, const CraneModel& model, const CompareResult& result,
                    const std::string& heading_prefix = "");

/// A page of its own, with a verdict.
Page compare_page(const CraneModel& model, const CompareResult& result);

/// Appends how a model was learned: processes with their data and noise, margins, valve gains, pressure maps.
void add_fit(Page& page, const FitResult& result);
Page fit_page(const FitResult& result);

}  // namespace sparflow
