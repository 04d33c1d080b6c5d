#include "apps/tasks/evaluate_task.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/motion_inputs.h"
#include "identification/signals/recorded_motion.h"
#include "models/math/error.h"
#include "models/math/robust.h"
#include "problems/motion_table.h"

namespace sparflow {
namespace {

/// The machine's own limits, from the motion's own start to its own end.
MotionProblem own_problem(const CraneModel& model, const OwnMotion& given) {
  MotionProblem problem;
  problem.name = std::filesystem::path(given.name).stem().string();
  problem.machine = model.machine;
  problem.limits = limits_of(model.machine);
  problem.payload = given.payload;
  problem.start = given.motion.q.row(0).transpose();
  problem.goal = JointGoal{given.motion.q.row(given.motion.size() - 1).transpose()};
  return problem;
}

/// Limits of the start and the goal that a motion sets itself say nothing.
void remove_own_ends(std::vector<LimitCheck>& checks) {
  std::erase_if(checks, [](const LimitCheck& c) {
    return c.what.find("start") != std::string::npos || c.what.find("goal") != std::string::npos;
  });
}

}  // namespace

OwnMotion own_motion(const std::string& name, Trajectory motion, const Machine& machine) {
  if (motion.size() < 2)
    throw UsageError(fmt::format("{}: {} rows; expected at least two", name, motion.size()));
  if (motion.q.cols() != machine.joint_count()) {
    throw UsageError(fmt::format("{}: a motion of {} joints; machine {} has {}", name,
                                 motion.q.cols(), machine.name, machine.joint_count()));
  }
  OwnMotion out;
  out.name = name;
  out.motion = std::move(motion);
  out.motion.stops.clear();  // of the problem that it was made for
  return out;
}

OwnMotion own_motion(const Log& log, const Machine& machine) {
  const MachineSignals signals = make_signals(machine, log);
  const SampleRange range = longest_stretch(signals);
  if (range.size() < 2) {
    throw InputError({log.path, 0, 0}, "", "no two rows in a row have the positions of all joints");
  }
  OwnMotion out;
  out.name = log.file;
  out.from_positions = true;
  out.motion = recorded_motion(machine, signals, range);
  out.notes.push_back(
      "The file gives positions without speeds and accelerations: speeds are those of the smoothed "
      "positions, and a rod slower than 2 mm/s stands.");
  if (range.size() < signals.samples()) {
    out.notes.push_back(
        fmt::format("Only {:.2f} to {:.2f} s is evaluated, the longest stretch without a gap.",
                    signals.time[range.begin], signals.time[range.end - 1]));
  }
  if (!signals.payload_measured) return out;
  const Eigen::VectorXd load = signals.payload.segment(range.begin, range.size());
  out.payload = median(load);
  if (load.maxCoeff() > load.minCoeff()) {
    out.payload_note = fmt::format(
        "The payload changes from {:.4g} to {:.4g} kg; the evaluation takes its "
        "median, {:.4g} kg.",
        load.minCoeff(), load.maxCoeff(), out.payload);
  }
  return out;
}

OwnMotion own_motion(const std::string& name, std::vector<LogColumn> columns,
                     const Machine& machine, const std::string& mapping) {
  std::string header;
  for (const LogColumn& c : columns) header += c.name + ",";
  if (!names_speeds(header, machine)) {
    LogOptions options;
    options.mapping_file = mapping;
    return own_motion(log_from_columns(name, std::move(columns), machine, options), machine);
  }
  std::map<std::string, std::vector<double>> by_name;
  for (LogColumn& c : columns) by_name[c.name] = std::move(c.values);
  return own_motion(name, motion_from_columns(name, by_name, machine), machine);
}

OwnMotion load_own_motion(const std::string& path, const Machine& machine,
                          const std::string& mapping, const Listener& listener) {
  std::istringstream text(read_file(path));
  std::string header;
  std::getline(text, header);
  if (names_speeds(header, machine))
    return own_motion(std::filesystem::path(path).filename().string(), load_motion(path, machine),
                      machine);
  LogOptions options;
  options.mapping_file = mapping;
  const Log log = load_log(path, machine, options);
  for (const std::string& w : log.warnings) listener.say_warning(log.file + ": " + w);
  return own_motion(log, machine);
}

Evaluated evaluate_task(const CraneModel& model, const MotionProblem* problem, OwnMotion given,
                        const EvaluateTask& task) {
  if (!(task.payload < 0.0))  // NaN is refused as well
    require_range((task.verb + ": --payload").c_str(), task.payload, 0.0, 1e6);
  Evaluated out;
  out.by_problem = problem != nullptr;
  if (problem != nullptr) {
    require_one_move(task.verb, *problem);
    out.problem = *problem;
  } else {
    out.problem = own_problem(model, given);
    if (task.payload < 0.0 && !given.payload_note.empty())
      given.notes.push_back(given.payload_note);
  }
  if (task.payload >= 0.0) out.problem.payload = task.payload;
  const std::vector<std::string> missing = model.missing();
  if (!missing.empty()) {
    given.notes.push_back(
        fmt::format("The model has no working pressure for {}: there it counts as zero.",
                    fmt::join(missing, ", ")));
  }
  MotionEvaluation& evaluation = out.evaluation;
  evaluation.file = given.name;
  evaluation.from_positions = given.from_positions;
  evaluation.motion = std::move(given.motion);
  evaluation.notes = std::move(given.notes);
  evaluation.energy = exact_energy(model, out.problem, evaluation.motion);
  evaluation.checks = check_limits(model, out.problem, evaluation.motion);
  if (problem == nullptr) {
    remove_own_ends(evaluation.checks);
  } else {
    evaluation.checks.push_back(check_duration(out.problem, evaluation.motion.duration()));
    std::stable_sort(evaluation.checks.begin(), evaluation.checks.end(),
                     [](const LimitCheck& l, const LimitCheck& r) { return l.excess > r.excess; });
  }
  return out;
}

std::string evaluated_csv(const CraneModel& model, const Evaluated& e, double rate) {
  const Trajectory rows = rate > 0.0 ? at_rate(e.evaluation.motion, rate) : e.evaluation.motion;
  return motion_csv(model, rows, e.problem.payload, least_flows(model.machine, e.problem.limits));
}

}  // namespace sparflow
