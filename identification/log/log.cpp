#include "identification/log/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "identification/log/log_checks.h"
#include "identification/log/log_columns.h"
#include "identification/log/log_dialect.h"
#include "identification/log/log_mapping.h"
#include "identification/log/log_matlab.h"
#include "identification/log/log_time.h"
#include "identification/log/one_clock.h"
#include "identification/log/recordings/recording_formats.h"
#include "models/math/door.h"
#include "models/math/error.h"
#include "models/math/sha256.h"

namespace sparflow {
namespace {

struct InterpretedColumn {
  const RawColumn* raw = nullptr;
  ColumnMeaning meaning;
};

std::string column_list(const RawTable& table) {
  std::string list;
  for (const RawColumn& column : table.columns) {
    if (list.size() > 400) return list + ", ...";
    list += (list.empty() ? "" : ", ") + column.name;
  }
  return list;
}

bool same_place(const ColumnMeaning& a, const ColumnMeaning& b) {
  return a.is_time == b.is_time && a.role == b.role && a.index == b.index &&
         (a.is_time || a.role != Role::kCandidate);
}

/// Interprets the name of each column. @throws InputError for two columns of one quantity and for unknown units
std::vector<InterpretedColumn> interpret(const RawTable& table, const Machine& machine) {
  const FilePlace header = {table.file, table.header_line, 0};
  std::vector<InterpretedColumn> columns;
  for (const RawColumn& raw : table.columns) {
    columns.push_back({&raw, column_meaning(raw.name, raw.unit, machine)});
  }
  for (InterpretedColumn& column : columns) {
    if (column.meaning.error.empty()) continue;
    // "q_boom_raw" beside "q_boom_rad" is another signal; alone it has an unknown unit.
    const bool another = std::any_of(columns.begin(), columns.end(), [&](const auto& other) {
      return other.meaning.error.empty() && same_place(other.meaning, column.meaning);
    });
    if (!another) {
      throw InputError(header, column.raw->name, column.meaning.error);
    }
    column.meaning = ColumnMeaning{};
    column.meaning.signal = column.raw->name;
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!same_place(columns[i].meaning, columns[j].meaning)) continue;
      throw InputError(
          header, columns[i].raw->name,
          fmt::format("measures the same as column {}; leave one out, or name it under "
                      "`ignore` in a mapping file",
                      columns[j].raw->name));
    }
  }
  return columns;
}

/// Makes the names of candidate signals unique; a repeated column is left out.
void make_names_unique(std::vector<InterpretedColumn>* columns,
                       std::vector<std::string>* warnings) {
  std::vector<InterpretedColumn> kept;
  const auto taken = [&](const std::string& signal) {
    return std::any_of(columns->begin(), columns->end(),
                       [&](const auto& c) {
                         return c.meaning.role != Role::kCandidate && c.meaning.signal == signal;
                       }) ||
           std::any_of(kept.begin(), kept.end(),
                       [&](const auto& c) { return c.meaning.signal == signal; });
  };
  for (InterpretedColumn& column : *columns) {
    if (column.meaning.role == Role::kCandidate && !column.meaning.is_time) {
      // A pressure under the name in the file would explain the mapped pressure perfectly.
      if (column.raw->mapped_from) continue;
      if (taken(column.meaning.signal)) column.meaning.signal = column.raw->name;
      if (taken(column.meaning.signal)) {
        warnings->push_back(
            fmt::format("column {} occurs twice; the second is left out", column.raw->name));
        continue;
      }
    }
    kept.push_back(column);
  }
  *columns = std::move(kept);
}

/// @return the column of time. @throws InputError when there is none
InterpretedColumn time_column(const RawTable& table,
                              const std::vector<InterpretedColumn>& columns) {
  const auto found = std::find_if(columns.begin(), columns.end(),
                                  [](const InterpretedColumn& c) { return c.meaning.is_time; });
  if (found == columns.end()) {
    throw InputError(
        {table.file, table.header_line, 0}, "t_s",
        fmt::format(
            "no column of this name; found {}; rename the column of time, or give a "
            "mapping file with columns: {{t_s: \"...\"}}, and skip_rows: N if lines of text stand "
            "before the header",
            column_list(table)));
  }
  if (found->raw->text) {
    throw InputError({table.file, found->raw->example_line, 0}, found->raw->name,
                     fmt::format("got \"{}\", expected a number of seconds from any start; export "
                                 "relative time instead of clock time",
                                 found->raw->example));
  }
  return *found;
}

