/// One start: smooth stages, solves with fixed modes, bound tightening.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "optimizer/phases/tightening.h"
#include "optimizer/solve/optimize.h"
#include "optimizer/solve/optimize_outcome.h"
#include "optimizer/solve/start_nlp.h"
#include "optimizer/sway/sway_model.h"

namespace sparflow {
namespace {

class Start {
 public:
  Start(const CraneModel& model, const MotionProblem& problem, const TimeWindow& time,
        const OptimizeOptions& options)
      : model_(model), problem_(problem), time_(time), options_(options) {
    uniform_mesh();
    tightening_.position.assign(model.machine.joints.size(), 0.0);
  }

  StartResult run(const ModeCandidate& candidate) {
    result_.seed = candidate.name;
    keep_clear_ends(candidate.guess);
    offer(candidate.guess, false, false);
    hold(candidate.modes, candidate.guess, true);
    if (result_.plan.count() > 0) {
      approach(result_.plan, result_.motion, false);
    } else if (candidate.guess.size() == candidate.modes.rows() + 1) {
      approach(plan_of(candidate.modes, candidate.guess.t), candidate.guess, true);
    }
    return finished();
  }

  StartResult run(const std::string& name, const PhasePlan& plan, const Trajectory& guess,
                  bool overlaps) {
    result_.seed = name;
    keep_clear_ends(guess);
    offer(guess, false, false);
    if (problem_.obstacles.empty() || result_.excess > options_.limit_tolerance) {
      hold_plan(plan, guess, overlaps);
      approach(result_.plan, result_.motion, false);
    } else {
      approach(plan, guess, overlaps);
    }
    return finished();
  }

  StartResult run(const SeedMotion& seed) {
    result_.seed = seed.name;
    const Trajectory timed = with_duration(seed.motion, time_.guess);
    /// Relative excess up to which a seed keeps the limits.
    /// @threshold [1] 0..0.1; chosen: time scaling of a seed on its own mesh: see time_parametrise
    constexpr double kSeedExcess = 1e-3;
    result_.seed_feasible = worst_excess(verdict(timed).checks) <= kSeedExcess;
    if (result_.seed_feasible) result_.seed_energy = verdict(timed).energy;
    keep_clear_ends(timed);
    if (options_.modes)
      offer(timed, false, false);  // so no start ends with more energy than its seed
    // The seed's own modes are solved first, so the smooth law can only improve on that result.
    if (options_.modes) hold_modes(resampled(timed, mesh_.times));
    Trajectory motion = timed;
    // Waypoints and stops need phases.
    const bool one_move = problem_.waypoints.empty() && problem_.stops.empty();
    const std::size_t stages = one_move ? options_.schedule.size() : 0;
    for (std::size_t stage = 0; stage < stages; ++stage) {
      uniform_mesh();
      const bool last = stage + 1 == options_.schedule.size();
      const bool rough = options_.modes || !last;
      const NlpResult solved =
          solve(motion, options_.schedule[stage], rough ? 1e-2 : options_.tolerance);
      note_status(solved);
      if (solved.status == NlpStatus::kInterrupted) return finished();
      if (!usable(solved)) break;  // the last usable motion, if any, has supplied the modes
      motion = motion_of(solved);
      if (options_.modes || last) {
        keep_limits(motion, options_.schedule[stage], !options_.modes);
      }
      if (options_.modes) hold_modes(motion);
    }
    if (options_.modes) approach(result_.plan, result_.motion, false);
    return finished();
  }

 private:
  /// The motion of a converged solve may still violate a limit: one without a row in the NLP, or one that tightening does
  /// not enforce between the knots. Then the message names the limit.
  StartResult finished() {
    const bool converged =
        result_.status == NlpStatus::kOptimal || result_.status == NlpStatus::kAcceptable;
    if (converged && result_.motion.size() > 1 && result_.excess > options_.limit_tolerance) {
      result_.status = NlpStatus::kInfeasible;
      result_.message =
          "its motion violates a limit: " + limit_text(worst_limit(verdict(result_.motion).checks));
    }
    return std::move(result_);
  }

