#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/simulation_page.h"
#include "diagnosis/experiment/experiment.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "models/math/units.h"
#include "simulator/plant/parameters/plant_effects.h"
#include "simulator/plant/parameters/plant_file.h"
#include "simulator/programmes/programmes.h"
#include "simulator/sensors/log_writer.h"

namespace sparflow::cli {
namespace {

struct SimulateArguments {
  std::string machine, output, plant, programme = "operator", track, replay, motion;
  std::vector<std::string> effects;
  double seconds = 60.0, rate = 50.0;
  double payload = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t seed = 1;
  Outputs outputs;
};

/// A payload of the log that is told in each row, or nothing.
Eigen::VectorXd payload_of(const Log& log) {
  const Channel* c = log.find(Role::kPayload);
  return c ? c->values : Eigen::VectorXd();
}

std::vector<double> first_row(const Eigen::MatrixXd& q) {
  std::vector<double> start;
  for (Eigen::Index k = 0; k < q.cols(); ++k) start.push_back(q(0, k));
  return start;
}

/// Joint positions of a log or motion, from strokes where it has those.
Eigen::MatrixXd positions_of(const Log& log, const Machine& machine) {
  Eigen::MatrixXd q = log.matrix(Role::kJointPosition, machine.joint_count());
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
    const Channel* stroke = log.find(Role::kStroke, c);
    if (stroke == nullptr) continue;
    for (Eigen::Index i = 0; i < q.rows(); ++i)
      if (std::isnan(q(i, j)) && stroke->valid[i])
        q(i, j) = joint_at_stroke(machine, c, stroke->values[i]);
  }
  return q;
}

double start_payload(const SimulateArguments& a, const Eigen::VectorXd& told) {
  if (!std::isnan(a.payload)) return a.payload;
  return told.size() > 0 && std::isfinite(told[0]) ? told[0] : 0.0;
}

plant::TimeTable motion_table(const Log& log, const Machine& machine, const SimulateArguments& a) {
  plant::TimeTable table;
  table.t = log.time;
  table.values = positions_of(log, machine);
  if (!table.values.allFinite())
    throw InputError({log.path, 0, 0}, "q",
                     "a motion to track needs the position of each joint in every row");
  table.start = first_row(table.values);
  const Eigen::VectorXd told = payload_of(log);
  table.start_payload = start_payload(a, told);
  if (std::isnan(a.payload)) table.payload = told;
  return table;
}

/// Commands of a file that need not tell positions; where it does, the machine starts there.
plant::TimeTable command_table(const Machine& machine, const SimulateArguments& a) {
  Machine no_joints = machine;  // so that the reader does not ask for positions
  no_joints.joints.clear();
  const Log log = load_log(a.replay, no_joints);
  plant::TimeTable table;
  table.t = log.time;
  table.values = log.matrix(Role::kCommand, machine.cylinder_count());
  if (!table.values.array().isFinite().any())
    throw InputError({a.replay, 0, 0}, "u_<cylinder>", "the file has no command to replay");
  table.values = table.values.array().isFinite().select(table.values, 0.0);
  const bool placed = std::any_of(log.channels.begin(), log.channels.end(), [](const Channel& c) {
    return c.signal.starts_with("q_") || c.role == Role::kStroke;
  });
  if (placed) {
    table.start = first_row(positions_of(load_log(a.replay, machine), machine));
  } else {
    for (const Joint& j : machine.joints)
      table.start.push_back(0.5 * (j.position.lo + j.position.hi));
  }
  const Eigen::VectorXd told = payload_of(log);
  table.start_payload = start_payload(a, told);
  if (std::isnan(a.payload)) table.payload = told;
  return table;
}

std::string listed_motions(const std::vector<MotionRecipe>& menu) {
  std::string text;
  for (std::size_t i = 0; i < menu.size(); ++i)
    text += fmt::format("{:3}  {}\n", i + 1, menu[i].words);
  return text;
}

/// One of the motions that `diagnose` proposes, by its number or the begin of its words.
const MotionRecipe& proposed(const std::vector<MotionRecipe>& menu, const std::string& wanted) {
  for (std::size_t i = 0; i < menu.size(); ++i)
    if (wanted == std::to_string(i + 1) || menu[i].words.starts_with(wanted)) return menu[i];
  throw UsageError(
      fmt::format("simulate: no motion \"{}\"; there are\n{}", wanted, listed_motions(menu)));
}

std::unique_ptr<plant::Programme> make_programme(const SimulateArguments& a, const Machine& machine,
                                                 const plant::PlantParameters& parameters) {
  plant::WorkRequest request{a.seed, a.seconds, 1.0 / a.rate, std::nullopt};
  if (!std::isnan(a.payload)) request.payload = a.payload;
  if (!a.track.empty())
    return plant::tracked_motion(machine, parameters,
                                 motion_table(load_log(a.track, machine), machine, a));
  if (!a.replay.empty()) return plant::replayed_commands(command_table(machine, a));
  if (!a.motion.empty()) {
    CraneModel model;
    model.machine = machine;
    model.cylinders.resize(machine.cylinders.size());
    model.pumps.resize(machine.pumps.size());
    const std::vector<MotionRecipe> menu =
        motion_menu(machine, request.payload.value_or(plant::usual_payload(machine)));
    SimulateArguments told = a;  // the recipe tells its loads
    told.payload = std::numeric_limits<double>::quiet_NaN();
    const Log log = synthesise_motion(model, proposed(menu, a.motion), 1.0 / a.rate, a.seconds);
    return plant::tracked_motion(machine, parameters, motion_table(log, machine, told));
  }
  if (a.programme == "cycles") return plant::work_cycles(machine, parameters, request);
  return plant::operator_work(machine, parameters, request);
}

struct Simulated {
  std::unique_ptr<plant::PlantRun> run;
  double elapsed = 0.0;  // [s]
  bool cut = false;
  int rows = 0;
};

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
      const Eigen::MatrixXd q = positions_of(*log_, machine_);
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
std::optional<Log> recording_of(const SimulateArguments& a, const Machine& machine) {
  const std::string path = a.track.empty() ? a.replay : a.track;
  if (path.empty()) return std::nullopt;
  try {
    return load_log(path, machine);
  } catch (const InputError&) {  // commands alone, which the replay has read already
    return std::nullopt;
  }
}

nlohmann::json simulation_json(const SimulateArguments& a, const Machine& machine,
                               const Simulated& s) {
  const plant::EnergyLedger& l = s.run->ledger();
  nlohmann::json json;
  json["status"] = s.cut                                                 ? "interrupted"
                   : s.run->status() == plant::RunStatus::kRunning       ? "done"
                   : s.run->status() == plant::RunStatus::kKinematicsEnd ? "kinematics_end"
                                                                         : "failed";
  json["message"] = s.run->message();
  json["interrupted"] = s.cut;
  json["seconds"] = s.run->time();
  json["samples"] = s.rows;
  json["seed"] = a.seed;
  json["effects"] = a.effects;
  json["elapsed_s"] = s.elapsed;
  json["times_real_time"] = s.run->time() / std::max(s.elapsed, 1e-9);
  for (std::size_t p = 0; p < machine.pumps.size(); ++p)
    json["pumps"][machine.pumps[p].name] = {
        {"work_J", l.pump_work[p]}, {"energy_J", l.delivered[p]}, {"loss_J", l.pump_loss[p]}};
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c) {
    for (int k = 0; k < plant::kLosses; ++k) {
      const auto place = static_cast<std::size_t>(k);
      json["losses_J"][machine.cylinders[c].name][plant::kLossNames[place]] =
          l.cylinder_loss[c][place];
    }
  }
  json["tank_loss_J"] = l.tank_loss;
  json["swing_loss_J"] = l.swing_loss;
  json["drive_work_J"] = l.drive_work;
  json["payload_exchange_J"] = l.payload_exchange;
  json["stored_J"] = l.stored;
  json["imbalance_J"] = l.imbalance();
  const plant::PlantRun::Counts counts = s.run->counts();
  json["integrator"] = {{"steps", counts.steps},
                        {"evaluations", counts.evaluations},
                        {"jacobians", counts.jacobians},
                        {"starts", counts.starts}};
  return json;
}

