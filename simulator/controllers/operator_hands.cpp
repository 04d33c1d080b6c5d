#include "simulator/controllers/operator_hands.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/controllers/goal_posture.h"

namespace sparflow::control {
namespace {

/// Time after which an operator sees whether something moves.
/// @threshold [s] 0.1..2; chosen: about a reaction time
constexpr double kLook = 0.4;
/// Way of a rod that is seen in that time.
/// @threshold [m] 0.0002..0.02; chosen: the tip moves some ten times as far
constexpr double kSeen = 0.0015;
/// By how much a lever that moves nothing is then pushed further.
/// @threshold [-] 0.002..0.2; chosen: a hand that feels for the point where the valve opens
constexpr double kPush = 0.02;
/// Most that a lever is pushed further.
/// @threshold [-] 0..1; chosen: more than any dead band
constexpr double kMostPush = 0.3;

}  // namespace

double Push::lever(std::size_t cylinder, double left, double lever) {
  double& more = more_[cylinder];
  if (lever == 0.0) {
    more = since_[cylinder] = 0.0;
    last_[cylinder] = left;
    return 0.0;
  }
  since_[cylinder] += sample_time_;
  if (since_[cylinder] >= kLook) {
    const bool moved = std::abs(left - last_[cylinder]) > kSeen;
    more = moved ? std::max(more - 2.0 * kPush, 0.0) : std::min(more + kPush, kMostPush);
    since_[cylinder] = 0.0;
    last_[cylinder] = left;
  }
  return std::copysign(std::min(1.0, std::abs(lever) + more), lever);
}

std::vector<Gain> OperatorGains::table() {
  const OperatorGains g;
  return {{"approach", "1/s", g.approach, 0.2, 5.0}, {"hurry", "-", g.hurry, 0.5, 1.0}};
}

const Eigen::VectorXd& Seen::look(const Measurement& now) {
  past_.emplace_back(now.t, now.q);
  while (past_.size() > 1 && past_[1].first <= now.t - kReaction) past_.pop_front();
  return past_.front().second;
}

const std::vector<double>& Hands::move(const std::vector<double>& wanted) {
  for (std::size_t c = 0; c < lever_.size(); ++c)
    lever_[c] += std::clamp(wanted[c] - lever_[c], -most_, most_);
  return lever_;
}

double careful_speed(double left, double cruise, double approach) {
  if (std::abs(left) < kArrived) return 0.0;
  return std::copysign(std::min(cruise, approach * std::abs(left)), left);
}

Operator::Operator(const Knowledge& knowledge, std::span<const double> gains)
    : know_(knowledge),
      gains_(OperatorGains::from(gains)),
      hands_(knowledge.machine->cylinders.size(), knowledge.sample_time),
      push_(knowledge.machine->cylinders.size(), knowledge.sample_time) {}

void Operator::aim(const Task& task, const Measurement& now) {
  goal_ = goal_posture(*know_.machine, task, now.q);
  seen_.clear();
}

double Operator::time_for(const Task& task, double pauses) const {
  return std::max(kLeastTime * task.duration, gains_.hurry * task.duration - pauses);
}

double Operator::way_left(int cylinder, const Eigen::VectorXd& q) const {
  const Machine& machine = *know_.machine;
  const int joint = machine.cylinders[static_cast<std::size_t>(cylinder)].joint;
  return cylinder_length(machine, cylinder, goal_[joint]) -
         cylinder_length(machine, cylinder, q[joint]);
}

double Operator::lever(int cylinder, double left, double cruise) {
  const double speed = careful_speed(left, cruise, gains_.approach);
  return push_.lever(static_cast<std::size_t>(cylinder), left,
                     know_.valves->lever(cylinder, speed));
}

}  // namespace sparflow::control
