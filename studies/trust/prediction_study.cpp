// Where the difference between the energy that a model predicts of its optima and the true energy of tracking them comes
// from, scenario by scenario, with any gains of the tracker. docs/benchmark.md.
//   prediction_study SCENARIO.yaml... [--model MODEL.json] [--controller NAME] [--gains 1.4:0.1:0.2,...] [--sway DEG] [--quiet]
//       [--ramp S] [--smoothing S] [--plans FOLDER] [--trace FOLDER] [--logs FOLDER]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <sstream>

#include "apps/tasks/benchmark/learned_run.h"
#include "bench/program_options.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "models/math/nan.h"
#include "models/math/units.h"
#include "problems/bundled.h"
#include "simulator/benchmark/scenario_file.h"
#include "simulator/controllers/joint_tracker.h"
#include "simulator/controllers/registry.h"
#include "simulator/sensors/log_writer.h"

namespace sparflow::bench {
namespace {

struct Arguments {
  std::vector<std::string> scenarios, gains;
  std::string model, controller = "tracked_optimum";
  std::string plans, trace, logs;  // folders; empty: none
  double sway = 0.0, ramp = OptimalMotionOptions{}.ramp,
         smoothing = OptimalMotionOptions{}.smoothing;
  bool quiet = false;
};

/// A scenario with its model and the energy-optimal motions by it.
struct Planned {
  benchmark::Scenario scenario;
  CraneModel model;
  OptimalMotions motions;
};

/// The plant's true values of a run.
struct Driven {
  std::vector<plant::Record> records;
  std::vector<double> energy;  // [J] of the pumps so far
};

/// True less predicted energy = tracking + law, where tracking = driven - predicted, law = measured - driven = flow +
/// pressure up to sampling. [J]
struct Split {
  double predicted = 0.0, measured = 0.0;
  double driven = 0.0;  // the model's energy of the motion as driven
  double late = 0.0;    // true energy after the planned end
  double flow = 0.0;    // law: the pumps' flow less the model's, times the mean pressure
  double pressure = 0.0;
  double starts = 0.0;  // law: the part within half a second after a cylinder begins to take oil
  int count = 0;        // of such starts
  double sway = 0.0;    // [rad]
};

/// Flow below which a valve counts as closed.
constexpr double kClosed = 1e-9;  // [m^3/s]
constexpr double kStart = 0.5;    // [s] that a start lasts

/// Acceleration of the joints from their true speeds.
Eigen::VectorXd acceleration(const std::vector<plant::Record>& r, std::size_t k) {
  const std::size_t a = k > 0 ? k - 1 : k, b = std::min(k + 1, r.size() - 1);
  const auto n = static_cast<Eigen::Index>(r[k].qd.size());
  return (Eigen::Map<const Eigen::VectorXd>(r[b].qd.data(), n) -
          Eigen::Map<const Eigen::VectorXd>(r[a].qd.data(), n)) /
         std::max(r[b].t - r[a].t, kClosed);
}

/// The model at a sample. A cylinder whose valve is closed rests in the model, though its rod yields with the oil.
const MachineState& modelled(Chain& chain, const Machine& m, const Driven& d, std::size_t k) {
  const plant::Record& r = d.records[k];
  std::vector<double> qd = r.qd;
  for (std::size_t c = 0; c < m.cylinders.size(); ++c)
    if (m.cylinders[c].hydraulic() && std::abs(r.flow[c]) < kClosed)
      qd[static_cast<std::size_t>(m.cylinders[c].joint)] = 0.0;
  const Eigen::VectorXd qdd = acceleration(d.records, k);
  return chain.evaluate({r.q.data(), qd.data(), qdd.data()}, r.payload);
}

/// Tells at which samples a cylinder began to take oil a short while ago.
class Starts {
 public:
  bool now(const plant::Record& r, int& count) {
    open_.resize(r.flow.size(), false);
    for (std::size_t c = 0; c < r.flow.size(); ++c) {
      const bool open = std::abs(r.flow[c]) >= kClosed;
      if (open && !open_[c]) {
        last_ = r.t;
        ++count;
      }
      open_[c] = open;
    }
    return r.t - last_ <= kStart;
  }

