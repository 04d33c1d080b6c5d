#include "apps/tasks/simulate/simulate_programme.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/experiment/experiment.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "simulator/programmes/programmes.h"

namespace sparflow {
namespace {

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

double start_payload(const SimulateTask& a, const Eigen::VectorXd& told) {
  if (!std::isnan(a.payload)) return a.payload;
  return told.size() > 0 && std::isfinite(told[0]) ? told[0] : 0.0;
}

plant::TimeTable motion_table(const Log& log, const Machine& machine, const SimulateTask& a) {
  plant::TimeTable table;
  table.t = log.time;
  table.values = simulated_positions(log, machine);
  if (!table.values.allFinite())
    throw InputError({log.path, 0, 0}, "q",
                     "a motion to track needs the position of each joint in every row");
  table.start = first_row(table.values);
  const Eigen::VectorXd told = payload_of(log);
  table.start_payload = start_payload(a, told);
  if (std::isnan(a.payload)) table.payload = told;
  return table;
}

std::vector<double> middle_of_ranges(const Machine& machine) {
  std::vector<double> middle;
  middle.reserve(machine.joints.size());
  for (const Joint& j : machine.joints) middle.push_back(0.5 * (j.position.lo + j.position.hi));
  return middle;
}

Log load_log_with_warnings(const std::string& path, const Machine& machine,
                           const Listener& listener) {
  Log log = load_log(path, machine);
  for (const std::string& w : log.warnings) listener.say_warning(w);
  return log;
}

/// Says what the plant does with commands that are missing or more than a full lever.
void doubt_commands(const Log& log, const Machine& machine, const Listener& listener) {
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const std::string name = "u_" + machine.cylinders[static_cast<std::size_t>(c)].name;
    const Channel* command = log.find(Role::kCommand, c);
    if (command == nullptr) {
      listener.say_warning(
          fmt::format("{}: no column {}: that valve stays closed", log.path, name));
      continue;
    }
    // NaN is not larger than anything.
    const auto beyond = (command->values.array().abs() > 1.0).count();
    if (beyond > 0)
      listener.say_warning(
          fmt::format("{}: {}: {} of {} values lie beyond 1, the full lever, and count as 1",
                      log.path, name, beyond, command->values.size()));
  }
}

/// Commands of a file that need not tell positions; where it does, the machine starts there.
plant::TimeTable command_table(const Machine& machine, const SimulateTask& a,
                               const Listener& listener) {
  Machine no_joints = machine;  // so that the reader does not ask for positions
  no_joints.joints.clear();
  const Log log = load_log_with_warnings(a.replay, no_joints, listener);
  plant::TimeTable table;
  table.t = log.time;
  table.values = log.matrix(Role::kCommand, machine.cylinder_count());
  if (!table.values.array().isFinite().any())
    throw InputError({a.replay, 0, 0}, "u_<cylinder>", "the file has no command to replay");
  doubt_commands(log, machine, listener);
  table.values = table.values.array().isFinite().select(table.values, 0.0);
  const bool placed = std::any_of(log.channels.begin(), log.channels.end(), [](const Channel& c) {
    return c.signal.starts_with("q_") || c.role == Role::kStroke;
  });
  if (placed) {
    table.start = first_row(simulated_positions(load_log(a.replay, machine), machine));
  } else {
    table.start = middle_of_ranges(machine);
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

/// @throws UsageError where a motion from memory is not one of this machine
void check_trajectory(const Trajectory& motion, const Machine& machine) {
  const auto refuse = [](const std::string& why) {
    throw UsageError("simulate: the motion to track " + why);
  };
  if (motion.q.cols() != machine.joint_count() && motion.size() > 0)
    refuse(fmt::format("has {} joints; machine {} has {}", motion.q.cols(), machine.name,
                       machine.joint_count()));
  if (motion.size() < 2 || motion.q.rows() != motion.t.size())
    refuse(
        fmt::format("has {} rows of positions at {} times; expected two or more, as many of "
                    "both",
                    motion.q.rows(), motion.t.size()));
  if (!motion.q.allFinite() || !motion.t.allFinite())
    refuse("has a time or a position that is no finite number");
  for (Eigen::Index i = 1; i < motion.t.size(); ++i)
    if (!(motion.t[i] > motion.t[i - 1]))
      refuse(fmt::format("has time {} s in row {} after {} s; times must increase", motion.t[i],
                         i + 1, motion.t[i - 1]));
}

/// A motion as a table. Its rows keep the payload of the start.
plant::TimeTable trajectory_table(const Trajectory& motion, const Machine& machine,
                                  double payload) {
  check_trajectory(motion, machine);
  plant::TimeTable table;
  table.t = motion.t;
  table.values = motion.q;
  table.start = first_row(motion.q);
  table.start_payload = std::isnan(payload) ? 0.0 : payload;
  return table;
}

/// Lets a controller drive the plant. It sees true values, as every programme does, with the sensors' gaps left out.
class Controlled final : public plant::Programme {
 public:
  Controlled(const Machine& machine, const SimulateTask& task) : start_(task.start) {
    if (start_.empty()) start_ = middle_of_ranges(machine);
    payload_ = std::isnan(task.payload) ? 0.0 : task.payload;
    control::Knowledge know;
    know.machine = &machine;
    know.sample_time = 1.0 / task.rate;
    controller_ = task.controller(know);
  }
  std::vector<double> start() const override { return start_; }
  double start_payload() const override { return payload_; }
  plant::ProgrammeStep step(const plant::Record& r) override {
    control::Measurement now;
    now.t = r.t;
    now.q = Eigen::Map<const Eigen::VectorXd>(r.q.data(), static_cast<Eigen::Index>(r.q.size()));
    now.qd = Eigen::Map<const Eigen::VectorXd>(r.qd.data(), static_cast<Eigen::Index>(r.qd.size()));
    now.pressure_bore = r.pressure_a;
    now.pressure_rod = r.pressure_b;
    now.pump_pressure = r.pump_pressure;
    now.payload = r.payload;
    now.oil = r.oil_temperature;
    return {controller_->step(now), std::nullopt, false};
  }

 private:
  std::vector<double> start_;
  double payload_ = 0.0;
  std::unique_ptr<control::Controller> controller_;
};

}  // namespace

/// Joint positions of a log or motion, from strokes where it has those.
Eigen::MatrixXd simulated_positions(const Log& log, const Machine& machine) {
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

std::unique_ptr<plant::Programme> simulate_programme(const SimulateTask& a, const Machine& machine,
                                                     const plant::PlantParameters& parameters,
                                                     const Listener& listener) {
  plant::WorkRequest request{a.seed, a.seconds, 1.0 / a.rate, std::nullopt};
  if (!std::isnan(a.payload)) request.payload = a.payload;
  if (a.controller) return std::make_unique<Controlled>(machine, a);
  if (a.trajectory)
    return plant::tracked_motion(machine, parameters,
                                 trajectory_table(*a.trajectory, machine, a.payload));
  if (!a.track.empty())
    return plant::tracked_motion(
        machine, parameters,
        motion_table(load_log_with_warnings(a.track, machine, listener), machine, a));
  if (!a.replay.empty()) return plant::replayed_commands(command_table(machine, a, listener));
  if (!a.motion.empty()) {
    CraneModel model;
    model.machine = machine;
    model.cylinders.resize(machine.cylinders.size());
    model.pumps.resize(machine.pumps.size());
    const std::vector<MotionRecipe> menu =
        motion_menu(machine, request.payload.value_or(plant::usual_payload(machine)));
    SimulateTask told = a;  // the recipe tells its loads
    told.payload = std::numeric_limits<double>::quiet_NaN();
    const Log log = synthesise_motion(model, proposed(menu, a.motion), 1.0 / a.rate, a.seconds);
    return plant::tracked_motion(machine, parameters, motion_table(log, machine, told));
  }
  if (a.programme == "cycles") return plant::work_cycles(machine, parameters, request);
  return plant::operator_work(machine, parameters, request);
}

}  // namespace sparflow
