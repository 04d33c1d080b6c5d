/// Sway of the payload against a pendulum integrated by another method, from the tip's path alone.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "models/effects/effect.h"
#include "models/effects/hanging_load/swing_state.h"
#include "models/effects/tip_motion.h"
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

/// Acceleration of the tip, by differences of its place.
Vector3d tip_acceleration(const Machine& machine, double t) {
  constexpr double h = 1e-3;
  return (tip_at(machine, t + h) - 2.0 * tip_at(machine, t) + tip_at(machine, t - h)) / (h * h);
}

/// A weight on a stiff spring of natural length `rope` in place of the rope, in Cartesian coordinates: another formulation of the
/// pendulum, integrated by the explicit midpoint rule with small steps. Damping acts across the spring.
/// @param start deflection across the rope [-] and velocity [m/s] at the first sample, from a weight that hangs along g - a
/// @return acceleration with which the spring pulls the weight, less gravity, at each sample
struct Start {
  Vector3d deflection = Vector3d::Zero(), velocity = Vector3d::Zero();
};
std::vector<Vector3d> rope_pull(const Machine& machine, const VectorXd& time, double rope,
                                const Start& start = {}) {
  const double omega = std::sqrt(machine.gravity.norm() / rope);
  constexpr double kStiff = 300.0;  // [rad/s] of the spring, a hundred times the pendulum's
  const auto spring = [&](const Vector3d& e, const Vector3d& v) {
    const Vector3d along = e.normalized();
    const Vector3d rate = along * along.dot(v);
    return (-kStiff * kStiff * (e.norm() - rope) * along - kStiff * rate -
            2.0 * kDamping * omega * (v - rate))
        .eval();
  };
  const auto slope = [&](double t, const Vector3d& e, const Vector3d& v) {
    return (machine.gravity - tip_acceleration(machine, t) + spring(e, v)).eval();
  };
  const Vector3d hangs = machine.gravity - tip_acceleration(machine, time[0]);
  const Vector3d along_rope = (hangs.normalized() + start.deflection).normalized();
  Vector3d v = start.velocity - along_rope * along_rope.dot(start.velocity);
  // the spring's length at which it carries the weight and turns it
  const double carried = hangs.dot(along_rope) + v.squaredNorm() / rope;
  Vector3d e = along_rope * (rope + carried / (kStiff * kStiff));
  std::vector<Vector3d> out = {spring(e, v) + machine.gravity};
  constexpr int kSteps = 8;
  for (Index k = 1; k < time.size(); ++k) {
    const double dt = (time[k] - time[k - 1]) / kSteps;
    for (int s = 0; s < kSteps; ++s) {
      const double t = time[k - 1] + s * dt;
      const Vector3d middle_e = e + 0.5 * dt * v, middle_v = v + 0.5 * dt * slope(t, e, v);
      e += dt * middle_v;
      v += dt * slope(t + 0.5 * dt, middle_e, middle_v);
    }
    out.push_back(spring(e, v) + machine.gravity);
  }
  return out;
}

/// Without measured forces a load swings from rest.
MachineSeries without_forces(MachineSeries log) {
  for (CylinderSeries& s : log.cylinders) s.force.resize(0);
  return log;
}

class PayloadSway : public testing::TestWithParam<double> {
 protected:
  const Effect& sway = *find_effect("payload_sway");
  const Machine machine = test_support::swing_crane();
  const MachineSeries log = without_forces(test_support::log_of(
      machine, [&](double t) { return swing(machine, t); }, 12.0, 0.002, kPayload));

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
    // The spring is longer than the rope by a hundredth of a per cent, and its own oscillation dies out within some hundredths of a second.
    EXPECT_LT(worst, 0.01 * largest) << i;
  }
}
INSTANTIATE_TEST_SUITE_P(Ropes, PayloadSway, testing::Values(0.5, 1.5, 6.0));

