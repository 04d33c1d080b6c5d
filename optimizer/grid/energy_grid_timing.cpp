/// Speed profiles along a grid path.
#include "optimizer/grid/energy_grid_timing.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/grid/energy_grid.h"
#include "optimizer/transcription/transcription.h"
#include "problems/motion_limits.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Longest ramp as share of a leg.
/// @threshold [1] 0.1..0.5; derived: two ramps of a leg must leave a part at constant speed
constexpr double kLongestRamp = 0.45;

/// Speed at the corners: 0 where a joint stops or reverses, else the lower of the two legs' mean speeds.
MatrixXd corner_speeds(const MatrixXd& corners, const VectorXd& durations) {
  MatrixXd speed = MatrixXd::Zero(corners.rows(), corners.cols());
  for (Eigen::Index k = 1; k + 1 < corners.rows(); ++k) {
    for (Eigen::Index j = 0; j < corners.cols(); ++j) {
      const double before = (corners(k, j) - corners(k - 1, j)) / durations[k - 1];
      const double after = (corners(k + 1, j) - corners(k, j)) / durations[k];
      if (before * after <= 0.0) continue;
      speed(k, j) = std::abs(before) < std::abs(after) ? before : after;
    }
  }
  return speed;
}

}  // namespace

LegProfile leg_profile(const MotionProblem& problem, const MatrixXd& corners,
                       const VectorXd& durations) {
  LegProfile profile;
  profile.corner_speed = corner_speeds(corners, durations);
  const Eigen::Index legs = durations.size();
  profile.ramp.resize(legs);
  profile.cruise.resize(legs, corners.cols());
  for (Eigen::Index k = 0; k < legs; ++k) {
    const double time = durations[k];
    double ramp = 0.02 * time;
    for (Eigen::Index j = 0; j < corners.cols(); ++j) {
      const double way = std::abs(corners(k + 1, j) - corners(k, j));
      const Range& a = problem.limits.acceleration[static_cast<std::size_t>(j)];
      const double most = 0.95 * std::min(a.hi, -a.lo);
      const bool rests = profile.corner_speed(k, j) == 0.0 || profile.corner_speed(k + 1, j) == 0.0;
      if (way <= 0.0 || !rests || !(most > 0.0)) continue;
      const double root = time * time - 4.0 * way / most;
      ramp = std::max(ramp, root > 0.0 ? 0.5 * (time - std::sqrt(root)) : kLongestRamp * time);
    }
    profile.ramp[k] = std::min(ramp, kLongestRamp * time);
    const double share = profile.ramp[k] / time;
    profile.cruise.row(k) =
        ((corners.row(k + 1) - corners.row(k)) / time -
         0.5 * share * (profile.corner_speed.row(k) + profile.corner_speed.row(k + 1))) /
        (1.0 - share);
  }
  return profile;
}

Trajectory profile_motion(const MatrixXd& corners, const VectorXd& durations,
                          const LegProfile& profile) {
  const Eigen::Index legs = durations.size(), n = corners.cols();
  Trajectory motion;
  motion.t.resize(3 * legs + 1);
  motion.q.resize(3 * legs + 1, n);
  motion.qd.setZero(3 * legs + 1, n);
  motion.qdd.setZero(3 * legs + 1, n);
  motion.t[0] = 0.0;
  motion.q.row(0) = corners.row(0);
  for (Eigen::Index k = 0; k < legs; ++k) {
    const double ramp = profile.ramp[k];
    const double step[3] = {ramp, durations[k] - 2.0 * ramp, ramp};
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Eigen::Index at = 3 * k + i;
      motion.t[at + 1] = motion.t[at] + step[i];
      motion.qd.row(at + 1) = i < 2 ? profile.cruise.row(k) : profile.corner_speed.row(k + 1);
      motion.qdd.row(at) = (motion.qd.row(at + 1) - motion.qd.row(at)) / step[i];
      motion.q.row(at + 1) =
          motion.q.row(at) + 0.5 * step[i] * (motion.qd.row(at) + motion.qd.row(at + 1));
    }
    motion.q.row(3 * k + 3) = corners.row(k + 1);  // removes rounding errors
  }
  motion.qdd.row(3 * legs) = motion.qdd.row(3 * legs - 1);
  return motion;
}

namespace {

/// Factor by which a leg's duration must grow so that it keeps its limits.
double leg_ratio(LimitRatios& ratios, const Trajectory& motion, Eigen::Index leg) {
  /// Parts of an interval at which a leg's limits are judged.
  /// @threshold [1] 2..64; chosen: finer than driven_grid_path() judges them
  constexpr int kFine = 24;
  double worst = 1e-3;
  for (Eigen::Index at = 3 * leg; at < 3 * leg + 3; ++at) {
    const double h = motion.t[at + 1] - motion.t[at];
    worst =
        std::max(worst, std::sqrt(ratios.acceleration(motion.qdd.row(at).transpose(), nullptr)));
    for (int part = 0; part <= kFine; ++part) {
      const double dt = h * part / kFine;
      const VectorXd qd = (motion.qd.row(at) + dt * motion.qdd.row(at)).transpose();
      const VectorXd q =
          (motion.q.row(at) + dt * motion.qd.row(at) + 0.5 * dt * dt * motion.qdd.row(at))
              .transpose();
      worst = std::max(worst, ratios.speed(q, qd, nullptr));
    }
  }
  return worst;
}

}  // namespace