double pump_work(const plant::PlantRun& run) {
  const std::vector<double>& work = run.ledger().pump_work;
  return std::accumulate(work.begin(), work.end(), 0.0);
}
double delivered(const plant::PlantRun& run) {
  const std::vector<double>& energy = run.ledger().delivered;
  return std::accumulate(energy.begin(), energy.end(), 0.0);
}

/// The energy balance and its losses in kJ; what is below one joule is left out.
void add_energies(const Machine& machine, const plant::PlantRun& run, SimulationView& view) {
  const plant::EnergyLedger& l = run.ledger();
  const auto add = [](auto& list, const std::string& name, double joule) {
    if (std::abs(joule) > 1.0) list.emplace_back(name, joule / 1e3);
  };
  add(view.balance_kJ, "work of the pumps", pump_work(run));
  add(view.balance_kJ, "work of drives without hydraulics", l.drive_work);
  add(view.balance_kJ, "brought by payloads that were taken, less those put down",
      l.payload_exchange);
  add(view.balance_kJ, "turned into heat", -l.total_loss());
  add(view.balance_kJ, "stored in height, motion and oil", -l.stored);
  add(view.balance_kJ, "error of the integration", -l.imbalance());
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c) {
    for (int k = 0; k < plant::kLosses; ++k) {
      const auto place = static_cast<std::size_t>(k);
      add(view.losses_kJ,
          fmt::format("{}: {}", machine.cylinders[c].name, plant::kLossWords[place]),
          l.cylinder_loss[c][place]);
    }
  }
  for (std::size_t p = 0; p < machine.pumps.size(); ++p)
    add(view.losses_kJ, "pump " + machine.pumps[p].name + ": leakage and relief", l.pump_loss[p]);
  add(view.losses_kJ, "return line", l.tank_loss);
  add(view.losses_kJ, "swinging payload and bending booms", l.swing_loss);
}