/// Released at 60 degrees, a pendulum swings 7.3 % more slowly than at small deflections (closed form: complete elliptic integral), and the
/// rope carries 2 m g at the bottom: m g (3 - 2 cos 60 degrees).
TEST_F(PayloadSway, SwingsSlowlyAtLargeDeflections) {
  MachineSeries still = log;
  const double rope = 1.5, g = machine.gravity.norm(), angle = std::numbers::pi / 3.0;
  still.time = VectorXd::LinSpaced(6001, 0.0, 12.0);
  still.runs = {{0, 6001}};
  // at the first sample the rope hangs along g - a; from the second on the tip rests
  Eigen::MatrixX3d acceleration = Eigen::MatrixX3d::Zero(6001, 3);
  acceleration(0, 0) = -g * std::tan(angle);
  const Eigen::MatrixX3d pull = pull_of_hanging_weight(still, acceleration, rope, 0.0);
  const double period = 4.0 * std::sqrt(rope / g) * std::comp_ellint_1(std::sin(0.5 * angle));
  EXPECT_NEAR(period / (2.0 * std::numbers::pi * std::sqrt(rope / g)), 1.073, 1e-3);
  std::vector<double> crossings;
  double deepest = 0.0;
  for (Index k = 2; k < 6001; ++k) {
    deepest = std::max(deepest, pull(k, 2));
    if (pull(k - 1, 0) < 0.0 && pull(k, 0) >= 0.0) crossings.push_back(still.time[k]);
  }
  ASSERT_GE(crossings.size(), 3U);
  const auto swings = static_cast<double>(crossings.size() - 1);
  // two samples of 2 ms in four swings
  EXPECT_NEAR((crossings.back() - crossings.front()) / swings, period, 2e-3);
  EXPECT_NEAR(deepest, 0.0 + (2.0 * g - g), 0.02 * g);
}

/// The swing at rest: nothing is pulled beyond the weight of a fixed payload.
TEST_F(PayloadSway, PullsNothingAtRest) {
  const Eigen::MatrixX3d rest = Eigen::MatrixX3d::Zero(log.samples(), 3);
  EXPECT_LT(pull_of_hanging_weight(log, rest, 1.5, 0.02).cwiseAbs().maxCoeff(), 1e-12);
}

/// A load that is taken by a hook in full swing: how it swings then is in the measured forces alone, beside an offset, friction and
/// inertia.
TEST_F(PayloadSway, SwingsOnAsTheForcesTell) {
  constexpr double kRope = 1.5;
  const Index taken = 2000;  // 4 s
  MachineSeries told = log;
  told.payload.head(taken).setConstant(0.0);
  const std::vector<Vector3d> pull = rope_pull(machine, log.time.tail(log.samples() - taken), kRope,
                                               {Vector3d(0.4, -0.3, 0.0), Vector3d(0.5, 0.8, 0.0)});
  Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(log.samples(), machine.cylinder_count());
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    CylinderSeries& s = told.cylinders[static_cast<std::size_t>(i)];
    const int joint = machine.cylinders[static_cast<std::size_t>(i)].joint;
    for (Index k = taken; k < log.samples(); ++k) {
      const Eigen::Matrix3Xd jacobian = point_jacobian_matrix(machine, VectorXd(log.q.row(k)),
                                                              machine.tip.joint, machine.tip.xyz);
      const Vector3d beyond =
          pull[static_cast<std::size_t>(k - taken)] - tip_acceleration(machine, log.time[k]);
      truth(k, i) =
          machine.tip.payload_scale * kPayload * jacobian.col(joint).dot(beyond) / s.rate[k];
    }
    s.force = s.static_force + truth.col(i);
    const double scale = truth.col(i).cwiseAbs().maxCoeff();
    s.acceleration = log.qdd.col(joint);
    s.direction = s.speed.unaryExpr([](double v) { return v > 0.0 ? 1 : -1; });
    s.force.array() +=
        scale * (0.3 + 0.2 * s.direction.cast<double>().array() +
                 0.5 * s.acceleration.array() / s.acceleration.cwiseAbs().maxCoeff());
  }
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    Eigen::MatrixXd by_forces, at_rest;
    const std::vector<double> shape = {kRope, kDamping};
    ASSERT_TRUE(sway.columns(told, {EvidenceKind::kForce, i}, -1, shape, by_forces));
    ASSERT_TRUE(sway.columns(without_forces(told), {EvidenceKind::kForce, i}, -1, shape, at_rest));
    const double all = truth.col(i).norm();
    // The forces are compared at every quarter of a radian of the swing.
    EXPECT_LT((by_forces.col(0) - truth.col(i)).norm(), 0.02 * all) << i;
    EXPECT_GT((at_rest.col(0) - truth.col(i)).norm(), 0.3 * all) << i;
  }
  EXPECT_EQ(sway.values_from_measurement(told), 4);
}

/// A log whose forces show a load that swings from the first sample on, from a state that only they tell.
struct SwingingLoad {
  MachineSeries log;
  std::vector<Vector3d> beyond;  // acceleration of the pull beyond a fixed load [m/s^2]
};

