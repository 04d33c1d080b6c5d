#pragma once
/// Ratios of a motion's values to its limits: joint speed, acceleration and position, valve and pump flow.
#include <Eigen/Dense>
#include <string>

#include "models/machine/trajectory.h"
#include "problems/problem.h"

namespace sparflow {

/// Every joint's mean speed limit. Coordinates divided by it are in seconds of travel at full speed, so
/// joints in rad and in m compare. @return [rad/s] or [m/s], by joint
Eigen::VectorXd speed_scale(const MotionProblem& problem);

/// Ratios of values to limits [-]; 1 = the limit is just kept. A mutable workspace that refers to `problem`.
class LimitRatios {
 public:
  explicit LimitRatios(const MotionProblem& problem);

  /// Largest ratio of joint speeds, valve flows (by direction) and pump flows, all of which are proportional to qd.
  /// @param name set to the quantity with the largest ratio, e.g. "flow of pump main"; may be null
  double speed(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, std::string* name);
  /// Largest ratio of the joint accelerations.
  double acceleration(const Eigen::VectorXd& qdd, std::string* name) const;

 private:
  const MotionProblem& problem_;
  Eigen::VectorXd pump_flow_;
};

/// Least flows of the valves, by cylinder. [m^3/s]
struct LeastFlow {
  double extend = 0.0;
  double retract = 0.0;
};
using LeastFlows = std::vector<LeastFlow>;

/// The least flow of every cylinder's valve: the problem's share of the valve's full flow; where the machine file gives no
/// valve, of its pump's largest flow; 0 where neither is known.
LeastFlows least_flows(const Machine& machine, const MotionLimits& limits);

/// True when a cylinder moves and its valve can give that flow.
/// @param least of all cylinders, or empty: then every flow can be given  @param speed of the rod [m/s]
bool firmly_moving(const LeastFlows& least, std::size_t cylinder, double flow, double speed);

/// Largest ratio over a motion at `factor` instants in each interval, positions included (as distance from the middle of
/// the range over half the range, only if it exceeds 1). @param limit set to the name of that limit; may be null
double limit_ratio(const MotionProblem& problem, const Trajectory& motion, int factor,
                   std::string* limit = nullptr);

}  // namespace sparflow
