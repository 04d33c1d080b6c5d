#include "apps/tasks/benchmark/optimal_motions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/tasks/benchmark/learned_machine.h"
#include "apps/tasks/benchmark/smoothed_motion.h"
#include "apps/tasks/motion_inputs.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_time.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/solve/child_processes.h"
#include "optimizer/solve/optimize.h"
#include "optimizer/solve/replan.h"

namespace sparflow {
namespace {

/// Payload before a goal is reached. [kg]
double payload_before(const benchmark::Scenario& s, int leg) {
  double payload = s.payload;
  for (int g = 0; g < leg; ++g) {
    const auto& after = s.goals[static_cast<std::size_t>(g)].payload;
    if (after) payload = *after;
  }
  return payload;
}

/// The larger of the estimated bounds of any motion and of motions in this time. [J] 0: none
double bound_of(const CraneModel& model, const MotionProblem& problem) {
  const EnergyBound any = energy_bound(model, problem);
  if (!any.valid) return 0.0;
  TimedBoundOptions options;
  options.any_duration = any.lower_bound_J;
  const TimedBound timed = energy_bound_at(model, problem, problem.duration.max, options);
  return std::max(any.lower_bound_J, timed.valid ? timed.value : 0.0);
}

OptimalLeg solve(MotionProblem problem, const CraneModel& model, const OptimalMotionOptions& o) {
  OptimalLeg leg;
  const double time = problem.duration.max;
  if (time <= o.smoothing) {
    leg.message = fmt::format("{:.1f} s are no longer than the {:.1f} s of its moving average",
                              time, o.smoothing);
    return leg;
  }
  problem.duration = {time - o.smoothing, time - o.smoothing};
  OptimizeOptions options;
  options.intervals = o.intervals;
  options.processes = 1;
  options.interrupted = o.interrupted;
  SeedOptions seeds;
  seeds.random_seed = o.seed;
  const Seeds found = make_seeds(problem, seeds, options.intervals);
  const OptimizeResult r = optimize(model, problem, found.motions, options);
  leg.solve_s = r.solve_s;
  if (r.motion.size() < 2 ||
      (r.status != OptimizeStatus::kOptimal && r.status != OptimizeStatus::kFeasible)) {
    leg.message = r.message.empty() ? found.paths.message : r.message;
    return leg;
  }
  leg.motion = smoothed(r.motion, o.smoothing);
  leg.energy = exact_total_energy(model, problem, leg.motion);
  problem.duration = {time, time};  // the bound is of every motion in this time
  if (o.bound && !(o.interrupted && o.interrupted())) leg.bound = bound_of(model, problem);
  return leg;
}

/// A goal's motion. One that has no time for ramps and smoothing gets shorter ones.
OptimalLeg solve_leg(const benchmark::Scenario& s, const CraneModel& model, int leg,
                     const Eigen::VectorXd& from, const OptimalMotionOptions& o) {
  OptimalMotionOptions now = o;
  OptimalLeg found = solve(problem_of(s, model, leg, from, now), model, now);
  while (found.motion.size() < 2 && 0.5 * now.ramp >= o.shortest_ramp &&
         !(o.interrupted && o.interrupted())) {
    now.ramp *= 0.5;
    now.smoothing *= 0.5;
    const double spent = found.solve_s;
    found = solve(problem_of(s, model, leg, from, now), model, now);
    found.solve_s += spent;
  }
  return found;
}

}  // namespace

MotionProblem problem_of(const benchmark::Scenario& s, const CraneModel& model, int leg,
                         const Eigen::VectorXd& from, const OptimalMotionOptions& o) {
  const benchmark::ScenarioGoal& goal = s.goals[static_cast<std::size_t>(leg)];
  MotionProblem p;
  p.name = fmt::format("{}, goal {}", s.id, leg + 1);
  p.file = s.file;
  p.machine = model.machine;
  p.limits = limits_of(model.machine);
  p.limits.valve_fraction = o.flow_share;
  for (double& flow : p.limits.pump_max_flow) flow *= o.flow_share;
  limit_accelerations(model, from, o.ramp, p.limits);
  p.payload = payload_before(s, leg);
  p.start = from;
  if (goal.q) {
    p.goal = JointGoal{*goal.q};
  } else {
    p.goal = TipGoal{goal.tip};
  }
  p.duration = {goal.duration, goal.duration};
  const double rope = s.plant.pendulum.rope_length;
  if (o.sway_limit > 0.0 && rope > 0.0)
    p.sway = SwayLimit{rope, o.sway_limit, o.sway_end_share * o.sway_limit};
  return p;
}

OptimalMotions optimal_motions(const benchmark::Scenario& s, const CraneModel& model,
                               const OptimalMotionOptions& o) {
  OptimalMotions all;
  Eigen::VectorXd from = s.start;
  for (int g = 0; g < static_cast<int>(s.goals.size()); ++g) {
    OptimalLeg leg;
    if (g > 0 && all.legs.back().motion.size() < 2) {
      leg.message = "there is no motion to the goal before";
    } else {
      leg = solve_leg(s, model, g, from, o);
      if (leg.motion.size() > 1) from = leg.motion.q.row(leg.motion.size() - 1);
    }
    all.legs.push_back(std::move(leg));
  }
  return all;
}

bool OptimalMotions::found() const {
  return !legs.empty() && std::all_of(legs.begin(), legs.end(),
                                      [](const OptimalLeg& l) { return l.motion.size() > 1; });
}

double OptimalMotions::energy() const {
  if (!found()) return std::nan("");
  double sum = 0.0;
  for (const OptimalLeg& l : legs) sum += l.energy;
  return sum;
}

double OptimalMotions::bound() const {
  double sum = 0.0;
  for (const OptimalLeg& l : legs) {
    if (l.bound <= 0.0) return std::nan("");
    sum += l.bound;
  }
  return sum;
}

double OptimalMotions::solve_s() const {
  double sum = 0.0;
  for (const OptimalLeg& l : legs) sum += l.solve_s;
  return sum;
}

std::string OptimalMotions::message() const {
  for (const OptimalLeg& l : legs)
    if (!l.message.empty()) return l.message;
  return "";
}

std::string packed(const OptimalMotions& motions) {
  Packer p;
  p.number(static_cast<double>(motions.legs.size()));
  for (const OptimalLeg& l : motions.legs) {
    p.text(l.message).number(l.energy).number(l.bound).number(l.solve_s);
    p.matrix(l.motion.t).matrix(l.motion.q).matrix(l.motion.qd).matrix(l.motion.qdd);
  }
  return p.bytes();
}

OptimalMotions motions_from(const std::string& bytes) {
  Unpacker u(bytes);
  OptimalMotions all;
  all.legs.resize(static_cast<std::size_t>(u.number()));
  for (OptimalLeg& l : all.legs) {
    l.message = u.text();
    l.energy = u.number();
    l.bound = u.number();
    l.solve_s = u.number();
    l.motion.t = u.matrix();
    l.motion.q = u.matrix();
    l.motion.qd = u.matrix();
    l.motion.qdd = u.matrix();
  }
  return all;
}

Trajectory ScenarioMotions::motion(const control::Task& task) {
  const auto leg = static_cast<std::size_t>(task.leg);
  if (leg >= motions_.legs.size())
    throw control::ControllerFailure("there is no energy-optimal motion: it was not computed");
  const OptimalLeg& l = motions_.legs[leg];
  if (l.motion.size() < 2)
    throw control::ControllerFailure("there is no energy-optimal motion: " + l.message);
  return l.motion;
}

std::optional<Trajectory> ScenarioMotions::motion_from(const control::Task& task,
                                                       const control::Measurement& now,
                                                       const Trajectory& current, double t) {
  const MotionProblem problem = problem_of(scenario_, model_, task.leg, now.q, options_);
  return replan(model_, problem, {&current, t, now.q, now.qd});
}

}  // namespace sparflow
