#pragma once
/// Rows in order of time, gaps, and holes in single channels.
#include <cstdint>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "identification/log/log_table.h"

namespace sparflow {

/// Rows that are kept: those with a time, without repetitions.
/// @param time [s], a value a row, NaN where missing
/// @return row numbers, along which time strictly increases
/// @throws InputError with the line where time goes back, or when the time's unit cannot be right
std::vector<std::size_t> rows_in_time(const RawTable& table, const std::string& column,
                                      const std::vector<double>& time, LogCounts* counts,
                                      std::vector<std::string>* warnings);

/// Stretches between gaps. @param time [s] increasing  @param step median interval [s]
std::vector<SampleRange> runs_between_gaps(const Eigen::VectorXd& time, double step,
                                           const LogOptions& options);

/// Fills short holes of a channel from their neighbours within a run and marks the rest as not valid.
/// Payload and oil temperature change slowly and are often logged slowly: their holes are filled however long.
/// @return number of samples filled
std::int64_t fill_holes(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                        const LogOptions& options, Channel* channel);

/// Median of the intervals [s]; 0 for fewer than two instants.
double median_step(const Eigen::VectorXd& time);

}  // namespace sparflow
