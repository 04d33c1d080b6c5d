#pragma once
/// Places in a problem file: postures and rates, points of the tip, the goal and the stops of a cycle.
#include <string>
#include <vector>

#include "models/yaml/yaml_reader.h"
#include "problems/oriented_goal.h"
#include "problems/problem.h"

namespace sparflow {

/// Reads into a problem whose machine and limits are read already, and refers to it. All throw InputError.
class PlaceReader {
 public:
  explicit PlaceReader(MotionProblem& problem) : problem_(problem) {}

  /// A position for each joint, within the limits. [rad] or [m]
  Eigen::VectorXd posture(const YamlValue& value) const;
  /// Rates of joints at a posture; joints that are not named rest. [rad/s] or [m/s]
  /// @param onwards 1: at the start, from where the joints must be able to stop; -1: at the goal, before which they start
  Eigen::VectorXd velocity(const YamlValue& value, const Eigen::VectorXd& q, double onwards) const;
  /// A position of the tip, which must lie in the machine's plane if it is planar. [m]
  Eigen::Vector3d tip(const YamlValue& value) const;
  /// Sets the goal, and the rates there.
  void goal(const YamlValue& value);
  /// Sets the stops of a cycle; the last one is the goal.
  void cycle(const YamlValue& value);

 private:
  std::vector<std::string> joint_names() const;
  const Joint& joint(std::size_t i) const { return problem_.machine.joints[i]; }
  bool revolute(std::size_t i) const { return joint(i).type == JointType::kRevolute; }
  Stop stop(const YamlValue& value, std::size_t number) const;
  Eigen::VectorXd joint_tolerance(const YamlMap& map) const;
  void oriented_goal(const YamlValue& value, const OrientedTip& wanted);

  MotionProblem& problem_;
};

}  // namespace sparflow
