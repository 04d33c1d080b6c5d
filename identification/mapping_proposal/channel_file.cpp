#include "identification/mapping_proposal/channel_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/log/log_mapping.h"
#include "identification/log/log_matlab.h"
#include "identification/log/one_clock.h"
#include "identification/log/recordings/recording_formats.h"
#include "identification/mapping_proposal/channel_words.h"
#include "models/math/error.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

/// A column seen as a clock.
struct ClockCandidate {
  const RawColumn* column = nullptr;
  double rising = 0.0;    ///< share of steps that are greater than zero
  double interval = 0.0;  ///< median step, in the column's unit
  double evenness = 0.0;  ///< 0..1, share of steps within a tenth of the median
  bool named = false;
};

ClockCandidate clock_candidate(const RawColumn& column) {
  ClockCandidate c;
  c.column = &column;
  c.named = names_a_clock(column.name) || column.name == "t_s";
  std::vector<double> steps;
  steps.reserve(column.values.size());
  double before = kNaN;
  for (const double v : column.values) {
    if (!std::isfinite(v)) continue;
    if (std::isfinite(before)) steps.push_back(v - before);
    before = v;
  }
  if (steps.size() < 2) return c;
  const auto n = static_cast<double>(steps.size());
  c.rising = static_cast<double>(
                 std::count_if(steps.begin(), steps.end(), [](double d) { return d > 0.0; })) /
             n;
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  c.interval = sorted[sorted.size() / 2];
  c.evenness =
      static_cast<double>(std::count_if(
          steps.begin(), steps.end(),
          [&](double d) { return std::abs(d - c.interval) <= 0.1 * std::abs(c.interval); })) /
      n;
  return c;
}

/// @return the column that holds the time. @throws InputError where none rises
ClockCandidate find_clock(const RawTable& table, const TimeColumnOptions& options) {
  ClockCandidate best;
  std::string named;
  for (const RawColumn& column : table.columns) {
    if (column.text) continue;
    const ClockCandidate c = clock_candidate(column);
    if (c.named && named.empty()) named = column.name;
    if (c.rising < options.rising) continue;
    const auto rank = [](const ClockCandidate& x) { return (x.named ? 2.0 : 0.0) + x.evenness; };
    if (best.column == nullptr || rank(c) > rank(best)) best = c;
  }
  if (best.column == nullptr) {
    if (!named.empty())
      throw InputError({table.file, table.header_line, 0}, named,
                       "this column is the time by its name, but its numbers do not rise from row "
                       "to row; sort the rows by their time, and give at least three");
    throw InputError({table.file, table.header_line, 0}, "time",
                     "no column rises from row to row as a time does; add a column of times, or "
                     "map one with `columns: {t_s: ...}` (docs/log_format.md)");
  }
  return best;
}

void settle_clock_unit(const ClockCandidate& c, const TimeColumnOptions& options,
                       TimedChannels* out) {
  const ChannelUnit unit = c.column->name == "t_s" ? channel_unit("t", "s")
                                                   : channel_unit(c.column->name, c.column->unit);
  const bool suffix = c.column->name.ends_with("_s");
  const std::string why =
      c.named ? "by its name"
              : fmt::format("because it rises in {:.3g} % of its steps", 100.0 * c.rising);
  if (unit.of == ChannelUnit::Of::kTime || suffix) {
    out->clock_unit = unit.of == ChannelUnit::Of::kTime ? unit.factor : 1.0;
    out->clock_reason = fmt::format("{} is the time {}; its unit is {}", c.column->name, why,
                                    unit.of == ChannelUnit::Of::kTime ? unit.word : "s");
    return;
  }
  const char* word = "s";
  if (c.interval > options.microseconds_from) {
    out->clock_unit = 1e-6, word = "us";
  } else if (c.interval > options.milliseconds_from) {
    out->clock_unit = 1e-3, word = "ms";
  }
  out->clock_reason =
      fmt::format("{} is the time {}; without a unit, steps of {:.4g} are taken for {}",
                  c.column->name, why, c.interval, word);
}

}  // namespace

TimedChannels timed_channels(const RawTable& table, const TimeColumnOptions& options) {
  TimedChannels out;
  out.recording.file = table.file;
  out.recording.format = table.dialect;
  out.recording.warnings = table.warnings;
  const ClockCandidate clock = find_clock(table, options);
  out.clock = clock.column->name;
  settle_clock_unit(clock, options, &out);
  std::vector<std::size_t> rows;
  std::vector<double> time;
  rows.reserve(table.rows());
  time.reserve(table.rows());
  const double first = [&] {
    for (const double v : clock.column->values)
      if (std::isfinite(v)) return v * out.clock_unit;
    return 0.0;
  }();
  std::size_t left_out = 0;
  for (std::size_t r = 0; r < table.rows(); ++r) {
    const double t = clock.column->values[r] * out.clock_unit - first;
    if (!std::isfinite(t) || (!time.empty() && t <= time.back())) {
      ++left_out;
      continue;
    }
    rows.push_back(r);
    time.push_back(t);
  }
  if (left_out > 0) {
    out.recording.warnings.push_back(
        fmt::format("{} {} left out: no time, or none after that of the row before", left_out,
                    left_out == 1 ? "row was" : "rows were"));
  }
  for (const RawColumn& column : table.columns) {
    if (&column == clock.column) continue;
    if (column.text) {
      out.recording.warnings.push_back(
          fmt::format("column {} left out: most of its cells are no numbers, e.g. \"{}\"",
                      column.name, column.example));
      continue;
    }
    RecordedChannel channel;
    channel.name = column.name;
    channel.unit = column.unit;
    channel.time = time;
    channel.values.reserve(rows.size());
    for (const std::size_t r : rows) channel.values.push_back(column.values[r]);
    out.recording.channels.push_back(std::move(channel));
  }
  return out;
}

TimedChannels read_timed_channels(const std::string& path, const ChannelFileOptions& options) {
  std::string bytes = read_bytes(path, options.limits.log_bytes);
  const bool mapped = !options.mapping_file.empty();
  const LogMapping mapping = mapped ? read_log_mapping(options.mapping_file) : LogMapping{};
  RawTable table;
  if (is_recording(bytes)) {
    RecordingOptions reading;
    reading.dbc_files = options.dbc_files;
    reading.dbc_files.insert(reading.dbc_files.end(), mapping.dbc.begin(), mapping.dbc.end());
    reading.limits = options.limits;
    Recording recording = read_recording(bytes, path, reading);
    if (!mapped) {
      TimedChannels out;
      out.recording = std::move(recording);
      out.clock_reason = "each channel has the time stamps of its own samples";
      return out;
    }
    ClockOptions clock;
    clock.limits = options.limits;
    clock.step = mapping.clock;
    table = on_one_clock(recording, clock);
  } else if (is_matlab(bytes, path)) {
    table = read_matlab(path, bytes, options.limits);
  } else {
    table = read_delimited(path, std::move(bytes), mapping.dialect, options.limits);
  }
  apply_mapping(mapping, &table);
  std::erase_if(table.columns, [](const RawColumn& c) { return c.mapped_from; });
  return timed_channels(table, options.time);
}

}  // namespace sparflow
