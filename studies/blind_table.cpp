#include "studies/blind_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "studies/share.h"

namespace sparflow::bench {
namespace {

using Runs = std::vector<BlindRun>;
using Pick = std::function<bool(const BlindRun&)>;

bool single(const BlindRun& r) { return r.asked.row == "clear" || r.asked.row == "small"; }
bool hidden(const BlindRun& r) { return single(r) || r.asked.row == "pairs"; }
Pick is(const char* row) {
  return [row](const BlindRun& r) { return r.asked.row == row; };
}

double median_of(std::vector<double> v) {
  if (v.empty()) return 0.0;
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

/// 95 % limits of a median, by order statistics with the normal approximation of the binomial distribution.
std::string median_limits(std::vector<double> v, double scale) {
  if (v.size() < 6) return "";
  std::sort(v.begin(), v.end());
  const auto n = static_cast<double>(v.size());
  const double half = 1.96 * 0.5 * std::sqrt(n);
  const auto at = [&](double k) {
    return scale * v[static_cast<std::size_t>(std::clamp(k, 0.0, n - 1.0))];
  };
  return fmt::format("{:.2g} .. {:.2g}", at(std::floor(0.5 * n - half)),
                     at(std::ceil(0.5 * n + half)));
}

/// A row of the table that shows a share.
struct ShareRow {
  std::string text;
  const char *least = "", *aim = "";  ///< "" for a row without a requirement
  double lowest = 0.0, highest = 1.0;
};

class Table {
 public:
  explicit Table(const Runs& runs) : runs_(runs) {}

  void share(const ShareRow& row, const Pick& of, const Pick& hit) {
    int n = 0, k = 0;
    for (const BlindRun& r : runs_) {
      if (!of(r)) continue;
      ++n;
      k += hit(r) ? 1 : 0;
    }
    share(row, k, n);
  }
  /// @param k of n runs
  void share(const ShareRow& row, int k, int n) {
    if (n == 0) return;
    const auto [lo, hi] = share_limits(k, n);
    const double p = 1.0 * k / n;
    lines_.push_back({row.text, fmt::format("{:.1f} %", 100.0 * p),
                      fmt::format("{:.0f} .. {:.0f} %", 100.0 * lo, 100.0 * hi),
                      fmt::format("{} of {}", k, n), row.least, row.aim, p,
                      p >= row.lowest && p <= row.highest});
  }
  void number(Measure m, double most) {
    m.reached = m.number <= most;
    lines_.push_back(std::move(m));
  }
  std::vector<Measure> lines() { return std::move(lines_); }

 private:
  const Runs& runs_;
  std::vector<Measure> lines_;
};

void add_set_size(const Runs& runs, Table& table) {
  std::vector<double> sizes;
  for (const BlindRun& r : runs) {
    if (single(r) && r.verdict == "missing") sizes.push_back(r.set_size);
  }
  if (sizes.empty()) return;
  double mean = 0.0, squares = 0.0;
  const auto n = static_cast<double>(sizes.size());
  for (const double s : sizes) mean += s / n;
  for (const double s : sizes) squares += (s - mean) * (s - mean);
  const double half = 1.96 * std::sqrt(squares / n / std::max(1.0, n - 1.0));
  table.number({"mean size of the reported set", fmt::format("{:.2f}", mean),
                fmt::format("{:.2f} .. {:.2f}", mean - half, mean + half),
                fmt::format("{}", sizes.size()), "<= 2", "<= 1.5", mean},
               2.0);
}

void add_parameters(const Runs& runs, Table& table) {
  std::vector<double> errors;
  int covered = 0, intervals = 0;
  for (const BlindRun& r : runs) {
    if (!single(r) || !r.top) continue;
    errors.insert(errors.end(), r.errors.begin(), r.errors.end());
    for (const bool c : r.covered) {
      covered += c ? 1 : 0;
      ++intervals;
    }
  }
  if (errors.empty()) return;
  const double median = median_of(errors);
  table.number({"parameter error, median", fmt::format("{:.1f} %", 100.0 * median),
                median_limits(errors, 100.0) + " %", fmt::format("{}", errors.size()), "<= 10 %",
                "<= 5 %", median},
               0.10);
  table.share({"95 % intervals that hold the truth", "90..98 %", "90..98 %", 0.9, 0.98}, covered,
              intervals);
}

/// Adds the geometric mean of the RMS with the named effects (if any) over the RMS with the true effects.
void add_held_out(const Runs& runs, Table& table) {
  double sum = 0.0, squares = 0.0, n = 0.0;
  for (const BlindRun& r : runs) {
    if (!hidden(r) || !std::isfinite(r.rms_ratio)) continue;
    const double l = std::log(r.rms_ratio);
    sum += l;
    squares += l * l;
    n += 1.0;
  }
  if (n < 2.0) return;
  const double mean = sum / n;
  const double half = 1.96 * std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1.0));
  table.number({"held-out RMS / with the true ids known", fmt::format("{:.3f}", std::exp(mean)),
                fmt::format("{:.3f} .. {:.3f}", std::exp(mean - half), std::exp(mean + half)),
                fmt::format("{:.0f}", n), "<= 1.05", "<= 1.02", std::exp(mean)},
               1.05);
}

/// Adds the energy error after over that before, as a ratio of sums, so that runs without an initial error do not count.
/// The requirement holds for all runs together. Runs with and without reference also have lines of their own, because
/// their initial errors differ: a model learned from a log with the effect contains a part of it already.
void add_energy(const Runs& runs, Table& table) {
  enum { kAll, kReference, kAlone };
  for (const int part : {kAll, kReference, kAlone}) {
    double before = 0.0, after = 0.0, squares = 0.0;
    std::vector<std::pair<double, double>> all;
    for (const BlindRun& r : runs) {
      if (!hidden(r) || !std::isfinite(r.energy_after)) continue;
      if (part != kAll && r.asked.reference != (part == kReference)) continue;
      before += r.energy_before;
      after += r.energy_after;
      all.emplace_back(r.energy_before, r.energy_after);
    }
    if (all.size() < 2 || !(before > 0.0)) continue;
    const double ratio = after / before;
    for (const auto& [b, a] : all) squares += (a - ratio * b) * (a - ratio * b);
    const double half = 1.96 * std::sqrt(squares) / before;  // of a ratio of sums
    const bool asked = part == kAll;
    table.number(
        {asked                ? "predicted-energy error after / before"
         : part == kReference ? "  of them with a reference"
                              : "  of them from one log alone",
         fmt::format("{:.2f}", ratio),
         fmt::format("{:.2f} .. {:.2f}", std::max(0.0, ratio - half), ratio + half),
         fmt::format("{}", all.size()), asked ? "<= 0.5" : "", asked ? "<= 0.3" : "", ratio},
        asked ? 0.5 : 1e300);
  }
}

}  // namespace

