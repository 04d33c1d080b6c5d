#include "optimizer/solve/replan.h"

#include <algorithm>
#include <cmath>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/nlp/ipopt_solver.h"
#include "optimizer/phases/motion_modes.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {
namespace {

/// Relative overshoot of a limit between the knots up to which a new plan is taken.
/// @threshold [1] 0..0.2; chosen: limits of the problem leave a reserve for the controller that is larger
constexpr double kExcess = 0.02;

/// What is left of a motion, on a mesh of equal intervals that begins at 0.
Trajectory rest_of(const Trajectory& motion, double t, int intervals) {
  const Eigen::VectorXd at =
      Eigen::VectorXd::LinSpaced(intervals + 1, motion.t[0] + t, motion.t[motion.size() - 1]);
  Trajectory rest = resampled(motion, at);
  rest.t.array() -= at[0];
  return rest;
}

TranscriptionBounds bounds_of(const MotionProblem& problem, int intervals) {
  const auto n = static_cast<Eigen::Index>(problem.limits.position.size());
  TranscriptionBounds::Box boxes[3];
  const std::vector<Range>* ranges[3] = {&problem.limits.position, &problem.limits.velocity,
                                         &problem.limits.acceleration};
  for (int d = 0; d < 3; ++d) {
    boxes[d].lower.resize(n);
    boxes[d].upper.resize(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      boxes[d].lower[j] = (*ranges[d])[static_cast<std::size_t>(j)].lo;
      boxes[d].upper[j] = (*ranges[d])[static_cast<std::size_t>(j)].hi;
    }
  }
  return TranscriptionBounds::uniform(intervals, boxes[0], boxes[1], boxes[2]);
}

/// Limits between the knots that a plan from a moving machine must keep: all but start and rest there.
bool keeps_limits(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion) {
  for (const LimitCheck& c : check_limits(model, problem, motion)) {
    const bool of_the_start =
        c.what == "speed at start and end" || c.what == "distance from the start posture";
    if (!of_the_start && c.excess > kExcess) return false;
  }
  return true;
}

}  // namespace

std::optional<Trajectory> replan(const CraneModel& model, const MotionProblem& problem,
                                 const Underway& now, const ReplanOptions& options) {
  MotionProblem left = problem;
  const Trajectory rest = rest_of(*now.motion, now.t, options.intervals);
  left.start = now.q;
  // The load swings already, which its limit's model from rest does not know.
  left.sway.reset();
  left.duration = {rest.duration(), rest.duration()};
  CraneKnotOptions knot;
  knot.smoothing.pressure = options.pressure;
  knot.energy_weight = std::max(problem.objective.energy, 0.0);
  knot.modes = modes_of(model, left, rest);
  TranscriptionSpec spec;
  spec.t = rest.t;
  spec.bounds = bounds_of(problem, options.intervals);
  apply_modes(model, knot.modes, spec.bounds);
  // The state as measured, as far as limits and modes allow: a cylinder that stands in the plan stands.
  const Eigen::VectorXd q = now.q.cwiseMax(spec.bounds.q_lower.row(0).transpose())
                                .cwiseMin(spec.bounds.q_upper.row(0).transpose());
  const Eigen::VectorXd qd = now.qd.cwiseMax(spec.bounds.qd_lower.row(0).transpose())
                                 .cwiseMin(spec.bounds.qd_upper.row(0).transpose());
  spec.bounds.fix_q(0, q);
  spec.bounds.fix_qd(0, qd);
  spec.bounds.fix_qd(options.intervals, Eigen::VectorXd::Zero(q.size()));
  if (const auto* goal = std::get_if<TipGoal>(&problem.goal)) {
    spec.terminal = std::make_shared<TipAtGoal>(model.machine, goal->tip);
  } else {
    spec.bounds.fix_q(options.intervals, std::get<JointGoal>(problem.goal).q);
  }
  spec.acceleration_weight.resize(q.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const Range& a = problem.limits.acceleration[static_cast<std::size_t>(j)];
    const double full = std::max({std::abs(a.lo), std::abs(a.hi), 1e-6});
    spec.acceleration_weight[j] = 1e-3 / (full * full);  // as in optimize_start.cpp
  }
  spec.knot = std::make_shared<CraneKnotModel>(model, left, knot);
  Transcription transcription(std::move(spec));
  transcription.set_start(rest);
  NlpOptions nlp;
  nlp.tolerance = options.tolerance;
  nlp.max_iterations = options.iterations;
  nlp.max_seconds = options.seconds;
  nlp.mu_init = 1e-3;
  const NlpResult solved = solve_with_ipopt(transcription, nlp);
  if (!solved.solved()) return std::nullopt;
  Trajectory motion = transcription.trajectory(solved.x);
  if (!keeps_limits(model, left, motion)) return std::nullopt;
  return motion;
}

}  // namespace sparflow
