#pragma once
/// Machines and problems for tests of problems/ and planners/, made in code.
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "problems/problem.h"

namespace sparflow::arms {

/// Limits of a joint; speed and acceleration are the same in both directions.
struct JointLimits {
  Range position;
  double velocity, acceleration;
};

inline Joint joint(const std::string& name, JointType type, const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& axis, const JointLimits& limits) {
  Joint j;
  j.name = name;
  j.type = type;
  j.origin.translation() = origin;
  j.axis = axis;
  j.position = limits.position;
  j.velocity = {-limits.velocity, limits.velocity};
  j.acceleration = {-limits.acceleration, limits.acceleration};
  return j;
}

/// The loader crane's geometry, cylinders, valves and pump without masses: planar, one redundant joint.
inline Machine loader_crane() {
  constexpr double kLpm = 1.0 / 6e4;
  Machine m;
  m.name = "loader-crane";
  m.joints = {
      joint("boom", JointType::kRevolute, {0, 0, 2}, {0, -1, 0}, {{-0.2, 1.35}, 0.11, 0.3}),
      joint("jib", JointType::kRevolute, {3.4, 0, 0}, {0, -1, 0}, {{-2.3, 0.05}, 0.18, 0.45}),
      joint("extension", JointType::kPrismatic, {3, 0, 0}, {1, 0, 0}, {{0, 6}, 0.3, 0.6})};
  m.tip.joint = 2;
  Cylinder boom;
  boom.name = "boom";
  boom.joint = 0;
  boom.bore = 0.18;
  boom.rod = 0.115;
  boom.linkage = PinsLinkage{{0.4, 0, 0.5}, {0.65, 0, -0.2}, true};
  Cylinder jib;
  jib.name = "jib";
  jib.joint = 1;
  jib.bore = 0.15;
  jib.rod = 0.1;
  FourBarLinkage knuckle;
  knuckle.barrel = {1.2, 0, -0.35};
  knuckle.rocker = {3.2, 0, 0};
  knuckle.coupler = {0.3, 0, 0};
  knuckle.rocker_length = 0.6;
  knuckle.coupler_length = 0.5;
  knuckle.branch = -1;
  jib.linkage = knuckle;
  Cylinder extension;
  extension.name = "extension";
  extension.joint = 2;
  extension.bore = 0.07;
  extension.rod = 0.05;
  extension.stages = 4;
  m.cylinders = {boom, jib, extension};
  Pump pump;
  pump.name = "main";
  pump.feeds = {0, 1, 2};
  pump.max_flow = 120 * kLpm;
  pump.max_pressure = 310e5;
  pump.standby = 22e5;
  m.pumps = {pump};
  m.valves = {{0, 100 * kLpm, 65 * kLpm}, {1, 85 * kLpm, 50 * kLpm}, {2, 75 * kLpm, 40 * kLpm}};
  return m;
}

/// The loader crane on a slewing column: four joints, spatial, one of them redundant.
inline Machine slewing_crane() {
  Machine m = loader_crane();
  m.joints[0].origin.translation() = Eigen::Vector3d(0.2, 0, 2);
  m.joints.insert(m.joints.begin(), joint("slew", JointType::kRevolute, {0, 0, 0.3}, {0, 0, 1},
                                          {{-2.5, 2.5}, 0.4, 0.5}));
  for (Cylinder& c : m.cylinders) ++c.joint;
  m.tip.joint = 3;
  m.tip.xyz = {0.1, 0, -0.2};
  return m;
}

/// Two booms in the vertical plane, no telescope: a tip goal has at most two postures.
inline Machine two_link() {
  Machine m;
  m.name = "two-link";
  m.joints = {joint("upper", JointType::kRevolute, {0, 0, 0}, {0, -1, 0}, {{-3, 3}, 1, 2}),
              joint("lower", JointType::kRevolute, {2, 0, 0}, {0, -1, 0}, {{-3, 3}, 1, 2})};
  m.tip.joint = 1;
  m.tip.xyz = {1.5, 0, 0};
  return m;
}

inline MotionProblem problem(Machine machine, const Eigen::VectorXd& start, Goal goal) {
  MotionProblem p;
  p.name = "test";
  p.machine = std::move(machine);
  p.start = start;
  p.goal = std::move(goal);
  p.duration = {0.0, std::numeric_limits<double>::infinity()};
  for (const Joint& j : p.machine.joints) {
    p.limits.position.push_back(j.position);
    p.limits.velocity.push_back(j.velocity);
    p.limits.acceleration.push_back(j.acceleration);
  }
  for (const Pump& pump : p.machine.pumps) {
    p.limits.pump_max_flow.push_back(pump.max_flow);
    p.limits.pump_max_pressure.push_back(pump.max_pressure);
  }
  return p;
}

inline Obstacle box(const std::string& name, const Eigen::Vector3d& center,
                    const Eigen::Vector3d& size) {
  Box b;
  b.center = center;
  b.size = size;
  return {name, b};
}

inline Obstacle sphere(const std::string& name, const Eigen::Vector3d& center, double radius) {
  return {name, Sphere{center, radius}};
}

inline Obstacle half_space(const std::string& name, const Eigen::Vector3d& point,
                           const Eigen::Vector3d& normal) {
  return {name, HalfSpace{point, normal.normalized()}};
}

}  // namespace sparflow::arms