std::vector<Measure> blind_table(const Runs& runs, double seconds) {
  Table t(runs);
  const auto good = [](const BlindRun& r) { return r.good(); };
  t.share({"false alarm, nothing missing", "<= 5 %", "<= 3 %", 0.0, 0.05}, is("none"),
          [](const BlindRun& r) { return r.verdict != "none"; });
  t.share({"top-1 id and place, clear effect", ">= 97 %", ">= 99 %", 0.97}, is("clear"), good);
  t.share({"top-1, small effect (one third)", ">= 90 %", ">= 95 %", 0.9}, is("small"), good);
  t.share({"true effect in the reported set", ">= 98 %", ">= 99 %", 0.98}, single,
          [](const BlindRun& r) { return r.in_set; });
  add_set_size(runs, t);
  t.share({"outside the catalogue -> unknown", ">= 90 %", ">= 95 %", 0.9}, is("outside"), good);
  t.share({"pairs: both found and nothing else", ">= 85 %", ">= 95 %", 0.85}, is("pairs"), good);
  t.share({"broken sensor set aside, nothing named"}, is("fault"), good);
  add_parameters(runs, t);
  add_held_out(runs, t);
  add_energy(runs, t);
  t.share(
      {"held-out made worse by what was added", "<= 2 %", "0", 0.0, 0.02},
      [](const BlindRun& r) { return r.changed; }, [](const BlindRun& r) { return r.made_worse; });
  if (std::isfinite(seconds)) {
    t.number({"diagnosis of 15 000 rows, wall time", fmt::format("{:.1f} s", seconds), "", "",
              "<= 60 s", "<= 20 s", seconds},
             60.0);
  }
  return t.lines();
}

std::string table_text(const std::vector<Measure>& table, const std::string& judge) {
  std::string text = judge == "ours" ? "" : "judged by " + judge + "\n";
  text += fmt::format("  {:44s} {:>8s}  {:>15s}  {:>10s}  {:>9s}  {:>9s}\n", "measure", "value",
                      "95 % limits", "runs", "at least", "aim");
  for (const Measure& m : table) {
    text += fmt::format("{} {:44s} {:>8s}  {:>15s}  {:>10s}  {:>9s}  {:>9s}\n",
                        m.reached ? " " : "!", m.text, m.value, m.limits, m.runs, m.least, m.aim);
  }
  return text;
}

