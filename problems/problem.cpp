#include "problems/problem.h"

#include <cmath>
#include <limits>

#include "models/math/linear_algebra.h"

namespace sparflow {

bool Duration::free() const { return min == 0.0 && std::isinf(max); }

MotionLimits limits_of(const Machine& machine) {
  MotionLimits limits;
  for (const Joint& joint : machine.joints) {
    limits.position.push_back(joint.position);
    limits.velocity.push_back(joint.velocity);
    limits.acceleration.push_back(joint.acceleration);
  }
  for (const Pump& pump : machine.pumps) {
    limits.pump_max_flow.push_back(pump.max_flow);
    limits.pump_max_pressure.push_back(pump.max_pressure);
  }
  return limits;
}

// A direction d is fixed when every revolute axis is parallel to d and every prismatic axis normal to it. Then no rotation
// turns d, so one posture is enough for the test. Joints behind the tip are ignored.
std::vector<Eigen::Vector3d> fixed_tip_directions(const Machine& machine) {
  // d is in the null space of this: sum of (I - a a^T) over revolute and a a^T over prismatic axes.
  Eigen::Matrix3d moved = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int i = 0; i <= machine.tip.joint; ++i) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(i)];
    rotation = (rotation * joint.origin.linear()).eval();
    const Eigen::Vector3d axis = rotation * joint.axis;
    const Eigen::Matrix3d along = axis * axis.transpose();
    moved += joint.type == JointType::kRevolute ? Eigen::Matrix3d::Identity() - along : along;
  }
  // The tolerance 1e-12 is the squared sine of the angle between the axes: a millionth of a radian.
  const Eigen::MatrixXd still = complement_of(moved, 1e-12);
  std::vector<Eigen::Vector3d> fixed;
  for (Eigen::Index k = 0; k < still.cols(); ++k) {
    Eigen::Vector3d d = still.col(k);
    Eigen::Index largest = 0;
    d.cwiseAbs().maxCoeff(&largest);
    if (d[largest] < 0.0) d = -d;
    fixed.push_back(d);
  }
  return fixed;
}

Eigen::Matrix3Xd moving_tip_directions(const Machine& machine) {
  const std::vector<Eigen::Vector3d> fixed = fixed_tip_directions(machine);
  if (fixed.empty()) return Eigen::Matrix3d::Identity();
  Eigen::MatrixXd still(3, static_cast<Eigen::Index>(fixed.size()));
  for (std::size_t k = 0; k < fixed.size(); ++k) still.col(static_cast<Eigen::Index>(k)) = fixed[k];
  return complement_of(still);
}

bool moves_at_an_end(const MotionProblem& problem) {
  const auto moves = [](const Eigen::VectorXd& v) { return v.size() > 0 && !v.isZero(0.0); };
  return moves(problem.start_velocity) || moves(problem.goal_velocity);
}

double payload_on(const MotionProblem& problem, std::size_t leg) {
  double payload = problem.payload;
  for (std::size_t s = 0; s < leg && s < problem.stops.size(); ++s)
    payload = problem.stops[s].payload.value_or(payload);
  return payload;
}

std::string end_of_leg(const MotionProblem& problem, std::size_t leg) {
  return leg < problem.stops.size() ? problem.stops[leg].name : problem.goal_name;
}

double total_dwell(const MotionProblem& problem) {
  double time = 0.0;
  for (const Stop& stop : problem.stops) time += stop.dwell;
  return time;
}

MotionProblem leg_of(const MotionProblem& problem, std::size_t leg, const Eigen::VectorXd& start) {
  MotionProblem one = problem;
  one.payload = payload_on(problem, leg);
  one.start = start;
  if (leg < problem.stops.size()) {
    one.goal = problem.stops[leg].goal;
    one.goal_name = problem.stops[leg].name;
  }
  one.stops.clear();
  return one;
}

MotionProblem::MotionProblem() = default;
MotionProblem::MotionProblem(const MotionProblem&) = default;
MotionProblem::MotionProblem(MotionProblem&&) noexcept = default;
MotionProblem& MotionProblem::operator=(const MotionProblem&) = default;
MotionProblem& MotionProblem::operator=(MotionProblem&&) noexcept = default;
MotionProblem::~MotionProblem() = default;

}  // namespace sparflow
