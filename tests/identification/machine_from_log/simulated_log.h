#pragma once
/// Logs of a machine whose values are known, for tests that blank them: smooth motions of all joints, pressures of the whole
/// balance with inertia and friction, noise of every sensor.
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "models/machine/inertial_torque.h"
#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "models/math/units.h"
#include "simulator/random/random.h"

namespace sparflow::testing_support {

struct LogPlan {
  std::uint64_t seed = 1;
  double seconds = 240.0;
  double step = 0.02;                                  ///< [s]
  std::vector<double> payloads = {0.0, 300.0, 600.0};  ///< [kg] one after the other
  bool strokes = true, positions = true, pressures = true, flows = false, payload_logged = true;
  double motion = 1.0;           ///< share of the joints' speeds
  double position_noise = 5e-4;  ///< [rad], [m]
  double stroke_noise = 5e-4;    ///< [m]
  double pressure_noise = 0.5;   ///< [bar]
  double flow_noise = 0.5;       ///< [l/min]
  double flow_gain = 1.0;        ///< what the sensor shows of the flow
  double friction = 800.0;       ///< [N] Coulomb, of each cylinder
};

/// Sum of three sines inside the joint's range, as fast as its limits allow.
class JointMotion {
 public:
  JointMotion(const Joint& joint, double share, simulator::Random& random) {
    const double half = 0.45 * (joint.position.hi - joint.position.lo);
    middle_ = 0.5 * (joint.position.hi + joint.position.lo);
    const double speed = share * std::min(-joint.velocity.lo, joint.velocity.hi);
    const double shares[3] = {0.6, 0.25, 0.15};
    double fastest = 0.0;
    for (int k = 0; k < 3; ++k) {
      size_[k] = shares[k] * half;
      rate_[k] = (1.0 + 0.7 * k) * random.uniform(0.85, 1.15);
      phase_[k] = random.uniform(0.0, 2.0 * std::numbers::pi);
      fastest += size_[k] * rate_[k];
    }
    for (double& r : rate_) r *= 0.9 * speed / fastest;
    if (share == 0.0) size_[0] = size_[1] = size_[2] = 0.0;
  }
  double at(double t, int derivative) const {
    double sum = derivative == 0 ? middle_ : 0.0;
    for (int k = 0; k < 3; ++k) {
      const double a = rate_[k] * t + phase_[k];
      sum += size_[k] * (derivative == 0   ? std::sin(a)
                         : derivative == 1 ? rate_[k] * std::cos(a)
                                           : -rate_[k] * rate_[k] * std::sin(a));
    }
    return sum;
  }

 private:
  double middle_ = 0.0, size_[3] = {}, rate_[3] = {}, phase_[3] = {};
};

inline double normal(simulator::Random& random) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += random.unit();
  return sum;
}

/// The columns of a log of this machine, by the names of docs/log_format.md.
inline std::vector<LogColumn> simulated_columns(const Machine& machine, const LogPlan& plan) {
  simulator::Random random(plan.seed, "motion"), noise(plan.seed, "noise");
  std::vector<JointMotion> motions;
  for (const Joint& j : machine.joints) motions.emplace_back(j, plan.motion, random);
  const int joints = machine.joint_count(), cylinders = machine.cylinder_count();
  std::vector<LogColumn> columns = {{"t_s", {}}};
  if (plan.payload_logged) columns.push_back({"payload_kg", {}});
  const auto add = [&](const std::string& name) {
    columns.push_back({name, {}});
    return columns.size() - 1;
  };
  std::vector<std::size_t> q_at, x_at, a_at, b_at, flow_at;
  for (const Joint& j : machine.joints)
    q_at.push_back(
        plan.positions ? add("q_" + j.name + (j.type == JointType::kRevolute ? "_rad" : "_m")) : 0);
  for (const Cylinder& c : machine.cylinders) {
    x_at.push_back(plan.strokes ? add("x_" + c.name + "_m") : 0);
    const bool pressures = plan.pressures && c.hydraulic();
    a_at.push_back(pressures ? add("pA_" + c.name + "_bar") : 0);
    b_at.push_back(pressures ? add("pB_" + c.name + "_bar") : 0);
    flow_at.push_back(plan.flows && c.hydraulic() ? add("Q_" + c.name + "_lpm") : 0);
  }
  StaticForce statics(machine);
  const auto rows = static_cast<int>(plan.seconds / plan.step);
  Eigen::VectorXd q(joints), qd(joints), qdd(joints);
  for (int k = 0; k < rows; ++k) {
    const double t = k * plan.step;
    const std::size_t part = std::min(
        plan.payloads.size() - 1,
        static_cast<std::size_t>(t / plan.seconds * static_cast<double>(plan.payloads.size())));
    const double payload = plan.payloads[part];
    for (int j = 0; j < joints; ++j) {
      const JointMotion& m = motions[static_cast<std::size_t>(j)];
      q[j] = m.at(t, 0);
      qd[j] = m.at(t, 1);
      qdd[j] = m.at(t, 2);
    }
    statics.update(q.data(), payload, 0);
    const Eigen::VectorXd inertia = inertial_torque<double>(machine, q, qd, qdd, payload);
    columns[0].values.push_back(t);
    if (plan.payload_logged) columns[1].values.push_back(payload);
    for (int j = 0; j < joints && plan.positions; ++j)
      columns[q_at[static_cast<std::size_t>(j)]].values.push_back(q[j] + plan.position_noise *
                                                                             normal(noise));
    for (int i = 0; i < cylinders; ++i) {
      const auto c = static_cast<std::size_t>(i);
      const Cylinder& part_of = machine.cylinders[c];
      const Taylor3& x = statics.length(i);
      const double speed = x.d1 * qd[part_of.joint];
      if (plan.strokes)
        columns[x_at[c]].values.push_back(x.value - part_of.length_at_zero_stroke.value_or(0.0) +
                                          plan.stroke_noise * normal(noise));
      if (!part_of.hydraulic()) continue;
      const double force = statics.force()[i] + inertia[part_of.joint] / x.d1 +
                           plan.friction * std::tanh(speed / 1e-3);
      const double a = part_of.area_piston(), r = part_of.area_rod();
      // The return side has back pressure, the other one what the force asks for; neither falls below 3 bar.
      const double back =
          (speed > 0.0 ? 4.0 + 60.0 * std::abs(speed) : 25.0 + 80.0 * std::abs(speed)) *
          units::kBar;
      const double pb = std::max(back, (3.0 * units::kBar * a - force) / r);
      const double pa = (force + r * pb) / a;
      if (plan.pressures) {
        columns[a_at[c]].values.push_back(pa / units::kBar + plan.pressure_noise * normal(noise));
        columns[b_at[c]].values.push_back(pb / units::kBar + plan.pressure_noise * normal(noise));
      }
      if (plan.flows) {
        const double flow =
            plan.flow_gain * std::abs(speed) * (speed > 0.0 ? a : r) / units::kLitrePerMinute;
        columns[flow_at[c]].values.push_back(std::max(0.0, flow + plan.flow_noise * normal(noise)));
      }
    }
  }
  return columns;
}

inline Log simulated_log(const Machine& machine, const LogPlan& plan, const std::string& name) {
  return log_from_columns(name, simulated_columns(machine, plan), machine);
}

}  // namespace sparflow::testing_support
