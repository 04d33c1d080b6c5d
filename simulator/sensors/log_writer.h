#pragma once
/// The log that the plant's sensors write, in the program's own column names (docs/log_format.md).
#include <string>

#include "simulator/sensors/sensors.h"

namespace sparflow::plant {

/// Collects records and writes them as sensors tell them.
class LogWriter {
 public:
  /// @param remark a line of comment at the head of the log; empty: none
  LogWriter(const Machine& machine, const PlantParameters& parameters, std::uint64_t seed,
            const std::string& remark);
  void add(const Record& record);
  int rows() const { return rows_; }
  /// The log as text. @param cut a line of comment behind the last row, for a log that was ended early; empty: none
  std::string text(const std::string& cut) const;

 private:
  Sensors sensors_;
  std::string text_;
  int rows_ = 0;
};

}  // namespace sparflow::plant