 private:
  std::vector<bool> open_;
  double last_ = -kStart;
};

Split split_of(const Driven& d, const Planned& p) {
  const benchmark::Scenario& s = p.scenario;
  Chain chain(p.model);
  chain.oil = s.plant.tank.temperature;
  double end = 0.0;
  for (const benchmark::ScenarioGoal& g : s.goals) end += g.duration;
  Split x;
  x.predicted = p.motions.energy();
  x.measured = d.energy.back();
  Starts starts;
  for (std::size_t k = 1; k < d.records.size(); ++k) {
    const plant::Record& r = d.records[k];
    const double dt = r.t - d.records[k - 1].t, truth = d.energy[k] - d.energy[k - 1];
    const MachineState& now = modelled(chain, s.machine, d, k);
    x.driven += now.power * dt;
    if (r.t > end) x.late += truth;
    if (starts.now(r, x.count)) x.starts += truth - now.power * dt;
    for (std::size_t i = 0; i < now.pumps.size(); ++i) {
      const PumpState& m = now.pumps[i];
      x.flow += 0.5 * (r.pump_flow[i] - m.flow) * (r.pump_pressure[i] + m.pressure) * dt;
      x.pressure += 0.5 * (r.pump_pressure[i] - m.pressure) * (r.pump_flow[i] + m.flow) * dt;
    }
    x.sway = std::max(x.sway, std::hypot(r.swing_1, r.swing_2));
  }
  return x;
}

double median(std::vector<double> v) {
  if (v.empty()) return kNaN;
  std::sort(v.begin(), v.end());
  return 0.5 * (v[(v.size() - 1) / 2] + v[v.size() / 2]);
}

/// "1:1.4:0.2" @throws UsageError where it is not one number for each gain
std::vector<double> gains_of(const std::string& text, const control::ControllerInfo& info) {
  std::vector<double> values;
  std::stringstream in(text);
  std::string part;
  while (std::getline(in, part, ':')) values.push_back(std::strtod(part.c_str(), nullptr));
  if (values.size() != info.gains.size())
    throw UsageError(fmt::format("--gains: {} has {} gains, \"{}\" are {}", info.name,
                                 info.gains.size(), text, values.size()));
  return values;
}

/// What is summed up over the scenarios of one set of gains; failures are left out and counted.
struct Sums {
  std::vector<double> error, bias, tracking, law, end, path, time;
  double measured = 0.0, cost = 0.0;
  int failed = 0;