  static bool usable(const NlpResult& r) {
    /// Violation up to which a solve that was cut short is used.
    /// @threshold [1] 0..1e-3; chosen: OptimizeOptions::tolerance
    constexpr double kUsableViolation = 1e-6;
    return r.solved() ||
           (r.status == NlpStatus::kIterationLimit && r.max_violation < kUsableViolation);
  }

  /// Sets a mesh of equal intervals without phases.
  void uniform_mesh() {
    mesh_ = PhaseMesh{};
    mesh_.times.setLinSpaced(options_.intervals + 1, 0.0, time_.guess);
  }

  NlpResult solve(const Trajectory& from, const Smoothing& smoothing, double tolerance) {
    CraneKnotOptions knot;
    knot.smoothing = smoothing;
    knot.clear_postures = clear_postures_;
    if (planes_) {
      knot.plane_postures =
          from.size() == mesh_.times.size() ? from.q : resampled(from, mesh_.times).q;
    } else if (!problem_.obstacles.empty()) {
      knot.near_postures = from.q;
      if (is_clear(from)) knot.clear_motion = from.q;
    }
    transcribe(from, nlp_of_mesh().spec(knot, options_.knot_wrapper));
    NlpOptions nlp;
    nlp.tolerance = tolerance;
    nlp.max_iterations =
        mesh_.modes.rows() > 0 ? options_.phase_iterations : options_.smooth_iterations;
    nlp.max_seconds = options_.max_seconds;
    nlp.more = options_.ipopt;
    if (mesh_.modes.rows() > 0 || result_.iterations > 0) nlp.mu_init = 1e-3;
    nlp.on_iteration = [this](const NlpIteration&) {
      return !(options_.interrupted && options_.interrupted());
    };
    NlpResult solved = solve_with_ipopt(*transcription_, nlp);
    converged_ = solved.solved() && tolerance <= options_.tolerance;
    result_.iterations += solved.iterations;
    result_.solve_s += solved.solve_s;
    result_.callbacks_s += solved.callbacks_s;
    result_.linear_solver_s += solved.linear_solver_s;
    note_stage(solved, smoothing);
    return solved;
  }

  void transcribe(const Trajectory& from, TranscriptionSpec spec) {
    if (!problem_.sway) {
      transcription_ = std::make_unique<Transcription>(std::move(spec));
      transcription_->set_start(from);
      return;
    }
    const bool on_mesh = !mesh_.of_interval.empty() && from.size() == mesh_.times.size();
    const Trajectory guess = on_mesh ? from : resampled(from, mesh_.times);
    nlp_of_mesh().add_load(guess, spec);
    transcription_ = std::make_unique<Transcription>(std::move(spec));
    transcription_->set_start(extended(guess));
  }

  void note_stage(const NlpResult& solved, const Smoothing& smoothing) {
    StageRecord record;
    record.what = mesh_.modes.rows() > 0
                      ? "modes"
                      : fmt::format("smooth, {:g} mm/s, {:g} bar", 1e3 * smoothing.speed,
                                    smoothing.pressure / 1e5);
    if (tightenings_used_ > 0)
      record.what += fmt::format(", limits tightened ({})", tightenings_used_);
    record.status = solved.status;
    record.iterations = solved.iterations;
    record.solve_s = solved.solve_s;
    if (usable(solved)) {
      const Trajectory motion = motion_of(solved);
      record.energy_exact = verdict(motion).energy;
      record.excess = worst_excess(verdict(motion).checks);
    }
    result_.stages.push_back(std::move(record));
  }

