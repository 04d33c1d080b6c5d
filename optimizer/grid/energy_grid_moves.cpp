#include "optimizer/grid/energy_grid_moves.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/chain/pump_law.h"

namespace sparflow {

double MoveCost::at_price(double price) const {
  double least = std::numeric_limits<double>::infinity();
  for (int s = 0; s < 3; ++s) {
    least = std::min(least, static_cast<double>(energy[s]) +
                                price * static_cast<double>(seconds) / kMoveSpeeds[s]);
  }
  return least;
}

double MoveCost::least_energy() const {
  return static_cast<double>(std::min({energy[0], energy[1], energy[2]}));
}

void MoveCost::add(const MoveCost& other) {
  seconds += other.seconds;
  for (int s = 0; s < 3; ++s) energy[s] += other.energy[s];
}

MovePricer::MovePricer(const CraneModel& model, const MotionProblem& problem, const Machine& loaded,
                       const std::vector<Range>& force_range)
    : problem_(&problem),
      machine_(&loaded),
      demands_(cylinder_demands(model, problem, force_range)),
      pump_flow_limit_(pump_flow_limits(model, problem)),
      pump_volume_(model.pumps.size()),
      statics_(loaded) {
  for (std::size_t p = 0; p < model.pumps.size(); ++p) {
    standby_.push_back(model.pumps[p].standby);
    const double most = problem.limits.pump_max_pressure[p];
    const bool limited = most > 0.0 && model.machine.pumps[p].type == PumpType::kLoadSensing;
    pump_pressure_limit_.push_back(limited ? most : std::numeric_limits<double>::infinity());
  }
  dx_.resize(demands_.size());
  force_.resize(demands_.size());
  length_before_.resize(demands_.size());
  force_before_.resize(demands_.size());
}

MoveCost MovePricer::price(const double* dq, const double* dx, const double* force) {
  MoveCost cost;
  double seconds = 0.0;
  for (std::size_t j = 0; j < problem_->limits.velocity.size(); ++j) {
    const Range& v = problem_->limits.velocity[j];
    if (dq[j] != 0.0) seconds = std::max(seconds, dq[j] > 0.0 ? dq[j] / v.hi : dq[j] / v.lo);
  }
  std::fill(pump_volume_.begin(), pump_volume_.end(), 0.0);
  for (std::size_t i = 0; i < demands_.size(); ++i) {
    const CylinderDemand& d = demands_[i];
    const int side = dx[i] > 0.0 ? 0 : 1;
    const double volume = d.area[side] * std::abs(dx[i]);
    seconds = std::max(seconds, volume / d.valve_flow[side]);
    pump_volume_[static_cast<std::size_t>(d.pump)] += volume;
  }
  for (std::size_t p = 0; p < pump_volume_.size(); ++p) {
    seconds = std::max(seconds, pump_volume_[p] / pump_flow_limit_[p]);
  }
  cost.seconds = static_cast<float>(seconds);
  for (int s = 0; s < 3; ++s) {
    double energy = 0.0;
    for (std::size_t p = 0; p < pump_volume_.size(); ++p) {
      if (pump_volume_[p] <= 0.0) continue;
      PumpLaw law(standby_[p]);
      for (std::size_t i = 0; i < demands_.size(); ++i) {
        const CylinderDemand& d = demands_[i];
        if (dx[i] == 0.0 || !d.load_sensing || static_cast<std::size_t>(d.pump) != p) continue;
        const int side = dx[i] > 0.0 ? 0 : 1;
        const double flow = d.area[side] * std::abs(dx[i]) * kMoveSpeeds[s] / seconds;
        law.add(d.cylinder, d.table[side].demand(flow, force[i]));
      }
      const double pressure = law.pressure();
      energy += pressure > pump_pressure_limit_[p] ? std::numeric_limits<double>::infinity()
                                                   : pressure * pump_volume_[p];
    }
    cost.energy[s] = static_cast<float>(energy);
  }
  return cost;
}

MoveCost MovePricer::price_line(const Eigen::VectorXd& from, const Eigen::VectorXd& to, int parts) {
  MoveCost total;
  const Eigen::VectorXd dq = (to - from) / parts;
  Eigen::VectorXd q = from;
  for (int k = 0; k <= parts; ++k) {
    q = from + k * dq;
    statics_.update(q.data(), problem_->payload, 0);
    for (std::size_t i = 0; i < demands_.size(); ++i) {
      const int c = demands_[i].cylinder;
      const double x = statics_.length(c).value, f = statics_.force()[c];
      dx_[i] = dq[demands_[i].joint] == 0.0 ? 0.0 : x - length_before_[i];
      force_[i] = 0.5 * (f + force_before_[i]);
      length_before_[i] = x;
      force_before_[i] = f;
    }
    if (k > 0) total.add(price(dq.data(), dx_.data(), force_.data()));
  }
  return total;
}

}  // namespace sparflow
