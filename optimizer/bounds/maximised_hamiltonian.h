#pragma once
/// Maximised Hamiltonian: the largest p.v - power(q, v) over admissible speeds v at one posture, with the pressure that
/// each flow demands.
#include <vector>

#include "optimizer/grid/energy_grid_table.h"

namespace sparflow {

/// One joint moving in one direction: its largest flow as a function of the supply pressure. For a joint without
/// hydraulics (pump -1) the volume is the travel itself (area 1) and no pressure is needed.
struct TimedMove {
  int joint = 0, direction = 0, pump = -1;
  double area = 0.0;       ///< volume per travel [m^3/rad] or [m^2]
  double top = 0.0;        ///< largest volume flow [m^3/s]
  double slope = 0.0;      ///< p_j / area, in the direction of the move [Pa]
  double standby = 0.0;    ///< standby of the pump [Pa]
  double flow_step = 0.0;  ///< volume flow from knot to knot of `demand` [m^3/s], 0 = no demand
  DemandTable::Rising demand{};  ///< at the knots [Pa]

  /// Pump pressure of this move alone at vanishing flow. [Pa]
  double least_pressure() const;
  /// Largest volume flow at a supply pressure [m^3/s], and its right derivative [m^3/s/Pa].
  /// @param knot where the search for the pressure begins: at or below the last knot whose demand it meets; set to that knot
  double flow(double pressure, double* growth, std::size_t* knot) const;
  /// Slope at which this move alone has the Hamiltonian `gain` [W]: min over P >= standby of P + gain / flow(P). [Pa]
  double least_slope(double gain) const;
};

/// max over P >= standby and flows 0 <= x_i <= flow_i(P), sum x_i <= the pump's limit, of sum (slope_i - P) x_i, summed
/// over the pumps. A mutable workspace.
class MaximisedHamiltonian {
 public:
  /// Upper bound of the maximum, too large by at most a relative 2e-5 (rounding aside). [W] The two directions of one
  /// joint are never combined.
  /// @param pump_flow by pump [m^3/s], may be infinite
  double of(const std::vector<TimedMove>& moves, const std::vector<double>& pump_flow);

 private:
  struct At {
    double gain = 0.0, slope = 0.0;
  };
  double one_way(const std::vector<TimedMove>& moves, const std::vector<double>& pump_flow);
  double of_pump(double pump_flow);
  double between(double low, double high, double pump_flow);
  /// Value and derivative at a pressure between two breaks; flow_ and growth_ belong to `low`.
  At at(double pressure, double low, double high, double pump_flow) const;

  std::vector<const TimedMove*> order_;  // moves of one pump, by falling slope
  std::vector<double> breaks_, flow_, growth_;
  std::vector<std::size_t> knot_;  // where each move's flow was found last
};

}  // namespace sparflow