SwingingLoad swinging_load(const Machine& machine, MachineSeries log, double rope) {
  const std::vector<Vector3d> pull =
      rope_pull(machine, log.time, rope, {Vector3d(0.4, -0.3, 0.0), Vector3d(0.5, 0.8, 0.0)});
  SwingingLoad out{std::move(log), {}};
  for (Index k = 0; k < out.log.samples(); ++k)
    out.beyond.push_back(pull[static_cast<std::size_t>(k)] -
                         tip_acceleration(machine, out.log.time[k]));
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    CylinderSeries& s = out.log.cylinders[static_cast<std::size_t>(i)];
    const int joint = machine.cylinders[static_cast<std::size_t>(i)].joint;
    s.force = s.static_force;
    for (Index k = 0; k < out.log.samples(); ++k) {
      const Eigen::Matrix3Xd jacobian = point_jacobian_matrix(machine, VectorXd(out.log.q.row(k)),
                                                              machine.tip.joint, machine.tip.xyz);
      s.force[k] += machine.tip.payload_scale * kPayload *
                    jacobian.col(joint).dot(out.beyond[static_cast<std::size_t>(k)]) / s.rate[k];
    }
    s.direction = s.speed.unaryExpr([](double v) { return v > 0.0 ? 1 : -1; });
  }
  return out;
}

/// RMS error of the pull, over its RMS.
double error_of_pull(const SwingingLoad& load, const TipMotion& tip, double rope) {
  const Eigen::MatrixX3d pull = pull_of_hanging_weight(
      load.log, tip.acceleration, rope, kDamping, swinging_parts(load.log, tip, rope, kDamping));
  double squares = 0.0, all = 0.0;
  for (Index k = 0; k < load.log.samples(); ++k) {
    const Vector3d& truth = load.beyond[static_cast<std::size_t>(k)];
    squares += (Vector3d(pull.row(k)) - truth).squaredNorm();
    all += truth.squaredNorm();
  }
  return std::sqrt(squares / all);
}

/// Positions that scatter make accelerations that scatter, whose sum over a swing is no more than the positions'. The states of the load are
/// compared on every quarter of a radian only, and must not miss the samples between: the pull by the state that is found and by the
/// true one, with the same accelerations.
TEST_F(PayloadSway, NoiseOfAccelerationsDoesNotAddUp) {
  constexpr double kRope = 1.5;
  const SwingingLoad load = swinging_load(machine, log, kRope);
  TipMotion tip = tip_motion(load.log);
  const std::vector<LoadPart> truth = swinging_parts(load.log, tip, kRope, kDamping);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  constexpr Index kHalf = 25;  // of a triangle: 0.1 s
  const Index n = load.log.samples();
  for (int axis = 0; axis < 3; ++axis) {
    const VectorXd white =
        VectorXd::NullaryExpr(n + 2 * kHalf, [&] { return 2e-4 * normal(random); });  // [m]
    for (Index k = 0; k < n; ++k) {
      // second derivative of the scatter behind a triangle: its two steps of slope
      const double change = white[k] - 2.0 * white[k + kHalf] + white[k + 2 * kHalf];
      tip.acceleration(k, axis) += change / std::pow(load.log.step * kHalf, 2);
    }
  }
  const auto pull = [&](const std::vector<LoadPart>& parts) {
    return pull_of_hanging_weight(load.log, tip.acceleration, kRope, kDamping, parts);
  };
  const Eigen::MatrixX3d exact = pull(truth);
  EXPECT_LT((pull(swinging_parts(load.log, tip, kRope, kDamping)) - exact).norm(),
            0.02 * exact.norm());
}

/// Friction carries the load of a cylinder at rest, whose force then tells nothing.
TEST_F(PayloadSway, CylindersAtRestTellNothingOfTheSwing) {
  constexpr double kRope = 1.5;
  SwingingLoad load = swinging_load(machine, log, kRope);
  const TipMotion tip = tip_motion(load.log);
  const Index rests = load.log.samples() / 2;
  for (CylinderSeries& s : load.log.cylinders) {
    s.direction.head(rests).setZero();
    s.force.head(rests) = s.static_force.head(rests);
  }
  EXPECT_LT(error_of_pull(load, tip, kRope), 0.05);
}

TEST_F(PayloadSway, VanishesWithTheRope) {
  for (int i = 0; i < machine.cylinder_count(); ++i)
    EXPECT_LT(column(i, 0.002).norm(), 0.1 * column(i, 2.0).norm()) << i;
}

}  // namespace
}  // namespace sparflow
