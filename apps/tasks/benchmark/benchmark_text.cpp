#include "apps/tasks/benchmark/benchmark_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "models/math/units.h"

namespace sparflow {
namespace {

using benchmark::ControllerSummary;
using benchmark::Estimate;
using benchmark::Row;
using nlohmann::ordered_json;

std::string cell(double value, const char* form) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(form), value) : "-";
}

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json estimate_json(const Estimate& e) {
  return {{"median", number(e.median)},
          {"ci95", {number(e.lower), number(e.upper)}},
          {"scenarios", e.n}};
}

ordered_json summary_json(const ControllerSummary& s) {
  ordered_json j;
  j["controller"] = s.controller;
  j["runs"] = s.runs;
  j["failed"] = s.failed;
  j["energy_J"] = number(s.energy);
  j["pump_work_J"] = number(s.pump_work);
  j["time_s"] = number(s.time);
  j["tip_error_path_m"] = number(s.tip_path);
  j["tip_error_end_m"] = number(s.tip_end);
  j["sway_rad"] = number(s.sway);
  j["peak_pressure_bar"] = number(s.peak_pressure / units::kBar);
  j["roughness_1_s"] = number(s.roughness);
  j["step_median_s"] = number(s.step_median);
  j["step_worst_s"] = number(s.step_worst);
  j["runs_breaking_limits"] = s.runs_breaking_limits;
  j["mean_rank"] = number(s.rank);
  j["energy_above_reference"] = estimate_json(s.against);
  j["time_above_reference_s"] = estimate_json(s.later);
  j["tip_error_path_above_reference_m"] = estimate_json(s.path_above);
  j["tip_error_end_above_reference_m"] = estimate_json(s.end_above);
  j["share_dearer_than_reference"] = number(s.dearer);
  j["energy_above_predicted_optimum"] = estimate_json(s.above_promise);
  j["energy_above_bound"] = estimate_json(s.above_bound);
  return j;
}

const ControllerSummary* find(const BenchmarkResult& r, const std::string& name) {
  for (const ControllerSummary& s : r.summary)
    if (s.controller == name) return &s;
  return nullptr;
}

int failures(const BenchmarkResult& r) {
  int count = 0;
  for (const Row& row : r.rows) count += row.done ? 0 : 1;
  return count;
}

std::string headline(const BenchmarkResult& r) {
  const ControllerSummary* best = nullptr;
  for (const ControllerSummary& s : r.summary)
    if (std::isfinite(s.rank) && s.failed < s.runs && (best == nullptr || s.rank < best->rank))
      best = &s;
  if (best == nullptr) return "No run was done";
  return fmt::format("Least energy: {} (mean rank {:.2f} of {})", best->controller, best->rank,
                     r.controllers.size());
}

/// Energy of the reference in a scenario at a seed. [J] NaN: none
double reference_energy(const BenchmarkResult& r, const Row& row) {
  for (const Row& other : r.rows)
    if (other.controller == r.reference && other.scenario == row.scenario &&
        other.seed == row.seed && other.done)
      return other.energy;
  return std::nan("");
}

