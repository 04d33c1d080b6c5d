#pragma once
/// Reads any log file (CSV, MAT, recordings with several clocks) into timed channels, without a machine.
#include <string>
#include <vector>

#include "identification/log/log_table.h"
#include "identification/log/recordings/recording.h"
#include "models/math/door.h"

namespace sparflow {

/// How the clock of a table is found.
struct TimeColumnOptions {
  /// Smallest share of rising steps of a column that may be a clock.
  /// @threshold [1] 0.8..1; chosen: a few repeated or torn rows do not make another column the clock
  double rising = 0.97;
  /// Median interval from which a clock without a unit counts milliseconds.
  /// @threshold [1] 1..20; derived: an interval of more than 2 s is an error of a log (docs/log_format.md)
  double milliseconds_from = 2.0;
  /// Median interval from which it counts microseconds.
  /// @threshold [1] 500..5000; derived: as above, in milliseconds
  double microseconds_from = 2000.0;
};

/// The channels of a file and what is known of their clock.
struct TimedChannels {
  Recording recording;
  std::string clock;  ///< column that holds the time; "" where channels have clocks of their own
  double clock_unit = 1.0;   ///< [s] of one unit of that column
  std::string clock_reason;  ///< a sentence: why this column, why this unit
};

struct ChannelFileOptions {
  std::string mapping_file;            ///< "" = none; mapped columns bear the program's names
  std::vector<std::string> dbc_files;  ///< decode raw CAN frames
  DoorLimits limits;
  TimeColumnOptions time;
};

/// @throws InputError when the file cannot be read, or no column rises like a time
TimedChannels read_timed_channels(const std::string& path, const ChannelFileOptions& options = {});

/// Channels of a table of which one column is the clock. @throws InputError as above
TimedChannels timed_channels(const RawTable& table, const TimeColumnOptions& options = {});

}  // namespace sparflow
