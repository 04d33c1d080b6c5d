#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/evaluation.h"
#include "identification/signals/recorded_motion.h"
#include "models/math/error.h"
#include "models/math/robust.h"
#include "problems/motion_table.h"

namespace sparflow::cli {
namespace {

struct EvaluateArguments {
  std::string model, motion, problem, mapping, output;
  double payload = -1.0;
  double rate = 0.0;
  Outputs outputs;
};

/// Whether the file names a speed and an acceleration of every joint, as motions of `optimize` do.
bool has_speeds(const std::string& path, const Machine& machine) {
  std::istringstream text(read_file(path));
  std::string header;
  std::getline(text, header);
  return std::all_of(machine.joints.begin(), machine.joints.end(), [&](const Joint& j) {
    const char* unit = j.type == JointType::kRevolute ? "rad" : "m";
    return header.find(fmt::format("qd_{}_{}_s", j.name, unit)) != std::string::npos &&
           header.find(fmt::format("qdd_{}_{}_s2", j.name, unit)) != std::string::npos;
  });
}

/// The motion of a file of positions or strokes, and its payload.
struct Recorded {
  Trajectory motion;
  double payload = 0.0;  ///< [kg]
  std::vector<std::string> notes;
};

Recorded read_recording(const EvaluateArguments& a, const Machine& machine) {
  const std::vector<Log> logs = load_logs({a.motion}, machine, a.mapping);
  const MachineSignals signals = make_signals(machine, logs.front());
  const SampleRange range = longest_stretch(signals);
  if (range.size() < 2) {
    throw InputError({a.motion, 0, 0}, "", "no two rows in a row have the positions of all joints");
  }
  Recorded out;
  out.motion = recorded_motion(machine, signals, range);
  out.notes.push_back(
      "The file gives positions without speeds and accelerations: speeds are those of the smoothed "
      "positions, and a rod slower than 2 mm/s stands.");
  if (range.size() < signals.samples()) {
    out.notes.push_back(
        fmt::format("Only {:.2f} to {:.2f} s is evaluated, the longest stretch without a gap.",
                    signals.time[range.begin], signals.time[range.end - 1]));
  }
  if (signals.payload_measured) {
    const Eigen::VectorXd load = signals.payload.segment(range.begin, range.size());
    out.payload = median(load);
    if (a.payload < 0.0 && load.maxCoeff() > load.minCoeff()) {
      out.notes.push_back(
          fmt::format("The payload changes from {:.4g} to {:.4g} kg; the evaluation takes its "
                      "median, {:.4g} kg.",
                      load.minCoeff(), load.maxCoeff(), out.payload));
    }
  }
  return out;
}

/// The machine's own limits, from the motion's own start to its own end.
MotionProblem own_problem(const CraneModel& model, const std::string& file) {
  MotionProblem problem;
  problem.name = std::filesystem::path(file).stem().string();
  problem.machine = model.machine;
  problem.limits = limits_of(model.machine);
  return problem;
}

/// Limits of the start and the goal that a motion sets itself say nothing.
void remove_own_ends(std::vector<LimitCheck>& checks) {
  std::erase_if(checks, [](const LimitCheck& c) {
    return c.what.find("start") != std::string::npos || c.what.find("goal") != std::string::npos;
  });
}

int run(const EvaluateArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("evaluate", outputs,
                      {{"MOTION.csv", a.motion},
                       {"--model", a.model},
                       {"--problem", a.problem},
                       {"--mapping", a.mapping}});
  check_writable(a.output);
  a.outputs.check();
  MotionProblem problem;
  CraneModel model;
  if (!a.problem.empty()) {
    ProblemAndModel both = load_problem_and_model(a.problem, a.model);
    require_one_move("evaluate", both.problem);
    problem = std::move(both.problem);
    model = std::move(both.model);
  } else if (a.model.empty()) {
    throw UsageError("evaluate: give --model MODEL.json, or --problem FILE that names a model");
  } else {
    model = load_model_with_warnings(a.model);
    problem = own_problem(model, a.motion);
  }
  MotionEvaluation evaluation;
  evaluation.file = std::filesystem::path(a.motion).filename().string();
  if (has_speeds(a.motion, model.machine)) {
    evaluation.motion = load_motion(a.motion, model.machine);
  } else {
    Recorded recorded = read_recording(a, model.machine);
    evaluation.motion = std::move(recorded.motion);
    evaluation.from_positions = true;
    evaluation.notes = std::move(recorded.notes);
    if (a.problem.empty()) problem.payload = recorded.payload;
  }
  if (a.payload >= 0.0) problem.payload = a.payload;
  const std::vector<std::string> missing = model.missing();
  if (!missing.empty()) {
    evaluation.notes.push_back(
        fmt::format("The model has no working pressure for {}: there it counts as zero.",
                    fmt::join(missing, ", ")));
  }
  if (a.problem.empty()) {
    problem.start = evaluation.motion.q.row(0).transpose();
    problem.goal = JointGoal{evaluation.motion.q.row(evaluation.motion.size() - 1).transpose()};
  }
  evaluation.energy = exact_energy(model, problem, evaluation.motion);
  evaluation.checks = check_limits(model, problem, evaluation.motion);
  if (a.problem.empty()) {
    remove_own_ends(evaluation.checks);
  } else {
    evaluation.checks.push_back(check_duration(problem, evaluation.motion.duration()));
    std::stable_sort(evaluation.checks.begin(), evaluation.checks.end(),
                     [](const LimitCheck& l, const LimitCheck& r) { return l.excess > r.excess; });
  }
  if (!a.output.empty()) {
    const Trajectory rows = a.rate > 0.0 ? at_rate(evaluation.motion, a.rate) : evaluation.motion;
    write_file_atomically(a.output, motion_csv(model, rows, problem.payload,
                                               least_flows(model.machine, problem.limits)));
  }
  if (!a.outputs.json.empty()) a.outputs.write_json(evaluation_json(model, problem, evaluation));
  if (!a.outputs.report.empty())
    evaluation_page(model, problem, evaluation).write(a.outputs.report);
  tell(evaluation_table(model, problem, evaluation));
  return a.problem.empty() || limits_kept(evaluation) ? kDone : kVerification;
}

}  // namespace

void add_evaluate_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<EvaluateArguments>();
  CLI::App* verb =
      app.add_subcommand("evaluate", "price a motion of your own: energy, losses, limits");
  verb->add_option("motion", a->motion,
                   "motion (CSV) of optimize, or a log or table with t_s and q_<joint> or "
                   "x_<cylinder>_m")
      ->required()
      ->type_name("MOTION.csv");
  verb->add_option("--model", a->model, "fitted model; absent: the one that the problem names")
      ->type_name("MODEL.json");
  verb->add_option(
          "--problem,-p", a->problem,
          "motion problem (YAML) whose limits, obstacles, payload, duration, start and goal judge "
          "the motion; exit code 5 when it breaks one")
      ->type_name("FILE");
  verb->add_option("--payload", a->payload, "payload; absent: that of the problem or of the log")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6));
  verb->add_option("--output,-o", a->output,
                   "motion with flows, pressures, strokes and commands to write (CSV)")
      ->type_name("MOTION.csv");
  verb->add_option("--rate", a->rate, "rows per second of --output; absent: as in the motion")
      ->type_name("HZ")
      ->check(number_from(0.1, 1e5));
  verb->add_option("--mapping", a->mapping,
                   "mapping file for tables with other column names (YAML)")
      ->type_name("FILE");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
