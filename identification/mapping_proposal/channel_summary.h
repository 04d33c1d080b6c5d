#pragma once
/// What a channel of a log looks like: rate, range, gaps, missing values, resolution and noise.
#include <string>
#include <vector>

#include "identification/log/recordings/recording.h"

namespace sparflow {

struct SummaryOptions {
  /// A gap is longer than this many median intervals,
  /// @threshold [1] 2..20; chosen: as LogOptions::gap_steps
  double gap_steps = 5.0;
  /// and longer than this.
  /// @threshold [s] 0.01..2; chosen: as LogOptions::gap_s
  double gap_s = 0.2;
  /// Values of a channel from which its resolution is found; of longer ones stretches are taken.
  /// @threshold [1] 1e3..1e6; chosen: the sorting of so many takes a few milliseconds
  std::size_t sorted_values = 50'000;
  /// Share of neighbouring values whose distance must be a whole multiple of the smallest one.
  /// @threshold [1] 0.9..1; chosen: values that were converted from integers are multiples but for rounding
  double on_the_grid = 0.98;
};

struct ChannelSummary {
  std::string name, unit, group, comment;
  std::size_t samples = 0;
  double duration = 0.0;       ///< [s] from first to last sample
  double rate = 0.0;           ///< [Hz] one over the median interval; 0 = fewer than two samples
  double missing_share = 0.0;  ///< 0..1 of the samples
  int gaps = 0;
  double longest_gap = 0.0;                          ///< [s]
  double longest_gap_at = 0.0;                       ///< [s] where it begins
  double smallest = 0.0, largest = 0.0, mean = 0.0;  ///< in the channel's unit; NaN without values
  double resolution = 0.0;  ///< step of the values, in the channel's unit; 0 = none was found
  double noise = 0.0;       ///< standard deviation from third differences, in the channel's unit
  bool constant = false;
};

ChannelSummary summarise(const RecordedChannel& channel, const SummaryOptions& options = {});

/// One line for each channel, with a header.
std::string summary_table(const std::vector<ChannelSummary>& channels);

}  // namespace sparflow
