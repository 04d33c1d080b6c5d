#include "identification/log/log_time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

// [s] A crane's motion lasts seconds, so slower sampling cannot show it; no logger is faster than 1 MHz.
constexpr double kSlowestStep = 2.0;
constexpr double kFastestStep = 1e-6;

bool rows_equal(const RawTable& table, std::size_t a, std::size_t b) {
  return std::all_of(table.columns.begin(), table.columns.end(), [&](const RawColumn& column) {
    const double x = column.values[a], y = column.values[b];
    return x == y || (std::isnan(x) && std::isnan(y));
  });
}

void refuse_odd_steps(const RawTable& table, const std::string& column,
                      const std::vector<double>& time, const std::vector<std::size_t>& rows) {
  Eigen::VectorXd kept(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) kept[static_cast<Eigen::Index>(i)] = time[rows[i]];
  const double step = median_step(kept);
  if (step > kSlowestStep) {
    throw InputError(table.place(rows[1]), column,
                     fmt::format("the samples are {:.4g} s apart, too slow to see a motion; if the "
                                 "numbers are milliseconds, name the column t_ms",
                                 step));
  }
  if (step < kFastestStep) {
    throw InputError(
        table.place(rows[1]), column,
        fmt::format("the samples are {:.3g} s apart; if the numbers are days or hours, "
                    "convert them in a mapping file, e.g. t_s: \"Time * 86400\"",
                    step));
  }
}

}  // namespace

std::vector<std::size_t> rows_in_time(const RawTable& table, const std::string& column,
                                      const std::vector<double>& time, LogCounts* counts,
                                      std::vector<std::string>* warnings) {
  std::vector<std::size_t> rows;
  rows.reserve(time.size());
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (std::isnan(time[i])) {
      ++counts->rows_without_time;
      continue;
    }
    if (!rows.empty()) {
      const double last = time[rows.back()];
      if (time[i] < last) {
        throw InputError(
            table.place(i), column,
            fmt::format("time goes back from {:.10g} to {:.10g} s{}; {}", last, time[i],
                        table.lines.empty() ? fmt::format(" in row {}", i + 1) : "",
                        time[i] - time[rows.front()] < 0.1 * (last - time[rows.front()])
                            ? "two logs in one file? Cut it here"
                            : "sort the rows, or cut the log here"));
      }
      if (time[i] == last) {
        ++(rows_equal(table, i, rows.back()) ? counts->rows_repeated : counts->rows_same_time);
        continue;
      }
    }
    rows.push_back(i);
  }
  if (rows.size() < 2) {
    throw InputError({table.file, table.header_line, 0}, column,
                     fmt::format("{} {} with a distinct time, expected at least two", rows.size(),
                                 rows.size() == 1 ? "row" : "rows"));
  }
  refuse_odd_steps(table, column, time, rows);
  if (counts->rows_without_time > 0) {
    warnings->push_back(
        fmt::format("{} rows left out: {} is missing", counts->rows_without_time, column));
  }
  if (counts->rows_repeated > 0) {
    warnings->push_back(
        fmt::format("{} rows left out: repetitions of the row before", counts->rows_repeated));
  }
  if (counts->rows_same_time > 0) {
    const double share =
        static_cast<double>(counts->rows_same_time) / static_cast<double>(time.size());
    warnings->push_back(fmt::format("{} rows left out ({:.2g} %): same {} as the row before{}",
                                    counts->rows_same_time, 100.0 * share, column,
                                    share > 0.05 ? "; write the time with more digits" : ""));
  }
  return rows;
}

double median_step(const Eigen::VectorXd& time) {
  if (time.size() < 2) return 0.0;
  std::vector<double> steps(static_cast<std::size_t>(time.size() - 1));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    steps[i] = time[k + 1] - time[k];
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

std::vector<SampleRange> thinning(const Eigen::VectorXd& time, double step,
                                  const std::vector<SampleRange>& runs, const LogOptions& options) {
  if (!(2.0 * step <= options.finest_step * (1.0 + 1e-9))) return {};
  std::vector<SampleRange> groups;
  const double width =
      options.finest_step - 0.5 * step;  // half a step keeps rounding out of the count
  for (const SampleRange& run : runs) {
    Eigen::Index begin = run.begin;
    for (Eigen::Index i = run.begin + 1; i <= run.end; ++i) {
      if (i < run.end && time[i] - time[begin] < width) continue;
      groups.push_back({begin, i});
      begin = i;
    }
  }
  return groups;
}

std::vector<SampleRange> runs_between_gaps(const Eigen::VectorXd& time, double step,
                                           const LogOptions& options) {
  const double gap = std::max(options.gap_steps * step, options.gap_s);
  std::vector<SampleRange> runs;
  Eigen::Index begin = 0;
  for (Eigen::Index i = 1; i <= time.size(); ++i) {
    if (i == time.size() || time[i] - time[i - 1] > gap) {
      runs.push_back({begin, i});
      begin = i;
    }
  }
  return runs;
}

std::int64_t fill_holes(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                        const LogOptions& options, Channel* channel) {
  const bool slow = channel->role == Role::kPayload || channel->role == Role::kOilTemperature;
  const std::vector<SampleRange> whole = {{0, time.size()}};
  Eigen::VectorXd& v = channel->values;
  std::int64_t filled = 0;
  for (const SampleRange& run : slow ? whole : runs) {
    Eigen::Index last = -1;  // valid sample before the hole
    for (Eigen::Index i = run.begin; i <= run.end; ++i) {
      if (i < run.end && std::isnan(v[i])) continue;
      const Eigen::Index hole_begin = last < 0 ? run.begin : last + 1;
      if (i > hole_begin) {
        const bool inside = last >= 0 && i < run.end;
        const bool brief = inside && (i - hole_begin <= options.hole_samples ||
                                      time[i] - time[last] <= options.hole_s);
        if (brief || (slow && (last >= 0 || i < run.end))) {
          for (Eigen::Index k = hole_begin; k < i; ++k) {
            const double share = inside ? (time[k] - time[last]) / (time[i] - time[last]) : 0.0;
            v[k] = !inside ? v[last >= 0 ? last : i] : (1.0 - share) * v[last] + share * v[i];
          }
          filled += i - hole_begin;
        }
      }
      last = i;
    }
  }
  channel->valid = v.array().isFinite();
  return filled;
}

}  // namespace sparflow
