#pragma once
/// Areas, rated flows and units that the hydraulic effects use in common.
#include <vector>

#include "models/effects/series.h"
#include "models/machine/machine.h"
#include "models/math/units.h"

namespace sparflow {

namespace units {
// no threshold: units
inline constexpr double kBarPerLpm = kBar / kLitrePerMinute;  ///< [Pa s/m^3] in one bar/(l/min)
inline constexpr double kBarPerLpm2 =
    kBar / (kLitrePerMinute * kLitrePerMinute);      ///< [Pa s^2/m^6] in one bar/(l/min)^2
inline constexpr double kLitrePerBar = 1e-3 / kBar;  // [m^3/Pa]; no threshold: unit
}  // namespace units

/// Area of the supply chamber while moving to `side` (+1 extends, -1 retracts). [m^2]
inline double supply_area(const Cylinder& c, int side) {
  return side > 0 ? c.area_piston() : c.area_rod();
}
/// Area of the return chamber. [m^2]
inline double return_area(const Cylinder& c, int side) { return supply_area(c, -side); }

/// Cylinders with a bore.
std::vector<int> hydraulic_cylinders(const Machine& machine);
/// {-1}, or nothing when no cylinder has a bore: places of an effect of the whole hydraulic circuit.
std::vector<int> whole_circuit(const Machine& machine);
/// Pumps of one type.
std::vector<int> pumps_of_type(const Machine& machine, PumpType type);

/// Rated flow of a valve section into the supply chamber of `side` [m^3/s]: the valve's full flow, else the pump's
/// largest, else 1e-3 (60 l/min).
double rated_flow(const Machine& machine, int cylinder, int side);

/// Return flow of all cylinders together. [m^3/s]
Eigen::VectorXd total_return_flow(const MachineSeries& log);
/// Flow a pump delivers to all its cylinders. [m^3/s]
Eigen::VectorXd pump_flow(const MachineSeries& log, int pump);
/// What a pump's pressure shows of a change of its demand: late where the model has a lag of the pump, else all of it at once.
/// @param change [samples, Pa]
Eigen::VectorXd reaching_pump(const MachineSeries& log, int pump, const Eigen::VectorXd& change);
/// The force that a cylinder carries: measured, or by virtual work where it is not measured. [N]
const Eigen::VectorXd& carried_force(const CylinderSeries& cylinder);
/// CylinderSeries::steady_force where it is known, else carried_force. [N]
const Eigen::VectorXd& steady_force(const CylinderSeries& cylinder);

/// Direction of the motion whose return or supply chamber `kind` is: +1, -1; 0 for other kinds.
int return_side(EvidenceKind kind);
int supply_side(EvidenceKind kind);

}  // namespace sparflow
