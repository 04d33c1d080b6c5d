#include "simulator/controllers/joint_tracker.h"

#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"

namespace sparflow::control {
namespace {

/// Largest part of the full speed that the integral may ask for.
/// @threshold [-] 0..1; chosen: it makes up for a valve that was learned badly, not for one that is exhausted
constexpr double kMostIntegral = 0.2;
/// Share of the time in which a straight line's speed rises, and falls again.
/// @threshold [-] 0.01..0.5; chosen: a third more than the mean speed between the ramps
constexpr double kRamp = 0.25;

/// Rates below which a linkage is singular.
/// @threshold [m/rad] 0..0.1; numerical: nothing is divided by zero
constexpr double kLeastRate = 1e-3;

/// Way of the tip per movement of a joint. [m/rad] or [-]
double tip_way(const Machine& machine, int joint, const Eigen::VectorXd& q) {
  ChainGeometry chain(machine);
  chain.update(machine, q.data());
  const auto j = static_cast<std::size_t>(joint);
  if (!chain.revolute[j]) return 1.0;
  const Eigen::Vector3d arm = chain.point(machine.tip.joint, machine.tip.xyz) - chain.origin[j];
  return chain.axis[j].cross(arm).norm();
}

}  // namespace

std::vector<Gain> TrackerGains::table() {
  const TrackerGains g;
  return {{"proportional", "1/s", g.proportional, 0.1, 10.0},
          {"integral", "1/s2", g.integral, 0.01, 5.0},
          {"lead", "s", g.lead, 0.01, 0.5}};
}

TrackerGains TrackerGains::from(std::span<const double> gains) {
  return {gains[0], gains[1], gains[2]};
}

MotionInstant at_time(const Trajectory& motion, double t) {
  const Eigen::Index rows = motion.size();
  const double first = motion.t[0], at = first + t;
  if (t <= 0.0) return {motion.q.row(0), Eigen::VectorXd::Zero(motion.q.cols())};
  if (at >= motion.t[rows - 1])
    return {motion.q.row(rows - 1), Eigen::VectorXd::Zero(motion.q.cols())};
  const double* begin = motion.t.data();
  const Eigen::Index k = std::upper_bound(begin, begin + rows, at) - begin - 1;
  const double dt = at - motion.t[k];
  return {motion.q.row(k) + dt * motion.qd.row(k) + 0.5 * dt * dt * motion.qdd.row(k),
          motion.qd.row(k) + dt * motion.qdd.row(k)};
}

Trajectory joint_line(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double duration) {
  const double ramp = kRamp * duration;
  const Eigen::VectorXd speed = (to - from) / (duration - ramp);
  Trajectory m;
  m.t.resize(4);
  m.t << 0.0, ramp, duration - ramp, duration;
  m.q.resize(4, from.size());
  m.qd = m.qdd = Eigen::MatrixXd::Zero(4, from.size());
  m.q.row(0) = from;
  m.q.row(1) = from + 0.5 * ramp * speed;
  m.q.row(2) = to - 0.5 * ramp * speed;
  m.q.row(3) = to;
  m.qd.row(1) = m.qd.row(2) = speed;
  m.qdd.row(0) = speed / ramp;
  m.qdd.row(2) = m.qdd.row(3) = -speed / ramp;
  return m;
}

JointTracker::JointTracker(const Knowledge& knowledge, const TrackerGains& gains)
    : know_(knowledge), gains_(gains) {
  reset();
}

void JointTracker::reset() {
  integral_.assign(know_.machine->cylinders.size(), 0.0);
  way_.assign(know_.machine->cylinders.size(), 0);
  rest_.assign(know_.machine->cylinders.size(), RestCorrection());
}

double JointTracker::held(int c, double error, const Measurement& now) {
  const auto k = static_cast<std::size_t>(c);
  const int j = know_.machine->cylinders[k].joint;
  const double rate = linkage_rates(*know_.machine, c, now.q[j]).d1;
  RestCorrection::Rod rod;
  rod.error = error;
  rod.speed = rate * now.qd[j];
  rod.tip_way = std::max(tip_way(*know_.machine, j, now.q) / std::max(std::abs(rate), kLeastRate),
                         kLeastRate);
  rod.full_speed = know_.valves->full_speed(c, error > 0.0);
  rod.sample_time = know_.sample_time;
  return rest_[k].speed(rod, gains_.proportional);
}

std::vector<double> JointTracker::step(const Trajectory& motion, double t, const Measurement& now) {
  const Machine& machine = *know_.machine;
  const MotionInstant wanted = at_time(motion, t), ahead = at_time(motion, t + gains_.lead);
  std::vector<double> lever(machine.cylinders.size(), 0.0);
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const auto k = static_cast<std::size_t>(c);
    const int j = machine.cylinders[k].joint;
    const double error =
        cylinder_length(machine, c, wanted.q[j]) - cylinder_length(machine, c, now.q[j]);
    const double speed = linkage_rates(machine, c, ahead.q[j]).d1 * ahead.qd[j];
    // What the integral has learned holds for one way of one valve edge; carried on it would drive the rod past its stop.
    const int way = speed > 0.0 ? 1 : speed < 0.0 ? -1 : 0;
    if (way != way_[k]) integral_[k] = 0.0;
    way_[k] = way;
    if (wanted.qd[j] == 0.0 && ahead.qd[j] == 0.0) {
      lever[k] = know_.valves->lever(c, held(c, error, now));
      continue;
    }
    rest_[k].moving();
    const double asked = speed + gains_.proportional * error + integral_[k];
    const double full = know_.valves->full_speed(c, asked > 0.0);
    if (std::abs(asked) < full) {
      integral_[k] = std::clamp(integral_[k] + gains_.integral * error * know_.sample_time,
                                -kMostIntegral * full, kMostIntegral * full);
    }
    lever[k] = know_.valves->lever(c, asked);
  }
  return lever;
}

MotionSource& MotionFollower::motions() const {
  if (know_.motions == nullptr) throw ControllerFailure("it needs a learned model");
  return *know_.motions;
}

void MotionFollower::follow(Trajectory motion, double begin, bool goes_on) {
  motion_ = std::move(motion);
  begin_ = begin;
  if (!goes_on) tracker_.reset();
}

std::vector<double> MotionFollower::step(const Measurement& now) {
  tip_ = tip_position<double>(*know_.machine, at_time(motion_, now.t - begin_).q);
  return tracker_.step(motion_, now.t - begin_, now);
}

}  // namespace sparflow::control
