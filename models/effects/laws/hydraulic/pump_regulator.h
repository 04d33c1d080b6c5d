#pragma once
/// Pressure of a load-sensing pump by the flow balance of its line, with a regulator that integrates. Until the pump's flow has
/// grown to what the open valves ask for, its pressure stays at the highest load that it moves; once they close, it
/// overshoots until the flow has fallen. A lag of the demand knows neither.
///   C dp/dt = C x - sum Q_i (max(0, p - p_i) / s_i)^0.5 - C p / rest,  each root at most 1
///   C x = what the regulator holds = y + 2 D C e / tau between 0 and the pump's largest flow,
///   dy/dt = C e / tau^2 (anti-windup: with the held value)
///   e = max(standby, max_i (min(p, p_i) + margin_i)) - p
/// In front of closed valves the pressure has the natural frequency 1 / tau and the damping ratio D.
/// Source: R. Akers, M. Gassman, R. Smith (2006), Hydraulic Power System Analysis (regulator as integrating servo);
/// P. Krus (1988), On Load Sensing Fluid Power Systems, Linkoping (line, load and regulator).
#include <limits>
#include <vector>

#include "models/effects/series.h"

namespace sparflow {

/// A valve section as the pump's line sees it.
struct OpenSection {
  Eigen::VectorXd load;    ///< [samples, Pa] pressure behind the valve; NaN while it is closed
  Eigen::VectorXd margin;  ///< [samples, Pa] that it asks for above the load
  Eigen::VectorXd flow;    ///< [samples, m^3/s] that it passes at its full pressure drop
};

/// Share of its full flow that a valve passes at a pressure drop. @param margin [Pa] that it asks for
double passed_share(double drop, double margin);

struct PumpRegulator {
  double tau = 0.0;       ///< [s] > 0
  double capacity = 0.0;  ///< [m^3/Pa] C of the line, > 0
  double rest = 0.0;  ///< [s] time constant of the fall by leakage while every valve is closed, > 0
  double most_flow = std::numeric_limits<double>::infinity();  ///< [m^3/s] of the pump
};

/// @return [samples, Pa] pressure, from `start` [samples, Pa] at the beginning of every run
Eigen::VectorXd regulated_pressure(const MachineSeries& log, double standby,
                                   const std::vector<OpenSection>& sections,
                                   const PumpRegulator& regulator, const Eigen::VectorXd& start);

}  // namespace sparflow