/// @throws InputError when a joint has neither its position nor the stroke of its cylinder
void require_positions(const RawTable& table, const std::vector<InterpretedColumn>& columns,
                       const Machine& machine) {
  const auto usable = [&](Role role, int index) {
    return std::any_of(columns.begin(), columns.end(), [&](const InterpretedColumn& c) {
      return c.meaning.role == role && c.meaning.index == index && !c.raw->text &&
             std::any_of(c.raw->values.begin(), c.raw->values.end(),
                         [](double v) { return !std::isnan(v); });
    });
  };
  for (int joint = 0; joint < machine.joint_count(); ++joint) {
    const int cylinder = machine.cylinder_of_joint(joint);
    if (usable(Role::kJointPosition, joint)) continue;
    if (cylinder >= 0 && usable(Role::kStroke, cylinder)) continue;
    const std::string expected = usual_name(Role::kJointPosition, joint, machine);
    std::string hint;
    for (const InterpretedColumn& column : columns) {
      if (column.meaning.suggestion != expected) continue;
      hint = fmt::format("; is \"{}\" meant to be {}?", column.raw->name, expected);
    }
    const std::string stroke =
        cylinder < 0 ? "" : " or " + usual_name(Role::kStroke, cylinder, machine);
    throw InputError({table.file, table.header_line, 0}, "",
                     fmt::format("no position of joint {}: expected column {}{}; found {}{}",
                                 machine.joints[static_cast<std::size_t>(joint)].name, expected,
                                 stroke, column_list(table),
                                 hint.empty() ? "; rename it, or give a mapping file" : hint));
  }
}

/// The rows of a table that become samples.
struct KeptRows {
  std::vector<std::size_t> rows;
  std::vector<SampleRange>
      groups;  ///< of `rows`, each the mean of a sample; empty: each row is a sample

  std::size_t samples() const { return groups.empty() ? rows.size() : groups.size(); }
  /// Row in the middle of a sample's group.
  std::size_t row(std::size_t sample) const {
    if (groups.empty()) return rows[sample];
    return rows[static_cast<std::size_t>((groups[sample].begin + groups[sample].end) / 2)];
  }
  /// @return mean of the sample's values that are not missing; NaN where half of them or more are
  double value(const std::vector<double>& values, std::size_t sample) const {
    if (groups.empty()) return values[rows[sample]];
    const SampleRange& group = groups[sample];
    double sum = 0.0;
    Eigen::Index count = 0;
    for (Eigen::Index i = group.begin; i < group.end; ++i) {
      const double v = values[rows[static_cast<std::size_t>(i)]];
      if (std::isnan(v)) continue;
      sum += v;
      ++count;
    }
    return 2 * count > group.size() ? sum / static_cast<double>(count)
                                    : std::numeric_limits<double>::quiet_NaN();
  }
};

/// @throws InputError at the first value of a column with a meaning that no machine can have
void refuse_absurd(const RawTable& table, const InterpretedColumn& column, const KeptRows& kept,
                   const LogOptions& options) {
  if (column.meaning.role == Role::kCandidate) return;
  for (const std::size_t row : kept.rows) {
    const double v = column.meaning.factor * column.raw->values[row] + column.meaning.offset;
    if (!(std::abs(v) > options.largest_value)) continue;
    throw InputError(
        table.place(row), column.raw->name,
        fmt::format(
            "got {:.4g}{}, which no machine has; check the unit, or give a mark for missing "
            "values under `missing` in a mapping file",
            column.raw->values[row],
            table.lines.empty() ? fmt::format(" in row {}", row + 1) : ""));
  }
}

