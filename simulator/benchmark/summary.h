#pragma once
/// Compares controllers over scenarios: medians, paired differences with intervals, ranks.
#include <map>
#include <string>
#include <vector>

#include "simulator/benchmark/result.h"

namespace sparflow::benchmark {

struct SummaryOptions {
  /// Draws of the bootstrap.
  /// @threshold [1] 100..1e6; chosen: an interval's end then varies by a tenth of its width
  int draws = 2000;
  std::uint64_t seed = 1;
  /// Two energies within this share count as equal.
  /// @threshold [-] 0..0.1; chosen: what the plant's integration may be wrong by
  double tie = 1e-3;
};

/// A median over scenarios with its 95 % interval by the percentile bootstrap (Efron 1979, Annals of Statistics 7(1)).
struct Estimate {
  double median = kNotKnown, lower = kNotKnown, upper = kNotKnown;
  int n = 0;  ///< scenarios
};

/// What the optimiser promises for a scenario.
struct Promise {
  double energy = kNotKnown;  ///< [J] predicted of the energy-optimal motion in the scenario's time
  double bound = kNotKnown;   ///< [J] estimated lower bound
};

struct ControllerSummary {
  std::string controller;
  int runs = 0, failed = 0;
  // medians over the runs that were done
  double energy = kNotKnown, pump_work = kNotKnown, time = kNotKnown, tip_path = kNotKnown,
         tip_end = kNotKnown, sway = kNotKnown, peak_pressure = kNotKnown, roughness = kNotKnown,
         step_median = kNotKnown;
  double step_worst = 0.0;  ///< [s] of all runs
  int runs_breaking_limits = 0;
  double rank = kNotKnown;         ///< mean rank of the energy over scenarios; a failure ranks last
  Estimate against;                ///< relative energy above the reference's, paired by scenario
  Estimate later;                  ///< [s] time above the reference's, paired by scenario
  Estimate path_above, end_above;  ///< [m] tip errors above the reference's, paired by scenario
  double dearer =
      kNotKnown;           ///< share of these scenarios in which it takes more than the reference
  Estimate above_promise;  ///< relative energy above the promised optimum
  Estimate above_bound;    ///< relative energy above the bound
};

/// Rows of one scenario are averaged over its seeds before scenarios are compared; a scenario in which a seed failed takes
/// no part in that controller's pairs.
/// @param controllers in the order of the result @param reference one of them, or none
std::vector<ControllerSummary> summarise(const std::vector<Row>& rows,
                                         const std::vector<std::string>& controllers,
                                         const std::string& reference,
                                         const std::map<std::string, Promise>& promises,
                                         const SummaryOptions& options = {});

/// Median of the finite values; NaN without one.
double median_of(std::vector<double> values);
/// @param values one a scenario; those that are not finite are left out
Estimate estimate(std::vector<double> values, const SummaryOptions& options = {});

}  // namespace sparflow::benchmark
