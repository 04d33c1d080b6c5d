#pragma once
/// How much of its limits a motion uses: joint speed, acceleration and position, valve and pump flow.
#include <Eigen/Dense>
#include <string>

#include "models/machine/trajectory.h"
#include "problems/problem.h"

namespace sparflow {

/// Every joint's mean speed limit. Coordinates divided by it are in seconds of travel at full speed, so
/// joints in rad and in m compare. @return [rad/s] or [m/s], by joint
Eigen::VectorXd speed_scale(const MotionProblem& problem);

/// Ratios of what is asked to what is allowed; 1 = just held. A mutable workspace that refers to `problem`.
class LimitRatios {
 public:
  explicit LimitRatios(const MotionProblem& problem);

  /// Worst of joint speeds, valve flows (by direction) and pump flows: all proportional to qd.
  /// @param name gets what is worst, e.g. "flow of pump main"; may be null
  double speed(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, std::string* name);
  /// Worst of the joint accelerations.
  double acceleration(const Eigen::VectorXd& qdd, std::string* name) const;

 private:
  const MotionProblem& problem_;
  Eigen::VectorXd pump_flow_;
};

/// Worst ratio over a motion at `factor` instants an interval, positions included (there the distance from the middle
/// of the range over half the range, counted only beyond 1). @param limit gets the worst's name; may be null
double limit_ratio(const MotionProblem& problem, const Trajectory& motion, int factor,
                   std::string* limit = nullptr);

}  // namespace sparflow
