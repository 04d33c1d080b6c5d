/// One start: smooth stages, solves with fixed modes, bound tightening.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optimizer/phases/tightening.h"
#include "optimizer/solve/optimize.h"
#include "optimizer/solve/optimize_outcome.h"
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
    const ModeTable& modes = mesh_.modes;
    TranscriptionSpec spec;
    spec.t = mesh_.times;
    for (std::size_t w = 0; w < mesh_.waypoint_knots.size() && problem_.stops.empty(); ++w) {
      spec.waypoints.push_back(
          {mesh_.waypoint_knots[w],
           std::make_shared<TipAtGoal>(model_.machine, problem_.waypoints[w])});
    }
    if (!mesh_.of_interval.empty()) {
      PhaseTimes& phases = spec.phases;
      phases.of_interval = mesh_.of_interval;
      phases.lower.setConstant(phases.count(), shortest_phase());
      phases.upper.setConstant(phases.count(), time_.upper);
      hold_dwells(phases);
      phases.total_lower = time_.lower;
      phases.total_upper = time_.upper;
      phases.price =
          1e-3 * (problem_.objective.energy * problem_.idle_power + problem_.objective.time);
    }
    CraneKnotOptions knot;
    knot.smoothing = smoothing;
    knot.energy_weight = problem_.objective.energy;
    knot.command_weight = problem_.objective.commands;
    knot.modes = modes;
    knot.payloads = payloads();
    knot.flow_share = tightening_.flow;
    knot.valve_share = tightening_.valve;
    knot.pressure_share = tightening_.pressure;
    knot.tip_line_share = tightening_.line;
    knot.trust_share = tightening_.trust;
    knot.extra_clearance = tightening_.clearance;
    knot.limit_pressure = tightening_.limit_pressure;
    knot.clear_postures = clear_postures_;
    if (planes_) {
      knot.plane_postures =
          from.size() == mesh_.times.size() ? from.q : resampled(from, mesh_.times).q;
    } else if (!problem_.obstacles.empty()) {
      knot.near_postures = from.q;
      if (is_clear(from)) knot.clear_motion = from.q;
    }
    spec.knot = std::make_shared<CraneKnotModel>(model_, problem_, knot);
    if (options_.knot_wrapper) spec.knot = options_.knot_wrapper(knot, spec.knot);
    set_bounds(spec);
    if (modes.rows() > 0) apply_modes(model_, modes, spec.bounds);
    set_stops(spec);
    set_end_velocities(spec.bounds);
    spec.acceleration_weight.resize(model_.machine.joint_count());
    for (int j = 0; j < model_.machine.joint_count(); ++j) {
      const auto i = static_cast<std::size_t>(j);
      spec.joint_names.push_back(model_.machine.joints[i].name);
      const Range& a = problem_.limits.acceleration[i];
      const double full = std::max({std::abs(a.lo), std::abs(a.hi), 1e-6});
      // By default full acceleration all the time costs one watt, which only decides between motions of equal energy.
      spec.acceleration_weight[j] = problem_.objective.smoothness
                                        ? *problem_.objective.smoothness * 1e-3
                                        : 1e-3 / (full * full);
    }
    transcribe(from, std::move(spec));
    NlpOptions nlp;
    nlp.tolerance = tolerance;
    nlp.max_iterations = modes.rows() > 0 ? options_.phase_iterations : options_.smooth_iterations;
    nlp.max_seconds = options_.max_seconds;
    nlp.more = options_.ipopt;
    if (modes.rows() > 0 || result_.iterations > 0) nlp.mu_init = 1e-3;
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
    add_load(guess, spec);
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
    spec.bounds = TranscriptionBounds::uniform(static_cast<int>(mesh_.times.size()) - 1,
                                               {lo[0], hi[0]}, {lo[1], hi[1]}, {lo[2], hi[2]});
    spec.bounds.rest_to_rest(problem_.start);
    spec.terminal = reach(problem_.goal, static_cast<int>(mesh_.times.size()) - 1, spec.bounds);
  }

  /// The constraint of a place in which the machine rests: rows of the tip, or (null) bounds of the posture at that knot.
  std::shared_ptr<TerminalModel> reach(const Goal& place, int knot,
                                       TranscriptionBounds& bounds) const {
    if (const auto* goal = std::get_if<TipGoal>(&place)) {
      if (goal->tolerance > 0.0)
        return std::make_shared<TipNearGoal>(model_.machine, goal->tip, goal->tolerance);
      return std::make_shared<TipAtGoal>(model_.machine, goal->tip);
    }
    const auto& posture = std::get<JointGoal>(place);
    if (posture.tolerance.size() == 0) {
      bounds.fix_q(knot, posture.q);
      return nullptr;
    }
    for (Eigen::Index j = 0; j < posture.q.size(); ++j) {
      bounds.q_lower(knot, j) =
          std::max(bounds.q_lower(knot, j), posture.q[j] - posture.tolerance[j]);
      bounds.q_upper(knot, j) =
          std::min(bounds.q_upper(knot, j), posture.q[j] + posture.tolerance[j]);
    }
    return nullptr;
  }

  /// Velocities at the start and at the goal, where they are not rest.
  void set_end_velocities(TranscriptionBounds& bounds) const {
    if (problem_.start_velocity.size() > 0) bounds.fix_qd(0, problem_.start_velocity);
    if (problem_.goal_velocity.size() > 0)
      bounds.fix_qd(static_cast<int>(mesh_.times.size()) - 1, problem_.goal_velocity);
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

  /// Number of the leg to which a phase belongs, or that follows the stop in which it rests.
  std::size_t leg_of_phase(int phase) const {
    std::size_t leg = 0;
    while (leg < plan_.waypoint_after.size() && plan_.waypoint_after[leg] < phase) ++leg;
    return leg;
  }

  /// Payload of every interval; empty where it does not change.
  std::vector<double> payloads() const {
    std::vector<double> all;
    if (problem_.stops.empty()) return all;
    all.reserve(mesh_.of_interval.size());
    for (const int phase : mesh_.of_interval)
      all.push_back(payload_on(problem_, leg_of_phase(phase)));
    return all;
  }

  /// Whether the machine rests at a stop in this phase, as long as the stop asks for.
  bool dwells(int phase) const {
    return !problem_.stops.empty() && (plan_.modes.row(phase).array() == CylinderMode::kRest).all();
  }

  /// Gives the phases at rest the times that the stops ask for.
  void hold_dwells(PhaseTimes& phases) const {
    for (int p = 0; p < phases.count(); ++p) {
      const std::size_t leg = leg_of_phase(p);
      if (dwells(p) && leg > 0) phases.lower[p] = phases.upper[p] = problem_.stops[leg - 1].dwell;
    }
  }

  /// Rest at the stops and while the machine dwells there, and where they are.
  void set_stops(TranscriptionSpec& spec) const {
    if (problem_.stops.empty()) return;
    const Eigen::VectorXd still = Eigen::VectorXd::Zero(model_.machine.joint_count());
    for (std::size_t s = 0; s < mesh_.waypoint_knots.size(); ++s) {
      const int knot = mesh_.waypoint_knots[s];
      spec.bounds.fix_qd(knot, still);
      if (auto model = reach(problem_.stops[s].goal, knot, spec.bounds))
        spec.waypoints.push_back({knot, std::move(model)});
    }
    for (std::size_t k = 0; k < mesh_.of_interval.size(); ++k) {
      if (!dwells(mesh_.of_interval[k])) continue;
      spec.bounds.fix_qd(static_cast<int>(k), still);
      spec.bounds.fix_qd(static_cast<int>(k) + 1, still);
    }
  }

  /// Makes the load's coordinates further joints of the transcription.
  void add_load(const Trajectory& from, TranscriptionSpec& spec) const {
    const SwayLimit& sway = *problem_.sway;
    const Machine& machine = model_.machine;
    /// Share of the sway's limits that a solve uses at first.
    /// @threshold [1] 0.8..1; chosen: the load's equations are averaged over an interval, an error of some tenths of a per cent
    constexpr double kFirstShare = 0.995;
    SwayRows rows;
    rows.limit = kFirstShare * tightening_.sway * sway.limit;
    rows.end_limit = kFirstShare * tightening_.still * sway.end_limit;
    rows.cable = sway.cable;
    rows.still_knots = mesh_.waypoint_knots;
    rows.still_knots.push_back(static_cast<int>(mesh_.times.size()) - 1);
    if (const auto* goal = std::get_if<JointGoal>(&problem_.goal);
        goal != nullptr && problem_.goal_velocity.size() > 0) {
      const Tip& tip = machine.tip;
      rows.end_velocity =
          sway_directions(machine).transpose() *
          (point_jacobian_matrix(machine, goal->q, tip.joint, tip.xyz) * problem_.goal_velocity);
    }
    spec.knot = std::make_shared<SwayKnotModel>(machine, spec.knot, rows);
    spec.interval =
        std::make_shared<SwayDynamics>(machine, load_stiffness(machine, from, sway.cable));
    const Trajectory with = extended(from);
    const Eigen::Index n = from.q.cols(), all = with.q.cols();
    const auto beside = [&](std::shared_ptr<TerminalModel>& posture) {
      if (posture)
        posture = std::make_shared<PostureBesideLoad>(posture, static_cast<int>(n),
                                                      static_cast<int>(all - n));
    };
    beside(spec.terminal);
    for (Waypoint& w : spec.waypoints) beside(w.model);
    const auto widen = [&](Eigen::MatrixXd& bound, double value) {
      bound.conservativeResize(Eigen::NoChange, all);
      bound.rightCols(all - n).setConstant(value);
    };
    TranscriptionBounds& b = spec.bounds;
    for (Eigen::MatrixXd* lower : {&b.q_lower, &b.qd_lower, &b.qdd_lower}) widen(*lower, -kNoBound);
    for (Eigen::MatrixXd* upper : {&b.q_upper, &b.qd_upper, &b.qdd_upper}) widen(*upper, kNoBound);
    // At the start the load hangs still below the tip, and moves with it.
    for (Eigen::Index c = n; c < all; ++c) {
      b.q_lower(0, c) = b.q_upper(0, c) = with.q(0, c);
      b.qd_lower(0, c) = b.qd_upper(0, c) = with.qd(0, c);
      spec.joint_names.push_back(fmt::format("load, direction {}", c - n + 1));
    }
    spec.acceleration_weight.conservativeResize(all);
    spec.acceleration_weight.tail(all - n).setZero();
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
      verdict_.checks = check_limits(model_, problem_, motion, options_.refine);
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

  /// [s] lower bound of a phase's duration, below the time in which a valve opens and closes
  double shortest_phase() const { return std::min(0.02, 2e-3 * time_.guess); }

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
