#include "simulator/operator/operator_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "models/machine/linkage.h"

namespace sparflow::simulator {
namespace {

constexpr double kStopMargin =
    0.03;                            // [-] of a joint's range that the operator keeps from its ends
constexpr double kPumpShare = 0.97;  // [-] of the pump's flow that the operator uses at most
constexpr double kSlowMoves = 0.12;  // [-] share of slow moves

double smooth_step(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

std::size_t direction(double speed) { return speed > 0.0 ? 0 : 1; }

}  // namespace

double OperatorMotion::Move::profile() const {
  if (phase <= 0.0 || phase >= duration()) return 0.0;
  return smooth_step(phase / ramp) * smooth_step((duration() - phase) / ramp);
}

std::vector<LeverFlow> lever_flows(const Machine& machine,
                                   const std::vector<std::array<double, 2>>& flows) {
  std::vector<LeverFlow> r;
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c)
    r.push_back({flows[c], {machine.cylinders[c].area_piston(), machine.cylinders[c].area_rod()}});
  return r;
}

OperatorMotion::OperatorMotion(const Machine& machine, std::vector<LeverFlow> flows,
                               std::uint64_t motion_seed)
    : machine_(machine), flows_(std::move(flows)), random_(motion_seed, "motion") {
  preferred_.assign(machine.cylinders.size(), 0);
  pause_end_ = random_.uniform(0.5, 1.5);
}

std::vector<double> OperatorMotion::start_posture() {
  std::vector<double> q;
  for (const Joint& joint : machine_.joints) {
    const double span = joint.position.hi - joint.position.lo;
    q.push_back(joint.position.lo + span * random_.uniform(0.2, 0.8));
  }
  return q;
}

bool OperatorMotion::plan_move(int cylinder, double window, double q, Move& move) {
  const auto c = static_cast<std::size_t>(cylinder);
  const Cylinder& drive = machine_.cylinders[c];
  const Joint& joint = machine_.joints[static_cast<std::size_t>(drive.joint)];
  const double span = joint.position.hi - joint.position.lo;
  const double lo = joint.position.lo + kStopMargin * span;
  const double hi = joint.position.hi - kStopMargin * span;
  int way =
      random_.chance(0.65) && preferred_[c] != 0 ? preferred_[c] : (random_.chance(0.5) ? 1 : -1);
  const double room_up = hi - q, room_down = q - lo;
  if ((way > 0 ? room_up : room_down) < 0.08 * span) way = -way;
  const double room = way > 0 ? room_up : room_down;
  if (room < 0.02 * span) return false;
  const double limit = std::max(1e-3, std::min(joint.velocity.hi, -joint.velocity.lo));
  const double rate = linkage_rates(machine_, cylinder, q).d1;
  const std::size_t d = direction(static_cast<double>(way) * rate);
  const double area = flows_[c].area[d];
  const double gain = flows_[c].flow[d];
  const double fastest = std::min(limit, 0.95 * gain / (std::abs(rate) * area));
  const double share =
      random_.chance(kSlowMoves) ? random_.uniform(0.04, 0.2) : random_.uniform(0.2, 0.85);
  double speed = share * fastest;
  move.cylinder = cylinder;
  move.ramp = random_.uniform(0.35, 0.8);
  move.start = random_.uniform(0.0, 0.15 * window);
  double time = std::max(0.9, random_.uniform(0.7, 1.0) * (window - move.start));
  if (random_.chance(0.12)) time = random_.uniform(0.9, 2.5);
  move.ramp = std::min(move.ramp, 0.4 * time);
  time = std::min(time, room / speed + move.ramp);
  if (time < 2.2 * move.ramp) {
    move.ramp = 0.3;
    speed = std::min(speed, room / 0.6);
    time = std::min(0.9, room / speed + 0.3);
  }
  move.hold = std::max(0.0, time - 2.0 * move.ramp);
  move.lever_held = random_.chance(0.3);
  move.amplitude = way * speed;
  if (move.lever_held) {
    // A constant lever moves the joint at a speed that depends on posture; the move must end within the range left.
    const double held = 0.85 * speed * std::abs(rate) * area / gain;
    move.amplitude = way * (rate > 0.0 ? 1.0 : -1.0) * std::min(held, 1.0);
  }
  preferred_[c] = way;
  return true;
}

void OperatorMotion::plan_block(double t, const std::vector<double>& q) {
  block_start_ = t;
  moves_.clear();
  const int count = machine_.cylinder_count();
  const double draw = random_.unit();
  const int together = std::min(count, draw < 0.25 ? 1 : (draw < 0.7 ? 2 : 3));
  std::vector<int> order(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) order[static_cast<std::size_t>(i)] = i;
  for (int i = count - 1; i > 0; --i)
    std::swap(order[static_cast<std::size_t>(i)],
              order[static_cast<std::size_t>(random_.below(i + 1))]);
  const double window = random_.uniform(6.0, 9.5);
  for (int i = 0; i < together; ++i) {
    Move move;
    const int cylinder = order[static_cast<std::size_t>(i)];
    const auto joint =
        static_cast<std::size_t>(machine_.cylinders[static_cast<std::size_t>(cylinder)].joint);
    if (plan_move(cylinder, window, q[joint], move)) moves_.push_back(move);
  }
  double first = 1e9;
  for (const Move& m : moves_) first = std::min(first, m.start);
  for (Move& m : moves_) m.start -= first;
}

void OperatorMotion::levers(double t, double h, const std::vector<double>& q,
                            const std::vector<double>& length_rate, std::vector<double>& command) {
  std::fill(command.begin(), command.end(), 0.0);
  if (moves_.empty()) {
    if (t < pause_end_) return;
    plan_block(t, q);
    if (moves_.empty()) return;
  }
  std::vector<double>& u = command;
  for (const Move& m : moves_) {
    const auto c = static_cast<std::size_t>(m.cylinder);
    const double profile = m.profile();
    if (profile == 0.0) continue;
    if (m.lever_held) {
      u[c] = m.amplitude * profile;
    } else {
      const double rod_speed = m.amplitude * profile * length_rate[c];
      const std::size_t d = direction(rod_speed);
      const double area = flows_[c].area[d];
      u[c] = rod_speed * area / flows_[c].flow[d];
    }
    u[c] = std::clamp(u[c], -1.0, 1.0);
    // The operator releases a lever when the joint has reached that end of its range.
    const auto j = static_cast<std::size_t>(machine_.cylinders[c].joint);
    const Range range = machine_.joints[j].position;
    const double way = u[c] * length_rate[c];
    const double left = (way > 0.0 ? range.hi - q[j] : q[j] - range.lo) / (range.hi - range.lo);
    u[c] *= smooth_step((left - 0.005) / 0.02);
  }
  double slow = 1.0;
  for (const Pump& pump : machine_.pumps) {
    double flow = 0.0;
    for (const int i : pump.feeds) {
      const auto c = static_cast<std::size_t>(i);
      flow += std::abs(u[c]) * flows_[c].flow[direction(u[c])];
    }
    if (pump.max_flow > 0.0 && flow > kPumpShare * pump.max_flow)
      slow = std::min(slow, kPumpShare * pump.max_flow / flow);
  }
  bool done = true;
  for (double& value : u) value *= slow;
  for (Move& m : moves_) {
    if (t - block_start_ >= m.start) m.phase += h * slow;
    done = done && m.phase >= m.duration();
  }
  if (done) {
    moves_.clear();
    pause_end_ = t + random_.uniform(0.4, 1.8);
  }
}

}  // namespace sparflow::simulator
