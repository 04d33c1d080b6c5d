#include "identification/log/one_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "models/math/error.h"
#include "models/math/nan.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

/// A channel that has a rate.
struct Timed {
  const RecordedChannel* channel = nullptr;
  double step = 0.0;        ///< [s] median interval
  std::size_t stamps = 0;   ///< channels with equal numbers have equal time stamps
  bool leading = false;     ///< the clock follows it
  bool has_values = false;  ///< at least one is finite
};

/// Median of the intervals between different stamps [s]; 0 where there are none, negative where time decreases.
double median_interval(const std::vector<double>& time) {
  std::vector<double> intervals;
  intervals.reserve(time.size());
  for (std::size_t i = 1; i < time.size(); ++i) {
    const double interval = time[i] - time[i - 1];
    if (!(interval >= 0.0) || !std::isfinite(interval)) return -1.0;
    if (interval > 0.0) intervals.push_back(interval);
  }
  if (intervals.empty()) return 0.0;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

/// Channels in intervals of time that have samples at both ends.
struct Stretch {
  double begin, end;  ///< [s]
};

class OneClock {
 public:
  OneClock(const Recording& recording, const ClockOptions& options)
      : recording_(recording), options_(options) {}

  RawTable table() {
    table_.file = recording_.file;
    table_.warnings = recording_.warnings;
    find_channels();
    const std::vector<double> clock = choose_clock();
    require_room(static_cast<double>(clock.size()));
    if (clock.size() < 2)
      fail("the clock has fewer than two instants; expected a longer recording");
    table_.columns.reserve(timed_.size() + 1);
    RawColumn time;
    time.name = "t_s";
    time.values = clock;
    table_.columns.push_back(std::move(time));
    for (const Timed& timed : timed_) add_column(timed, clock);
    table_.dialect = fmt::format("{}; {}", recording_.format, words_);
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw InputError({recording_.file, 0, 0}, "", message);
  }

  void require_room(double rows) const {
    const double values = rows * static_cast<double>(timed_.size() + 1);
    if (values <= static_cast<double>(options_.limits.log_values)) return;
    fail(
        fmt::format("{:.3g} instants of {} channels are more than the {:.3g} values of a log "
                    "(docs/limits.md); cut the recording into shorter files",
                    rows, timed_.size(), static_cast<double>(options_.limits.log_values)));
  }

  void leave_out(const std::vector<std::string>& names, const char* why) {
    if (names.empty()) return;
    std::string list;
    for (const std::string& name : names) {
      if (list.size() > 200) {
        list += ", ...";
        break;
      }
      list += (list.empty() ? "" : ", ") + printable(name);
    }
    table_.warnings.push_back(fmt::format("{} {} left out: {} ({})", names.size(),
                                          names.size() == 1 ? "channel is" : "channels are", why,
                                          list));
  }

  void find_channels() {
    std::vector<std::string> single, backwards;
    const auto& channels = recording_.channels;
    if (channels.size() > static_cast<std::size_t>(options_.limits.log_columns)) {
      fail(fmt::format("{} channels, more than the {} columns of a log (docs/limits.md)",
                       channels.size(), options_.limits.log_columns));
    }
    std::vector<std::size_t> known;  // channels whose stamps are those of no channel before
    const std::set<std::size_t> leading(options_.leading.begin(), options_.leading.end());
    for (std::size_t i = 0; i < channels.size(); ++i) {
      Timed timed;
      timed.channel = &channels[i];
      const std::vector<double>& time = timed.channel->time;
      const auto same = std::find_if(known.begin(), known.end(), [&](std::size_t k) {
        return timed_[k].channel->time == time;
      });
      timed.step = same == known.end() ? median_interval(time) : timed_[*same].step;
      if (!(timed.step > 0.0)) {
        (timed.step < 0.0 ? backwards : single).push_back(timed.channel->name);
        continue;
      }
      timed.stamps = same == known.end() ? timed_.size() : *same;
      if (same == known.end()) known.push_back(timed_.size());
      timed.has_values = std::any_of(timed.channel->values.begin(), timed.channel->values.end(),
                                     [](double v) { return std::isfinite(v); });
      timed.leading = timed.has_values && (leading.empty() || leading.count(i) > 0);
      timed_.push_back(timed);
    }
    leave_out(single, "fewer than two instants");
    leave_out(backwards, "their time decreases");
    if (std::none_of(timed_.begin(), timed_.end(), [](const Timed& t) { return t.leading; })) {
      for (Timed& timed : timed_) timed.leading = timed.has_values;
    }
    if (std::none_of(timed_.begin(), timed_.end(), [](const Timed& t) { return t.leading; })) {
      fail("no channel has values at two instants; expected a recording of a motion");
    }
  }

  /// The median of the fastest channels' steps [s].
  double fastest_step() const {
    std::vector<double> steps;
    for (const Timed& timed : timed_) {
      if (timed.leading) steps.push_back(timed.step);
    }
    std::sort(steps.begin(), steps.end());
    const auto fastest =
        static_cast<std::size_t>(std::ceil(options_.fastest * static_cast<double>(steps.size())));
    return steps[(std::max<std::size_t>(fastest, 1) - 1) / 2];
  }

  std::vector<double> choose_clock() {
    const double fastest = fastest_step();
    if (options_.step <= 0.0) {
      std::vector<std::size_t> count(timed_.size());
      std::size_t leading = 0;
      for (const Timed& timed : timed_) {
        if (!timed.leading) continue;
        ++leading;
        ++count[timed.stamps];
      }
      const auto most = std::max_element(count.begin(), count.end());
      const Timed& group = timed_[static_cast<std::size_t>(most - count.begin())];
      if (static_cast<double>(*most) >= options_.dominating * static_cast<double>(leading) &&
          group.step <= options_.same_rate * fastest) {
        return stamps_of(group, *most);
      }
    }
    double step = options_.step;
    if (step <= 0.0) {
      // Three digits say all that a median of jittering stamps does.
      const double unit = std::pow(10.0, std::floor(std::log10(fastest)) - 2.0);
      step = std::max(options_.finest_step, unit * std::round(fastest / unit));
    }
    words_ = fmt::format("one clock for all channels, a row every {:.3g} s", step);
    return grid(step, options_.same_rate * fastest);
  }

  std::vector<double> stamps_of(const Timed& group, std::size_t count) {
    std::vector<double> clock;
    clock.reserve(group.channel->time.size());
    for (const double t : group.channel->time) {
      if (clock.empty() || t > clock.back()) clock.push_back(t);
    }
    words_ = fmt::format("the time stamps of {} channels ({}), every {:.3g} s", count,
                         group.channel->group.empty() ? group.channel->name : group.channel->group,
                         group.step);
    return clock;
  }

  /// Where a leading channel no slower than `slowest` [s] has values, in order and apart from each other.
  std::vector<Stretch> stretches(double slowest) const {
    std::vector<Stretch> all;
    std::set<std::size_t> seen;
    for (const Timed& timed : timed_) {
      if (!timed.leading || timed.step > slowest || !seen.insert(timed.stamps).second) continue;
      const std::vector<double>& time = timed.channel->time;
      const double gap = options_.gap_steps * timed.step;
      Stretch stretch = {time.front(), time.front()};
      for (const double t : time) {
        if (t - stretch.end > gap) {
          all.push_back(stretch);
          stretch.begin = t;
        }
        stretch.end = t;
      }
      all.push_back(stretch);
    }
    std::sort(all.begin(), all.end(),
              [](const Stretch& a, const Stretch& b) { return a.begin < b.begin; });
    std::vector<Stretch> merged;
    for (const Stretch& stretch : all) {
      if (!merged.empty() && stretch.begin <= merged.back().end) {
        merged.back().end = std::max(merged.back().end, stretch.end);
      } else {
        merged.push_back(stretch);
      }
    }
    return merged;
  }

  std::vector<double> grid(double step, double slowest) const {
    const std::vector<Stretch> parts = stretches(slowest);
    const double start = parts.front().begin;
    const double slack = tolerance(step);
    double rows = 0.0;
    for (const Stretch& part : parts) rows += std::floor((part.end - part.begin) / step) + 1.0;
    require_room(rows);
    std::vector<double> clock;
    clock.reserve(static_cast<std::size_t>(rows));
    for (const Stretch& part : parts) {
      const double last = std::floor((part.end + slack - start) / step);
      for (double k = std::ceil((part.begin - slack - start) / step); k <= last; k += 1.0) {
        const double t = start + k * step;
        if (!clock.empty() && t <= clock.back()) {
          // Beyond the digits of a double the grid stands still.
          if (k + 1.0 == k || t + step == t) return clock;
          continue;
        }
        clock.push_back(t);
      }
    }
    return clock;
  }

  /// Instants that differ by less than this share of a step are one: sums of steps are rounded.
  static double tolerance(double step) { return 1e-6 * step; }

  bool has_states(const std::vector<double>& values) const {
    std::set<double> states;
    for (const double v : values) {
      if (std::isnan(v)) continue;
      if (v != std::round(v)) return false;
      states.insert(v);
      if (states.size() > options_.most_states) return false;
    }
    return true;
  }

  void add_column(const Timed& timed, const std::vector<double>& clock) {
    const std::vector<double>& time = timed.channel->time;
    const std::vector<double>& values = timed.channel->values;
    const double gap = options_.gap_steps * timed.step, slack = tolerance(timed.step);
    const bool held = has_states(values);
    RawColumn column;
    column.name = timed.channel->name;
    // The column of time is the clock.
    if (column.name == "t_s") column.name = timed.channel->group + ".t_s";
    column.unit = timed.channel->unit;
    column.values.reserve(clock.size());
    std::size_t next = 0;  // the first sample behind the instant
    for (const double t : clock) {
      while (next < time.size() && time[next] <= t + slack) ++next;
      double value = kNaN;
      if (next > 0 && t - time[next - 1] <= slack) {
        value = values[next - 1];
      } else if (next > 0 && next < time.size() && time[next] - time[next - 1] <= gap) {
        const double a = values[next - 1], b = values[next];
        const double part = (t - time[next - 1]) / (time[next] - time[next - 1]);
        value = held && !std::isnan(b) ? a : a + part * (b - a);
      }
      column.values.push_back(value);
    }
    table_.columns.push_back(std::move(column));
  }

  const Recording& recording_;
  const ClockOptions& options_;
  RawTable table_;
  std::vector<Timed> timed_;
  std::string words_;
};

}  // namespace

RawTable on_one_clock(const Recording& recording, const ClockOptions& options) {
  return OneClock(recording, options).table();
}

}  // namespace sparflow
