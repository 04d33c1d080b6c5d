#include "optimizer/sway/pendulum.h"

#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Vector3d;

/// The tip's acceleration along one interval of a motion.
class DrivenEnd {
 public:
  DrivenEnd(const Machine& machine, const Trajectory& motion)
      : machine_(machine),
        motion_(motion),
        chain_(machine),
        columns_(3, machine.joint_count()),
        q_(machine.joint_count()),
        qd_(q_.size()) {}

  /// @param k interval  @param dt time since its beginning [s]
  Vector3d acceleration(Eigen::Index k, double dt) {
    qd_ = motion_.qd.row(k) + dt * motion_.qdd.row(k);
    q_ = motion_.q.row(k) + dt * motion_.qd.row(k) + 0.5 * dt * dt * motion_.qdd.row(k);
    chain_.update(machine_, q_.data());
    const int tip = machine_.tip.joint;
    const Vector3d p = chain_.point(tip, machine_.tip.xyz);
    Vector3d sum = Vector3d::Zero();
    for (int j = 0; j <= tip; ++j) {
      const Vector3d column = point_jacobian(chain_, tip, p, j);
      sum += motion_.qdd(k, j) * column;
      for (int i = 0; i <= j; ++i)
        sum += (i == j ? 1.0 : 2.0) * qd_[i] * qd_[j] * point_hessian(chain_, i, column);
    }
    return sum;
  }

  Vector3d velocity() const {
    const Eigen::VectorXd q = motion_.q.row(0), qd = motion_.qd.row(0);
    return point_jacobian_matrix(machine_, q, machine_.tip.joint, machine_.tip.xyz) * qd;
  }

 private:
  const Machine& machine_;
  const Trajectory& motion_;
  ChainGeometry chain_;
  Eigen::Matrix3Xd columns_;
  Eigen::VectorXd q_, qd_;
};

double stiffness(const RopeState& s, const Vector3d& apparent) {
  return (s.rate.squaredNorm() + s.rope.dot(apparent)) / s.rope.squaredNorm();
}

RopeState rates(const RopeState& s, const Vector3d& apparent) {
  return {s.rate, apparent - stiffness(s, apparent) * s.rope};
}

RopeState moved(const RopeState& s, double h, const RopeState& rate) {
  return {s.rope + h * rate.rope, s.rate + h * rate.rate};
}

}  // namespace

double rope_angle(const Machine& machine, const RopeState& s) {
  const Vector3d down = machine.gravity.normalized();
  return std::atan2(s.rope.cross(down).norm(), s.rope.dot(down));
}

double swing_amplitude(const Machine& machine, const RopeState& s) {
  const double g = machine.gravity.norm(), l = s.rope.norm();
  // 1 - cos(amplitude) by the energy; the half angle keeps small amplitudes exact.
  const double angle = rope_angle(machine, s), half = std::sin(0.5 * angle);
  const double rise = half * half + 0.25 * s.rate.squaredNorm() / (g * l);
  return 2.0 * std::asin(std::min(1.0, std::sqrt(rise)));
}

RopeCourse rope_course(const Machine& machine, const Trajectory& motion, double cable, int parts) {
  SPARFLOW_CHECK(cable > 0.0 && parts >= 1 && motion.size() > 1, "a rope, steps and a motion");
  const Vector3d gravity = machine.gravity;
  DrivenEnd tip(machine, motion);
  RopeCourse course;
  RopeState s{cable * gravity.normalized(), Vector3d::Zero()};
  course.knots.reserve(static_cast<std::size_t>(motion.size()));
  course.knots.push_back(s);
  course.stiffness.resize(motion.size() - 1);
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double h = (motion.t[k + 1] - motion.t[k]) / parts;
    double mean = 0.0;
    Vector3d left = gravity - tip.acceleration(k, 0.0);
    for (int part = 0; part < parts; ++part) {
      const double dt = part * h;
      const Vector3d middle = gravity - tip.acceleration(k, dt + 0.5 * h);
      const Vector3d right = gravity - tip.acceleration(k, dt + h);
      const RopeState k1 = rates(s, left), k2 = rates(moved(s, 0.5 * h, k1), middle);
      const RopeState k3 = rates(moved(s, 0.5 * h, k2), middle);
      const RopeState k4 = rates(moved(s, h, k3), right);
      const double before = stiffness(s, left);
      s.rope += h / 6.0 * (k1.rope + 2.0 * k2.rope + 2.0 * k3.rope + k4.rope);
      s.rate += h / 6.0 * (k1.rate + 2.0 * k2.rate + 2.0 * k3.rate + k4.rate);
      s.rope *= cable / s.rope.norm();
      s.rate -= s.rope * (s.rope.dot(s.rate) / s.rope.squaredNorm());
      mean += 0.5 * (before + stiffness(s, right)) / parts;
      left = right;
      const double angle = rope_angle(machine, s);
      if (angle > course.largest_angle) {
        course.largest_angle = angle;
        course.largest_at = motion.t[k] + dt + h;
      }
    }
    course.stiffness[k] = mean;
    course.knots.push_back(s);
  }
  return course;
}

}  // namespace sparflow