Channel make_channel(const InterpretedColumn& column, const KeptRows& kept) {
  const ColumnMeaning& meaning = column.meaning;
  Channel channel;
  channel.column = column.raw->name;
  channel.signal = meaning.signal;
  channel.role = meaning.role;
  channel.index = meaning.index;
  channel.unit = meaning.unit;
  channel.values.resize(static_cast<Eigen::Index>(kept.samples()));
  for (std::size_t i = 0; i < kept.samples(); ++i) {
    channel.values[static_cast<Eigen::Index>(i)] =
        meaning.factor * kept.value(column.raw->values, i) + meaning.offset;
  }
  return channel;
}

/// @return whether the column can be a channel; if not, a warning says why
bool is_usable(const InterpretedColumn& column, const Channel& channel, Log* log) {
  const RawColumn& raw = *column.raw;
  if (raw.text) {
    log->warnings.push_back(fmt::format("column {} left out: it holds text (\"{}\" in line {})",
                                        raw.name, raw.example, raw.example_line));
    return false;
  }
  if (!channel.values.array().isFinite().any()) {
    log->warnings.push_back(fmt::format("column {} left out: it is empty", raw.name));
    return false;
  }
  return true;
}

void note_holes(const RawColumn& raw, const Channel& channel, std::int64_t filled, Log* log) {
  if (raw.unreadable > 0) {
    log->warnings.push_back(
        fmt::format("{}: {} {} no number (the first \"{}\" in line {}), taken as missing", raw.name,
                    raw.unreadable, raw.unreadable == 1 ? "cell is" : "cells are", raw.example,
                    raw.example_line));
  }
  const Eigen::Index invalid = channel.valid.size() - channel.valid.count();
  if (invalid > 0) {
    log->warnings.push_back(fmt::format(
        "{}: missing in {:.2g} % of the samples after {} short-hole {} filled", raw.name,
        100.0 * static_cast<double>(invalid) / static_cast<double>(channel.valid.size()), filled,
        filled == 1 ? "value was" : "values were"));
  }
}

void add_channels(const RawTable& table, const std::vector<InterpretedColumn>& columns,
                  const KeptRows& kept, const LogOptions& options, Log* log) {
  for (const InterpretedColumn& column : columns) {
    if (column.meaning.is_time) continue;
    refuse_absurd(table, column, kept, options);
    Channel channel = make_channel(column, kept);
    if (column.meaning.role == Role::kCandidate &&
        (channel.values.array().abs() > options.largest_value).any()) {
      log->warnings.push_back(fmt::format("column {} left out: it holds values beyond {:g}",
                                          column.raw->name, options.largest_value));
      continue;
    }
    if (!is_usable(column, channel, log)) continue;
    if (!column.meaning.suggestion.empty() &&
        std::none_of(columns.begin(), columns.end(), [&](const InterpretedColumn& c) {
          return c.raw->name == column.meaning.suggestion;
        })) {
      log->warnings.push_back(
          fmt::format("column {} names no part of the machine; did you mean {}?", column.raw->name,
                      column.meaning.suggestion));
    }
    log->counts.cells_missing += (!channel.values.array().isFinite()).count();
    log->counts.cells_unreadable += column.raw->unreadable;
    const std::int64_t filled = fill_holes(log->time, log->runs, options, &channel);
    log->counts.cells_interpolated += filled;
    note_holes(*column.raw, channel, filled, log);
    log->channels.push_back(std::move(channel));
  }
  std::stable_partition(log->channels.begin(), log->channels.end(),
                        [](const Channel& c) { return c.role != Role::kCandidate; });
}

void note_runs(Log* log) {
  if (log->runs.size() < 2) return;
  double longest = 0.0, at = 0.0;
  for (std::size_t i = 1; i < log->runs.size(); ++i) {
    const Eigen::Index k = log->runs[i].begin;
    const double gap = log->time[k] - log->time[k - 1];
    if (gap > longest) longest = gap, at = log->time[k - 1];
  }
  log->warnings.push_back(fmt::format(
      "{} {} in time split the log into {} runs; the longest is {:.3g} s after t = {:.3f} s",
      log->runs.size() - 1, log->runs.size() == 2 ? "gap" : "gaps", log->runs.size(), longest, at));
}