Eigen::VectorXd vector_of(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

BenchmarkedRun run_view(const Row& row) {
  BenchmarkedRun run;
  run.controller = row.controller;
  const auto n = static_cast<Eigen::Index>(row.trace.t.size());
  run.t = vector_of(row.trace.t);
  run.power_kW = 1e-3 * vector_of(row.trace.power);
  run.loss_kW = 1e-3 * vector_of(row.trace.loss);
  run.motion.t = run.t;
  if (n > 0) {
    const auto joints = static_cast<Eigen::Index>(row.trace.q.front().size());
    run.motion.q.resize(n, joints);
    for (Eigen::Index i = 0; i < n; ++i)
      run.motion.q.row(i) = vector_of(row.trace.q[static_cast<std::size_t>(i)]).transpose();
    run.motion.qd = run.motion.qdd = Eigen::MatrixXd::Zero(n, joints);
  }
  using plant::Loss;
  const auto throttles = [](std::size_t k) {
    const auto place = static_cast<Loss>(k);
    return place == Loss::kMeterIn || place == Loss::kMeterOut || place == Loss::kCounterbalance ||
           place == Loss::kLine || place == Loss::kAntiCavitation || place == Loss::kPortRelief;
  };
  run.went = {{"gained in height", "", row.useful / 1e3}};
  for (std::size_t k = 0; k < row.loss.size(); ++k)
    run.went.push_back({plant::kLossWords[k], throttles(k) ? "throttled" : "friction and leakage",
                        row.loss[k] / 1e3});
  run.went.push_back({"return line", "throttled", row.tank_loss / 1e3});
  run.went.push_back({"pump leakage, relief", "friction and leakage", row.pump_loss / 1e3});
  run.went.push_back({"swing and bending", "friction and leakage", row.swing_loss / 1e3});
  return run;
}

/// The first scenario that most controllers have done is shown in detail, at its first seed.
void add_detail(const BenchmarkResult& r, BenchmarkView& view) {
  std::size_t most = 0;
  for (const benchmark::Scenario& s : r.scenarios) {
    std::vector<const Row*> rows;
    for (const Row& row : r.rows)
      if (row.scenario == s.id && row.seed == s.seeds.front() && row.trace.t.size() > 1)
        rows.push_back(&row);
    std::size_t done = 0;
    for (const Row* row : rows) done += row->done ? 1 : 0;
    if (done <= most) continue;
    most = done;
    view.shown = s.id;
    view.machine = s.machine;
    view.runs.clear();
    for (const Row* row : rows) view.runs.push_back(run_view(*row));
  }
}

}  // namespace

bool BenchmarkResult::any_done() const {
  return std::any_of(rows.begin(), rows.end(), [](const Row& r) { return r.done; });
}

std::string benchmark_headline(const BenchmarkResult& r) { return headline(r); }

std::string benchmark_table(const BenchmarkResult& r) {
  std::string text = fmt::format(
      "{} scenarios, {} controllers, {} runs, {} of them failed\n\n{:<22} {:>9} {:>5} {:>8} "
      "{:>22} {:>8} {:>7} {:>7} {:>7} {:>6}\n",
      r.scenarios.size(), r.controllers.size(), r.rows.size(), failures(r), "controller", "done",
      "rank", "energy", "above the reference", "optimum", "time", "path", "end", "sway");
  text += fmt::format("{:<22} {:>9} {:>5} {:>8} {:>22} {:>8} {:>7} {:>7} {:>7} {:>6}\n", "", "", "",
                      "kJ", "% [95 % interval]", "+%", "s", "mm", "mm", "deg");
  for (const ControllerSummary& s : r.summary) {
    const Estimate& a = s.against;
    const std::string above = s.controller == r.reference ? "reference"
                              : std::isfinite(a.lower)
                                  ? fmt::format("{:+.1f} [{:+.1f}, {:+.1f}]", 100.0 * a.median,
                                                100.0 * a.lower, 100.0 * a.upper)
                                  : cell(100.0 * a.median, "{:+.1f}");
    text += fmt::format("{:<22} {:>9} {:>5} {:>8} {:>22} {:>8} {:>7} {:>7} {:>7} {:>6}\n",
                        s.controller, fmt::format("{}/{}", s.runs - s.failed, s.runs),
                        cell(s.rank, "{:.2f}"), cell(s.energy / 1e3, "{:.2f}"), above,
                        cell(100.0 * s.above_promise.median, "{:+.1f}"), cell(s.time, "{:.1f}"),
                        cell(1e3 * s.tip_path, "{:.0f}"), cell(1e3 * s.tip_end, "{:.0f}"),
                        cell(s.sway / units::kDegree, "{:.1f}"));
  }
  text += fmt::format(
      "\nMedians; energy is the pumps' pressure times their flow into the valves; the reference is "
      "{};\noptimum: above what the model predicts for the energy-optimal motion in the same "
      "time.\n",
      r.reference.empty() ? "missing" : r.reference);
  constexpr int kListed = 8;  // no threshold: the table stays on one screen
  int listed = 0;
  for (const Row& row : r.rows) {
    if (row.done || ++listed > kListed) continue;
    text += fmt::format("failed: {}, {}, seed {}: {}\n", row.scenario, row.controller, row.seed,
                        row.reason);
  }
  if (listed > kListed)
    text += fmt::format("and {} more; --json, --csv and --report have all\n", listed - kListed);
  return text + headline(r) + "\n";
}

