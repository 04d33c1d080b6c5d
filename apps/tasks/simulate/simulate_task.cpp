#include "apps/tasks/simulate/simulate_task.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/simulate/simulate_programme.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "models/math/interruption.h"
#include "models/math/units.h"
#include "simulator/plant/parameters/plant_effects.h"
#include "simulator/plant/parameters/plant_file.h"
#include "simulator/sensors/log_writer.h"

namespace sparflow {
namespace {

/// Values of a recorded channel at other instants, NaN outside it and where it is not valid.
Eigen::VectorXd at_times(const Log& log, const Eigen::VectorXd& values, const Eigen::VectorXd& t) {
  Eigen::VectorXd r = Eigen::VectorXd::Constant(t.size(), std::numeric_limits<double>::quiet_NaN());
  Eigen::Index i = 0;
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    const double at = log.time[0] + t[k];
    while (i + 1 < log.samples() && log.time[i + 1] < at) ++i;
    if (i + 1 >= log.samples()) break;
    const double share = (at - log.time[i]) / (log.time[i + 1] - log.time[i]);
    r[k] = values[i] + share * (values[i + 1] - values[i]);
  }
  return r;
}

/// Collects what the page and the errors against a recording are made of.
class Recording {
 public:
  Recording(const Machine& machine, const std::vector<plant::Record>& rows, std::optional<Log> log)
      : machine_(machine), rows_(rows), log_(std::move(log)) {
    view_.machine = machine.name;
    view_.t.resize(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) view_.t[static_cast<Eigen::Index>(i)] = rows[i].t;
    for (int c = 0; c < machine.cylinder_count(); ++c) add_cylinder(c);
    for (int p = 0; p < machine.pump_count(); ++p) {
      const auto k = static_cast<std::size_t>(p);
      add({"pump " + machine.pumps[k].name, "pressure", "pressure", "bar", {}, {}}, units::kBar,
          Role::kPumpPressure, p, [k](const plant::Record& r) { return r.pump_pressure[k]; });
    }
  }
  SimulationView& view() { return view_; }

 private:
  void add_cylinder(int c) {
    const auto k = static_cast<std::size_t>(c);
    const Cylinder& drive = machine_.cylinders[k];
    const auto j = static_cast<std::size_t>(drive.joint);
    SimulatedChannel stroke{drive.name, "stroke", "stroke", "mm", {}, {}};
    stroke.simulated =
        collected([&](const plant::Record& r) { return 1e3 * stroke_at(machine_, c, r.q[j]); });
    if (log_) {
      const Eigen::MatrixXd q = simulated_positions(*log_, machine_);
      Eigen::VectorXd x(q.rows());
      for (Eigen::Index i = 0; i < q.rows(); ++i)
        x[i] = std::isfinite(q(i, drive.joint)) ? 1e3 * stroke_at(machine_, c, q(i, drive.joint))
                                                : std::numeric_limits<double>::quiet_NaN();
      if (x.array().isFinite().any()) stroke.recorded = at_times(*log_, x, view_.t);
    }
    view_.channels.push_back(std::move(stroke));
    add({drive.name, "command", "command", "", {}, {}}, 1.0, Role::kCommand, c,
        [k](const plant::Record& r) { return r.command[k]; });
    if (!drive.hydraulic()) return;
    add({drive.name, "pressures", "bore side", "bar", {}, {}}, units::kBar, Role::kPressureA, c,
        [k](const plant::Record& r) { return r.pressure_a[k]; });
    add({drive.name, "pressures", "rod side", "bar", {}, {}}, units::kBar, Role::kPressureB, c,
        [k](const plant::Record& r) { return r.pressure_b[k]; });
  }
  template <class Value>
  Eigen::VectorXd collected(const Value& value) const {
    Eigen::VectorXd v(view_.t.size());
    for (std::size_t i = 0; i < rows_.size(); ++i)
      v[static_cast<Eigen::Index>(i)] = value(rows_[i]);
    return v;
  }
  template <class Value>
  void add(SimulatedChannel channel, double scale, Role role, int index, const Value& value) {
    channel.simulated = collected(value) / scale;
    const Channel* measured = log_ ? log_->find(role, index) : nullptr;
    if (measured != nullptr) channel.recorded = at_times(*log_, measured->values / scale, view_.t);
    view_.channels.push_back(std::move(channel));
  }

