#include "optimizer/bounds/maximised_hamiltonian.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/chain/pump_law.h"

namespace sparflow {

double TimedMove::flow(double pressure, double* growth, std::size_t* knot) const {
  *growth = 0.0;
  if (!(flow_step > 0.0)) return top;
  if (pressure < demand[0]) return 0.0;
  std::size_t k = *knot;
  while (k < kFlowKnots && demand[k + 1] <= pressure) ++k;
  *knot = k;
  double flow = static_cast<double>(k) * flow_step;
  if (k < kFlowKnots && flow < top) {
    const double rate = flow_step / (demand[k + 1] - demand[k]);
    flow += rate * (pressure - demand[k]);
    if (flow < top) *growth = rate;
  }
  return k == kFlowKnots ? top : std::min(flow, top);
}

double TimedMove::least_pressure() const {
  return flow_step > 0.0 ? pump_pressure(standby, demand[0]) : standby;
}

double TimedMove::least_slope(double gain) const {
  const double first = least_pressure();
  std::size_t at = 0;
  double growth = 0.0, pressure = first, flow_here = flow(first, &growth, &at);
  if (!(gain > 0.0)) return first;
  double best =
      flow_here > 0.0 ? first + gain / flow_here : std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; flow_here < top && k <= kFlowKnots; ++k) {
    if (demand[k] <= pressure) continue;
    // Up to the knot the flow is linear in P, so P + gain / flow is least where flow^2 = gain growth.
    const double flow_at_knot = flow_here + growth * (demand[k] - pressure);
    const double want =
        std::clamp(std::sqrt(gain * growth), flow_here, std::min(flow_at_knot, top));
    if (want > 0.0) best = std::min(best, pressure + (want - flow_here) / growth + gain / want);
    pressure = demand[k];
    flow_here = flow(pressure, &growth, &at);
    if (flow_here > 0.0) best = std::min(best, pressure + gain / flow_here);
  }
  return best;
}

double MaximisedHamiltonian::of(const std::vector<TimedMove>& moves,
                                const std::vector<double>& pump_flow) {
  for (std::size_t i = 0; i < moves.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (moves[k].joint != moves[i].joint) continue;
      double best = 0.0;
      for (const std::size_t without : {i, k}) {
        std::vector<TimedMove> rest = moves;
        rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(without));
        best = std::max(best, of(rest, pump_flow));
      }
      return best;
    }
  }
  return one_way(moves, pump_flow);
}

double MaximisedHamiltonian::one_way(const std::vector<TimedMove>& moves,
                                     const std::vector<double>& pump_flow) {
  double total = 0.0;
  for (const TimedMove& m : moves) {
    if (m.pump < 0) total += m.slope * m.top;
  }
  for (std::size_t p = 0; p < pump_flow.size(); ++p) {
    order_.clear();
    for (const TimedMove& m : moves) {
      if (m.pump == static_cast<int>(p) && m.slope > m.standby) order_.push_back(&m);
    }
    if (!order_.empty()) total += of_pump(pump_flow[p]);
  }
  return total;
}

double MaximisedHamiltonian::of_pump(double pump_flow) {
  std::sort(order_.begin(), order_.end(),
            [](const TimedMove* a, const TimedMove* b) { return a->slope > b->slope; });
  const double standby = order_[0]->standby, highest = order_[0]->slope;
  breaks_.assign(1, standby);
  const auto add = [&](double pressure) {
    if (pressure > standby && pressure < highest) breaks_.push_back(pressure);
  };
  for (const TimedMove* m : order_) {
    add(m->slope);
    if (!(m->flow_step > 0.0)) continue;
    for (std::size_t k = 0; k <= kFlowKnots; ++k) {
      add(m->demand[k]);
      const double from = static_cast<double>(k) * m->flow_step;
      if (k == kFlowKnots || from + m->flow_step <= m->top) continue;
      add(m->demand[k] + (m->top - from) / m->flow_step * (m->demand[k + 1] - m->demand[k]));
      break;
    }
  }
  std::sort(breaks_.begin(), breaks_.end());
  breaks_.push_back(highest);
  flow_.resize(order_.size());
  growth_.resize(order_.size());
  knot_.assign(order_.size(), 0);  // the pressures below rise
  double best = 0.0;
  for (std::size_t b = 0; b + 1 < breaks_.size(); ++b) {
    if (breaks_[b + 1] <= breaks_[b]) continue;
    const double half = 0.5 * (breaks_[b + 1] - breaks_[b]);
    double most = 0.0;  // upper bound of the maximum between these two breaks
    for (std::size_t i = 0; i < order_.size(); ++i) {
      // The line is evaluated in the middle: at a break itself rounding decides which of the two lines is found.
      const double middle = order_[i]->flow(breaks_[b] + half, &growth_[i], &knot_[i]);
      flow_[i] = middle - growth_[i] * half;
      const double at_end = middle + growth_[i] * half;
      most += std::max(0.0, order_[i]->slope - breaks_[b]) * at_end;
    }
    if (most <= best) continue;
    best = std::max(best, between(breaks_[b], breaks_[b + 1], pump_flow));
  }
  return best;
}

MaximisedHamiltonian::At MaximisedHamiltonian::at(double pressure, double low, double high,
                                                  double pump_flow) const {
  // Fractional knapsack: moves are filled by falling slope until the pump's flow is used up.
  At a;
  double left = pump_flow;
  for (std::size_t i = 0; i < order_.size(); ++i) {
    if (order_[i]->slope < high) break;  // it gains nothing at any pressure between low and high
    const double per_volume = order_[i]->slope - pressure;
    const double flow = flow_[i] + growth_[i] * (pressure - low);
    if (flow < left) {
      a.gain += per_volume * flow;
      a.slope += per_volume * growth_[i] - flow;
      left -= flow;
      continue;
    }
    a.gain += per_volume * left;
    a.slope -= left;
    for (std::size_t k = 0; k < i; ++k) a.slope -= per_volume * growth_[k];
    break;
  }
  return a;
}

double MaximisedHamiltonian::between(double low, double high, double pump_flow) {
  // Between two breaks the value is a minimum of functions concave in the pressure, so tangents bound it from above.
  /// Relative gap between upper and lower bound at which the search between two breaks ends.
  /// @threshold [1] 1e-8..1e-2; chosen: a twentieth of kPriceTolerance; the upper bound is returned
  constexpr double kEnough = 2e-5;
  const double from = low, to = high;
  At left = at(low, from, to, pump_flow), right = at(high, from, to, pump_flow);
  double best = std::max(left.gain, right.gain), most = best;
  /// Largest number of tangents.
  /// @threshold [1] 10..1000; numerical: the upper bound is returned at any time
  constexpr int kMost = 60;
  for (int i = 0; i < kMost; ++i) {
    if (left.slope <= 0.0 || right.slope >= 0.0) return std::max(left.gain, right.gain);
    const double cross = (right.gain - left.gain + left.slope * low - right.slope * high) /
                         (left.slope - right.slope);
    const double middle = std::clamp(cross, low, high);
    most = left.gain + left.slope * (middle - low);
    if (most <= best * (1.0 + kEnough)) return most;
    const At here = at(middle, from, to, pump_flow);
    best = std::max(best, here.gain);
    if (most <= best * (1.0 + kEnough)) return most;
    if (here.slope > 0.0) {
      low = middle;
      left = here;
    } else {
      high = middle;
      right = here;
    }
  }
  return most;
}

}  // namespace sparflow