std::string benchmark_json(const BenchmarkResult& r) {
  ordered_json j;
  j["interrupted"] = r.interrupted;
  j["headline"] = headline(r);
  j["reference"] = r.reference;
  for (const ControllerSummary& s : r.summary) j["summary"].push_back(summary_json(s));
  for (const benchmark::Scenario& s : r.scenarios) {
    ordered_json one = {
        {"id", s.id}, {"file", s.file}, {"set", s.set}, {"machine", s.machine.name}};
    double duration = 0.0;
    for (const benchmark::ScenarioGoal& g : s.goals) duration += g.duration;
    one["duration_s"] = duration;
    const auto promise = r.promises.find(s.id);
    const bool known = promise != r.promises.end();
    one["predicted_optimum_J"] = known ? number(promise->second.energy) : ordered_json(nullptr);
    one["bound_J"] = known ? number(promise->second.bound) : ordered_json(nullptr);
    const auto why = r.no_promise.find(s.id);
    one["message"] = why == r.no_promise.end() ? "" : why->second;
    j["scenarios"].push_back(one);
  }
  for (const Row& row : r.rows) j["rows"].push_back(ordered_json::parse(benchmark::row_json(row)));
  return j.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string benchmark_csv(const BenchmarkResult& r) {
  std::string text = benchmark::csv_head();
  for (const Row& row : r.rows) text += benchmark::row_csv(row);
  return text;
}

BenchmarkView benchmark_view(const BenchmarkResult& r) {
  BenchmarkView view;
  view.headline = headline(r);
  view.text = fmt::format("{} scenarios, {} runs, {} of them failed.", r.scenarios.size(),
                          r.rows.size(), failures(r));
  if (r.interrupted) view.banner = "Interrupted: runs that were not finished count as failed.";
  view.reference = r.reference;
  for (std::size_t k = 0; k < r.controllers.size(); ++k) {
    const ControllerSummary* s = find(r, r.controllers[k]);
    if (s == nullptr) continue;
    BenchmarkedController c;
    c.name = s->controller;
    c.words = r.words[k];
    c.runs = s->runs;
    c.failed = s->failed;
    c.rank = s->rank;
    c.energy_kJ = s->energy / 1e3;
    c.time_s = s->time;
    c.tip_path_mm = 1e3 * s->tip_path;
    c.tip_end_mm = 1e3 * s->tip_end;
    c.sway_deg = s->sway / units::kDegree;
    c.roughness = s->roughness;
    c.limits = s->runs_breaking_limits;
    c.step_median_ms = 1e3 * s->step_median;
    c.step_worst_ms = 1e3 * s->step_worst;
    c.above = 100.0 * s->against.median;
    c.above_lower = 100.0 * s->against.lower;
    c.above_upper = 100.0 * s->against.upper;
    c.pairs = s->against.n;
    c.dearer = 100.0 * s->dearer;
    c.above_promise = 100.0 * s->above_promise.median;
    c.above_bound = 100.0 * s->above_bound.median;
    std::vector<double> energy, time, reference;
    for (const Row& row : r.rows) {
      if (row.controller != c.name || !row.done) continue;
      energy.push_back(row.energy / 1e3);
      time.push_back(row.time);
      reference.push_back(reference_energy(r, row) / 1e3);
    }
    c.scenario_energy = vector_of(energy);
    c.scenario_time = vector_of(time);
    c.reference_energy = vector_of(reference);
    view.controllers.push_back(std::move(c));
  }
  for (const Row& row : r.rows)
    if (!row.done)
      view.failures.push_back({row.scenario, row.controller, std::to_string(row.seed), row.reason});
  add_detail(r, view);
  return view;
}

}  // namespace sparflow