  const Machine& machine_;
  const std::vector<plant::Record>& rows_;
  std::optional<Log> log_;
  SimulationView view_;
};

/// The file whose commands or motion were given, where it tells positions.
std::optional<Log> recording_of(const SimulateTask& a, const Machine& machine) {
  const std::string path = a.track.empty() ? a.replay : a.track;
  if (path.empty()) return std::nullopt;
  try {
    return load_log(path, machine);
  } catch (const InputError&) {  // commands alone, which the replay has read already
    return std::nullopt;
  }
}

plant::PlantParameters plant_of(const Machine& machine, const SimulateTask& task) {
  if (task.parameters) return *task.parameters;
  plant::PlantParameters parameters = plant::default_parameters(machine);
  if (!task.plant.empty()) plant::load_plant_file(task.plant, machine, parameters);
  std::vector<plant::EffectSetting> settings;
  settings.reserve(task.effects.size());
  for (const std::string& item : task.effects) settings.push_back(plant::parse_effect(item));
  plant::apply_effects(machine, settings, parameters);
  return parameters;
}

/// Runs the plant until the programme ends or somebody asks to stop. @return true when somebody did
bool drive(const SimulateTask& task, plant::Programme& programme, plant::PlantRun& run,
           const Listener& listener, const std::function<void(plant::Record)>& add) {
  while (run.time() < task.seconds - 1e-9 && run.status() == plant::RunStatus::kRunning) {
    plant::ProgrammeStep step;
    try {
      step = programme.step(run.record());
    } catch (const Interruption&) {  // whoever is asked for commands is not asked any more
      return true;
    }
    if (step.end) break;
    if (step.payload) run.set_payload(*step.payload);
    plant::Record row = run.record();
    row.command = step.command;
    add(std::move(row));
    run.advance(step.command);
    if (listener.progress)
      listener.progress(run.time() / task.seconds, fmt::format("{:.0f} s", run.time()));
    if (listener.stop()) return true;
  }
  return false;
}

}  // namespace

void check_one_programme(const SimulateTask& t) {
  if (!t.track.empty() + !t.replay.empty() + !t.motion.empty() + t.trajectory.has_value() +
          (t.controller != nullptr) >
      1)
    throw UsageError("simulate: give one of --track, --replay, --motion");
}

void check_ranges(const SimulateTask& task) {
  require_range("simulate: --seconds", task.seconds, 0.1, 1e6);
  require_range("simulate: --rate", task.rate, 10.0, 1000.0);
  if (!std::isnan(task.payload)) require_range("simulate: --payload", task.payload, 0.0, 1e6);
}

Simulation simulate_task(std::shared_ptr<const Machine> machine, const SimulateTask& task,
                         const Listener& listener) {
  check_one_programme(task);
  check_ranges(task);
  const plant::PlantParameters parameters = plant_of(*machine, task);
  const std::unique_ptr<plant::Programme> programme =
      simulate_programme(task, *machine, parameters, listener);
  plant::LogWriter log(
      *machine, parameters, task.seed,
      fmt::format(
          "sparflow simulate: {}, seed {}, effects: {}", machine->name, task.seed,
          task.effects.empty() ? "default" : fmt::format("{}", fmt::join(task.effects, " "))));
  plant::RunOptions options;
  options.sample_time = 1.0 / task.rate;
  plant::PlantRun run(*machine, parameters, programme->start(), programme->start_payload(),
                      options);
  Simulation s;
  std::vector<plant::Record> rows;
  if (task.searching) task.searching();
  const auto begin = std::chrono::steady_clock::now();
  s.interrupted = drive(task, *programme, run, listener, [&](plant::Record row) {
    log.add(row);
    rows.push_back(std::move(row));
  });
  s.elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  s.seed = task.seed;
  s.effects = task.effects;
  s.ledger = run.ledger();
  s.status = run.status();
  s.counts = run.counts();
  s.message = run.message();
  s.time = run.time();
  s.rows = log.rows();
  std::string mark;
  if (s.interrupted) mark = fmt::format("cut at {:.4f} s by an interruption", s.time);
  if (s.status != plant::RunStatus::kRunning)
    mark = fmt::format("cut at {:.4f} s: {}", s.time, s.message);
  s.log = log.text(mark);
  Recording recording(*machine, rows, recording_of(task, *machine));
  s.view = std::move(recording.view());
  s.machine = std::move(machine);
  return s;
}

}  // namespace sparflow
