#pragma once
/// A log in the form that effects evaluate: measured signals and what the model computes from the measured pose, sample
/// by sample, in SI. identification/ fills it from a log. Effects with memory (lags, delays, hysteresis) work on whole
/// series, laws without memory sample by sample. An empty vector means not measured, NaN not valid.
#include <Eigen/Dense>
#include <memory>
#include <utility>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow {

class Effect;

/// A law of the model through which other effects act.
struct LawOfModel {
  const Effect* effect = nullptr;  ///< null: the model has no such law
  int at = -1;
  std::vector<double> values;  ///< [SI] by parameter
};

struct CylinderSeries {
  Eigen::VectorXd length;        ///< [m] pin to pin
  Eigen::VectorXd rate;          ///< dx/dq [m/rad] or [-]
  Eigen::VectorXd speed;         ///< dx/dt [m/s], positive extending
  Eigen::VectorXd acceleration;  ///< [m/s^2]
  bool stroke_measured =
      false;  ///< whether length and speed are measured, and the joint follows from them
  /// [N] from the machine file by virtual work, positive when the load pushes the rod in
  Eigen::VectorXd static_force;
  Eigen::MatrixXd
      static_slope;  ///< [samples x joints] d static_force / d q, [N/rad] or [N/m]; empty: not computed
  Eigen::VectorXd force;  ///< [N] measured, through the same filter as the position
  /// [N] static force plus the mean of (measured - static force) over half a second to either side within a motion. Laws
  /// of one pressure use it, because the force from both pressures would carry that pressure's own noise.
  Eigen::VectorXd steady_force;
  Eigen::VectorXd command;  ///< [-] -1..1, as logged
  /// [-] valve opening that the model's valve effects without memory (a dead band) leave of the command; a valve lag acts
  /// on it. Empty: the command itself.
  Eigen::VectorXd opening;
  Eigen::VectorXd
      late;  ///< [-] the opening behind the model's valve lag. Empty: the command itself.
  /// [-] share of the valve's flow that the measured pressure drop over its edge passes, by the model's law. What lowers the pump's
  /// pressure shows in it, and beside it in no flow. Empty: the model has no such law.
  Eigen::VectorXd passed;
  LawOfModel passing;  ///< the law of `passed` (Effect::passed_flow)
  /// [-] `late` times `passed` by the laws of the model whose series this is: the rod's speed over its gain. Empty: the model has none.
  Eigen::VectorXd reached;
  Eigen::VectorXd reached_share;  ///< [-] `passed` in it. Empty: the model has no such law.
  /// [Pa] pressures of the chambers, through the same filter as the position
  Eigen::VectorXd pressure_a, pressure_b;
  Eigen::VectorXd measured_a, measured_b;  ///< [Pa] the same as measured, before the filter
  /// Commanded direction: +1 extending, -1 retracting, 0 at rest (identification/signals/signals.h).
  Eigen::VectorXi direction;
  Eigen::VectorXd flow;         ///< [m^3/s] into the supply chamber, never negative; 0 at rest
  Eigen::VectorXd return_flow;  ///< [m^3/s] out of the return chamber, never negative; 0 at rest
};

struct PumpSeries {
  Eigen::VectorXd pressure;  ///< [Pa] measured, through the filter
  /// [Pa] demand by the law without missing effects, max(standby, measured working pressures + margins), not filtered.
  /// Empty: working pressures or commands are not measured.
  Eigen::VectorXd demand;
  Eigen::VectorXi leader;  ///< load-sensing leader, -1 = standby
  double standby = 0.0;    ///< [Pa]
  LawOfModel following;    ///< how the pressure follows the demand (Effect::followed_demand)
  std::vector<int> feeds;  ///< hydraulic cylinders, the columns of `asked`
  /// [samples x feeds, Pa] measured working pressure + margin of each cylinder, NaN at rest. No rows: not load-sensing.
  Eigen::MatrixXd asked;
};

/// Motion of the machine's tip (models/effects/tip_motion.h), in the base frame.
struct TipMotion {
  Eigen::MatrixX3d acceleration;  ///< [samples x 3, m/s^2]; no rows: not computed
  Eigen::MatrixXd jacobian;  ///< [samples x 3 joints]: d tip / d q, three columns for each joint
};

struct MachineSeries {
  /// Shared with whatever keeps the series, a diagnosis for example, which may outlive the model it was made with.
  std::shared_ptr<const Machine> machine;
  double step = 0.0;                                        ///< [s] median sampling interval
  Eigen::VectorXd time;                                     ///< [s]
  std::vector<std::pair<Eigen::Index, Eigen::Index>> runs;  ///< gap-free [first, last)
  Eigen::MatrixXd q, qd, qdd;                               ///< [samples x joints]
  Eigen::VectorXd payload;                                  ///< [kg]
  Eigen::VectorXd oil;                                      ///< [degC]
  Eigen::VectorXd return_pressure;  ///< [Pa] of the common return line; empty: not measured
  /// [-] Share of the machine's inertial forces that the model's effects contain; a changed mass changes this share of them as well.
  double inertia = 0.0;
  TipMotion tip;
  std::vector<CylinderSeries> cylinders;
  std::vector<PumpSeries> pumps;

  Eigen::Index samples() const { return time.size(); }
};

/// Evidence channels: one measured quantity each, compared with what the preceding stages predict for it.
enum class EvidenceKind {
  kForce,  ///< cylinder: measured force - static force [N]
  kFlow,   ///< cylinder: rod speed dx/dt, given the command [m/s]
  /// cylinder: return chamber's pressure while extending, given the return flow [Pa]; only where the
  /// return line sets it
  kReturnExtend,
  kReturnRetract,  ///< the same while retracting
  /// cylinder: supply chamber's pressure while extending, given flow and measured force [Pa]; only where a
  /// counterbalance valve sets it, the force then appears in the return chamber
  kSupplyExtend,
  kSupplyRetract,  ///< the same while retracting
  kPump,           ///< pump: pressure - demand of the measured working pressures [Pa]
  kReturnLine      ///< machine: pressure of the common return line, given all return flows [Pa]
};

}  // namespace sparflow
