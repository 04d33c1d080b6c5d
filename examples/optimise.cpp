/// The library's way from a model to a motion: load a model, evaluate it on states, turn seed paths into starts, optimise, and
/// write the motion as a file (docs/library.md explains each step).
///   optimise [PROBLEM.yaml MODEL.json [MOTION.csv]]
#include <fmt/format.h>

#include <exception>

#include "models/chain/crane_model.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "models/math/units.h"
#include "optimizer/solve/optimize.h"
#include "planners/seed_paths.h"
#include "problems/bundled.h"
#include "problems/motion_table.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

using namespace sparflow;

namespace {

/// Paths clear of obstacles, driven as fast as the limits allow: what the optimiser starts from.
std::vector<SeedMotion> seeds_of(const MotionProblem& problem) {
  const SeedResult found = find_seed_paths(problem);
  if (found.paths.empty()) throw InputError({problem.file, 0, 0}, "", found.message);
  std::vector<SeedMotion> seeds;
  for (const SeedPath& path : found.paths) {
    const TimedMotion timed = time_parametrise(problem, path.path, 0.0);
    if (timed.motion.size() < 2) continue;
    seeds.push_back({path.planner, timed.motion, timed.shortest, path.planner == "straight line"});
  }
  if (seeds.empty()) throw InputError({problem.file, 0, 0}, "", "no path keeps the limits");
  return seeds;
}

/// Evaluates the exact law on states: forces, flows and pressures of every cylinder and the pumps' power.
void print_states(const CraneModel& model, const Trajectory& motion, double payload) {
  Chain chain(model);  // one for each thread; refers to the model
  for (const double share : {0.25, 0.5, 0.75}) {
    const auto k = static_cast<Eigen::Index>(share * static_cast<double>(motion.size() - 1));
    const Eigen::VectorXd q = motion.q.row(k), qd = motion.qd.row(k), qdd = motion.qdd.row(k);
    const MachineState& state = chain.evaluate({q.data(), qd.data(), qdd.data()}, payload);
    fmt::print("  at {:5.2f} s: {:6.2f} kW", motion.t[k], state.power / 1e3);
    for (std::size_t i = 0; i < state.cylinders.size(); ++i) {
      const CylinderState& c = state.cylinders[i];
      fmt::print("; {}: {:.1f} kN, {:.1f} l/min, {:.0f} bar", model.machine.cylinders[i].name,
                 c.total_force / 1e3, c.flow / units::kLitrePerMinute, c.pressure / units::kBar);
    }
    fmt::print("\n");
  }
}

int run(int argc, char** argv) {
  if (argc != 1 && argc != 3 && argc != 4)
    throw UsageError("usage: optimise [PROBLEM.yaml MODEL.json [MOTION.csv]]");
  const std::string file = argc > 1 ? argv[1] : bundled_file("reaches/loader_crane_lift.yaml");
  const CraneModel model =
      load_model(argc > 1 ? argv[2] : bundled_file("models/loader_crane.json"));
  const MotionProblem problem = load_problem(file, &model.machine);

  const OptimizeResult result = optimize(model, problem, seeds_of(problem));
  fmt::print("{}\n", result.message);
  for (const LimitCheck& c : result.checks) {
    fmt::print("  {:<36} {:8.2f} of {:8.2f} {:<6} at {:5.2f} s{}\n", c.what, c.value, c.limit,
               c.unit, c.time, c.excess > OptimizeOptions{}.limit_tolerance ? "  broken" : "");
  }
  if (result.status != OptimizeStatus::kOptimal) return 4;
  print_states(model, result.motion, problem.payload);
  const std::string path = argc == 4 ? argv[3] : "motion.csv";
  write_file_atomically(path, motion_csv(model, result.motion, problem.payload));
  if (result.nearest_line_energy > 0.0)
    fmt::print("straight joint line in the same time: {:.2f} kJ\n",
               result.nearest_line_energy / 1e3);
  fmt::print("{}: {:.2f} kJ by the exact law in {:.2f} s, motion in {}\n", problem.name,
             result.energy.total / 1e3, result.duration, path);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
