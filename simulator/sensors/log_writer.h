#pragma once
/// Sensors of the plant and the log that they write, in the program's own column names (docs/log_format.md).
#include <deque>
#include <string>
#include <vector>

#include "simulator/plant/run/plant_run.h"
#include "simulator/random/random.h"

namespace sparflow::plant {

/// Collects records and writes them as sensors tell them. Positions, commands and payload come at once, pressures and forces
/// after the sensors' delay; each channel has its own noise and its own gaps.
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
  enum class Kind { kExact, kPosition, kPressure, kForce };
  struct Column {
    std::string name;
    Kind kind;
    double scale;   // number in the file = SI value / scale
    double offset;  // SI
    double gap_until = -1.0;
  };
  void add_column(const std::string& name, Kind kind, double scale, double offset = 0.0);
  double sensed(Kind kind, double value);
  std::vector<double> values(const Record& r) const;

  const Machine& machine_;
  SensorParameters sensors_;
  simulator::Random random_;
  std::vector<Column> columns_;
  std::deque<std::pair<double, std::vector<double>>> past_;  // true values, for delayed channels
  double largest_force_ = 0.0;
  std::string text_;
  int rows_ = 0;
};

}  // namespace sparflow::plant
