#include "simulator/controllers/tip_path.h"

#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "simulator/controllers/inverse_kinematics.h"
#include "simulator/controllers/joint_tracker.h"

namespace sparflow::control {
namespace {

/// Share of a joint's range at its ends in which it is not moved outwards.
/// @threshold [-] 0..0.2; chosen: the way a rod needs to stop
constexpr double kEnd = 0.02;
/// Weight of a joint that shall not move, over the largest other one.
/// @threshold [-] 1e3..1e12; numerical: it takes no part
constexpr double kBlocked = 1e6;
/// Largest speed that the integral may ask for.
/// @threshold [m/s] 0..1; chosen: it makes up for a valve that was learned badly, not for one that is exhausted
constexpr double kMostTipIntegral = 0.1;
/// Error of the tip that is left alone while the line rests.
/// @threshold [m] 0..0.05; chosen: no hunting in the valves' dead bands
constexpr double kTipRest = 0.01;

}  // namespace

std::vector<Gain> TipGains::table() {
  const TipGains g;
  return {{"proportional", "1/s", g.proportional, 0.1, 10.0},
          {"integral", "1/s2", g.integral, 0.01, 5.0},
          {"lead", "s", g.lead, 0.01, 0.5}};
}

double full_rate(const Knowledge& knowledge, const Eigen::VectorXd& q, int joint, bool positive) {
  const int c = knowledge.machine->cylinder_of_joint(joint);
  if (c < 0) return 0.0;
  const double rate = linkage_rates(*knowledge.machine, c, q[joint]).d1;
  return knowledge.valves->full_speed(c, positive == (rate > 0.0)) / std::max(std::abs(rate), 1e-6);
}

Eigen::VectorXd full_rate_weights(const Knowledge& knowledge, const Eigen::VectorXd& q) {
  Eigen::VectorXd w(q.size());
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    const double full = full_rate(knowledge, q, static_cast<int>(k), true);
    w[k] = full > 0.0 ? 1.0 / (full * full) : 0.0;
  }
  const double largest = w.maxCoeff();
  for (double& x : w)
    if (x == 0.0) x = kBlocked * largest;
  return w;
}

TipPath::TipPath(const Knowledge& knowledge, std::span<const double> gains)
    : know_(knowledge), gains_(TipGains::from(gains)) {}

void TipPath::begin(const Task& task, const Measurement& now) {
  task_ = task;
  line_ = joint_line(tip_position<double>(*know_.machine, now.q), task.tip, task.duration);
  integral_.setZero();
}

Eigen::VectorXd TipPath::rates(const Measurement& now, const Eigen::Vector3d& v) {
  const Machine& machine = *know_.machine;
  const Eigen::Matrix3Xd jacobian =
      point_jacobian_matrix(machine, now.q, machine.tip.joint, machine.tip.xyz);
  Eigen::VectorXd w = weights(now, jacobian, v);
  const double blocked = kBlocked * w.maxCoeff();
  Eigen::VectorXd qd;
  for (Eigen::Index again = 0; again <= now.q.size(); ++again) {
    qd = weighted_rates(jacobian, w, v, kTipDamping);
    bool changed = false;
    for (Eigen::Index k = 0; k < now.q.size(); ++k) {
      const Range r = machine.joints[static_cast<std::size_t>(k)].position;
      const double end = kEnd * (r.hi - r.lo);
      const bool out =
          (now.q[k] < r.lo + end && qd[k] < 0.0) || (now.q[k] > r.hi - end && qd[k] > 0.0);
      if (!out || w[k] >= blocked) continue;
      w[k] = blocked;
      changed = true;
    }
    if (!changed) break;
  }
  double most = 1.0;
  for (Eigen::Index k = 0; k < qd.size(); ++k) {
    const double full = full_rate(know_, now.q, static_cast<int>(k), qd[k] > 0.0);
    if (full > 0.0) most = std::max(most, std::abs(qd[k]) / full);
  }
  return qd / most;
}

std::vector<double> TipPath::step(const Measurement& now) {
  const Machine& machine = *know_.machine;
  const double t = now.t - task_.begin;
  wanted_ = at_time(line_, t).q;
  const Eigen::Vector3d ahead = at_time(line_, t + gains_.lead).qd;
  const Eigen::Vector3d error = wanted_ - tip_position<double>(machine, now.q);
  std::vector<double> lever(machine.cylinders.size(), 0.0);
  if (t >= task_.duration && error.norm() < kTipRest) return lever;
  integral_ += gains_.integral * know_.sample_time * error;
  if (integral_.norm() > kMostTipIntegral) integral_ *= kMostTipIntegral / integral_.norm();
  const Eigen::VectorXd qd = rates(now, ahead + gains_.proportional * error + integral_);
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const auto k = static_cast<std::size_t>(c);
    const int j = machine.cylinders[k].joint;
    lever[k] = know_.valves->lever(c, linkage_rates(machine, c, now.q[j]).d1 * qd[j]);
  }
  return lever;
}

}  // namespace sparflow::control