/// Page, and errors against a recording in JSON and text.
std::string write_comparison(const SimulateArguments& a, const Machine& machine, const Simulated& s,
                             const std::vector<plant::Record>& rows, nlohmann::json& json) {
  Recording recording(machine, rows, recording_of(a, machine));
  SimulationView& view = recording.view();
  std::string text;
  for (const SimulatedChannel& c : view.channels) {
    const RecordingError e = recording_error(c);
    if (!std::isfinite(e.rmse) || c.name == "command") continue;
    json["recording"][c.label()] = {{"rmse", e.rmse}, {"spread", e.spread}, {"unit", c.unit}};
    text += fmt::format("  {:<28} {:8.3g} {} RMS from the recording (its spread {:.3g})\n",
                        c.label(), e.rmse, c.unit, e.spread);
  }
  if (a.outputs.report.empty()) return text;
  add_energies(machine, *s.run, view);
  view.headline = fmt::format(
      "In {:.1f} s the pumps did {:.1f} kJ of work, of which {:.1f} kJ went into the valves",
      s.run->time(), pump_work(*s.run) / 1e3, delivered(*s.run) / 1e3);
  view.text = text.empty() ? "Nothing was recorded to compare with."
                           : "The plant got what was recorded; the table tells its errors.";
  if (s.cut) view.text += " The run was interrupted.";
  if (!s.run->message().empty()) view.text += " The run ended early: " + s.run->message() + ".";
  view.provenance = {{"machine", a.machine},
                     {"plant", a.plant},
                     {"seed", std::to_string(a.seed)},
                     {"effects", fmt::format("{}", fmt::join(a.effects, " "))},
                     {"recording", a.track.empty() ? a.replay : a.track}};
  simulation_page(view).write(a.outputs.report);
  return text;
}

std::string summary(const Machine& machine, const Simulated& s, const std::string& output) {
  const plant::EnergyLedger& l = s.run->ledger();
  std::string text = fmt::format("{}: {:.2f} s, {} samples, {:.0f} times real time\n", machine.name,
                                 s.run->time(), s.rows, s.run->time() / std::max(s.elapsed, 1e-9));
  for (std::size_t p = 0; p < machine.pumps.size(); ++p)
    text +=
        fmt::format("  {:<21} {:10.2f} kJ of work, {:.2f} kJ of them into the valves\n",
                    "pump " + machine.pumps[p].name, l.pump_work[p] / 1e3, l.delivered[p] / 1e3);
  for (int k = 0; k < plant::kLosses; ++k) {
    const auto place = static_cast<std::size_t>(k);
    double sum = 0.0;
    for (const auto& c : l.cylinder_loss) sum += c[place];
    text += fmt::format("  {:<21} {:10.2f} kJ lost\n", plant::kLossWords[place], sum / 1e3);
  }
  text += fmt::format("  {:<21} {:10.2f} kJ lost\n", "pump leakage, relief",
                      std::accumulate(l.pump_loss.begin(), l.pump_loss.end(), 0.0) / 1e3);
  text += fmt::format("  {:<21} {:10.2f} kJ lost\n", "return line", l.tank_loss / 1e3);
  if (std::abs(l.payload_exchange) > 1.0)
    text +=
        fmt::format("  {:<21} {:10.2f} kJ brought\n", "payloads taken", l.payload_exchange / 1e3);
  text += fmt::format("  energy balance closes to {:.2g} %\n",
                      100.0 * std::abs(l.imbalance()) /
                          std::max(1.0, l.drive_work + std::accumulate(l.pump_work.begin(),
                                                                       l.pump_work.end(), 0.0)));
  if (!s.run->message().empty())
    text += fmt::format("  ended at {:.2f} s: {}\n", s.run->time(), s.run->message());
  return text + fmt::format("log written to {}\n", output);
}

