/// Replays optimised motions on a plant that shares no law with the model: the simulator's crane with its own body
/// forces, return lines, counterbalance valves and pump (simulator/hidden_effects/plant.h), of which the model was
/// identified from a noisy log.
///   build/bench/replay [--cranes 2] [--json OUT.json]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/motion_cases.h"
#include "bench/planned_seeds.h"
#include "bench/program_options.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/plant.h"

namespace {

using namespace sparflow;
using namespace sparflow::bench;

constexpr int kDensity = 16;  // steps of the replay in each mesh interval
constexpr int kOtherDensity =
    37;  // samples of each interval at which limits are also checked; the optimiser never uses this density

struct Replayed {
  double energy = 0.0;        // [J]
  double furthest = 0.0;      // [rad] or [m] largest distance from the motion
  double top_pressure = 0.0;  // [Pa] largest pump pressure
};

/// Positions of a motion at time t [s].
struct Instant3 {
  Eigen::VectorXd q, qd;
};
Instant3 at_time(const Trajectory& motion, double t) {
  const double* begin = motion.t.data();
  const double* end = begin + motion.size();
  const Eigen::Index k =
      std::clamp<Eigen::Index>(std::upper_bound(begin, end, t) - begin - 1, 0, motion.size() - 2);
  const double dt = t - motion.t[k];
  return {motion.q.row(k) + dt * motion.qd.row(k) + 0.5 * dt * dt * motion.qdd.row(k),
          motion.qd.row(k) + dt * motion.qdd.row(k)};
}

/// Drives a motion. The levers give the plant's rods the motion's speeds; deviations of position are corrected with a
/// time constant of half a second. Power is evaluated in the middle of every step, because speeds jump at knots only.
Replayed replay(const Machine& machine, const simulator::CraneLaws& laws, const Trajectory& motion,
                double payload) {
  const auto steps = static_cast<long>(kDensity * (motion.size() - 1));
  const double h = motion.duration() / static_cast<double>(steps);
  constexpr double kSteering = 2.0;  // [1/s]
  std::vector<std::unique_ptr<simulator::HiddenLaw>> none;
  const Eigen::VectorXd start = motion.q.row(0);
  simulator::Plant plant(machine, laws, none, {start.data(), start.data() + start.size()}, h);
  Replayed result;
  std::vector<double> command(machine.cylinders.size());
  for (long i = 0; i < steps; ++i) {
    const double t = motion.t[0] + (static_cast<double>(i) + 0.5) * h;
    const Instant3 wanted = at_time(motion, t);
    for (std::size_t c = 0; c < command.size(); ++c) {
      const Cylinder& cylinder = machine.cylinders[c];
      const int j = cylinder.joint;
      double qd = wanted.qd[j];
      if (qd != 0.0) {
        const double stray = wanted.q[j] - h * qd - plant.state().q[static_cast<std::size_t>(j)];
        const double steered = qd + kSteering * stray;
        qd = steered * qd > 0.0 ? steered : qd;
      }
      const double speed = plant.state().cylinders[c].rate * qd;
      const simulator::DirectionLaws& law = laws.cylinders[c].direction[speed > 0.0 ? 0 : 1];
      const double area = speed > 0.0 ? cylinder.area_piston() : cylinder.area_rod();
      command[c] = std::abs(speed) <= kRestSpeed ? 0.0 : speed * area / law.valve_gain;
    }
    plant.step(payload, 40.0, command);
    for (const simulator::PumpState& pump : plant.state().pumps) {
      result.energy += h * pump.pressure * pump.flow;
      result.top_pressure = std::max(result.top_pressure, pump.pressure);
    }
    for (Eigen::Index j = 0; j < wanted.q.size(); ++j)
      result.furthest = std::max(
          result.furthest, std::abs(wanted.q[j] - plant.state().q[static_cast<std::size_t>(j)]));
  }
  return result;
}

/// Identifies a model of one crane from a log of ten minutes of work without hidden effects.
CraneModel learned(const Machine& machine, std::uint64_t crane) {
  simulator::LogRequest request;
  request.machine = machine;
  request.crane_seed = request.motion_seed = crane;
  request.seconds = 600.0;
  const std::string name = fmt::format("crane {}.csv", crane);
  return fit(machine, {log_from_text(name, csv_text(generate(request)), machine)}).model;
}

struct Outcome {
  std::string reach, status;
  double reported = 0.0, replayed = 0.0;  // [J]
  double excess = 0.0, excess_other = 0.0;
  double furthest = 0.0, outside = 0.0;
  double difference() const { return replayed / reported - 1.0; }
};

Outcome run_reach(const CraneModel& model, const simulator::CraneLaws& laws,
                  const MotionProblem& problem) {
  Outcome outcome{problem.name, {}};
  OptimizeOptions options;
  options.sequence_rounds = 1;  // A motion near the optimum suffices for a replay.
  const OptimizeResult r = optimize(model, problem, planned_seeds(problem, 4, 100), options);
  outcome.status = to_string(r.status);
  if (r.status != OptimizeStatus::kOptimal) return outcome;
  const Replayed again = replay(problem.machine, laws, r.motion, problem.payload);
  outcome.reported = r.energy.total;
  outcome.replayed = again.energy;
  outcome.furthest = again.furthest;
  outcome.outside = r.energy.moving_share_outside_data;
  outcome.excess = worst_excess(check_limits(model, problem, r.motion, kDensity));
  outcome.excess_other = worst_excess(check_limits(model, problem, r.motion, kOtherDensity));
  return outcome;
}

int run(int cranes, const std::string& json_path) {
  const std::vector<MotionProblem> reaches = loader_crane_reaches();
  const Machine& machine = reaches.front().machine;
  nlohmann::json json;
  std::vector<double> differences;
  double worst = 0.0, excess = 0.0;
  int unsolved = 0;
  fmt::print("{:6} {:14} {:>10} {:>10} {:>9} {:>10} {:>11} {:>11} {:>9}\n", "crane", "reach",
             "reported", "replayed", "differs", "strays by", "limits x16", "limits x37", "outside");
  for (int crane = 1; crane <= cranes; ++crane) {
    const CraneModel model = learned(machine, static_cast<std::uint64_t>(crane));
    const simulator::CraneLaws laws =
        simulator::draw_crane_laws(machine, static_cast<std::uint64_t>(crane));
    for (const MotionProblem& problem : reaches) {
      const Outcome o = run_reach(model, laws, problem);
      if (o.reported == 0.0) {
        fmt::print("{:<6} {:14} {}\n", crane, o.reach, o.status);
        ++unsolved;
        continue;
      }
      fmt::print(
          "{:<6} {:14} {:7.2f} kJ {:7.2f} kJ {:+7.2f} % {:10.1e} {:11.1e} {:11.1e} {:7.1f} %\n",
          crane, o.reach, 1e-3 * o.reported, 1e-3 * o.replayed, 100.0 * o.difference(), o.furthest,
          o.excess, o.excess_other, 100.0 * o.outside);
      differences.push_back(std::abs(o.difference()));
      worst = std::max(worst, std::abs(o.difference()));
      excess = std::max({excess, o.excess, o.excess_other});
      json["motions"].push_back({{"crane", crane},
                                 {"reach", o.reach},
                                 {"reported_J", o.reported},
                                 {"replayed_J", o.replayed},
                                 {"excess_16", o.excess},
                                 {"excess_37", o.excess_other}});
    }
  }
  fmt::print(
      "\n{} motions, {} not found: reported and replayed energy differ by {:.2f} % in the median, "
      "{:.2f} % at worst;\nlargest relative overshoot of a limit, at 16 and 37 times the knots' "
      "density: {:.1e}\n",
      differences.size(), unsolved, 100.0 * median(differences), 100.0 * worst, excess);
  json["median_difference"] = median(differences);
  json["worst_difference"] = worst;
  json["worst_excess"] = excess;
  if (!json_path.empty()) write_file_atomically(json_path, json.dump(2) + "\n");
  return differences.empty() ? 4 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  setvbuf(stdout, nullptr, _IOLBF, 0);  // The run takes minutes, so each line is printed at once.
  int cranes = 2;
  std::string json;
  bench::ProgramOptions app(
      "Optimised motions replayed on a simulated crane that shares no law with the model.");
  app.add("--cranes", cranes, "number of cranes of the same drawing, each with laws of its own")
      .range(1, 100);
  app.add("--json", json, "file for the figures (JSON)");
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    return run(cranes, json);
  } catch (const InputError& error) {
    std::cerr << "replay: " << error.what() << "\n";
    return 3;
  }
}
