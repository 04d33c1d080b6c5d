#pragma once
/// The content of a file whose channels have clocks of their own (MDF4, CAN traces, MCAP bags), before the channels are brought
/// to one clock. one_clock.h makes a table with one row for each instant of it.
#include <string>
#include <vector>

namespace sparflow {

/// One channel with its own clock.
struct RecordedChannel {
  std::string name;          ///< as in the file (UTF-8); unique in a recording
  std::string unit;          ///< as in the file, "" when it says none
  std::string group;         ///< channel group, CAN message or topic it comes from
  std::string comment;       ///< the file's own description, "" when there is none
  std::vector<double> time;  ///< [s] from the recording's start, not decreasing
  std::vector<double>
      values;  ///< physical values, one for each time; NaN = the file says that the value is not valid
};

struct Recording {
  std::string file;
  std::string format;  ///< in words, e.g. "MDF 4.10, 12 channel groups"
  std::vector<RecordedChannel> channels;
  std::vector<std::string> warnings;  ///< whole sentences: what was left out and why
};

}  // namespace sparflow
