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

void TimedWeights::make_moves(const double* force, const double* rate) const {
  moves_.clear();
  for (Eigen::Index j = 0; j < shares_.share.rows(); ++j) {
    for (const int direction : {0, 1}) {
      if (!(shares_.share(j, direction) > 0.0)) continue;
      Move m;
      m.joint = static_cast<int>(j);
      m.direction = direction;
      const Range& v = speed_[static_cast<std::size_t>(j)];
      m.speed = direction == 0 ? v.hi : -v.lo;
      if (!(m.speed > 0.0)) continue;
      for (const CylinderDemand& d : demands()) {
        if (d.joint != m.joint) continue;
        const double r = rate[d.cylinder];
        const int side = (direction == 0) == (r > 0.0) ? 0 : 1;
        const double area = d.area[side] * std::abs(r);
        double least = pump_standby_[static_cast<std::size_t>(d.pump)];
        if (d.load_sensing) least = std::max(least, d.table[side].least(force[d.cylinder]));
        least = std::max(0.0, shares_.energy_weight * least);
        m.pump = d.pump;
        m.pressure = std::max(m.pressure, least);
        m.area += area;
        m.slope += least * area;
        if (area > 0.0) m.speed = std::min(m.speed, d.valve_flow[side] / area);
      }
      if (m.area <= 0.0) m.pump = -1;
      m.growth = shares_.share(j, direction) / m.speed;
      moves_.push_back(m);
    }
  }
}

double TimedWeights::gain(double* derivative) const {
  double total = 0.0, slope = 0.0;
  for (const Move& m : moves_) {  // without hydraulics a move costs nothing
    if (m.pump >= 0) continue;
    total += m.slope * m.speed;
    slope += m.growth * m.speed;
  }
  for (std::size_t p = 0; p < pump_flow_.size(); ++p) {
    order_.clear();
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      if (moves_[i].pump == static_cast<int>(p)) order_.push_back(static_cast<int>(i));
    }
    if (order_.empty()) continue;
    const auto at = [&](int i) -> const Move& { return moves_[static_cast<std::size_t>(i)]; };
    std::sort(order_.begin(), order_.end(), [&](int a, int b) {
      return at(a).slope * at(b).area > at(b).slope * at(a).area;  // by slope per volume
    });
    const double standby = std::max(0.0, shares_.energy_weight * pump_standby_[p]);
    double best = 0.0, best_slope = 0.0;
    for (const int leader : order_) {
      const double pressure = std::max(standby, at(leader).pressure);
      double left = pump_flow_[p], sum = 0.0, grow = 0.0;
      for (const int i : order_) {  // a fractional knapsack: the dearest volume first
        const Move& m = at(i);
        const double per_volume = m.slope / m.area - pressure;
        if (per_volume <= 0.0) break;
        if (m.pressure > pressure) continue;
        const double flow = std::min(left, m.area * m.speed);
        sum += per_volume * flow;
        grow += m.growth / m.area * flow;
        left -= flow;
        if (left <= 0.0) break;
      }
      if (sum > best) {
        best = sum;
        best_slope = grow;
      }
    }
    total += best;
    slope += best_slope;
  }
  if (derivative != nullptr) *derivative = slope;
  return total;
}

void TimedWeights::prices(const double* force, const double* rate, Eigen::MatrixX2d& price) const {
  MoveWeights::prices(force, rate, price);
  price *= shares_.energy_weight;
  make_moves(force, rate);
  if (moves_.empty() || !(shares_.price > 0.0)) return;
  // The gain is convex and piecewise linear in alpha and not below the price where one move alone uses it up: Newton
  // from there comes down to the root.
  double alpha = std::numeric_limits<double>::infinity();
  for (const Move& m : moves_) alpha = std::min(alpha, shares_.price / (m.growth * m.speed));
  const std::vector<Move> base = moves_;
  double value = 0.0;
  for (int iteration = 0; iteration < 12; ++iteration) {
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      moves_[i].slope = base[i].slope + alpha * base[i].growth;
    }
    double derivative = 0.0;
    value = gain(&derivative);
    if (value <= shares_.price * (1.0 + 1e-9) || !(derivative > 0.0)) break;
    alpha -= (value - shares_.price) / derivative;
  }
  // convex and zero at zero: what is left over is scaled away
  const double safe = value > shares_.price ? shares_.price / value : 1.0;
  double ramps = 0.0, of_joint = 0.0;
  int joint = -1;
  for (const Move& m : base) {
    const double extra = safe * alpha * m.growth;
    price(m.joint, m.direction) += extra;
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
  const TimeShares kept = shares_;
  shares_.share.resize(q.size(), 2);
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    shares_.share(j, 0) = slope[j] > 0.0 ? 1.0 : 0.0;
    shares_.share(j, 1) = slope[j] < 0.0 ? 1.0 : 0.0;
  }
  make_moves(force_data(), rate_data());
  for (Move& m : moves_) m.slope = std::abs(slope[m.joint]);
  shares_ = kept;
  return gain(nullptr);
}

}  // namespace sparflow