  /// Modes of the cylinders that move at an end; the others rest there.
  std::vector<CylinderMode> modes_at(const Eigen::VectorXd& q, const Eigen::VectorXd& qd) const {
    const Machine& machine = model_.machine;
    std::vector<CylinderMode> modes(machine.cylinders.size(), CylinderMode::kRest);
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(c)];
      const auto j = static_cast<Eigen::Index>(cylinder.joint);
      CylinderMode& mode = modes[static_cast<std::size_t>(c)];
      if (!cylinder.hydraulic()) mode = CylinderMode::kFree;
      if (!cylinder.hydraulic() || qd.size() == 0 || qd[j] == 0.0) continue;
      const double speed = linkage_rates(machine, c, q[j]).d1 * qd[j];
      mode = speed > 0.0 ? CylinderMode::kExtend : CylinderMode::kRetract;
    }
    return modes;
  }

  /// A plan in which the cylinders that move at the start and at the goal do so.
  PhasePlan moving_at_ends(const PhasePlan& plan) const {
    if (!moves_at_an_end(problem_)) return plan;
    const auto* goal = std::get_if<JointGoal>(&problem_.goal);
    const Eigen::VectorXd end = goal != nullptr ? goal->q : problem_.start;
    /// Duration of a phase in which the cylinders stop that move at the start, over that of the whole.
    /// @threshold [1] 0.001..0.5; chosen: its duration is a variable
    constexpr double kBraking = 0.05;
    return with_moving_ends(plan, modes_at(problem_.start, problem_.start_velocity),
                            modes_at(end, problem_.goal_velocity), kBraking * plan.total());
  }

  /// The motion with the load's coordinates, where the transcription has them.
  Trajectory extended(const Trajectory& motion) const {
    return problem_.sway ? with_load(model_.machine, motion, *problem_.sway) : motion;
  }

  /// The machine's motion that a solve found, with the instants of its stops.
  Trajectory motion_of(const NlpResult& solved) const {
    Trajectory motion = transcription_->trajectory(solved.x);
    if (problem_.sway) motion = without_load(motion, model_.machine.joint_count());
    for (std::size_t s = 0; s < mesh_.waypoint_knots.size() && !problem_.stops.empty(); ++s)
      motion.stops.push_back(motion.t[mesh_.waypoint_knots[s]]);
    return motion;
  }

  /// Limits and energy of a motion by the exact law, between its knots too.
  struct Verdict {
    Trajectory motion;
    std::vector<LimitCheck> checks;
    double energy = 0.0;  // [J]
  };
  /// The last result is kept, because it is mostly asked for twice.
  const Verdict& verdict(const Trajectory& motion) {
    const Trajectory& known = verdict_.motion;
    const bool same = known.t.size() == motion.t.size() && known.t == motion.t &&
                      known.q == motion.q && known.qd == motion.qd &&
                      known.qdd.rows() == motion.qdd.rows() && known.qdd == motion.qdd &&
                      known.stops == motion.stops;
    if (!same) {
      std::vector<LimitCheck>& checks = verdict_.checks;
      checks = check_limits(model_, problem_, motion, options_.refine);
      const std::ptrdiff_t limits = std::ssize(checks);
      std::ranges::move(check_jumps(problem_, motion), std::back_inserter(checks));
      std::ranges::inplace_merge(checks, checks.begin() + limits, std::ranges::greater{},
                                 &LimitCheck::excess);
      verdict_.energy = exact_total_energy(model_, problem_, motion, options_.refine);
      verdict_.motion = motion;
    }
    return verdict_;
  }

