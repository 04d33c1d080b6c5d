/// One start: smooth stages, modes, tightening.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optimizer/optimize.h"

namespace sparflow {
namespace {

/// How far limits are drawn in so that they also hold between knots.
struct Tightening {
  double flow = 1.0, valve = 1.0, pressure = 1.0, line = 1.0;  // shares
  double clearance = 0.0;                                      // [m]
  std::vector<double> position;                                // [rad] or [m] by joint
  bool limit_pressure = false;
};

class Start {
 public:
  Start(const CraneModel& model, const MotionProblem& problem, double duration,
        const OptimizeOptions& options)
      : model_(model), problem_(problem), options_(options) {
    const int intervals = options.intervals;
    times_.setLinSpaced(intervals + 1, 0.0, duration);
    tightening_.position.assign(model.machine.joints.size(), 0.0);
  }

  StartResult run(const ModeCandidate& candidate) {
    result_.seed = candidate.name;
    keep_clear_ends(candidate.guess);
    offer(candidate.guess, false);
    hold(candidate.modes, candidate.guess);
    return result_;
  }

  StartResult run(const SeedMotion& seed, double duration) {
    result_.seed = seed.name;
    const Trajectory timed = with_duration(seed.motion, duration);
    result_.seed_feasible =
        worst_excess(check_limits(model_, problem_, timed, options_.refine)) <= 1e-3;
    if (result_.seed_feasible)
      result_.seed_energy = exact_energy(model_, timed, problem_.payload, options_.refine).total;
    keep_clear_ends(timed);
    if (options_.modes) offer(timed, false);  // no start ends dearer than its seed
    // The seed's own modes first: whatever the smooth law then leads to, the start never ends dearer than that.
    if (options_.modes) hold_modes(resampled(timed, times_));
    Trajectory motion = timed;
    for (std::size_t stage = 0; stage < options_.schedule.size(); ++stage) {
      const bool last = stage + 1 == options_.schedule.size();
      const bool rough = options_.modes || !last;
      const NlpResult solved =
          solve(motion, options_.schedule[stage], ModeTable(), rough ? 1e-2 : options_.tolerance);
      note_status(solved);
      if (solved.status == NlpStatus::kInterrupted) return result_;
      if (!usable(solved)) break;  // a coarser motion, if there is one, starts the modes
      motion = transcription_->trajectory(solved.x);
      if (options_.modes || last) {
        keep_limits(motion, options_.schedule[stage], ModeTable(), !options_.modes);
      }
      if (options_.modes) hold_modes(motion);
    }
    return result_;
  }

 private:
  static bool usable(const NlpResult& r) {
    return r.solved() || (r.status == NlpStatus::kIterationLimit && r.max_violation < 1e-6);
  }

