#pragma once
/// Fuel of an engine at its working speed over the power at its shaft, and the pump's efficiency over pressure and flow: what
/// turns hydraulic energy into litres.
#include <Eigen/Dense>

namespace sparflow {

struct EngineMap {
  Eigen::VectorXd power;       ///< [W] at the shaft, ascending
  Eigen::VectorXd fuel;        ///< [m^3/s] at `power`
  Eigen::VectorXd pressure;    ///< [Pa] ascending
  Eigen::VectorXd flow;        ///< [m^3/s] ascending
  Eigen::MatrixXd efficiency;  ///< [pressures x flows] hydraulic power over shaft power, in (0, 1]

  /// Between the values of the map it is linear; outside, the value at the edge holds.
  double efficiency_at(double p, double q) const;
  /// [W] for a pump that gives q [m^3/s] at p [Pa]; 0 without flow or pressure (a motor gives nothing back)
  double shaft_power(double p, double q) const;
  /// [m^3/s] linear between the values of the map; beyond its largest power the last slope goes on, below its least power
  /// the first value holds
  double fuel_rate(double shaft_power) const;
};

/// Pressures and flows of the pumps over time.
struct PumpTrace {
  Eigen::VectorXd t;         ///< [s] ascending
  Eigen::MatrixXd pressure;  ///< [instants x pumps, Pa]
  Eigen::MatrixXd flow;      ///< [instants x pumps, m^3/s]
};

/// Fuel over a trace, all pumps on one engine, by the trapezoidal rule. [m^3]; not a number where a pressure with flow is none
double fuel_of(const EngineMap& map, const PumpTrace& trace);

}  // namespace sparflow