  /// Keeps a motion if it is better than the best so far: by violation first, then by exact cost; of equal costs the
  /// one of a solve that converged. @return its limits
  std::vector<LimitCheck> offer(const Trajectory& motion, bool modes_held, bool converged) {
    const std::vector<LimitCheck> checks = verdict(motion).checks;
    const double excess = worst_excess(checks);
    const double energy = verdict(motion).energy;
    const double cost = exact_cost(model_, problem_, motion, energy, options_.refine);
    const bool kept = excess <= options_.limit_tolerance;
    const bool first = result_.motion.size() < 2;
    const bool had_kept = !first && result_.excess <= options_.limit_tolerance;
    const double rank = cost + (converged ? 0.0 : kSameCost * std::abs(cost));
    const double known =
        result_.cost + (result_.converged ? 0.0 : kSameCost * std::abs(result_.cost));
    if (!first && !(kept && (!had_kept || rank < known)) &&
        !(!kept && !had_kept && excess < result_.excess)) {
      return checks;
    }
    result_.converged = converged;
    result_.motion = motion;
    result_.excess = excess;
    result_.energy_exact = energy;
    result_.cost = cost;
    result_.duration = motion.duration();
    result_.modes_held = modes_held;
    result_.plan = PhasePlan{};
    if (modes_held && !mesh_.of_interval.empty()) {
      result_.plan = plan_;
      result_.plan.durations = durations_of(mesh_, motion.t);
    }
    // The smooth energy is that of the last solve; before the first one there is none.
    result_.energy_smooth =
        transcription_
            ? 1e3 * transcription_->model_cost(transcription_->variables(extended(motion))) /
                  problem_energy_weight()
            : energy;
    return checks;
  }

  /// Keeps a motion if it is better than the best so far; while it violates limits between knots, solves again with those
  /// limits tightened.
  void keep_limits(Trajectory motion, const Smoothing& smoothing, bool solve_again = true) {
    for (int attempt = 0;; ++attempt) {
      const std::vector<LimitCheck> checks = offer(motion, mesh_.modes.rows() > 0, converged_);
      if (!solve_again || attempt == options_.tightenings) return;
      // Tighter limits make a motion dearer, and this one is no better already.
      if (result_.excess <= options_.limit_tolerance &&
          exact_cost(model_, problem_, motion, verdict(motion).energy, options_.refine) >=
              result_.cost)
        return;
      if (split_where_it_touches(problem_, motion, options_.refine, 4 * options_.intervals,
                                 mesh_)) {
        motion = resampled(motion, mesh_.times);
      } else if (!tightening_.tighten_bounds(problem_, checks, options_.limit_tolerance)) {
        return;
      }
      ++tightenings_used_;
      const NlpResult solved = solve(motion, smoothing, options_.tolerance);
      if (!usable(solved)) return;
      motion = motion_of(solved);
    }
  }

  double problem_energy_weight() const {
    return problem_.objective.energy > 0.0 ? problem_.objective.energy : 1.0;
  }

  /// Whether a motion keeps the clearance by the exact distance, between its knots too.
  bool is_clear(const Trajectory& motion) {
    const std::vector<LimitCheck>& checks = verdict(motion).checks;
    return std::none_of(checks.begin(), checks.end(), [&](const LimitCheck& c) {
      return c.what.starts_with("clearance") && c.excess > options_.limit_tolerance;
    });
  }

  /// Remembers start and end posture of a motion if they are clear by the exact distance.
  void keep_clear_ends(const Trajectory& motion) {
    if (problem_.obstacles.empty()) return;
    ClearanceModel clearance(problem_);
    const Eigen::MatrixXd& q = motion.q;
    Eigen::VectorXd posture;
    clear_postures_.resize(0, q.cols());
    for (const Eigen::Index k : {Eigen::Index{0}, q.rows() - 1}) {
      posture = q.row(k);
      if (!clearance.clear(posture.data())) continue;
      clear_postures_.conservativeResize(clear_postures_.rows() + 1, q.cols());
      clear_postures_.row(clear_postures_.rows() - 1) = q.row(k);
    }
  }

  /// Records the status of the solve that gave the motion, or of the last solve while there is none.
  void note_status(const NlpResult& solved) {
    if (result_.status == NlpStatus::kOptimal && result_.modes_held) return;
    result_.status = solved.status;
    result_.message = solved.message;
    if (!solved.solved() && !solved.max_violation_at.empty()) {
      result_.message += fmt::format(" (worst: {})", solved.max_violation_at);
    }
  }

