#include <algorithm>
#include <cmath>
#include <limits>

#include "optimizer/energy_bound_time.h"

namespace sparflow {

TimedWeights::TimedWeights(const CraneModel& model, const MotionProblem& problem,
                           const Machine& loaded, const std::vector<Range>& force_range)
    : MoveWeights(model, problem, loaded, force_range),
      speed_(problem.limits.velocity),
      acceleration_(problem.limits.acceleration),
      pump_flow_(pump_flow_limits(model, problem)) {
  for (const PumpModel& pump : model.pumps) pump_standby_.push_back(pump.standby);
  for (const CylinderDemand& a : demands()) {
    for (const CylinderDemand& b : demands()) {
      if (a.joint == b.joint && a.pump != b.pump) possible_ = false;
    }
  }
}

TimedMove TimedWeights::move_of(int joint, int direction, const double* force,
                                const double* rate) const {
  TimedMove m;
  m.joint = joint;
  m.direction = direction;
  const Range& v = speed_[static_cast<std::size_t>(joint)];
  double speed = std::max(0.0, direction == 0 ? v.hi : -v.lo);
  const CylinderDemand* hardest = nullptr;
  double most = 0.0, own_area = 0.0;
  for (const CylinderDemand& d : demands()) {
    if (d.joint != joint) continue;
    const double r = rate[d.cylinder];
    const int side = (direction == 0) == (r > 0.0) ? 0 : 1;
    const double area = d.area[side] * std::abs(r);
    m.pump = d.pump;
    m.area += area;
    if (!(area > 0.0)) continue;
    speed = std::min(speed, d.valve_flow[side] / area);
    const double least = d.load_sensing ? d.table[side].least(force[d.cylinder]) : 0.0;
    if (hardest != nullptr && least <= most) continue;
    hardest = &d;
    most = least;
    own_area = area;
  }
  m.top = speed;
  if (hardest == nullptr) m.pump = -1;
  if (m.pump < 0) {
    m.area = 1.0;  // its "volume" is its travel
    return m;
  }
  m.top = speed * m.area;
  m.standby =
      std::max(0.0, shares_.energy_weight * pump_standby_[static_cast<std::size_t>(m.pump)]);
  if (hardest->load_sensing && shares_.energy_weight > 0.0) {
    const int side = (direction == 0) == (rate[hardest->cylinder] > 0.0) ? 0 : 1;
    const DemandTable& table = hardest->table[side];
    table.rising(force[hardest->cylinder], m.demand);
    if (shares_.straight) m.demand.fill(most);
    for (double& p : m.demand) p *= shares_.energy_weight;
    m.flow_step = table.flow_max() / kFlowKnots * m.area / own_area;
  }
  return m;
}

void TimedWeights::make_moves(const double* force, const double* rate) const {
  moves_.clear();
  for (Eigen::Index j = 0; j < shares_.share.rows(); ++j) {
    for (const int direction : {0, 1}) {
      if (!(shares_.share(j, direction) > 0.0)) continue;
      TimedMove m = move_of(static_cast<int>(j), direction, force, rate);
      if (m.top > 0.0) moves_.push_back(m);
    }
  }
}

void TimedWeights::prices(const double* force, const double* rate, Eigen::MatrixX2d& price) const {
  MoveWeights::prices(force, rate, price);
  price *= shares_.energy_weight;
  make_moves(force, rate);
  if (moves_.empty() || !(shares_.price > 0.0)) return;
  double largest = 0.0;
  for (const TimedMove& m : moves_)
    largest = std::max(largest, shares_.share(m.joint, m.direction));
  // What is gained beyond the price of time at these slopes; rises with alpha.
  const auto surplus = [&](double alpha) {
    for (TimedMove& m : moves_) {
      const double share = alpha * shares_.share(m.joint, m.direction);
      const double least = price(m.joint, m.direction) / m.area;
      m.slope = shares_.straight ? least + share / m.top : std::max(m.least_slope(share), least);
    }
    return gain_.of(moves_, pump_flow_) - shares_.price;
  };
  // False position (Illinois) from where one move alone uses the price up; ends where the inequality holds.
  const double enough = kPriceTolerance * shares_.price;
  double high = shares_.price / largest, over = surplus(high);
  for (int i = 0; shares_.straight && over <= enough && i < 6; ++i) {
    high *= 1.5;  // at top speed a move alone needs more than the least pressure
    over = surplus(high);
  }
  if (over > enough) {
    double low = 0.0, under = -shares_.price, reached = under;
    int last = 0;
    double alpha = alpha_ratio_ * high;  // as at the posture before, which mostly is a neighbour
    constexpr int kMost = 40;
    for (int i = 0; i < kMost && reached < -enough; ++i) {
      const double value = surplus(alpha);
      if (value > enough) {
        high = alpha;
        over = value;
        if (last > 0) under *= 0.5;
        last = 1;
      } else {
        low = alpha;
        under = reached = value;
        if (last < 0) over *= 0.5;
        last = -1;
      }
      alpha = (low * over - high * under) / (over - under);
    }
    if (last > 0) surplus(low);
    alpha_ratio_ = std::clamp(low * largest / shares_.price, 0.05, 0.95);
  }
  double ramps = 0.0, of_joint = 0.0;
  int joint = -1;
  for (const TimedMove& m : moves_) {
    double& own = price(m.joint, m.direction);
    const double extra = std::max(0.0, m.slope * m.area - own);
    own += extra;
    const Range& a = acceleration_[static_cast<std::size_t>(m.joint)];
    if (m.joint != joint) {
      ramps += of_joint;
      of_joint = 0.0;
      joint = m.joint;
    }
    of_joint = std::max(of_joint, extra * std::max(a.hi, -a.lo));
  }
  ramp_gain_ = std::max(ramp_gain_, ramps + of_joint);
}

double TimedWeights::largest_gain(const Eigen::VectorXd& q, const Eigen::VectorXd& slope) {
  update(q);
  moves_.clear();
  for (Eigen::Index j = 0; j < slope.size(); ++j) {
    if (slope[j] == 0.0) continue;
    TimedMove m = move_of(static_cast<int>(j), slope[j] > 0.0 ? 0 : 1, force_data(), rate_data());
    m.slope = std::abs(slope[j]) / m.area;
    if (m.top > 0.0) moves_.push_back(m);
  }
  return gain_.of(moves_, pump_flow_);
}

}  // namespace sparflow
