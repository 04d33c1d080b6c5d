#pragma once
/// A measurement log, clean: read once at the door, SI behind it. The format, its dialects, units and the
/// mapping file are described in docs/log_format.md.
#include <Eigen/Dense>
#include <cstdint>
#include <string>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow {

/// What a channel measures; `Channel::index` says of which joint, cylinder or pump.
enum class Role {
  kJointPosition,   ///< of a joint [rad] or [m]
  kStroke,          ///< of a cylinder [m], grows as it extends
  kCommand,         ///< of a cylinder's valve section [-], -1..1, positive extends
  kPressureA,       ///< of a cylinder, piston side [Pa]
  kPressureB,       ///< of a cylinder, rod side [Pa]
  kForce,           ///< of a cylinder [N], measured, in place of pressures
  kFlow,            ///< of a cylinder [m^3/s]
  kPumpPressure,    ///< of a pump [Pa]
  kReturnPressure,  ///< [Pa]
  kPayload,         ///< [kg]
  kOilTemperature,  ///< [degC]
  kCandidate  ///< a column the program has no meaning for: offered to the diagnosis as a signal
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

/// What was left out, filled in or not understood, for the report.
struct LogCounts {
  std::int64_t rows_read = 0;          ///< rows of the file's table, wrong ones included
  std::int64_t rows_wrong_width = 0;   ///< left out: not one value a column
  std::int64_t rows_without_time = 0;  ///< left out
  std::int64_t rows_repeated = 0;      ///< left out: equal to the row before in every column
  std::int64_t rows_same_time = 0;     ///< left out: the time of the row before, other values
  std::int64_t cells_missing = 0;  ///< in kept rows and used columns, before short holes are filled
  std::int64_t cells_unreadable = 0;    ///< of the missing ones: held something that is no number
  std::int64_t cells_interpolated = 0;  ///< missing ones filled from their neighbours
};

struct Log {
  std::string path;               ///< as given
  std::string file;               ///< file name without folder
  std::string sha256;             ///< of the file's bytes
  std::string dialect;            ///< how the text was read, in words
  Eigen::VectorXd time;           ///< [s], [samples], strictly increasing
  double step = 0.0;              ///< [s] median sampling interval
  std::vector<Channel> channels;  ///< roles first, candidates last, each in the file's order
  std::vector<SampleRange> runs;  ///< gap-free stretches, in order, covering every sample
  std::vector<int> line;          ///< line of each sample in the file (row number for .mat)
  LogCounts counts;
  std::vector<std::string> warnings;  ///< plain sentences

  Eigen::Index samples() const { return time.size(); }
  double duration() const { return samples() == 0 ? 0.0 : time[samples() - 1] - time[0]; }
  /// nullptr when the log does not measure it.
  const Channel* find(Role role, int index = -1) const;
  const Channel* find(const std::string& signal) const;
  /// [samples x count] one column for each index of a role, NaN where nothing was measured.
  Eigen::MatrixXd matrix(Role role, int count) const;

  // Defaulted where they are defined: compiled once, not in every file that copies one.
  Log();
  Log(const Log&);
  Log(Log&&) noexcept;
  Log& operator=(const Log&);
  Log& operator=(Log&&) noexcept;
  ~Log();
};

struct LogOptions {
  std::string mapping_file;  ///< "" = the columns have the program's names
  double gap_steps = 5.0;    ///< a longer interval than this many median steps ...
  double gap_s = 0.2;        ///< ... and than this splits the log [s]
  int hole_samples = 3;      ///< missing values in a row that are interpolated, or ...
  double hole_s = 0.1;       ///< ... between valid neighbours this close [s]
};

/// Reads a text or MATLAB log.
/// @throws InputError (with line and column's name) when the file cannot be read, a joint of the machine has
///   neither position nor stroke, a unit is unknown, or time goes backwards
Log load_log(const std::string& path, const Machine& machine, const LogOptions& options = {});

/// The same from a text log in memory. @param path name for messages
Log log_from_text(const std::string& path, std::string bytes, const Machine& machine,
                  const LogOptions& options = {});

}  // namespace sparflow
