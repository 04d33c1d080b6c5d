/// Sway of the payload against a pendulum integrated by another method, from the tip's path alone.
#include <gtest/gtest.h>

#include "models/effects/effect.h"
#include "models/machine/kinematics.h"
#include "tests/models/effects/effects_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPayload = 400.0, kDamping = 0.05;

/// Joints swing from rest with periods of their own.
VectorXd swing(const Machine& machine, double t) {
  const Index n = machine.joint_count();
  VectorXd q(n), qd(n), qdd(n);
  for (Index j = 0; j < n; ++j) {
    const Range& r = machine.joints[static_cast<std::size_t>(j)].position;
    const double a = 0.1 * (r.hi - r.lo), w = 0.5 + 0.13 * static_cast<double>(j);
    q[j] = 0.5 * (r.lo + r.hi) + a * (1.0 - std::cos(w * t));
    qd[j] = a * w * std::sin(w * t);
    qdd[j] = a * w * w * std::cos(w * t);
  }
  return test_support::stacked(q, qd, qdd);
}

Vector3d tip_at(const Machine& machine, double t) {
  const VectorXd q = swing(machine, t).head(machine.joint_count());
  return tip_position<double>(machine, q);
}

Vector3d horizontal(const Machine& machine, const Vector3d& v) {
  const Vector3d down = machine.gravity.normalized();
  return v - down * down.dot(v);
}

/// Horizontal acceleration of the tip, by differences of its place.
Vector3d tip_acceleration(const Machine& machine, double t) {
  constexpr double h = 1e-3;
  return horizontal(machine,
                    tip_at(machine, t + h) - 2.0 * tip_at(machine, t) + tip_at(machine, t - h)) /
         (h * h);
}

/// e'' + 2 zeta omega e' + omega^2 e = -a of the payload's place e relative to the tip, by the explicit midpoint rule.
/// @return -omega^2 e at each sample, the acceleration by which the rope pulls the payload
std::vector<Vector3d> rope_pull(const Machine& machine, const VectorXd& time, double rope) {
  const double omega = std::sqrt(machine.gravity.norm() / rope);
  const auto slope = [&](double t, const Vector3d& e, const Vector3d& v) {
    return (-tip_acceleration(machine, t) - 2.0 * kDamping * omega * v - omega * omega * e).eval();
  };
  Vector3d e = -tip_acceleration(machine, 0.0) / (omega * omega), v = Vector3d::Zero();
  std::vector<Vector3d> out = {-omega * omega * e};
  for (Index k = 1; k < time.size(); ++k) {
    const double dt = time[k] - time[k - 1], t = time[k - 1];
    const Vector3d middle_e = e + 0.5 * dt * v, middle_v = v + 0.5 * dt * slope(t, e, v);
    e += dt * middle_v;
    v += dt * slope(t + 0.5 * dt, middle_e, middle_v);
    out.push_back(-omega * omega * e);
  }
  return out;
}

class PayloadSway : public testing::TestWithParam<double> {
 protected:
  const Effect& sway = *find_effect("payload_sway");
  const Machine machine = test_support::swing_crane();
  const MachineSeries log = test_support::log_of(
      machine, [&](double t) { return swing(machine, t); }, 12.0, 0.002, kPayload);

  VectorXd column(int cylinder, double rope) const {
    Eigen::MatrixXd c;
    EXPECT_TRUE(sway.columns(log, {EvidenceKind::kForce, cylinder}, -1,
                             std::vector<double>{rope, kDamping}, c));
    return c.col(0);
  }
};

TEST_P(PayloadSway, IsWhatAPendulumPullsBeyondAPayloadFixedToTheTip) {
  const std::vector<Vector3d> pull = rope_pull(machine, log.time, GetParam());
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const int joint = machine.cylinders[static_cast<std::size_t>(i)].joint;
    const VectorXd by_law = column(i, GetParam());
    double largest = 0.0, worst = 0.0;
    for (Index k = 50; k < log.samples(); k += 50) {
      const VectorXd q = log.q.row(k);
      const Eigen::Matrix3Xd jacobian =
          point_jacobian_matrix(machine, q, machine.tip.joint, machine.tip.xyz);
      const Vector3d beyond =
          pull[static_cast<std::size_t>(k)] - tip_acceleration(machine, log.time[k]);
      const double force = machine.tip.payload_scale * kPayload * jacobian.col(joint).dot(beyond) /
                           log.cylinders[static_cast<std::size_t>(i)].rate[k];
      largest = std::max(largest, std::abs(force));
      worst = std::max(worst, std::abs(force - by_law[k]));
    }
    EXPECT_GT(largest, 1.0) << i;
    // The law holds the acceleration over an interval of 2 ms, which delays it by half of it, omega dt / 2 = 0.4 % of the pull; what is beyond the
    // fixed payload is several times smaller than the pull where the rope is short.
    EXPECT_LT(worst, 0.03 * largest) << i;
  }
}
INSTANTIATE_TEST_SUITE_P(Ropes, PayloadSway, testing::Values(0.5, 1.5, 6.0));

TEST_F(PayloadSway, VanishesWithTheRope) {
  for (int i = 0; i < machine.cylinder_count(); ++i)
    EXPECT_LT(column(i, 0.002).norm(), 0.1 * column(i, 2.0).norm()) << i;
}

}  // namespace
}  // namespace sparflow
