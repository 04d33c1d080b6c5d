#pragma once
/// What speeds can gain: the largest p.v - power(q, v) at one posture, with the pressure that each flow needs.
#include <vector>

#include "optimizer/grid/energy_grid_table.h"

namespace sparflow {

/// A joint that moves one way: how much it may move at which supply pressure. For a joint without hydraulics (pump -1)
/// the volume is the travel itself (area 1) and no pressure is needed.
struct TimedMove {
  int joint = 0, direction = 0, pump = -1;
  double area = 0.0;       ///< volume per travel [m^3/rad] or [m^2]
  double top = 0.0;        ///< largest volume flow [m^3/s]
  double slope = 0.0;      ///< p_j / area, in the direction of the move [Pa]
  double standby = 0.0;    ///< of the pump [Pa]
  double flow_step = 0.0;  ///< volume flow from knot to knot of `demand`, 0 = nothing is asked
  DemandTable::Rising demand{};  ///< needed at the knots [Pa]

  /// Largest volume flow at a supply pressure [m^3/s], and how it grows from there on [m^3/s/Pa].
  double flow(double pressure, double* growth) const;
  /// min over P >= standby of P + gain / flow(P): at this slope the move alone gains `gain` [W]. [Pa]
  double least_slope(double gain) const;
};

/// max over P >= standby and flows 0 <= x_i <= flow_i(P), sum x_i <= the pump's, of sum (slope_i - P) x_i; pumps add up.
/// A workspace.
class LargestGain {
 public:
  /// From above, by at most a relative 2e-5. [W] Moves of one joint both ways are never taken together.
  /// @param pump_flow by pump [m^3/s], may be infinite
  double of(const std::vector<TimedMove>& moves, const std::vector<double>& pump_flow);

 private:
  struct At {
    double gain = 0.0, slope = 0.0;
  };
  double one_way(const std::vector<TimedMove>& moves, const std::vector<double>& pump_flow);
  double of_pump(double pump_flow);
  double between(double low, double high, double pump_flow);
  /// At a pressure between two breaks; flow_ and growth_ are those at `low`.
  At at(double pressure, double low, double high, double pump_flow) const;

  std::vector<const TimedMove*> order_;  // of one pump, the dearest volume first
  std::vector<double> breaks_, flow_, growth_;
};

}  // namespace sparflow
