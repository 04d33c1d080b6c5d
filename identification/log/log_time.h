#pragma once
/// Orders rows by time, splits the log at gaps and interpolates short holes of single channels.
#include <cstdint>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "identification/log/log_table.h"

namespace sparflow {

/// Selects the rows that have a time of their own.
/// @param time [s] [rows], NaN where missing
/// @return row numbers, along which time strictly increases
/// @throws InputError with the line where time decreases, or when the sampling interval is implausible
std::vector<std::size_t> rows_in_time(const RawTable& table, const std::string& column,
                                      const std::vector<double>& time, LogCounts* counts,
                                      std::vector<std::string>* warnings);

/// Groups of neighbouring samples whose means thin a log.
/// @param time [s] increasing  @param step median interval [s]  @param runs no group reaches across a gap between them
/// @return one range of samples for each sample of the thinned log; empty where the log is no faster than needed
std::vector<SampleRange> thinning(const Eigen::VectorXd& time, double step,
                                  const std::vector<SampleRange>& runs, const LogOptions& options);

/// @param time [s] increasing  @param step median interval [s]
/// @return the stretches between gaps, in order of time
std::vector<SampleRange> runs_between_gaps(const Eigen::VectorXd& time, double step,
                                           const LogOptions& options);

/// Interpolates short holes of a channel from their neighbours within a run and marks the others as not valid.
/// Payload and oil temperature change slowly and are often logged slowly, so their holes are filled at any length.
/// @return number of samples filled
std::int64_t fill_holes(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                        const LogOptions& options, Channel* channel);

/// @return median sampling interval [s]; 0 for fewer than two instants
double median_step(const Eigen::VectorXd& time);

}  // namespace sparflow
