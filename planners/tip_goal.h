#pragma once
/// Sampling of the goal region: all postures of a redundant arm that put the tip at the goal.
#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "problems/clearance.h"
#include "problems/motion_limits.h"
#include "problems/problem.h"

namespace sparflow {

/// Distance from the goal within which the tip counts as there; samples usually are within 1e-9.
/// @threshold [m] 1e-6..0.1; chosen: a millimetre, below what any of these machines is positioned to; the optimiser
/// then puts the tip at the goal itself
inline constexpr double kTipTolerance = 1e-3;

/// Length of a polyline in the metric of all planners: Euclidean over joint coordinates divided by speed_scale(), so in
/// seconds of travel at full speed [s]. It is the same in both directions and says nothing about energy.
/// @param path waypoints x joints
double path_length(const Eigen::MatrixXd& path, const Eigen::VectorXd& scale);

/// A posture found for a wanted tip position.
struct Posture {
  Eigen::VectorXd q;      ///< within the position limits
  Eigen::Vector3d tip;    ///< where it puts the tip [m]
  double distance = 0.0;  ///< of the tip from the wanted point [m]
};

/// Inverse kinematics within the limits by damped Newton steps on the tip's error. Steps are least in the metric of
/// path_length(), so redundant joints share the motion in proportion to their speed. Directions along which the tip cannot
/// move (a planar machine's normal) do not enter the steps, but count in `distance`. Immutable and safe to share.
class TipSolver {
 public:
  explicit TipSolver(const MotionProblem& problem);

  /// Posture near `from` with the tip at `target`, or the local optimum of its distance.
  /// @param frozen joint that must not move, -1 = none
  Posture solve(const Eigen::VectorXd& from, const Eigen::Vector3d& target, int frozen = -1) const;

  /// Moves a solution along the goal region towards `anchor`: Gauss-Newton on the distance in the same metric, subject to
  /// the tip's position. A local method; the result reaches the target if `posture` does.
  Posture pull_towards(const Posture& posture, const Eigen::VectorXd& anchor,
                       const Eigen::Vector3d& target) const;

  /// Dimension of the goal region: joints less directions in which the tip can move; 0 = isolated postures.
  int redundancy() const;
  Eigen::Vector3d tip(const Eigen::VectorXd& q) const;
  const Eigen::VectorXd& scale() const { return scale_; }

 private:
  Eigen::VectorXd step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual,
                       double damping, const Eigen::VectorXd& q, int frozen) const;
  Machine machine_;
  std::vector<Range> limits_;
  Eigen::VectorXd scale_;
  Eigen::Matrix3Xd moving_;  ///< columns are the orthonormal directions in which the tip can move
};

/// Goal configurations of a problem.
struct GoalPostures {
  std::vector<Eigen::VectorXd>
      postures;  ///< within limits and clear of obstacles; the first is the nearest to the start
  bool reachable = false;  ///< whether a posture reaches the goal, clear or not
  Posture nearest;         ///< nearest posture when nothing reaches the goal
  Nearest blocked;         ///< nearest approach of the least blocked posture when none is clear
};

/// Samples the goal region by Newton's method from the start, from the start with one joint held (motions that leave a
/// joint at rest are often the cheapest) and from random postures. The nearest samples are moved towards the start,
/// colliding ones dropped and duplicates merged. A joint goal gives that posture only. The same seed gives the same result.
/// @param samples random starts of Newton's method
GoalPostures sample_goal(const MotionProblem& problem, ClearanceModel& clearance, int samples,
                         std::uint64_t seed);

/// Adds postures to `chosen` until it holds `count`: each time the one furthest from those already chosen (Gonzalez 1985),
/// as long as it is further than `least` [s] from them. @param chosen indices into `postures`
void spread_out(const std::vector<Eigen::VectorXd>& postures, const Eigen::VectorXd& scale,
                std::size_t count, double least, std::vector<std::size_t>& chosen);

}  // namespace sparflow
