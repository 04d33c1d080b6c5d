#include "apps/tasks/audit_task.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/benchmark/learned_machine.h"
#include "apps/tasks/motion_inputs.h"
#include "identification/data_checks/set_aside.h"
#include "identification/signals/recorded_motion.h"
#include "models/math/error.h"
#include "models/math/robust.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/solve/child_processes.h"

namespace sparflow {
namespace {

/// The signals of a log and what was set aside in them.
struct CheckedLog {
  MachineSignals signals;
  std::vector<std::pair<Role, BadChannel>> bad;
};

CheckedLog checked_log(const Machine& machine, const Log& log) {
  CheckedSignals checked = checked_signals(machine, log, {}, {}, Staying::kNothing);
  CheckedLog out{std::move(checked.signals), {}};
  for (BadChannel& b : checked.bad) {
    const auto channel = std::find_if(log.channels.begin(), log.channels.end(),
                                      [&](const Channel& c) { return c.signal == b.channel; });
    out.bad.emplace_back(channel->role, std::move(b));
  }
  return out;
}

/// A move that was found, not yet examined.
struct Found {
  const CheckedLog* log;
  RecordedMove move;
};

/// The first fault found in the logs as a further sentence; empty without one.
std::string first_fault(const std::vector<CheckedLog>& logs) {
  for (const CheckedLog& log : logs)
    if (!log.bad.empty())
      return fmt::format(". Set aside in {}: {}", log.signals.file,
                         bad_channel_sentence(log.bad.front().second));
  return {};
}

/// Why a quantity is missing in a move: a channel with one of these roles is faulty there, or the log lacks it.
std::string lacks(const Found& f, const std::string& what, const std::vector<Role>& roles) {
  const Eigen::VectorXd& t = f.log->signals.time;
  const double from = t[f.move.samples.begin], to = t[f.move.samples.end - 1];
  for (const auto& [role, b] : f.log->bad) {
    const bool here = std::any_of(b.stretches.begin(), b.stretches.end(),
                                  [&](const auto& s) { return s.first <= to && s.second >= from; });
    if (here && std::find(roles.begin(), roles.end(), role) != roles.end())
      return "Bad data in it: " + bad_channel_sentence(b);
  }
  return fmt::format("The log lacks {} in it.", what);
}

/// Why a move cannot be compared with another motion; empty: it can.
std::string why_not(const Found& f, const Trajectory& recorded, double largest_payload_change) {
  if (!f.move.from_rest) return "It begins in motion, at a gap or the beginning of the log.";
  if (!f.move.to_rest) return "It ends in motion, at a gap or the end of the log.";
  /// Least share of the rods' way that leads from the start to the end.
  /// @threshold [1] 0..1; chosen: what turns back more than this went its way for the way's sake (a cycle, a test), which an
  /// optimum from start to end leaves out
  constexpr double kLeastGain = 0.2;
  if (f.move.gain < kLeastGain * f.move.way)
    return fmt::format(
        "It ends near where it began ({:.2f} m from it, after {:.2f} m of the rods together): the "
        "way "
        "was its work.",
        f.move.gain, f.move.way);
  if (!recorded.q.allFinite() || !recorded.qd.allFinite())
    return lacks(f, "a joint's position", {Role::kJointPosition, Role::kStroke});
  const Eigen::VectorXd load =
      f.log->signals.payload.segment(f.move.samples.begin, f.move.samples.size());
  if (!load.allFinite()) return lacks(f, "the payload", {Role::kPayload});
  if (load.maxCoeff() - load.minCoeff() > largest_payload_change)
    return fmt::format("The payload changes on the way, from {:.0f} to {:.0f} kg.", load.minCoeff(),
                       load.maxCoeff());
  return {};
}

/// The moves of all logs with the longest way, at most `most`, in order of time. @param left_out number of the others
std::vector<Found> find_moves(const std::vector<CheckedLog>& logs, const AuditTask& a,
                              int& left_out) {
  std::vector<Found> found;
  for (const CheckedLog& log : logs)
    for (const RecordedMove& m : recorded_moves(log.signals, a.cutting)) found.push_back({&log, m});
  left_out = std::max(0, static_cast<int>(found.size()) - a.most);
  if (left_out == 0) return found;
  std::vector<double> ways;
  ways.reserve(found.size());
  for (const Found& f : found) ways.push_back(f.move.way);
  std::nth_element(ways.begin(), ways.begin() + left_out, ways.end());
  const double least = ways[static_cast<std::size_t>(left_out)];
  std::erase_if(found, [&](const Found& f) { return f.move.way < least; });
  return found;
}

AuditedMove examine(const CraneModel& model, const Found& f, const AuditTask& a,
                    const MoveAuditOptions& options, const Listener& listener) {
  AuditedMove out;
  const SampleRange range = f.move.samples;
  const MachineSignals& signals = f.log->signals;
  out.log = signals.file;
  out.from = signals.time[range.begin];
  out.to = signals.time[range.end - 1];
  const std::vector<double> measured = measured_energy(model.machine, signals, range);
  out.measured = std::accumulate(measured.begin(), measured.end(), 0.0);
  out.recorded = recorded_motion(model.machine, signals, range);
  // what a load cell's noise may be; a load that is taken or put down is more
  const Eigen::VectorXd load = signals.payload.segment(range.begin, range.size());
  out.payload = a.payload >= 0.0 ? a.payload : median(load);
  /// @threshold [kg] 0..1000; chosen: the noise of a load cell and of its swinging load
  constexpr double kLeastChange = 50.0;
  /// @threshold [1] 0..1; chosen: the same of a heavy load
  constexpr double kChange = 0.1;
  out.audit.not_judged =
      why_not(f, out.recorded, std::max(kLeastChange, kChange * std::abs(out.payload)));
  const bool logged = std::all_of(signals.pumps.begin(), signals.pumps.end(),
                                  [](const PumpSignals& p) { return p.pressure.size() > 0; });
  if (out.audit.judged() && logged && !std::isfinite(out.measured))
    out.audit.not_judged = lacks(f, "the pump's pressure", {Role::kPumpPressure});
  if (!out.audit.judged()) return out;
  out.recorded.t.array() -= out.from;
  out.recorded.qd.row(0).setZero();
  out.recorded.qd.row(out.recorded.size() - 1).setZero();
  out.audit = audit_move(model, out.recorded, out.payload, options);
  /// Largest relative distance of the model's energy of the recorded motion from the measured energy.
  /// @threshold [1] 0..1; chosen: as large as most savings are
  constexpr double kMostModelError = 0.25;
  if (out.audit.judged() && std::abs(out.model_error()) > kMostModelError)
    out.audit.not_judged = fmt::format(
        "The model's energy of it is {:+.0f} % off the measured: extend or improve the model "
        "first.",
        100.0 * out.model_error());
  if (out.audit.judged() && a.bound && !listener.stop()) {
    // in a process of its own, which can be ended at any time
    const ChildResult child = run_in_child(
        [&] {
          const EnergyBound bound = energy_bound(model, out.audit.problem);
          return Packer().number(bound.valid ? bound.lower_bound_J : std::nan("")).bytes();
        },
        [&] { return listener.stop(); });
    if (child.ok) out.bound = Unpacker(child.bytes).number();
  }
  if (out.audit.judged() && a.engine) {
    out.fuel_recorded = fuel_of(*a.engine, pumps_along(model, out.recorded, out.payload));
    out.fuel_optimum = fuel_of(*a.engine, pumps_along(model, out.audit.best, out.payload));
  }
  return out;
}

/// Adds the fuel of a log, by its logged pressures.
void add_fuel(const Machine& machine, const EngineMap& engine, const MachineSignals& signals,
              AuditResult& result) {
  result.engine_map = true;
  for (const SampleRange& run : signals.runs)
    result.fuel += fuel_of(engine, measured_pumps(machine, signals, run));
  result.fuel_at_rest += engine.fuel_rate(0.0) * time_at_rest(signals);
}

/// Time from rest to full speed that valves are given in the optimum.
/// @threshold [s] 0..5; chosen: somewhat above an operator's lever time; spools and pilot lines follow within 0.4 s
constexpr double kRamp = 0.8;

/// Lets the optimum accelerate no joint faster than valves can, or than the recording did where that was faster.
void narrow_accelerations(const CraneModel& model, const Trajectory& recorded,
                          MotionLimits& limits) {
  const std::vector<Range> machine = limits.acceleration;
  limit_accelerations(model, recorded.q.row(0).transpose(), kRamp, limits);
  for (Eigen::Index j = 0; j < recorded.qdd.cols(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    Range& a = limits.acceleration[k];
    a.lo = std::max(machine[k].lo, std::min(a.lo, recorded.qdd.col(j).minCoeff()));
    a.hi = std::min(machine[k].hi, std::max(a.hi, recorded.qdd.col(j).maxCoeff()));
  }
}

void examine_all(const CraneModel& model, const std::vector<Found>& found, const AuditTask& a,
                 const Listener& listener, AuditResult& result) {
  MoveAuditOptions options;
  options.optimize.processes = a.processes > 0 ? a.processes : usable_processors();
  options.optimize.interrupted = listener.interrupted;
  options.seeds = [&](const MotionProblem& problem) {
    SeedOptions paths;
    paths.seconds = 1.0;  // without obstacles the straight lines are nearly all that is needed
    return make_seeds(problem, paths, options.optimize.intervals).motions;
  };
  options.narrow = [&](const Trajectory& recorded, MotionLimits& limits) {
    narrow_accelerations(model, recorded, limits);
  };
  if (a.searching) a.searching();
  for (std::size_t i = 0; i < found.size() && !listener.stop(); ++i) {
    if (listener.progress)
      listener.progress(static_cast<double>(i) / static_cast<double>(found.size()),
                        fmt::format("move {} of {}", i + 1, found.size()));
    AuditedMove move = examine(model, found[i], a, options, listener);
    if (!listener.stop()) result.moves.push_back(std::move(move));
  }
  result.interrupted = listener.stop();
}

}  // namespace

void check_ranges(const AuditTask& task) {
  require_range_or("audit: --payload", task.payload, -1.0, 0.0, 1e6);
  require_range("audit: --pause", task.cutting.pause_s, 0.1, 60.0);
  require_range("audit: --moves", task.most, 1, 100000);
  require_range("audit: --litres-per-kwh", task.litres_per_kWh, 0.0, 10.0);
  require_range("audit: --processes", task.processes, 0, 256);
}

AuditResult audit_task(const CraneModel& model, std::vector<Log>&& logs, const AuditTask& task,
                       const Listener& listener) {
  check_ranges(task);
  std::vector<CheckedLog> checked;
  checked.reserve(logs.size());
  AuditResult result;
  result.litres_per_kWh = task.litres_per_kWh;
  bool payload_known = true, pressure_known = true;
  for (const Log& log : logs) {
    checked.push_back(checked_log(model.machine, log));
    const MachineSignals& s = checked.back().signals;
    for (const auto& [role, b] : checked.back().bad)
      result.notes.push_back(fmt::format("Set aside in {}: {}", log.file, bad_channel_sentence(b)));
    for (const SampleRange& run : s.runs) result.seconds += s.time[run.end - 1] - s.time[run.begin];
    result.at_rest += time_at_rest(s);
    if (task.engine) add_fuel(model.machine, *task.engine, s, result);
    payload_known = payload_known && (s.payload_measured || task.payload >= 0.0);
    for (const PumpSignals& p : s.pumps) pressure_known = pressure_known && p.pressure.size() > 0;
  }
  const std::string first = logs.front().path;
  std::vector<Log>().swap(logs);  // what follows needs their signals alone
  if (!payload_known)
    result.notes.push_back(
        "A log has no payload: it counts as 0 kg there; --payload gives another.");
  if (!pressure_known)
    result.notes.push_back(
        "A log has no pump pressure, so that nothing tells how far the model can be trusted in "
        "it.");
  const std::vector<Found> found = find_moves(checked, task, result.not_examined);
  if (found.empty())
    throw InputError({first, 0, 0}, "",
                     fmt::format("no move of more than {:.2g} m of the rods together was found in "
                                 "{:.0f} s{}",
                                 task.cutting.least_way, result.seconds, first_fault(checked)));
  examine_all(model, found, task, listener, result);
  return result;
}

}  // namespace sparflow
