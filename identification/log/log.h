#pragma once
/// A measurement log, checked and converted to SI when it is read. docs/log_format.md describes the file format, its
/// dialects, the units and the mapping file.
#include <Eigen/Dense>
#include <cstdint>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/door.h"

namespace sparflow {

/// What a channel measures; its index names the joint, cylinder or pump.
enum class Role {
  kJointPosition,   ///< of a joint [rad] or [m]
  kStroke,          ///< of a cylinder [m], grows as it extends
  kCommand,         ///< of a cylinder's valve section [-], -1..1, positive extends
  kPressureA,       ///< of a cylinder, bore side [Pa]
  kPressureB,       ///< of a cylinder, rod side [Pa]
  kForce,           ///< of a cylinder [N], measured by a load cell instead of pressures
  kFlow,            ///< of a cylinder [m^3/s]
  kPumpPressure,    ///< of a pump [Pa]
  kReturnPressure,  ///< [Pa]
  kPayload,         ///< [kg]
  kOilTemperature,  ///< [degC]
  kCandidate        ///< a column without a known meaning, offered to the diagnosis as a signal
};

/// Samples begin .. end-1.
struct SampleRange {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;
  Eigen::Index size() const { return end - begin; }
};

struct Channel {
  std::string column;  ///< name in the file, e.g. "pA_boom_bar"
  std::string signal;  ///< name without its unit, e.g. "pA_boom"; unique in a log
  Role role = Role::kCandidate;
  int index = -1;          ///< joint, cylinder or pump; -1 when the role has none
  std::string unit;        ///< of `values`: SI for every role; of a candidate "" when unknown
  Eigen::VectorXd values;  ///< [samples], NaN where not valid
  Eigen::Array<bool, Eigen::Dynamic, 1> valid;  ///< [samples]
  bool complete() const { return valid.all(); }
};

/// Counts of rows and cells that were left out, interpolated or unreadable, for the report.
struct LogCounts {
  std::int64_t rows_read = 0;           ///< rows of the file's table, wrong ones included
  std::int64_t rows_wrong_width = 0;    ///< left out: the number of values is not that of columns
  std::int64_t rows_without_time = 0;   ///< left out
  std::int64_t rows_repeated = 0;       ///< left out: equal to the row before in every column
  std::int64_t rows_same_time = 0;      ///< left out: the time of the row before, other values
  std::int64_t cells_missing = 0;       ///< in kept rows and used columns, before interpolation
  std::int64_t cells_unreadable = 0;    ///< missing cells whose text is not a number
  std::int64_t cells_interpolated = 0;  ///< missing cells filled from their neighbours
};

struct Log {
  std::string path;               ///< as given
  std::string file;               ///< file name without folder
  std::string sha256;             ///< of the file's bytes
  std::string dialect;            ///< separator, decimal mark and units row, in words
  std::string machine_parts;      ///< parts_of the machine whose channels these are; "" = not known
  Eigen::VectorXd time;           ///< [s], [samples], strictly increasing
  double step = 0.0;              ///< [s] median sampling interval
  std::vector<Channel> channels;  ///< roles first, candidates last, each in the file's order
  std::vector<SampleRange> runs;  ///< gap-free stretches, in order, covering every sample
  std::vector<int> line;          ///< line of each sample in the file (row number for .mat)
  LogCounts counts;
  std::vector<std::string> warnings;  ///< whole sentences

  Eigen::Index samples() const { return time.size(); }
  double duration() const { return samples() == 0 ? 0.0 : time[samples() - 1] - time[0]; }
  /// @return nullptr when the log does not measure it
  const Channel* find(Role role, int index = -1) const;
  const Channel* find(const std::string& signal) const;
  /// @return [samples x count] one column for each index of a role, NaN where nothing was measured
  Eigen::MatrixXd matrix(Role role, int count) const;

  // The .cpp file defines these, so that they are compiled once.
  Log();
  Log(const Log&);
  Log(Log&&) noexcept;
  Log& operator=(const Log&);
  Log& operator=(Log&&) noexcept;
  ~Log();
};

/// The names of a machine's joints, cylinders and pumps, in their order: what the indices of a log's channels refer to.
std::string parts_of(const Machine& machine);

struct LogOptions {
  std::string mapping_file;  ///< "" = the columns have the program's names
  double gap_steps = 5.0;    ///< an interval splits the log when it is longer than this many median
  double gap_s = 0.2;        ///< [s] steps and longer than this
  int hole_samples = 3;      ///< up to so many missing values in a row are interpolated, and those
  double hole_s = 0.1;       ///< [s] between valid neighbours no further apart than this
  DoorLimits limits;
  /// A log that is sampled at least twice as fast is thinned to about this interval by means of neighbouring samples.
  /// @threshold [s] 1e-4..0.01; chosen: a hundredth of the shortest smoothing window; hydraulic cylinders move no faster
  double finest_step = 1e-3;
  /// Largest magnitude of a value with a meaning, in SI.
  /// @threshold [SI] 1e13..1e30; chosen: pressures in Pa taken for bar stay below it and get a warning; squares and
  /// products of such values stay finite
  double largest_value = 1e15;
};

/// Reads a text or MATLAB log.
/// @throws InputError (with line and column name) when the file cannot be read, a joint of the machine has
///   neither position nor stroke, a unit is unknown, or time decreases
Log load_log(const std::string& path, const Machine& machine, const LogOptions& options = {});

/// A column of measurements in memory, named as in a file ("pA_boom_bar"). NaN = missing.
struct LogColumn {
  std::string name;
  std::vector<double> values;
};

/// Makes a log of columns of one length, by the same checks as a file's.
/// @param name of the log in messages and reports  @throws InputError as `load_log`, and for columns of several lengths
Log log_from_columns(const std::string& name, std::vector<LogColumn> columns,
                     const Machine& machine, const LogOptions& options = {});

/// Reads a text log from memory. @param path name for messages  @throws InputError as `load_log`
Log log_from_text(const std::string& path, std::string bytes, const Machine& machine,
                  const LogOptions& options = {});

}  // namespace sparflow
