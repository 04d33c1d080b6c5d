#include "apps/tasks/trust/trust_task.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/benchmark/drawn_moves.h"
#include "apps/tasks/benchmark/learned_run.h"
#include "apps/tasks/inputs.h"
#include "apps/tasks/simulate/simulate_task.h"
#include "models/math/error.h"
#include "models/math/interruption.h"
#include "optimizer/solve/child_processes.h"
#include "simulator/controllers/registry.h"
#include "simulator/plant/parameters/plant_effects.h"

namespace sparflow {
namespace {

// Shares of the work, on which only the progress that is told depends.
/// Until the logs are simulated.
/// @threshold [1] 0.01..0.5; chosen: plants are fast
constexpr double kSimulated = 0.05;
/// Until the model is improved.
/// @threshold [1] 0.1..0.9; chosen: diagnosing and optimising take about as long
constexpr double kImproved = 0.55;

plant::PlantParameters parameters_of(const Machine& machine, const TrustTask& task) {
  if (task.parameters) return *task.parameters;
  plant::PlantParameters p = plant::default_parameters(machine);
  std::vector<plant::EffectSetting> settings;
  settings.reserve(task.effects.size());
  for (const std::string& item : task.effects) settings.push_back(plant::parse_effect(item));
  plant::apply_effects(machine, settings, p);
  return p;
}

/// An operator's work on the plant, as its sensors tell it.
Log simulated_log(const std::shared_ptr<const Machine>& machine, const SimulateTask& work,
                  const Listener& listener) {
  const Simulation s = simulate_task(machine, work, listener);
  if (s.interrupted) throw Interruption();
  if (!s.whole()) throw InputError({}, "plant", "its run ended early: " + s.message);
  return log_from_text(fmt::format("simulated_{}.csv", work.seed), s.log, *machine);
}

/// The logs to learn from and to judge on, of one plant at different work.
struct SimulatedLogs {
  std::vector<Log> train, test;
};
SimulatedLogs simulated_logs(const std::shared_ptr<const Machine>& machine,
                             const plant::PlantParameters& parameters, const TrustTask& task,
                             const Listener& listener) {
  SimulateTask work;
  work.parameters = parameters;
  work.rate = task.rate;
  const double learned = task.train_seconds / (task.train_seconds + task.test_seconds);
  Listener part = listener;
  SimulatedLogs logs;
  work.seconds = task.train_seconds;
  work.seed = task.seed;
  part.progress = part_of(listener.progress, 0.0, kSimulated * learned);
  logs.train.push_back(simulated_log(machine, work, part));
  work.seconds = task.test_seconds;
  work.seed = task.seed + 1;
  part.progress = part_of(listener.progress, kSimulated * learned, kSimulated);
  logs.test.push_back(simulated_log(machine, work, part));
  return logs;
}

/// What is done with one move: three motions of one kind each.
enum class Way { kBefore, kAfter, kSequential, kJointPi };
constexpr Way kWays[] = {Way::kBefore, Way::kAfter, Way::kSequential, Way::kJointPi};

const char* controller_of(Way way) {
  return way == Way::kSequential ? "sequential_operator"
         : way == Way::kJointPi  ? "joint_pi"
                                 : "tracked_optimum";
}

/// Computes the motion where the way needs one, and runs it on the plant.
TrackedMotion tracked(const benchmark::Scenario& move, const CraneModel& model, Way way,
                      const Listener& listener) {
  OptimalMotionOptions planning;
  planning.bound = false;
  planning.interrupted = listener.interrupted;
  const bool optimum = way == Way::kBefore || way == Way::kAfter;
  const OptimalMotions motions =
      optimum ? optimal_motions(move, model, planning) : OptimalMotions{};
  TrackedMotion t;
  if (optimum && !motions.found()) {
    t.failure = "there is no energy-optimal motion: " + motions.message();
    return t;
  }
  const control::ControllerInfo& info = *control::find_controller(controller_of(way));
  benchmark::LoopOptions loop;
  loop.stop = listener.interrupted;
  const benchmark::Row row = LearnedRun{move, &model, motions, planning}.run(
      std::string(info.name),
      [&](const control::Knowledge& know) { return control::make_controller(info, know); },
      move.seeds.front(), loop);
  if (!row.done) t.failure = row.reason;
  if (optimum) t.predicted = motions.energy();
  t.measured = row.energy;
  t.tip_error = row.tip_error_end;
  return t;
}

std::string packed(const TrackedMotion& t) {
  return Packer()
      .number(t.predicted)
      .number(t.measured)
      .number(t.tip_error)
      .text(t.failure)
      .bytes();
}

TrackedMotion motion_from(const ChildResult& child) {
  TrackedMotion t;
  if (!child.ok) {
    t.failure = child.error;
    return t;
  }
  Unpacker u(child.bytes);
  t.predicted = u.number();
  t.measured = u.number();
  t.tip_error = u.number();
  t.failure = u.text();
  return t;
}

TrackedMotion& of(TrustedMove& move, Way way) {
  switch (way) {
    case Way::kBefore:
      return move.before;
    case Way::kAfter:
      return move.after;
    case Way::kSequential:
      return move.sequential;
    case Way::kJointPi:
      break;
  }
  return move.joint_pi;
}

/// Every move in every way, each in a process of its own.
void track_all(const std::vector<benchmark::Scenario>& moves, const TrustTask& task,
               const Listener& listener, TrustLoop& loop) {
  loop.moves.reserve(moves.size());
  for (const benchmark::Scenario& m : moves) {
    TrustedMove& move = loop.moves.emplace_back();
    move.name = m.id;
    move.payload = m.payload;
    move.duration = m.goals.front().duration;
  }
  const auto ways = static_cast<int>(std::size(kWays));
  const int count = ways * static_cast<int>(moves.size());
  const auto move_of = [&](int i) { return static_cast<std::size_t>(i / ways); };
  const auto way_of = [&](int i) { return kWays[i % ways]; };
  const std::vector<ChildResult> results = run_in_children(
      count, task.processes > 0 ? task.processes : usable_processors(),
      [&](int i) {
        const Way way = way_of(i);
        const CraneModel& model = way == Way::kAfter ? loop.after() : loop.before();
        return packed(tracked(moves[move_of(i)], model, way, listener));
      },
      [&](int i, int done, const ChildResult&) {
        if (!listener.progress) return;
        listener.progress(kImproved + (1.0 - kImproved) * done / count,
                          fmt::format("{}, {}", moves[move_of(i)].id, controller_of(way_of(i))));
      });
  for (int i = 0; i < count; ++i)
    of(loop.moves[move_of(i)], way_of(i)) = motion_from(results[static_cast<std::size_t>(i)]);
}

/// Learns, diagnoses and extends.
void learn(const Machine& machine, const SimulatedLogs& logs, const TrustTask& task,
           const Listener& listener, TrustLoop& loop) {
  const WorkProgress progress = part_of(listener.progress, kSimulated, kImproved);
  const auto told = [&](double share, const std::string& what) {
    if (progress) progress(share, what);
    if (listener.stop()) throw Interruption();
  };
  /// Share of this part that the fit is, on which only the progress that is told depends.
  /// @threshold [1] 0..0.5; chosen: a diagnosis is ten times the work
  constexpr double kFit = 0.1;
  loop.fitted = fit(machine, logs.train, logs.test, {},
                    [&](double share, const std::string& what) { told(kFit * share, what); });
  if (!loop.fitted.model.complete())
    throw InputError(
        {}, "plant",
        "the simulated log is too short to learn every pressure; ask for more seconds");
  ExtendOptions options;
  options.date = today();
  options.max_steps = task.most_effects;
  options.fit.threads = task.processes;
  loop.improved = improve(
      loop.fitted.model, {logs.train, {}, logs.test}, options,
      [&](double share, const std::string& what) { told(kFit + (1.0 - kFit) * share, what); });
}

}  // namespace

void check_ranges(const TrustTask& task) {
  require_range("trust: train seconds", task.train_seconds, 20.0, 1e5);
  require_range("trust: test seconds", task.test_seconds, 10.0, 1e5);
  require_range("trust: rate", task.rate, 10.0, 1000.0);
  require_range("trust: most effects", task.most_effects, 1, 20);
  require_range("trust: moves", task.moves, 1, 10000);
  require_range("trust: processes", task.processes, 0, 256);
}

TrustLoop trust_task(std::shared_ptr<const Machine> machine, const TrustTask& task,
                     const Listener& listener) {
  check_ranges(task);
  const auto begin = std::chrono::steady_clock::now();
  const auto say = [&](const std::string& sentence) {
    if (task.told) task.told(sentence);
  };
  TrustLoop loop;
  loop.machine = machine->name;
  loop.seed = task.seed;
  loop.effects = task.effects;
  loop.train_seconds = task.train_seconds;
  loop.test_seconds = task.test_seconds;
  const plant::PlantParameters parameters = parameters_of(*machine, task);
  const SimulatedLogs logs = simulated_logs(machine, parameters, task, listener);
  say(fmt::format(
      "Simulated {:.0f} s of an operator's work to learn from and {:.0f} s to judge on.",
      task.train_seconds, task.test_seconds));
  learn(*machine, logs, task, listener, loop);
  loop.test_before = compare(loop.before(), logs.test);
  loop.test_after = compare(loop.after(), logs.test);
  say(trust_story(loop));
  loop.interrupted = loop.improved.interrupted || listener.stop();
  if (!loop.interrupted)
    track_all(drawn_moves(*machine, parameters, task.seed, task.moves), task, listener, loop);
  loop.interrupted = loop.interrupted || listener.stop();
  loop.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return loop;
}

}  // namespace sparflow