  /// Solves with the modes of a motion held fixed and keeps the best result.
  void hold_modes(const Trajectory& shown) {
    hold(modes_of(model_, problem_, shown, options_.mode_options), shown, true);
  }

  void hold(const ModeTable& modes, const Trajectory& shown, bool overlaps) {
    // A guess may have a mesh of its own; modes without a guess are on equal intervals.
    const Trajectory from =
        shown.size() == modes.rows() + 1
            ? shown
            : resampled(shown, Eigen::VectorXd::LinSpaced(modes.rows() + 1, shown.t[0],
                                                          shown.t[shown.size() - 1]));
    // Near obstacles a rough start would move through them if durations were free from the beginning.
    const bool hemmed = !problem_.obstacles.empty() && time_.lower == time_.upper &&
                        problem_.waypoints.empty() && !moves_at_an_end(problem_);
    if (options_.free_phases && !hemmed &&
        hold_plan(plan_of(modes, from.t, waypoint_times(from)), from, overlaps))
      return;
    // They need phases.
    if (!problem_.waypoints.empty() || !problem_.stops.empty() || moves_at_an_end(problem_)) return;
    if (time_.lower < time_.upper) return;  // a free duration needs phases
    mesh_ = PhaseMesh{};
    mesh_.times = from.t;
    mesh_.modes = modes;
    const NlpResult solved = solve(from, exact_law(), options_.tolerance);
    note_status(solved);
    if (!usable(solved)) return;
    keep_limits(motion_of(solved), exact_law());
    if (options_.free_phases && hemmed && result_.excess <= options_.limit_tolerance)
      hold_plan(plan_of(modes, from.t), result_.motion, overlaps);
  }

  /// Beside obstacles: solves with planes between machine and obstacles at every knot, renewed at each solve, from a motion
  /// that keeps all limits. The smooth rows keep some centimetres more than the exact distance; the planes keep no more than
  /// that in the motion they come from, so that each solve begins at a motion that its rows allow, and none is dearer than
  /// the last. @return whether a solve gave a motion that is better than those before
  bool approach(const PhasePlan& plan, const Trajectory& guess, bool overlaps) {
    if (problem_.obstacles.empty() || plan.count() == 0 || guess.size() < 2 ||
        worst_excess(verdict(guess).checks) > options_.limit_tolerance)
      return false;
    planes_ = true;
    PhasePlan next = plan;
    Trajectory from = guess;
    bool any = false;
    for (int round = 0; round < options_.plane_solves; ++round) {
      const double before = result_.cost;
      tightening_.clearance = 0.0;
      if (!hold_plan(next, from, overlaps && round == 0)) break;
      if (!(result_.cost < before) || result_.plan.count() == 0) break;
      any = true;
      /// Relative gain of a solve from which another one follows.
      /// @threshold [1] 1e-6..0.01; chosen: as the mesh error
      constexpr double kEnough = 1e-4;
      if (result_.cost > (1.0 - kEnough) * before) break;
      next = result_.plan;
      from = result_.motion;
    }
    planes_ = false;
    return any;
  }

  /// Instants at which the tip is nearest to each waypoint, in increasing order. [s]
  std::vector<double> waypoint_times(const Trajectory& motion) const {
    std::vector<double> times;
    Eigen::Index from = 1;
    const auto count = static_cast<Eigen::Index>(problem_.waypoints.size());
    for (Eigen::Index w = 0; w < count; ++w) {
      const Eigen::Index until = motion.size() - 1 - (count - w);
      Eigen::Index best = from;
      double nearest = std::numeric_limits<double>::infinity();
      for (Eigen::Index k = from; k <= until; ++k) {
        const Eigen::VectorXd q = motion.q.row(k).transpose();
        const double distance = (tip_position<double>(model_.machine, q) -
                                 problem_.waypoints[static_cast<std::size_t>(w)])
                                    .norm();
        if (distance >= nearest) continue;
        nearest = distance;
        best = k;
      }
      times.push_back(motion.t[best]);
      from = best + 1;
    }
    return times;
  }

