#include "optimizer/phases/motion_modes.h"

#include <algorithm>
#include <cmath>

#include "models/math/error.h"

namespace sparflow {
namespace {

/// A range [begin, end) of intervals with equal mode in one cylinder's column.
struct Run {
  Eigen::Index begin, end;
  CylinderMode mode;
};

std::vector<Run> runs_of(const ModeTable& modes, int cylinder) {
  std::vector<Run> runs;
  for (Eigen::Index k = 0; k < modes.rows(); ++k) {
    if (!runs.empty() && runs.back().mode == modes(k, cylinder)) {
      runs.back().end = k + 1;
    } else {
      runs.push_back({k, k + 1, modes(k, cylinder)});
    }
  }
  return runs;
}

void fill(ModeTable& modes, int cylinder, const Run& run, CylinderMode mode) {
  for (Eigen::Index k = run.begin; k < run.end; ++k) modes(k, cylinder) = mode;
}

/// Full speed of a cylinder: through its valve if one is known, else at its joint's velocity limit. [m/s]
double full_speed(const CraneModel& model, const MotionProblem& problem, int cylinder,
                  const Trajectory& motion) {
  const Cylinder& c = model.machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (const Valve* valve = model.machine.valve_of_cylinder(cylinder);
      valve != nullptr && c.hydraulic()) {
    const double best =
        std::max(valve->max_flow_extend / c.area_piston(), valve->max_flow_retract / c.area_rod());
    if (best > 0.0) return best;
  }
  const Range& v = problem.limits.velocity[static_cast<std::size_t>(c.joint)];
  const double rate = linkage_rates(model.machine, cylinder, motion.q(0, c.joint)).d1;
  return std::max(std::abs(v.lo), std::abs(v.hi)) * std::abs(rate);
}

/// Signed travel of a rod in each interval. [m]
Eigen::VectorXd travels(const Machine& machine, int c, const Trajectory& motion) {
  const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
  Eigen::VectorXd way(motion.size() - 1);
  for (Eigen::Index k = 0; k < way.size(); ++k) {
    way[k] = linkage_rates(machine, c, motion.q(k + 1, j)).value -
             linkage_rates(machine, c, motion.q(k, j)).value;
  }
  return way;
}

/// Travel lost by rest below which a cylinder keeps its modes.
/// @threshold [m] 0..0.1; chosen: two millimetres of stroke are a centimetre or two at the tip, which the solve makes
/// up for in the phases that remain
constexpr double kLeastLost = 2e-3;

/// Gives a cylinder that covered much of its stroke creeping a window around its fastest interval, long enough to cover
/// that stroke at half speed.
/// @param way signed travel of the rod in each interval [m]  @param full_way at full speed [m]
void concentrate(ModeTable& modes, int c, const Eigen::VectorXd& way, double full_way,
                 double lost_share) {
  const Eigen::Index intervals = modes.rows();
  double lost = 0.0;
  for (Eigen::Index k = 0; k < intervals; ++k) {
    if (modes(k, c) == CylinderMode::kRest) lost += way[k];
  }
  const double total = way.cwiseAbs().sum();
  if (std::abs(lost) < std::max(lost_share * total, kLeastLost)) return;
  const CylinderMode mode = lost > 0.0 ? CylinderMode::kExtend : CylinderMode::kRetract;
  const auto length = std::clamp<Eigen::Index>(
      static_cast<Eigen::Index>(std::abs(lost) / (0.5 * full_way)) + 4, 4, intervals);
  Eigen::Index best = 0;
  double most = -1.0;
  for (Eigen::Index begin = 0; begin + length <= intervals; ++begin) {
    const double here = std::abs(way.segment(begin, length).sum());
    const auto opposite =
        mode == CylinderMode::kExtend ? CylinderMode::kRetract : CylinderMode::kExtend;
    const bool free = !(modes.col(c).segment(begin, length).array() == opposite).any();
    if (free && here > most) {
      most = here;
      best = begin;
    }
  }
  if (most >= 0.0) modes.col(c).segment(best, length).setConstant(mode);
}

}  // namespace

ModeTable modes_of(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion,
                   const ModeOptions& options) {
  const Eigen::Index intervals = motion.size() - 1;
  const int cylinders = model.machine.cylinder_count();
  ModeTable modes = ModeTable::Constant(intervals, cylinders, CylinderMode::kFree);
  for (int c = 0; c < cylinders; ++c) {
    const Cylinder& cylinder = model.machine.cylinders[static_cast<std::size_t>(c)];
    if (!cylinder.hydraulic()) continue;
    const double full = full_speed(model, problem, c, motion);
    const double creep = options.rest_share * full;
    const int j = cylinder.joint;
    for (Eigen::Index k = 0; k < intervals; ++k) {
      const double middle = 0.5 * (motion.q(k, j) + motion.q(k + 1, j));
      const double qd = (motion.q(k + 1, j) - motion.q(k, j)) / (motion.t[k + 1] - motion.t[k]);
      const double speed = linkage_rates(model.machine, c, middle).d1 * qd;
      modes(k, c) = std::abs(speed) < creep ? CylinderMode::kRest
                    : speed > 0.0           ? CylinderMode::kExtend
                                            : CylinderMode::kRetract;
    }
    // Pauses of one or two intervals inside a move belong to it; moves that are too short are dropped.
    std::vector<Run> runs = runs_of(modes, c);
    for (std::size_t r = 1; r + 1 < runs.size(); ++r) {
      const bool same =
          runs[r - 1].mode == runs[r + 1].mode && runs[r - 1].mode != CylinderMode::kRest;
      if (runs[r].mode == CylinderMode::kRest && same && runs[r].end - runs[r].begin <= 2) {
        fill(modes, c, runs[r], runs[r - 1].mode);
      }
    }
    for (const Run& run : runs_of(modes, c)) {
      if (run.end - run.begin < options.shortest_move) fill(modes, c, run, CylinderMode::kRest);
    }
    const double step = (motion.t[intervals] - motion.t[0]) / static_cast<double>(intervals);
    concentrate(modes, c, travels(model.machine, c, motion), full * step, options.lost_share);
    // A joint with a net travel must be allowed to move; if it creeps throughout, it moves where it is fastest.
    const double travel = motion.q(intervals, j) - motion.q(0, j);
    /// Net travel up to which a joint is at rest.
    /// @threshold [rad or m] 0..1e-6; numerical: rounding
    constexpr double kNoTravel = 1e-9;
    const bool must_move =
        std::holds_alternative<JointGoal>(problem.goal) && std::abs(travel) > kNoTravel;
    if (must_move && (modes.col(c).array() == CylinderMode::kRest).all()) {
      const double rate = linkage_rates(model.machine, c, motion.q(0, j)).d1;
      const CylinderMode mode =
          rate * travel > 0.0 ? CylinderMode::kExtend : CylinderMode::kRetract;
      modes.col(c).setConstant(mode);
    }
  }
  return modes;
}

void apply_modes(const CraneModel& model, const ModeTable& modes, TranscriptionBounds& bounds) {
  SPARFLOW_CHECK(modes.rows() == bounds.qdd_lower.rows(),
                 "modes and bounds must have the same mesh");
  for (int c = 0; c < model.machine.cylinder_count(); ++c) {
    const int j = model.machine.cylinders[static_cast<std::size_t>(c)].joint;
    const Range& range = model.machine.joints[static_cast<std::size_t>(j)].position;
    const double sign =
        linkage_rates(model.machine, c, 0.5 * (range.lo + range.hi)).d1 > 0.0 ? 1.0 : -1.0;
    for (Eigen::Index k = 0; k < modes.rows(); ++k) {
      const CylinderMode mode = modes(k, c);
      if (mode == CylinderMode::kFree) continue;
      const bool rest = mode == CylinderMode::kRest;
      const bool forward = !rest && ((mode == CylinderMode::kExtend) == (sign > 0.0));
      for (const Eigen::Index knot : {k, k + 1}) {
        double& lower = bounds.qd_lower(knot, j);
        double& upper = bounds.qd_upper(knot, j);
        if (rest || forward) lower = std::max(lower, 0.0);
        if (rest || !forward) upper = std::min(upper, 0.0);
      }
      if (rest) bounds.qdd_lower(k, j) = bounds.qdd_upper(k, j) = 0.0;
    }
  }
}

}  // namespace sparflow