void set_times(const RawTable& table, const std::vector<double>& time, const KeptRows& kept,
               Log* log) {
  log->time.resize(static_cast<Eigen::Index>(kept.samples()));
  log->line.resize(kept.samples());
  for (std::size_t i = 0; i < kept.samples(); ++i) {
    log->time[static_cast<Eigen::Index>(i)] = kept.value(time, i);
    log->line[i] = table.line(kept.row(i));
  }
  log->step = median_step(log->time);
}

struct Clock {
  std::string column;
  const std::vector<double>* time;  ///< [s] of the table's rows
};

/// Takes means of neighbouring samples where the log is sampled faster than needed. @throws InputError where nothing is left
void thin(const RawTable& table, const Clock& clock, const LogOptions& options, KeptRows* kept,
          Log* log) {
  kept->groups = thinning(log->time, log->step, log->runs, options);
  if (kept->groups.empty()) return;
  const double before = log->step;
  if (kept->groups.size() < 2) {
    throw InputError({table.file, table.header_line, 0}, clock.column,
                     fmt::format("the log lasts {:.3g} s with samples {:.3g} s apart; expected a "
                                 "motion, or another unit of time",
                                 log->duration(), before));
  }
  set_times(table, *clock.time, *kept, log);
  log->runs = runs_between_gaps(log->time, log->step, options);
  log->warnings.push_back(
      fmt::format("sampled every {:.3g} s, faster than needed; thinned from {} to {} samples by "
                  "means over {:.3g} s",
                  before, kept->rows.size(), kept->groups.size(), log->step));
}

Log clean_log(const RawTable& table, const std::string& path, const std::string& sha256,
              const Machine& machine, const LogOptions& options) {
  Log log;
  log.path = path;
  log.machine_parts = parts_of(machine);
  log.file = path.substr(path.find_last_of('/') + 1);
  log.sha256 = sha256;
  log.dialect = table.dialect;
  log.warnings = table.warnings;
  log.counts.rows_wrong_width = table.rows_wrong_width;
  log.counts.rows_read = static_cast<std::int64_t>(table.rows()) + table.rows_wrong_width;

  std::vector<InterpretedColumn> columns = interpret(table, machine);
  const InterpretedColumn clock = time_column(table, columns);
  std::vector<double> time = clock.raw->values;
  for (double& t : time) t = clock.meaning.factor * t + clock.meaning.offset;
  require_positions(table, columns, machine);
  make_names_unique(&columns, &log.warnings);

  KeptRows kept;
  kept.rows = rows_in_time(table, clock.raw->name, time, &log.counts, &log.warnings);
  set_times(table, time, kept, &log);
  log.runs = runs_between_gaps(log.time, log.step, options);
  thin(table, {clock.raw->name, &time}, options, &kept, &log);
  note_runs(&log);
  add_channels(table, columns, kept, options, &log);
  check_plausible(machine, &log);
  return log;
}

LogMapping mapping_of(const LogOptions& options) {
  return options.mapping_file.empty() ? LogMapping{} : read_log_mapping(options.mapping_file);
}

/// The channels of a recording on one clock, which follows those with a meaning.
RawTable recorded_table(const std::string& path, std::string_view bytes, const LogMapping& mapping,
                        const LogOptions& options, const Machine& machine) {
  RecordingOptions reading;
  reading.limits = options.limits;
  reading.dbc_files = mapping.dbc;
  const Recording recording = read_recording(bytes, path, reading);
  ClockOptions clock;
  clock.limits = options.limits;
  clock.step = mapping.clock;
  for (std::size_t i = 0; i < recording.channels.size(); ++i) {
    const RecordedChannel& channel = recording.channels[i];
    const bool mapped =
        std::any_of(mapping.columns.begin(), mapping.columns.end(), [&](const MappedColumn& c) {
          return c.expression.find(channel.name) != std::string::npos;
        });
    if (mapped || column_meaning(channel.name, channel.unit, machine).role != Role::kCandidate) {
      clock.leading.push_back(i);
    }
  }
  return on_one_clock(recording, clock);
}

}  // namespace