  NlpResult solve(const Trajectory& from, const Smoothing& smoothing, const ModeTable& modes,
                  double tolerance) {
    TranscriptionSpec spec;
    spec.t = times_;
    CraneKnotOptions knot;
    knot.smoothing = smoothing;
    knot.energy_weight = problem_.objective.energy;
    knot.modes = modes;
    knot.flow_share = tightening_.flow;
    knot.valve_share = tightening_.valve;
    knot.pressure_share = tightening_.pressure;
    knot.tip_line_share = tightening_.line;
    knot.extra_clearance = tightening_.clearance;
    knot.limit_pressure = tightening_.limit_pressure;
    knot.clear_postures = clear_postures_;
    if (!problem_.obstacles.empty()) knot.near_postures = from.q;
    spec.knot = std::make_shared<CraneKnotModel>(model_, problem_, knot);
    set_bounds(spec);
    if (modes.rows() > 0) apply_modes(model_, modes, spec.bounds);
    spec.acceleration_weight.resize(model_.machine.joint_count());
    for (int j = 0; j < model_.machine.joint_count(); ++j) {
      const auto i = static_cast<std::size_t>(j);
      spec.joint_names.push_back(model_.machine.joints[i].name);
      const Range& a = problem_.limits.acceleration[i];
      const double full = std::max({std::abs(a.lo), std::abs(a.hi), 1e-6});
      // default: full acceleration all the time costs one watt, which only decides between equals
      spec.acceleration_weight[j] = problem_.objective.smoothness
                                        ? *problem_.objective.smoothness * 1e-3
                                        : 1e-3 / (full * full);
    }
    transcription_ = std::make_unique<Transcription>(std::move(spec));
    transcription_->set_start(from);
    NlpOptions nlp;
    nlp.tolerance = tolerance;
    nlp.max_iterations = modes.rows() > 0 ? 300 : options_.smooth_iterations;
    nlp.max_seconds = options_.max_seconds;
    nlp.more = options_.ipopt;
    if (modes.rows() > 0 || result_.iterations > 0) nlp.mu_init = 1e-3;
    nlp.on_iteration = [this](const NlpIteration&) {
      return !(options_.interrupted && options_.interrupted());
    };
    NlpResult solved = solve_with_ipopt(*transcription_, nlp);
    result_.iterations += solved.iterations;
    result_.solve_s += solved.solve_s;
    result_.callbacks_s += solved.callbacks_s;
    result_.linear_solver_s += solved.linear_solver_s;
    StageRecord record;
    record.what = modes.rows() > 0 ? "modes"
                                   : fmt::format("smooth, {:g} mm/s, {:g} bar",
                                                 1e3 * smoothing.speed, smoothing.pressure / 1e5);
    if (tightenings_used_ > 0)
      record.what += fmt::format(", limits drawn in ({})", tightenings_used_);
    record.status = solved.status;
    record.iterations = solved.iterations;
    record.solve_s = solved.solve_s;
    if (usable(solved)) {
      const Trajectory motion = transcription_->trajectory(solved.x);
      record.energy_exact = exact_energy(model_, motion, problem_.payload, options_.refine).total;
      record.excess = worst_excess(check_limits(model_, problem_, motion, options_.refine));
    }
    result_.stages.push_back(std::move(record));
    return solved;
  }

  void set_bounds(TranscriptionSpec& spec) const {
    const int n = model_.machine.joint_count();
    Eigen::VectorXd lo[3], hi[3];
    const std::vector<Range>* ranges[3] = {&problem_.limits.position, &problem_.limits.velocity,
                                           &problem_.limits.acceleration};
    for (int d = 0; d < 3; ++d) {
      lo[d].resize(n);
      hi[d].resize(n);
      for (int j = 0; j < n; ++j) {
        const Range& r = (*ranges[d])[static_cast<std::size_t>(j)];
        const double inset = d == 0 ? tightening_.position[static_cast<std::size_t>(j)] : 0.0;
        lo[d][j] = r.lo + inset;
        hi[d][j] = r.hi - inset;
      }
    }
    spec.bounds = TranscriptionBounds::uniform(static_cast<int>(times_.size()) - 1, lo[0], hi[0],
                                               lo[1], hi[1], lo[2], hi[2]);
    spec.bounds.rest_to_rest(problem_.start);
    if (const auto* goal = std::get_if<TipGoal>(&problem_.goal)) {
      spec.terminal = std::make_shared<TipAtGoal>(model_.machine, goal->tip);
    } else {
      spec.bounds.fix_q(static_cast<int>(times_.size()) - 1, std::get<JointGoal>(problem_.goal).q);
    }
  }

  /// Draws in what is broken between the knots. @return false when all limits are kept
  bool tighten(const std::vector<LimitCheck>& checks) {
    bool any = false;
    for (const LimitCheck& c : checks) {
      if (c.excess <= options_.limit_tolerance) continue;
      any = true;
      const double share = 1.0 - 1.3 * c.excess;
      if (c.what.starts_with("flow of pump")) tightening_.flow *= share;
      if (c.what.starts_with("flow through valve")) tightening_.valve *= share;
      if (c.what.starts_with("pressure of pump")) {
        if (tightening_.limit_pressure) tightening_.pressure *= share;
        tightening_.limit_pressure = true;
      }
      if (c.what.starts_with("distance of the tip from its line")) tightening_.line *= share;
      if (c.what.starts_with("clearance")) tightening_.clearance += 1.3 * c.excess;
      if (c.what.starts_with("position of joint ")) {
        const int j = model_.machine.joint_index(c.what.substr(18));
        const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
        tightening_.position[static_cast<std::size_t>(j)] += 1.3 * c.excess * (r.hi - r.lo);
      }
    }
    return any;
  }