  /// Smoothing with fixed modes: no blends, only the maximum is slightly smoothed.
  Smoothing exact_law() const {
    Smoothing exact = options_.schedule.empty() ? Smoothing{} : options_.schedule.back();
    exact.pressure = options_.pressure_in_modes;
    return exact;
  }

  double shortest_phase() const { return nlp_of_mesh().shortest_phase(); }

  StartNlp nlp_of_mesh() const {
    return StartNlp({model_, problem_, time_, mesh_, plan_, tightening_});
  }

  /// Solves with free durations of the phases; phases that shrink to zero are dropped and the others solved again.
  bool hold_plan(const PhasePlan& wanted, const Trajectory& from, bool overlaps) {
    PhasePlan plan = wanted;
    if (overlaps) plan = with_overlaps(plan, options_.overlap);
    plan = moving_at_ends(plan);
    Trajectory guess = from;
    bool any = false;
    for (int round = 0; round < 3; ++round) {
      plan_ = plan;
      mesh_ = mesh_of(plan, options_.intervals, options_.phase_intervals);
      Trajectory start = resampled(guess, mesh_.times);
      // Where the guess bends around an obstacle within an interval of this mesh, the mesh is made finer first.
      while (planes_ && split_where_it_touches(problem_, start, options_.refine,
                                               4 * options_.intervals, mesh_))
        start = resampled(guess, mesh_.times);
      const NlpResult solved = solve(start, exact_law(), options_.tolerance);
      note_status(solved);
      if (!usable(solved)) return any;
      const Trajectory motion = motion_of(solved);
      PhasePlan found = plan;
      found.durations = durations_of(mesh_, motion.t);
      const PhasePlan kept = moving_at_ends(without_short(found, 1.5 * shortest_phase()));
      const bool last = kept.count() == found.count() || round == 2;
      keep_limits(motion, exact_law(), last);
      any = true;
      if (last) return true;
      plan = kept;
      guess = motion;
    }
    return any;
  }

  const CraneModel& model_;
  const MotionProblem& problem_;
  TimeWindow time_;
  const OptimizeOptions& options_;
  PhaseMesh mesh_;  // mesh of the next solve; without phases all times are fixed
  PhasePlan plan_;  // phases of the mesh
  Tightening tightening_;
  int tightenings_used_ = 0;
  bool planes_ = false;     // whether planes keep the clearance, instead of smooth rows
  bool converged_ = false;  // whether the last solve did, to the tolerance of results
  Eigen::MatrixXd clear_postures_;
  std::unique_ptr<Transcription> transcription_;
  StartResult result_;
  Verdict verdict_;
};

}  // namespace

StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const OptimizeOptions& options) {
  return optimize_with_modes(model, problem, candidate,
                             TimeWindow::fixed(candidate.guess.duration()), options);
}

StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const TimeWindow& time,
                                const OptimizeOptions& options) {
  return Start(model, problem, time, options).run(candidate);
}

StartResult optimize_with_phases(const CraneModel& model, const MotionProblem& problem,
                                 const PhasedStart& start, const TimeWindow& time,
                                 const OptimizeOptions& options) {
  return Start(model, problem, time, options)
      .run(start.name, start.plan, start.guess, start.overlaps);
}

StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, double duration, const OptimizeOptions& options) {
  return optimize_from(model, problem, seed, TimeWindow::fixed(duration), options);
}

StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, const TimeWindow& time,
                          const OptimizeOptions& options) {
  return Start(model, problem, time, options).run(seed);
}

}  // namespace sparflow
