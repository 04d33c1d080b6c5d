#pragma once
/// The goal of a redundant arm is a region: all postures that put the tip there. This samples it.
#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "problems/clearance.h"
#include "problems/motion_limits.h"
#include "problems/problem.h"

namespace sparflow {

/// How near the tip must come to count as there [m]. Samples usually are within 1e-9.
inline constexpr double kTipTolerance = 1e-3;

/// Length of a polyline in the room's metric: Euclidean over joint coordinates divided by speed_scale(), so in
/// seconds of travel at full speed [s]. Symmetric in direction: a measure of how far, not of energy.
/// @param path waypoints x joints
double path_length(const Eigen::MatrixXd& path, const Eigen::VectorXd& scale);

/// A posture found for a wanted tip position.
struct Posture {
  Eigen::VectorXd q;      ///< within the position limits
  Eigen::Vector3d tip;    ///< where it puts the tip [m]
  double distance = 0.0;  ///< of the tip from the wanted point [m]
};

/// Inverse kinematics within the limits by damped, limit-aware Newton steps on the tip's error. Steps are
/// least in the room's metric, so redundant joints share the motion by their speed. Directions along which
/// the tip cannot move (a planar machine's normal) take no part in the steps, but count in `distance`.
/// Immutable: safe to share.
class TipSolver {
 public:
  explicit TipSolver(const MotionProblem& problem);

  /// Posture near `from` with the tip at `target`, or the local optimum of its distance.
  /// @param frozen joint that must not move, -1 = none
  Posture solve(const Eigen::VectorXd& from, const Eigen::Vector3d& target, int frozen = -1) const;

  /// Slides a solution along the goal region towards `anchor`: Gauss-Newton on the distance in the room's
  /// metric subject to the tip's position. Local; the result reaches the target if `posture` did.
  Posture pull_towards(const Posture& posture, const Eigen::VectorXd& anchor,
                       const Eigen::Vector3d& target) const;

  /// Degrees of freedom of the goal region: joints less directions in which the tip can move; 0 = isolated.
  int redundancy() const;
  Eigen::Vector3d tip(const Eigen::VectorXd& q) const;
  const Eigen::VectorXd& scale() const { return scale_; }

 private:
  Eigen::VectorXd step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual,
                       double damping, const Eigen::VectorXd& q, int frozen) const;
  Machine machine_;
  std::vector<Range> limits_;
  Eigen::VectorXd scale_;
  Eigen::Matrix3Xd moving_;  ///< columns: orthonormal directions in which the tip can move
};

/// Postures at the problem's goal.
struct GoalPostures {
  std::vector<Eigen::VectorXd>
      postures;            ///< within limits and clear; the first is the nearest to the start
  bool reachable = false;  ///< some posture reaches the goal, clear or not
  Posture nearest;         ///< nearest posture when nothing reaches the goal
  Nearest blocked;         ///< of the least blocked posture when none is clear
};

/// Samples the goal region: Newton from the start, from the start with one joint held (motions that leave a
/// joint at rest are often the cheapest) and from random postures; slides the nearest towards the start;
/// drops what collides and merges duplicates. A joint goal is its own only posture.
/// Same seed, same result.
/// @param samples random starts of Newton's method
GoalPostures sample_goal(const MotionProblem& problem, ClearanceModel& clearance, int samples,
                         std::uint64_t seed);

/// Adds spread-out postures to `chosen` until it holds `count`: always the one furthest from those already
/// chosen (Gonzalez 1985), as long as it is further than `least` [s] from them. Indices into `postures`.
void spread_out(const std::vector<Eigen::VectorXd>& postures, const Eigen::VectorXd& scale,
                std::size_t count, double least, std::vector<std::size_t>& chosen);

}  // namespace sparflow