int run(const SimulateArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("simulate", outputs,
                      {{"--machine", a.machine},
                       {"--plant", a.plant},
                       {"--track", a.track},
                       {"--replay", a.replay}});
  check_writable(a.output);
  a.outputs.check();
  if (!a.track.empty() + !a.replay.empty() + !a.motion.empty() > 1)
    throw UsageError("simulate: give one of --track, --replay, --motion");
  const Machine machine = load_machine_with_warnings(a.machine);
  plant::PlantParameters parameters = plant::default_parameters(machine);
  if (!a.plant.empty()) plant::load_plant_file(a.plant, machine, parameters);
  std::vector<plant::EffectSetting> settings;
  for (const std::string& item : a.effects) settings.push_back(plant::parse_effect(item));
  plant::apply_effects(machine, settings, parameters);
  const std::unique_ptr<plant::Programme> programme = make_programme(a, machine, parameters);
  plant::LogWriter log(
      machine, parameters, a.seed,
      fmt::format("sparflow simulate: {}, seed {}, effects: {}", machine.name, a.seed,
                  a.effects.empty() ? "default" : fmt::format("{}", fmt::join(a.effects, " "))));
  Simulated s;
  plant::RunOptions options;
  options.sample_time = 1.0 / a.rate;
  s.run = std::make_unique<plant::PlantRun>(machine, parameters, programme->start(),
                                            programme->start_payload(), options);
  std::vector<plant::Record> rows;
  finish_on_interrupt();
  const auto begin = std::chrono::steady_clock::now();
  {
    Progress progress("simulate");
    while (s.run->time() < a.seconds - 1e-9 && s.run->status() == plant::RunStatus::kRunning) {
      plant::ProgrammeStep step = programme->step(s.run->record());
      if (step.end) break;
      if (step.payload) s.run->set_payload(*step.payload);
      plant::Record row = s.run->record();
      row.command = step.command;
      log.add(row);
      rows.push_back(row);
      s.run->advance(step.command);
      progress(s.run->time() / a.seconds, fmt::format("{:.0f} s", s.run->time()));
      if (interrupted()) break;
    }
  }
  s.elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  s.cut = interrupted();
  s.rows = log.rows();
  std::string mark;
  if (s.cut) mark = fmt::format("cut at {:.4f} s by an interruption", s.run->time());
  if (s.run->status() != plant::RunStatus::kRunning)
    mark = fmt::format("cut at {:.4f} s: {}", s.run->time(), s.run->message());
  write_file_atomically(a.output, log.text(mark));
  nlohmann::json json = simulation_json(a, machine, s);
  const std::string errors = write_comparison(a, machine, s, rows, json);
  if (!a.outputs.json.empty())
    a.outputs.write_json(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  tell(fmt::format("{}{}", errors, summary(machine, s, a.output)));
  if (s.cut) return kInterrupted;
  return s.run->status() == plant::RunStatus::kRunning ? kDone : kNotSolved;
}

}  // namespace

void add_simulate_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<SimulateArguments>();
  CLI::App* verb = app.add_subcommand(
      "simulate", "write measurements of a dynamic plant that knows no law of the model");
  verb->add_option("--machine,-m", a->machine, "machine file (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--output,-o", a->output, "log to write (CSV)")
      ->required()
      ->type_name("LOG.csv");
  verb->add_option("--seconds", a->seconds, "duration")
      ->check(number_from(0.1, 1e6))
      ->capture_default_str();
  verb->add_option("--seed", a->seed, "random seed of work and sensors")->capture_default_str();
  verb->add_option("--rate", a->rate, "samples a second")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str();
  verb->add_option("--effects", a->effects,
                   "switch effects: none, all, or NAME[:AT][=VALUE|=off], in their order; see "
                   "--list-effects")
      ->delimiter(',')
      ->type_name("ITEM,...");
  verb->add_option("--plant", a->plant, "parameters of the plant (YAML, section plant:)")
      ->type_name("FILE");
  verb->add_option("--programme", a->programme,
                   "operator: random work; cycles: pick, lift, slew, place, return")
      ->check(CLI::IsMember({"operator", "cycles"}))
      ->capture_default_str();
  verb->add_option("--track", a->track, "track the joint positions of this motion or log (CSV)")
      ->type_name("FILE");
  verb->add_option("--replay", a->replay, "replay the commands u_<cylinder> of this file (CSV)")
      ->type_name("FILE");
  verb->add_option("--motion", a->motion,
                   "drive a motion that `diagnose` proposes: its words or its number")
      ->type_name("WORDS");
  verb->add_option("--payload", a->payload, "payload; absent: that of the file, or drawn")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6));
  verb->add_flag_callback(
      "--list-effects",
      [] {
        tell(plant::effects_help());
        throw CLI::Success();
      },
      "list the effects that can be switched, and end");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
