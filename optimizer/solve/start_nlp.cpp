#include "optimizer/solve/start_nlp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optimizer/sway/sway_model.h"

namespace sparflow {

double StartNlp::shortest_phase() const { return std::min(0.02, 2e-3 * time_.guess); }

TranscriptionSpec StartNlp::spec(CraneKnotOptions knot, const KnotWrapper& wrapper) const {
  const ModeTable& modes = mesh_.modes;
  TranscriptionSpec spec;
  spec.t = mesh_.times;
  for (std::size_t w = 0; w < mesh_.waypoint_knots.size() && problem_.stops.empty(); ++w) {
    spec.waypoints.push_back({mesh_.waypoint_knots[w],
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
  spec.knot = std::make_shared<CraneKnotModel>(model_, problem_, knot);
  if (wrapper) spec.knot = wrapper(knot, spec.knot);
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
  return spec;
}

void StartNlp::set_bounds(TranscriptionSpec& spec) const {
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

std::shared_ptr<TerminalModel> StartNlp::reach(const Goal& place, int knot,
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

void StartNlp::set_end_velocities(TranscriptionBounds& bounds) const {
  if (problem_.start_velocity.size() > 0) bounds.fix_qd(0, problem_.start_velocity);
  if (problem_.goal_velocity.size() > 0)
    bounds.fix_qd(static_cast<int>(mesh_.times.size()) - 1, problem_.goal_velocity);
}

std::size_t StartNlp::leg_of_phase(int phase) const {
  std::size_t leg = 0;
  while (leg < plan_.waypoint_after.size() && plan_.waypoint_after[leg] < phase) ++leg;
  return leg;
}

std::vector<double> StartNlp::payloads() const {
  std::vector<double> all;
  if (problem_.stops.empty()) return all;
  all.reserve(mesh_.of_interval.size());
  for (const int phase : mesh_.of_interval)
    all.push_back(payload_on(problem_, leg_of_phase(phase)));
  return all;
}

bool StartNlp::dwells(int phase) const {
  return !problem_.stops.empty() && (plan_.modes.row(phase).array() == CylinderMode::kRest).all();
}

void StartNlp::hold_dwells(PhaseTimes& phases) const {
  for (int p = 0; p < phases.count(); ++p) {
    const std::size_t leg = leg_of_phase(p);
    if (dwells(p) && leg > 0) phases.lower[p] = phases.upper[p] = problem_.stops[leg - 1].dwell;
  }
}

void StartNlp::set_stops(TranscriptionSpec& spec) const {
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

void StartNlp::add_load(const Trajectory& from, TranscriptionSpec& spec) const {
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
  const Trajectory with = with_load(machine, from, sway);
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

}  // namespace sparflow