VectorXd shortest_leg_durations(const CraneModel& model, const MotionProblem& problem,
                                const MatrixXd& corners) {
  const Eigen::Index legs = corners.rows() - 1;
  MotionProblem limited = problem;
  limited.limits.pump_max_flow.clear();
  for (const double most : pump_flow_limits(model, problem)) {
    limited.limits.pump_max_flow.push_back(std::isfinite(most) ? most : 0.0);
  }
  LimitRatios ratios(limited);
  const VectorXd scale = speed_scale(problem);
  VectorXd durations(legs);
  for (Eigen::Index k = 0; k < legs; ++k) {
    const auto way = (corners.row(k + 1) - corners.row(k)).transpose().array().abs();
    durations[k] = std::max(1e-3, (way / scale.array()).maxCoeff() * 1.5);
  }
  /// Rounds in which the legs' durations are adapted.
  /// @threshold [1] 3..100; chosen: changes are then below the last stretching
  constexpr int kRounds = 12;
  double worst = 1.0;
  VectorXd ratio(legs);
  for (int round = 0; round < kRounds; ++round) {
    const LegProfile profile = leg_profile(problem, corners, durations);
    const Trajectory motion = profile_motion(corners, durations, profile);
    for (Eigen::Index k = 0; k < legs; ++k) ratio[k] = leg_ratio(ratios, motion, k);
    worst = ratio.maxCoeff();
    if (round + 1 == kRounds) break;
    for (Eigen::Index k = 0; k < legs; ++k) durations[k] *= std::clamp(ratio[k], 0.6, 2.0);
  }
  // The remaining violation is removed by stretching all legs: a factor r divides speeds by r and accelerations by r^2.
  /// Factor on all durations for what lies between the samples.
  /// @threshold [1] 1..1.01; chosen: a fifth of kGridTolerance
  constexpr double kBetweenSamples = 1.0 + 2e-4;
  return durations * std::max(1.0, worst) * kBetweenSamples;
}

Trajectory timed_grid_path(const CraneModel& /*model*/, const MotionProblem& problem,
                           const GridPath& path, double duration) {
  SPARFLOW_CHECK(path.found && duration > 0.0, "a path that was found, and a duration");
  if (path.leg_durations.size() == 0) {  // the start is the goal
    Trajectory rest;
    rest.t = Eigen::Vector2d(0.0, duration);
    rest.q = path.corners.row(0).replicate(2, 1);
    rest.qd = rest.qdd = MatrixXd::Zero(2, path.corners.cols());
    return rest;
  }
  const LegProfile profile = leg_profile(problem, path.corners, path.leg_durations);
  return with_duration(profile_motion(path.corners, path.leg_durations, profile), duration);
}

ModeTable leg_modes(const Machine& machine, const MatrixXd& corners) {
  ModeTable modes =
      ModeTable::Constant(corners.rows() - 1, machine.cylinder_count(), CylinderMode::kRest);
  for (Eigen::Index k = 0; k < modes.rows(); ++k) {
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const int joint = machine.cylinders[static_cast<std::size_t>(c)].joint;
      const double way = corners(k + 1, joint) - corners(k, joint);
      if (way == 0.0) continue;
      const double middle = 0.5 * (corners(k + 1, joint) + corners(k, joint));
      const bool extends = way * linkage_rates(machine, c, middle).d1 > 0.0;
      modes(k, c) = extends ? CylinderMode::kExtend : CylinderMode::kRetract;
    }
  }
  return modes;
}

ModeCandidate grid_path_candidate(const CraneModel& model, const MotionProblem& problem,
                                  const GridPath& path, double duration, int intervals) {
  SPARFLOW_CHECK(path.found && path.leg_durations.size() > 0 && intervals > 0,
                 "a path with legs and a mesh");
  const Trajectory corners = timed_grid_path(model, problem, path, duration);
  std::vector<double> times = {0.0};
  std::vector<Eigen::Index> leg_of;
  for (Eigen::Index at = 0; at + 1 < corners.size(); ++at) {
    const double h = corners.t[at + 1] - corners.t[at];
    const int parts = std::max(1, static_cast<int>(std::lround(h / duration * intervals)));
    for (int k = 1; k <= parts; ++k) {
      times.push_back(k == parts ? corners.t[at + 1] : corners.t[at] + h * k / parts);
      leg_of.push_back(at / 3);
    }
  }
  ModeCandidate candidate;
  candidate.guess = resampled(
      corners, Eigen::Map<const VectorXd>(times.data(), static_cast<Eigen::Index>(times.size())));
  candidate.modes.resize(static_cast<Eigen::Index>(leg_of.size()), path.modes.cols());
  for (std::size_t k = 0; k < leg_of.size(); ++k) {
    candidate.modes.row(static_cast<Eigen::Index>(k)) = path.modes.row(leg_of[k]);
  }
  candidate.name = "grid:";
  for (Eigen::Index k = 0; k < path.modes.rows(); ++k) {
    candidate.name += k == 0 ? " " : ", ";
    bool first = true;
    for (int j = 0; j < model.machine.joint_count(); ++j) {
      if (path.corners(k + 1, j) == path.corners(k, j)) continue;
      candidate.name += (first ? "" : "+") + model.machine.joints[static_cast<std::size_t>(j)].name;
      first = false;
    }
  }
  candidate.energy = exact_total_energy(model, candidate.guess, problem.payload, 2);
  return candidate;
}

}  // namespace sparflow
