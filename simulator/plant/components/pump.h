#pragma once
/// Variable pump with pressure regulator: it holds p_set = min(max(p_LS + margin, standby), cut-off), or a constant
/// pressure, by its displacement s in 0..1 within its torque limit.
///   e = p_set - p,  s_asked = s_i + K e,  s_held = clamp(s_asked, 0, min(1, P / (p q_max)))
///   T_s ds/dt = s_held - s,  ds_i/dt = K_i e + (s_held - s_asked) / T
/// K = 2 D / (T b) and K_i = 1 / (T^2 b) with b = q_max / C, C the line's capacity [m^3/Pa], give the pressure in front of
/// closed valves the natural frequency 1 / T and the damping D. In steady state e = 0 within the limits.
/// Source: Akers, Gassman, Smith (2006), Hydraulic Power System Analysis (regulator as integrating servo);
/// times: Bosch Rexroth data sheet of the A10VSO. Load-sensing line: two equal lags.
#include <algorithm>

#include "simulator/plant/components/oil.h"

namespace sparflow::plant {

struct PumpParameters {
  double max_flow = 0.0;       ///< [m^3/s] at full displacement, oil at one atmosphere
  double cut_off = 300e5;      ///< [Pa]; of a constant-pressure pump the pressure it holds
  double standby = 20e5;       ///< [Pa]
  double margin = 20e5;        ///< [Pa] above the load-sensing pressure
  double response = 0.05;      ///< [s] T of the pressure
  double swash_lag = 0.02;     ///< [s] T_s of the displacement
  double power = 1e9;          ///< [W] torque limit times speed
  double line_delay = 0.03;    ///< [s] of the load-sensing line, the sum of its two lags
  double line_volume = 3e-3;   ///< [m^3] between pump and valves
  double leakage = 0.0;        ///< [m^3/s/Pa] into the case
  double relief_above = 25e5;  ///< [Pa] relief valve opens so much above the cut-off
  double flow_sharing = 0.0;   ///< [-] 1: compensators behind the edges, 0: before them
};

struct PumpRates {
  double displacement = 0.0, integral = 0.0;  ///< [1/s]
};

/// Pressure that the regulator holds. @param load_sensing [Pa] at the pump's end of the line
inline double pump_set_pressure(double load_sensing, bool constant, const PumpParameters& p) {
  if (constant) return p.cut_off;
  return std::min(std::max(load_sensing + p.margin, p.standby), p.cut_off);
}

/// Gains of the regulator.
struct PumpGains {
  double proportional = 0.0;  ///< [1/Pa] K
  double integral = 0.0;      ///< [1/(Pa s)] K_i
};

/// @param capacity [m^3/Pa] of the line between pump and valves
inline PumpGains pump_gains(const PumpParameters& p, double capacity) {
  constexpr double kDamping = 0.8;  // little overshoot, as regulators are set
  const double b = p.max_flow / capacity;
  return {2.0 * kDamping / (p.response * b), 1.0 / (p.response * p.response * b)};
}

struct PumpState {
  double error = 0.0;         ///< [Pa] e
  double pressure = 0.0;      ///< [Pa]
  double displacement = 0.0;  ///< [-] s
  double integral = 0.0;      ///< [-] s_i
};

inline PumpRates pump_rates(const PumpState& s, const PumpGains& gain, const PumpParameters& p) {
  const double asked = s.integral + gain.proportional * s.error;
  const double most = std::min(1.0, p.power / (p.max_flow * std::max(s.pressure, 1e5)));
  const double held = std::clamp(asked, 0.0, most);
  return {(held - s.displacement) / p.swash_lag,
          gain.integral * s.error + (held - asked) / p.response};
}

}  // namespace sparflow::plant