  /// Keeps a motion if it is better than what there is: limits first, then exact energy. @return its limits
  std::vector<LimitCheck> offer(const Trajectory& motion, bool modes_held) {
    std::vector<LimitCheck> checks = check_limits(model_, problem_, motion, options_.refine);
    const double excess = worst_excess(checks);
    const double energy = exact_energy(model_, motion, problem_.payload, options_.refine).total;
    const bool kept = excess <= options_.limit_tolerance;
    const bool first = result_.motion.size() < 2;
    const bool had_kept = !first && result_.excess <= options_.limit_tolerance;
    if (!first && !(kept && (!had_kept || energy < result_.energy_exact)) &&
        !(!kept && !had_kept && excess < result_.excess)) {
      return checks;
    }
    result_.motion = motion;
    result_.excess = excess;
    result_.energy_exact = energy;
    result_.modes_held = modes_held;
    // of the law last solved for; before the first solve there is none
    result_.energy_smooth =
        transcription_ ? 1e3 * transcription_->model_cost(transcription_->variables(motion)) /
                             problem_energy_weight()
                       : energy;
    return checks;
  }

  /// Keeps a motion if it is better than what there is; while it breaks limits between knots, solves again with
  /// those drawn in.
  void keep_limits(Trajectory motion, const Smoothing& smoothing, const ModeTable& modes,
                   bool solve_again = true) {
    for (int attempt = 0;; ++attempt) {
      const std::vector<LimitCheck> checks = offer(motion, modes.rows() > 0);
      if (!solve_again || attempt == options_.tightenings || !tighten(checks)) return;
      ++tightenings_used_;
      const NlpResult solved = solve(motion, smoothing, modes, options_.tolerance);
      if (!usable(solved)) return;
      motion = transcription_->trajectory(solved.x);
    }
  }

  double problem_energy_weight() const {
    return problem_.objective.energy > 0.0 ? problem_.objective.energy : 1.0;
  }

  /// Start and end posture of a motion, where the exact distance calls them clear.
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

  /// The outcome reported is that of the solve behind the motion, or of the last one while there is none.
  void note_status(const NlpResult& solved) {
    if (result_.status == NlpStatus::kOptimal && result_.modes_held) return;
    result_.status = solved.status;
    result_.message = solved.message;
    if (!solved.max_violation_at.empty()) {
      result_.message += fmt::format(" (worst: {})", solved.max_violation_at);
    }
  }

  /// Holds the modes a motion shows and makes the best of them; the start's motion is the best of all.
  void hold_modes(const Trajectory& shown) {
    hold(modes_of(model_, problem_, shown, options_.mode_options), shown);
  }

  void hold(const ModeTable& modes, const Trajectory& from) {
    Smoothing exact = options_.schedule.empty() ? Smoothing{} : options_.schedule.back();
    exact.pressure = options_.pressure_in_modes;
    const NlpResult solved = solve(from, exact, modes, options_.tolerance);
    note_status(solved);
    if (usable(solved)) keep_limits(transcription_->trajectory(solved.x), exact, modes);
  }

  const CraneModel& model_;
  const MotionProblem& problem_;
  const OptimizeOptions& options_;
  Eigen::VectorXd times_;
  Tightening tightening_;
  int tightenings_used_ = 0;
  Eigen::MatrixXd clear_postures_;
  std::unique_ptr<Transcription> transcription_;
  StartResult result_;
};

}  // namespace

StartResult optimize_with_modes(const CraneModel& model, const MotionProblem& problem,
                                const ModeCandidate& candidate, const OptimizeOptions& options) {
  return Start(model, problem, candidate.guess.duration(), options).run(candidate);
}

StartResult optimize_from(const CraneModel& model, const MotionProblem& problem,
                          const SeedMotion& seed, double duration, const OptimizeOptions& options) {
  return Start(model, problem, duration, options).run(seed, duration);
}

}  // namespace sparflow