std::string run_line(const BlindRun& r) {
  const char* way = r.asked.reference ? "reference" : "alone";
  if (!r.left_out.empty()) {
    return fmt::format("  {:8s} {:9s} {:5d} left out: {}\n", r.asked.row, way, r.asked.seed,
                       r.left_out);
  }
  std::string judged;
  if (std::isfinite(r.rms_ratio)) judged += fmt::format(" rms {:.3f}", r.rms_ratio);
  if (std::isfinite(r.energy_after))
    judged +=
        fmt::format(" energy {:.1f} -> {:.1f} %", 100.0 * r.energy_before, 100.0 * r.energy_after);
  if (r.made_worse) judged += " WORSE: " + r.worse_by;
  return fmt::format("{} {:8s} {:9s} {:5d} {:24s} {:60s} -> {}{}{}{}\n",
                     r.good() || r.asked.judge == "gp" ? " " : "X", r.asked.row, way, r.asked.seed,
                     r.machine, r.truth, r.asked.judge == "ours" ? "" : r.asked.judge + ": ",
                     r.verdict == "missing" ? "" : r.verdict + " ", r.answer, judged);
}

std::string coverage_text(const Runs& runs) {
  std::map<std::string, std::array<int, 2>> by;
  std::map<std::string, std::vector<double>> errors;
  for (const BlindRun& r : runs) {
    for (std::size_t k = 0; k < r.covered.size(); ++k) {
      ++by[r.parameters[k]][1];
      by[r.parameters[k]][0] += r.covered[k] ? 1 : 0;
      errors[r.parameters[k]].push_back(r.errors[k]);
    }
  }
  std::string text = "95 % intervals that contain the true value, and median error, by parameter\n";
  for (const auto& [name, count] : by) {
    text += fmt::format("  {:40s} {:3d} of {:3d}   {:5.1f} %\n", name, count[0], count[1],
                        100.0 * median_of(errors[name]));
  }
  return by.empty() ? "" : text;
}

std::string absorbed_text(const Runs& runs) {
  std::map<std::string, std::vector<double>> shares;
  for (const BlindRun& r : runs) {
    for (const auto& s : r.absorbed) shares[s.stage].push_back(s.share);
  }
  std::string text =
      "fitting again instead of diagnosing: share of the added error that is absorbed, median\n";
  for (const auto& [stage, all] : shares) {
    text +=
        fmt::format("  {:44s} {:5.1f} %  ({} runs)\n", stage, 100.0 * median_of(all), all.size());
  }
  return text;
}

nlohmann::json run_json(const BlindRun& r) {
  nlohmann::json named = nlohmann::json::array();
  for (const NamedEffect& n : r.named) {
    named.push_back(
        {{"effect", n.key}, {"size", n.size}, {"over_form", n.over_form}, {"gain", n.gain}});
  }
  const auto number = [](double v) {
    return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json();
  };
  return {{"row", r.asked.row},
          {"by", r.asked.judge},
          {"reference", r.asked.reference},
          {"seed", r.asked.seed},
          {"machine", r.machine},
          {"left_out", r.left_out},
          {"truth", r.truth},
          {"answer", r.answer},
          {"verdict", r.verdict},
          {"good", r.good()},
          {"exact", r.exact},
          {"in_set", r.in_set},
          {"set_size", r.set_size},
          {"named", named},
          {"said", said_json(r.said)},
          {"seconds", r.seconds},
          {"rows", r.rows},
          {"parameters", r.parameters},
          {"errors", r.errors},
          {"covered", r.covered},
          {"rms_ratio", number(r.rms_ratio)},
          {"energy_before", number(r.energy_before)},
          {"energy_after", number(r.energy_after)},
          {"made_worse", r.made_worse},
          {"worse_by", r.worse_by}};
}

nlohmann::json table_json(const std::vector<Measure>& table, const std::string& judge) {
  nlohmann::json out = nlohmann::json::array();
  for (const Measure& m : table) {
    out.push_back({{"by", judge},
                   {"measure", m.text},
                   {"number", m.number},
                   {"value", m.value},
                   {"limits95", m.limits},
                   {"runs", m.runs},
                   {"at_least", m.least},
                   {"aim", m.aim},
                   {"reached", m.reached}});
  }
  return out;
}

}  // namespace sparflow::bench
