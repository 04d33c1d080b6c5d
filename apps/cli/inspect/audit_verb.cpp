#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/audit_page.h"
#include "identification/signals/moves.h"
#include "identification/signals/recorded_motion.h"
#include "models/files/engine_map_file.h"
#include "models/math/error.h"
#include "models/math/robust.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/solve/child_processes.h"
#include "problems/motion_table.h"

namespace sparflow::cli {
namespace {

struct AuditArguments {
  std::string model, mapping, motions, engine_map;
  std::vector<std::string> logs;
  double payload = -1.0;
  double litres = 0.0;
  std::optional<EngineMap> engine;  ///< of the file engine_map
  int most = 40;
  int processes = 0;
  MoveOptions cutting;
  bool bound = true;
  Outputs outputs;
};

/// A move that was found, not yet examined.
struct Found {
  const MachineSignals* signals;
  RecordedMove move;
};

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
    return "The log lacks a joint's position in it.";
  const Eigen::VectorXd load =
      f.signals->payload.segment(f.move.samples.begin, f.move.samples.size());
  if (!load.allFinite()) return "The log lacks the payload in it.";
  if (load.maxCoeff() - load.minCoeff() > largest_payload_change)
    return fmt::format("The payload changes on the way, from {:.0f} to {:.0f} kg.", load.minCoeff(),
                       load.maxCoeff());
  return {};
}

/// The moves of all logs with the longest way, at most `most`, in order of time. @param left_out number of the others
std::vector<Found> find_moves(const std::vector<MachineSignals>& logs, const AuditArguments& a,
                              int& left_out) {
  std::vector<Found> found;
  for (const MachineSignals& s : logs)
    for (const RecordedMove& m : recorded_moves(s, a.cutting)) found.push_back({&s, m});
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

AuditedMove examine(const CraneModel& model, const Found& f, const AuditArguments& a,
                    const MoveAuditOptions& options) {
  AuditedMove out;
  const SampleRange range = f.move.samples;
  out.log = f.signals->file;
  out.from = f.signals->time[range.begin];
  out.to = f.signals->time[range.end - 1];
  const std::vector<double> measured = measured_energy(model.machine, *f.signals, range);
  out.measured = std::accumulate(measured.begin(), measured.end(), 0.0);
  out.recorded = recorded_motion(model.machine, *f.signals, range);
  // what a load cell's noise may be; a load that is taken or put down is more
  const Eigen::VectorXd load = f.signals->payload.segment(range.begin, range.size());
  out.payload = a.payload >= 0.0 ? a.payload : median(load);
  /// @threshold [kg] 0..1000; chosen: the noise of a load cell and of its swinging load
  constexpr double kLeastChange = 50.0;
  /// @threshold [1] 0..1; chosen: the same of a heavy load
  constexpr double kChange = 0.1;
  out.audit.not_judged =
      why_not(f, out.recorded, std::max(kLeastChange, kChange * std::abs(out.payload)));
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
  if (out.audit.judged() && a.bound && !interrupted()) {
    // in a process of its own, which can be ended at any time
    const ChildResult child = run_in_child(
        [&] {
          const EnergyBound bound = energy_bound(model, out.audit.problem);
          return Packer().number(bound.valid ? bound.lower_bound_J : std::nan("")).bytes();
        },
        interrupted);
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

/// Writes the proposed motion of each judged move to move_01.csv and so on, numbered as on the page.
void write_motions(const CraneModel& model, const AuditResult& result, const std::string& folder) {
  int number = 0;
  for (const AuditedMove& m : result.moves) {
    ++number;
    if (!m.audit.judged()) continue;
    write_file_atomically(fmt::format("{}/move_{:02d}.csv", folder, number),
                          motion_csv(model, m.audit.best, m.payload,
                                     least_flows(model.machine, m.audit.problem.limits)));
  }
}

void examine_all(const CraneModel& model, const std::vector<Found>& found, const AuditArguments& a,
                 AuditResult& result) {
  MoveAuditOptions options;
  options.optimize.processes = a.processes > 0 ? a.processes : usable_processors();
  options.optimize.interrupted = interrupted;
  options.seeds = [&](const MotionProblem& problem) {
    SeedOptions paths;
    paths.seconds = 1.0;  // without obstacles the straight lines are nearly all that is needed
    return make_seeds(problem, paths, options.optimize.intervals).motions;
  };
  finish_on_interrupt();
  Progress progress("audit");
  for (std::size_t i = 0; i < found.size() && !interrupted(); ++i) {
    progress(static_cast<double>(i) / static_cast<double>(found.size()),
             fmt::format("move {} of {}", i + 1, found.size()));
    AuditedMove move = examine(model, found[i], a, options);
    if (!interrupted()) result.moves.push_back(std::move(move));
  }
  result.interrupted = interrupted();
}

int run(AuditArguments a) {
  std::vector<NamedFile> inputs = named("LOG", a.logs);
  inputs.push_back({"--model", a.model});
  inputs.push_back({"--mapping", a.mapping});
  inputs.push_back({"--engine-map", a.engine_map});
  check_outputs_apart("audit", a.outputs.files(), inputs);
  a.outputs.check();
  if (!a.motions.empty()) {
    std::error_code error;
    std::filesystem::create_directories(a.motions, error);
    check_writable(a.motions + "/move_01.csv");
  }
  if (!a.engine_map.empty()) a.engine = load_engine_map(a.engine_map);
  const CraneModel model = load_model_with_warnings(a.model);
  const std::vector<std::string> missing = model.missing();
  if (!missing.empty())
    throw InputError(
        {a.model, 0, 0}, "cylinders",
        fmt::format("the model has no working pressure for {}; fit it on a log in which "
                    "that movement occurs",
                    fmt::join(missing, ", ")));
  std::vector<MachineSignals> signals;
  AuditResult result;
  result.litres_per_kWh = a.litres;
  bool payload_known = true, pressure_known = true;
  for (const Log& log : load_logs(a.logs, model.machine, a.mapping)) {
    signals.push_back(make_signals(model.machine, log));
    const MachineSignals& s = signals.back();
    for (const SampleRange& run : s.runs) result.seconds += s.time[run.end - 1] - s.time[run.begin];
    result.at_rest += time_at_rest(s);
    if (a.engine) add_fuel(model.machine, *a.engine, s, result);
    payload_known = payload_known && (s.payload_measured || a.payload >= 0.0);
    for (const PumpSignals& p : s.pumps) pressure_known = pressure_known && p.pressure.size() > 0;
  }
  if (!payload_known)
    result.notes.push_back(
        "A log has no payload: it counts as 0 kg there; --payload gives another.");
  if (!pressure_known)
    result.notes.push_back(
        "A log has no pump pressure, so that nothing tells how far the model can be trusted in "
        "it.");
  const std::vector<Found> found = find_moves(signals, a, result.not_examined);
  if (found.empty())
    throw InputError({a.logs.front(), 0, 0}, "",
                     fmt::format("no move of more than {:.2g} m of the rods together was found in "
                                 "{:.0f} s",
                                 a.cutting.least_way, result.seconds));
  examine_all(model, found, a, result);
  if (!a.motions.empty()) write_motions(model, result, a.motions);
  if (!a.outputs.json.empty()) a.outputs.write_json(audit_json(model, result));
  if (!a.outputs.report.empty()) audit_page(model, result).write(a.outputs.report);
  tell(audit_table(model, result));
  return result.interrupted ? kInterrupted : kDone;
}

}  // namespace

void add_audit_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<AuditArguments>();
  CLI::App* verb = app.add_subcommand(
      "audit", "compare each recorded move with its optimum: what was wasted, where, why");
  verb->add_option("log,--log,-l", a->logs, "recorded logs (CSV or MAT)")
      ->required()
      ->type_name("LOG...");
  verb->add_option("--model", a->model, "fitted model")->required()->type_name("MODEL.json");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--payload", a->payload, "payload; absent: that of the log")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6));
  verb->add_option("--pause", a->cutting.pause_s, "shortest rest that ends a move [s]")
      ->check(number_from(0.1, 60.0))
      ->capture_default_str();
  verb->add_option("--moves", a->most, "moves examined at most: those with the longest way")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  CLI::Option* litres = verb->add_option(
      "--litres-per-kwh", a->litres,
      "fuel for each kWh of hydraulic energy, where no map of the engine is at hand");
  litres->check(number_from(0.0, 10.0));
  verb->add_option(
          "--engine-map", a->engine_map,
          "fuel of the engine over its power, and efficiency of the pump (YAML): litres over "
          "the log, at rest, and saved")
      ->type_name("FILE")
      ->excludes(litres);
  verb->add_option("--motions", a->motions,
                   "folder for the proposed motion of each judged move (move_01.csv, ...)")
      ->type_name("DIR");
  verb->add_flag("!--no-bound", a->bound, "leave the lower bounds of the energy out");
  verb->add_option("--processes", a->processes, "starts solved in parallel; absent: all processors")
      ->check(CLI::Range(1, 256));
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