std::string parts_of(const Machine& machine) {
  const auto listed = [](const char* title, const auto& parts) {
    std::string names;
    for (const auto& part : parts) names += (names.empty() ? "" : ", ") + part.name;
    return fmt::format("{} {}", title, names.empty() ? "none" : names);
  };
  return fmt::format("{}; {}; {}", listed("joints", machine.joints),
                     listed("cylinders", machine.cylinders), listed("pumps", machine.pumps));
}

const Channel* Log::find(Role role, int index) const {
  const auto it = std::find_if(channels.begin(), channels.end(), [&](const Channel& c) {
    return c.role == role && c.index == index;
  });
  return it == channels.end() ? nullptr : &*it;
}

const Channel* Log::find(const std::string& signal) const {
  const auto it = std::find_if(channels.begin(), channels.end(),
                               [&](const Channel& c) { return c.signal == signal; });
  return it == channels.end() ? nullptr : &*it;
}

Eigen::MatrixXd Log::matrix(Role role, int count) const {
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Constant(samples(), count, std::numeric_limits<double>::quiet_NaN());
  for (int i = 0; i < count; ++i) {
    if (const Channel* channel = find(role, i)) all.col(i) = channel->values;
  }
  return all;
}

Log load_log(const std::string& path, const Machine& machine, const LogOptions& options) {
  std::string bytes = read_bytes(path, options.limits.log_bytes);
  if (is_recording(bytes)) {
    const LogMapping mapping = mapping_of(options);
    RawTable table = recorded_table(path, bytes, mapping, options, machine);
    apply_mapping(mapping, &table);
    return clean_log(table, path, sha256_hex(bytes), machine, options);
  }
  if (!is_matlab(bytes, path)) return log_from_text(path, std::move(bytes), machine, options);
  RawTable table = read_matlab(path, bytes, options.limits);
  apply_mapping(mapping_of(options), &table);
  return clean_log(table, path, sha256_hex(bytes), machine, options);
}

Log log_from_text(const std::string& path, std::string bytes, const Machine& machine,
                  const LogOptions& options) {
  const LogMapping mapping = mapping_of(options);
  const std::string sha256 = sha256_hex(bytes);
  RawTable table = read_delimited(path, std::move(bytes), mapping.dialect, options.limits);
  apply_mapping(mapping, &table);
  return clean_log(table, path, sha256, machine, options);
}

Log log_from_columns(const std::string& name, std::vector<LogColumn> columns,
                     const Machine& machine, const LogOptions& options) {
  const std::size_t rows = columns.empty() ? 0 : columns.front().values.size();
  if (static_cast<std::int64_t>(columns.size()) > options.limits.log_columns ||
      static_cast<std::int64_t>(rows * columns.size()) > options.limits.log_values) {
    throw InputError({name, 0, 0}, "",
                     fmt::format("got {} columns of {} rows, more than a log may have "
                                 "(docs/limits.md); give fewer columns or shorter ones",
                                 columns.size(), rows));
  }
  RawTable table;
  table.file = name;
  table.dialect = "columns in memory";
  table.columns.reserve(columns.size());
  std::string bytes;
  bytes.reserve(columns.size() * (rows * sizeof(double) + 32));
  for (LogColumn& column : columns) {
    if (column.values.size() != rows) {
      throw InputError({name, 0, 0}, column.name,
                       fmt::format("has {} values, {} has {}; expected one for each row in every "
                                   "column",
                                   column.values.size(), table.columns.front().name, rows));
    }
    bytes += column.name;
    bytes.append(reinterpret_cast<const char*>(column.values.data()), rows * sizeof(double));
    RawColumn& raw = table.columns.emplace_back();
    raw.name = std::move(column.name);
    raw.values = std::move(column.values);
  }
  apply_mapping(mapping_of(options), &table);
  return clean_log(table, name, sha256_hex(bytes), machine, options);
}

Log::Log() = default;
Log::Log(const Log&) = default;
Log::Log(Log&&) noexcept = default;
Log& Log::operator=(const Log&) = default;
Log& Log::operator=(Log&&) noexcept = default;
Log::~Log() = default;

}  // namespace sparflow
