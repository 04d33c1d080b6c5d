#include "problems/motion_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

}  // namespace

VectorXd speed_scale(const MotionProblem& problem) {
  VectorXd scale(problem.machine.joint_count());
  for (Eigen::Index j = 0; j < scale.size(); ++j) {
    const Range& v = problem.limits.velocity[at(j)];
    scale[j] = 0.5 * (v.hi - v.lo);
    SPARFLOW_CHECK(scale[j] > 0.0 && std::isfinite(scale[j]), "every joint needs a speed limit");
  }
  return scale;
}

LimitRatios::LimitRatios(const MotionProblem& problem)
    : problem_(problem), pump_flow_(VectorXd::Zero(problem.machine.pump_count())) {}

double LimitRatios::speed(const VectorXd& q, const VectorXd& qd, std::string* name) {
  double worst = 0.0;
  const auto judge = [&](double ratio, auto&& text) {
    if (ratio <= worst) return;
    worst = ratio;
    if (name) *name = text();
  };
  const Machine& machine = problem_.machine;
  for (Eigen::Index j = 0; j < qd.size(); ++j) {
    const Range& v = problem_.limits.velocity[at(j)];
    judge(qd[j] > 0.0 ? qd[j] / v.hi : qd[j] / v.lo,
          [&] { return "speed of joint " + machine.joints[at(j)].name; });
  }
  pump_flow_.setZero();
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const Cylinder& cylinder = machine.cylinders[at(i)];
    if (!cylinder.hydraulic()) continue;
    const double dx = linkage_rates(machine, i, q[cylinder.joint]).d1 * qd[cylinder.joint];
    const double flow = std::abs(dx) * (dx > 0.0 ? cylinder.area_piston() : cylinder.area_rod());
    if (const Valve* valve = machine.valve_of_cylinder(i)) {
      const double most = problem_.limits.valve_fraction *
                          (dx > 0.0 ? valve->max_flow_extend : valve->max_flow_retract);
      if (most > 0.0) {
        judge(flow / most, [&] {
          return fmt::format("flow of cylinder {} {}", cylinder.name,
                             dx > 0.0 ? "extending" : "retracting");
        });
      }
    }
    const int pump = machine.pump_of_cylinder(i);
    if (pump >= 0) pump_flow_[pump] += flow;
  }
  for (Eigen::Index p = 0; p < pump_flow_.size(); ++p) {
    const double most = problem_.limits.pump_max_flow[at(p)];
    if (most > 0.0) {
      judge(pump_flow_[p] / most, [&] { return "flow of pump " + machine.pumps[at(p)].name; });
    }
  }
  return worst;
}

double LimitRatios::acceleration(const VectorXd& qdd, std::string* name) const {
  double worst = 0.0;
  for (Eigen::Index j = 0; j < qdd.size(); ++j) {
    const Range& a = problem_.limits.acceleration[at(j)];
    const double ratio = qdd[j] > 0.0 ? qdd[j] / a.hi : qdd[j] / a.lo;
    if (ratio <= worst) continue;
    worst = ratio;
    if (name) *name = "acceleration of joint " + problem_.machine.joints[at(j)].name;
  }
  return worst;
}

LeastFlows least_flows(const Machine& machine, const MotionLimits& limits) {
  LeastFlows least(machine.cylinders.size());
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const Valve* valve = machine.valve_of_cylinder(i);
    const int pump = machine.pump_of_cylinder(i);
    const double whole = pump >= 0 ? limits.pump_max_flow[at(pump)] : 0.0;
    const auto full = [&](double flow) { return flow > 0.0 ? flow : whole; };
    const double extend = full(valve != nullptr ? valve->max_flow_extend : 0.0);
    const double retract = full(valve != nullptr ? valve->max_flow_retract : 0.0);
    least[at(i)] = {limits.valve_least_fraction * extend, limits.valve_least_fraction * retract};
  }
  return least;
}

bool firmly_moving(const LeastFlows& least, std::size_t cylinder, double flow, double speed) {
  if (least.empty()) return true;
  return flow >= (speed > 0.0 ? least[cylinder].extend : least[cylinder].retract);
}

double limit_ratio(const MotionProblem& problem, const Trajectory& motion, int factor,
                   std::string* limit) {
  LimitRatios limits(problem);
  const Trajectory fine = motion.refined(factor);
  double worst = 0.0;
  std::string name;
  for (Eigen::Index k = 0; k < fine.size(); ++k) {
    const VectorXd q = fine.q.row(k), qd = fine.qd.row(k), qdd = fine.qdd.row(k);
    const double speed = limits.speed(q, qd, &name);
    if (speed > worst) {
      worst = speed;
      if (limit) *limit = name;
    }
    const double acceleration = limits.acceleration(qdd, &name);
    if (acceleration > worst) {
      worst = acceleration;
      if (limit) *limit = name;
    }
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Range& range = problem.limits.position[at(j)];
      const double half = 0.5 * (range.hi - range.lo);
      if (half <= 0.0) continue;
      const double ratio = std::abs(q[j] - 0.5 * (range.lo + range.hi)) / half;
      if (ratio <= 1.0 + 1e-9 || ratio <= worst) continue;
      worst = ratio;
      if (limit) *limit = "position of joint " + problem.machine.joints[at(j)].name;
    }
  }
  return worst;
}

}  // namespace sparflow