  void add(const Split& x, const benchmark::Row& row, double duration) {
    if (!row.done) {
      ++failed;
      cost += 3.0;  // as studies/controllers/tune_gains.py, whose cost it is but for the energy
      return;
    }
    bias.push_back(x.predicted / x.measured - 1.0);
    error.push_back(std::abs(bias.back()));
    tracking.push_back((x.driven - x.predicted) / x.measured);
    law.push_back((x.measured - x.driven) / x.measured);
    end.push_back(row.tip_error_end);
    path.push_back(row.tip_error_path);
    time.push_back(row.time - duration);
    measured += x.measured;
    cost += std::abs(row.time / duration - 1.0) + (row.tip_error_path + row.tip_error_end) / 0.1 +
            row.roughness;
  }
  void tell(const std::string& gains) const {
    const double worst = error.empty() ? kNaN : *std::max_element(error.begin(), error.end());
    fmt::print(
        "gains {}: {} done, {} failed; error {:.1f} % (median; worst {:.1f} %), bias {:+.1f} %, of "
        "it tracking {:+.1f} and law {:+.1f} points; true {:.1f} kJ in all; tip error {:.0f} mm at "
        "the end, {:.0f} mm on the way; {:+.1f} s late; cost without energy {:.3f}\n",
        gains, error.size(), failed, 100.0 * median(error), 100.0 * worst, 100.0 * median(bias),
        100.0 * median(tracking), 100.0 * median(law), measured / 1e3, 1e3 * median(end),
        1e3 * median(path), median(time),
        cost / static_cast<double>(
                   std::max<std::size_t>(1, error.size() + static_cast<std::size_t>(failed))));
    std::fflush(stdout);
  }
};

void tell_head() {
  fmt::print("{:<36}{:>10}{:>9}{:>8} |{:>9}{:>7} |{:>7}{:>9}{:>8}{:>7} |{:>7}{:>8}{:>8}\n", "[kJ]",
             "predicted", "true", "error", "tracking", "late", "law:", "pressure", "starts",
             "count", "sway", "end mm", "way mm");
}

void tell_row(const std::string& id, const Split& x, const benchmark::Row& row) {
  fmt::print(
      "{:<36}{:>10.2f}{:>9.2f}{:>7.1f}% |{:>9.2f}{:>7.2f} |{:>7.2f}{:>9.2f}{:>8.2f}{:>7} |{:>6.1f}°"
      "{:>8.0f}{:>8.0f} {}\n",
      id, x.predicted / 1e3, x.measured / 1e3, 100.0 * (x.predicted / x.measured - 1.0),
      (x.driven - x.predicted) / 1e3, x.late / 1e3, x.flow / 1e3, x.pressure / 1e3, x.starts / 1e3,
      x.count, x.sway / units::kDegree, 1e3 * row.tip_error_end, 1e3 * row.tip_error_path,
      row.done ? "" : row.reason);
  std::fflush(stdout);
}

/// The scenario's optima: read where an earlier run has kept them, as the tracker is tuned on the same plans many times.
OptimalMotions motions_of(const benchmark::Scenario& s, const CraneModel& model, const Arguments& a,
                          const OptimalMotionOptions& planning) {
  if (a.plans.empty()) return optimal_motions(s, model, planning);
  const std::filesystem::path file = std::filesystem::path(a.plans) / (s.id + ".plan");
  if (std::filesystem::exists(file)) {
    std::ifstream in(file, std::ios::binary);
    return motions_from({std::istreambuf_iterator<char>(in), {}});
  }
  OptimalMotions motions = optimal_motions(s, model, planning);
  std::filesystem::create_directories(a.plans);
  std::ofstream(file, std::ios::binary) << packed(motions);
  return motions;
}

/// What was wanted and what the plant did, for a picture of one run.
void write_trace(const std::string& folder, const Planned& p, const Driven& d) {
  std::filesystem::create_directories(folder);
  std::ofstream out(std::filesystem::path(folder) / (p.scenario.id + ".csv"));
  out << "t,swing_1,swing_2";
  for (const Joint& j : p.scenario.machine.joints)
    out << fmt::format(",{0}_q,{0}_qd,{0}_plan_q,{0}_plan_qd", j.name);
  for (const Cylinder& c : p.scenario.machine.cylinders)
    out << fmt::format(",{0}_u,{0}_spool,{0}_flow,{0}_pa,{0}_pb,{0}_model_p", c.name);
  for (const Pump& pump : p.scenario.machine.pumps)
    out << fmt::format(",{0}_p,{0}_q,{0}_model_p,{0}_model_q", pump.name);
  out << "\n";
  Chain chain(p.model);
  chain.oil = p.scenario.plant.tank.temperature;
  const Trajectory& plan = p.motions.legs.front().motion;
  for (std::size_t at = 0; at < d.records.size(); ++at) {
    const plant::Record& r = d.records[at];
    const MachineState& model = modelled(chain, p.scenario.machine, d, at);
    out << fmt::format("{},{},{}", r.t, r.swing_1, r.swing_2);
    const control::MotionInstant wanted = control::at_time(plan, r.t);
    for (std::size_t j = 0; j < r.q.size(); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      out << fmt::format(",{},{},{},{}", r.q[j], r.qd[j], wanted.q[k], wanted.qd[k]);
    }
    for (std::size_t c = 0; c < r.command.size(); ++c)
      out << fmt::format(",{},{},{},{},{},{}", r.command[c], r.spool[c], r.flow[c], r.pressure_a[c],
                         r.pressure_b[c], model.cylinders[c].pressure);
    for (std::size_t i = 0; i < model.pumps.size(); ++i)
      out << fmt::format(",{},{},{},{}", r.pump_pressure[i], r.pump_flow[i],
                         model.pumps[i].pressure, model.pumps[i].flow);
    out << "\n";
  }
}

/// The run as sensors tell it, for `sparflow fit`.
void write_log(const std::string& folder, const Planned& p, const Driven& d) {
  std::filesystem::create_directories(folder);
  plant::LogWriter log(p.scenario.machine, p.scenario.plant, p.scenario.seeds.front(),
                       "prediction_study: " + p.scenario.id);
  for (const plant::Record& r : d.records) log.add(r);
  std::ofstream(std::filesystem::path(folder) / (p.scenario.id + ".csv")) << log.text("");
}

std::vector<Planned> planned(const Arguments& a, const OptimalMotionOptions& planning) {
  std::vector<Planned> all;
  all.reserve(a.scenarios.size());
  for (const std::string& file : a.scenarios) {
    benchmark::Scenario s = benchmark::load_scenario(file, bundled_file);
    CraneModel model = load_model(a.model.empty() ? s.model_path : a.model);
    OptimalMotions motions = motions_of(s, model, a, planning);
    if (!motions.found()) {
      fmt::print("{}: left out: {}\n", s.id, motions.message());
      continue;
    }
    all.push_back({std::move(s), std::move(model), std::move(motions)});
  }
  return all;
}

void run_all(const std::vector<Planned>& all, const std::string& gains, const Arguments& a,
             const OptimalMotionOptions& planning) {
  const control::ControllerInfo& info = *control::find_controller(a.controller);
  const std::vector<double> values = gains_of(gains, info);
  Sums sums;
  if (!a.quiet) tell_head();
  for (const Planned& p : all) {
    Driven d;
    benchmark::LoopOptions loop;
    loop.watch = [&](const plant::Record& r, const plant::EnergyLedger& l) {
      d.records.push_back(r);
      d.energy.push_back(std::accumulate(l.delivered.begin(), l.delivered.end(), l.drive_work));
    };
    const benchmark::Row row = LearnedRun{p.scenario, &p.model, p.motions, planning}.run(
        a.controller, [&](const control::Knowledge& know) { return info.make(know, values); },
        p.scenario.seeds.front(), loop);
    if (!a.trace.empty()) write_trace(a.trace, p, d);
    if (!a.logs.empty()) write_log(a.logs, p, d);
    const Split x = split_of(d, p);
    if (!a.quiet) tell_row(p.scenario.id, x, row);
    sums.add(x, row, p.scenario.goals.front().duration);
  }
  sums.tell(gains);
}

int run(const Arguments& a) {
  const control::ControllerInfo* info = control::find_controller(a.controller);
  if (info == nullptr) throw UsageError("no controller \"" + a.controller + "\"");
  OptimalMotionOptions planning;
  planning.bound = false;
  planning.ramp = a.ramp;
  planning.smoothing = a.smoothing;
  planning.sway_limit = a.sway * units::kDegree;
  std::vector<std::string> sets = a.gains;
  if (sets.empty()) {
    sets.emplace_back();
    for (const control::Gain& g : info->gains)
      sets[0] += fmt::format("{}{}", sets[0].empty() ? "" : ":", g.value);
  }
  const std::vector<Planned> all = planned(a, planning);
  for (const std::string& gains : sets) run_all(all, gains, a, planning);
  return 0;
}

int run_with(int argc, char** argv) {
  Arguments a;
  ProgramOptions app("where the true energy of tracked optima differs from the predicted one");
  app.add("scenarios", a.scenarios, "scenario files").required();
  app.add("--model", a.model, "in place of those that the scenarios name");
  app.add("--controller", a.controller, "of the registry");
  app.add("--gains", a.gains, "sets of the controller's gains, as 1:1.4:0.2");
  app.add("--ramp", a.ramp, "seconds from rest to full speed that the plan gives valves")
      .range(0.0, 5.0);
  app.add("--smoothing", a.smoothing, "seconds of the moving average of the plan").range(0.0, 5.0);
  app.add("--sway", a.sway, "limit of the planned payload's angle [deg], 0: none").range(0.0, 45.0);
  app.add("--plans", a.plans, "folder in which the optima are kept for the next run");
  app.add("--trace", a.trace, "folder for a CSV of each run");
  app.add("--logs", a.logs, "folder for a log of each run, as sensors tell it");
  app.flag("--quiet", a.quiet, "only the medians");
  if (const auto code = app.parse(argc, argv)) return *code;
  return run(a);
}

}  // namespace
}  // namespace sparflow::bench

int main(int argc, char** argv) {
  return sparflow::bench::run_program("prediction_study", sparflow::bench::run_with, argc, argv);
}
