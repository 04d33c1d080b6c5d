#pragma once
/// Signals of a log for its machine: for each sample the motion of joints and cylinders, the static forces, and the
/// measured quantities. Fitting, comparing and diagnosing all use them, so that "moving", "extending" and "load" have
/// one definition.
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "identification/log/segments.h"
#include "identification/signals/smoothing.h"
#include "models/machine/machine.h"

namespace sparflow {

using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

struct SignalOptions {
  SmoothingOptions smoothing;  ///< one filter for every signal of a log
  SegmentOptions motion;       ///< thresholds of "moving" and "commanded", and what one motion is
  /// Only columns are kept that learning and comparing read where no effect acts: two thirds of the memory of a long
  /// log. Not for pages, diagnoses and models with effects.
  bool slim = false;
};

/// One cylinder; all vectors are [samples]. A vector is empty when the log does not measure it and NaN where not valid.
struct CylinderSignals {
  Eigen::VectorXd length;        ///< [m] pin to pin
  Eigen::VectorXd rate;          ///< dx/dq [m/rad] or [-]
  Eigen::VectorXd speed;         ///< dx/dt [m/s], positive extending
  Eigen::VectorXd acceleration;  ///< d2x/dt2 [m/s^2]
  Eigen::VectorXd static_force;  ///< [N] by virtual work, positive if the load pushes the rod in
  Eigen::VectorXd command;       ///< [-] as logged
  Eigen::VectorXd pressure_a, pressure_b;                ///< [Pa] bore side, rod side, as logged
  Eigen::VectorXd pressure_a_smooth, pressure_b_smooth;  ///< [Pa] by the position's filter
  Eigen::VectorXd force;          ///< [N] measured: pA A_A - pB A_B, or the log's own force
  Eigen::VectorXd force_smooth;   ///< [N] by the position's filter
  Eigen::VectorXd measured_flow;  ///< [m^3/s] magnitude, as logged
  /// Whether the log has the stroke and not the joint's position: speeds and flows are then measured, whatever angle belongs
  /// to the stroke.
  bool stroke_measured = false;
  bool logs_a = false, logs_b = false;  ///< whether the log has the pressures of bore and rod side

  /// +1 extending, -1 retracting, 0 at rest. It follows the command where commands are logged, because the valve section
  /// connects the commanded side to the pump also while lag or load still move the rod the other way; else the speed.
  Eigen::VectorXi direction;
  /// Faster than the threshold and, where commands are logged, commanded (segments.h); force errors use these samples.
  Mask moving;
  /// Moving in the direction of the command; pressure models and valve gains are learned from these samples.
  Mask driven;
  /// [m^3/s] into the supply chamber, area * dx/dt in the direction, never negative; 0 at rest.
  Eigen::VectorXd flow;
  /// [Pa] measured in the supply chamber; NaN at rest. Empty when neither chamber is measured.
  Eigen::VectorXd working_pressure;
  Eigen::VectorXd working_pressure_smooth;  ///< [Pa] the same by the position's filter

  // `make_signals` gives these without effects, `with_effects` (apply_effects.h) with those of a model.
  Eigen::VectorXd model_force;  ///< [N] static force + force effects, input of the pressure models
  Eigen::VectorXd
      predicted_force;  ///< [N] model force + sensor effects, to compare with the sensor
  // An empty vector stands for no effect.
  Eigen::VectorXd pressure_effect;         ///< [Pa] added to the pressure model's working pressure
  Eigen::VectorXd return_effect;           ///< [Pa] added to the return chamber
  Eigen::VectorXd pressure_sensor_effect;  ///< [Pa] added to the working pressure by its sensor
  Eigen::VectorXd demand_effect;           ///< [Pa] added to working pressure + margin
  Eigen::VectorXd flow_effect;             ///< [m/s] added to the rod speed by valve gain * opening
  Eigen::VectorXd reached;  ///< [-] opening that the valve laws leave (CylinderSeries::reached)

  bool has_command() const { return command.size() > 0; }
  /// What the valve's gain multiplies: the command, or what the model's laws of the valve leave of it. [samples, -]
  const Eigen::VectorXd& opening() const { return reached.size() > 0 ? reached : command; }
  bool has_force() const { return force.size() > 0; }
  bool has_pressure() const { return working_pressure.size() > 0; }
  /// The static force; slim signals have no effects, and no column of their own for it.
  const Eigen::VectorXd& statics() const {
    return static_force.size() > 0 ? static_force : model_force;
  }
  /// The predicted force; slim signals have no sensor effects, and no column of their own for it.
  const Eigen::VectorXd& predicted() const {
    return predicted_force.size() > 0 ? predicted_force : model_force;
  }
};

struct PumpSignals {
  Eigen::VectorXd pressure;         ///< [Pa] as logged; empty when not measured
  Eigen::VectorXd pressure_smooth;  ///< [Pa] by the position's filter
  Eigen::VectorXd pressure_effect;  ///< [Pa] added to the maximum of the demands; empty = none
};

/// A column without a known meaning.
struct CandidateSignal {
  std::string name;  ///< without unit
  std::string unit;  ///< "" when unknown
  Eigen::VectorXd values;
};

/// A log seen through a machine. `make_signals`, `smoothed_anew` and `with_effects` alone build it; what was built is not
/// changed: each of them returns a new value, and whoever keeps one keeps it as const.
struct MachineSignals {
  std::string file;            ///< the log's name
  std::string sha256;          ///< of the log's bytes
  double step = 0.0;           ///< [s] median sampling interval
  Eigen::VectorXd time;        ///< [s]
  Eigen::MatrixXd q_measured;  ///< [samples x joints] as logged or from the strokes, SI
  Eigen::MatrixXd q, qd, qdd;  ///< [samples x joints] smoothed, SI
  Eigen::MatrixXd tip;         ///< [samples x 3] [m] in the base frame
  Eigen::VectorXd payload;     ///< [kg]; 0 everywhere when not logged
  bool payload_measured = false;
  Eigen::VectorXd oil;              ///< [degC]; empty when not measured
  Eigen::VectorXd return_pressure;  ///< [Pa]; empty when not measured
  std::vector<CylinderSignals> cylinders;
  std::vector<PumpSignals> pumps;
  std::vector<CandidateSignal> candidates;
  std::vector<SampleRange> runs;  ///< gap-free stretches
  std::vector<Segment> segments;  ///< motion and rest in turn, covering every sample
  double window = 0.0;            ///< [s] full width of the filter used
  int order = 0;                  ///< of its polynomial
  Mask edge;                      ///< within half a filter window of either end of a run
  Mask usable;                    ///< pose, speed and payload are known
  bool of_effective_machine =
      false;          ///< `with_effects` has computed speeds and flows with a changed machine
  bool slim = false;  ///< as SignalOptions::slim
  std::vector<std::string> notes;  ///< whole sentences: what was missing, converted, left out

  Eigen::Index samples() const { return time.size(); }

  // The .cpp file defines these, so that they are compiled once.
  MachineSignals();
  MachineSignals(const MachineSignals&);
  MachineSignals(MachineSignals&&) noexcept;
  MachineSignals& operator=(const MachineSignals&);
  MachineSignals& operator=(MachineSignals&&) noexcept;
  ~MachineSignals();
};

/// The signals without what only checks of sensors read: chamber pressures as logged, lengths and their derivatives.
MachineSignals without_checked(MachineSignals signals);

/// @throws InputError when the linkage cannot reach the measured stroke of a joint at any sample
MachineSignals make_signals(const Machine& machine, const Log& log,
                            const SignalOptions& options = {});

/// Recomputes the signals with another filter window; the contributions of effects (`with_effects`) are removed.
/// @param window_s full width [s], > 0
MachineSignals smoothed_anew(const Machine& machine, const MachineSignals& signals, double window_s,
                             const SignalOptions& options = {});

/// The signals with the accelerations of their own filter. Those of make_signals are of wider windows where they are steady
/// (quieten_acceleration), so that the same low-pass of a force leaves oscillations in it which they do not have.
MachineSignals with_accelerations_of_filter(const Machine& machine, MachineSignals signals);

/// Joint coordinates of a series of strokes by Newton's method from the sample before, or by the bracketed
/// `joint_at_stroke` where that fails. Error below 1e-10 rad.
/// @param strokes [samples] [m]  @param unreachable gets the number of samples without a joint coordinate
/// @return [samples] [rad] or [m], NaN where no joint coordinate has that stroke
Eigen::VectorXd joints_at_strokes(const Machine& machine, int cylinder,
                                  const Eigen::VectorXd& strokes,
                                  Eigen::Index* unreachable = nullptr);

/// @return [samples] [s] weights of the trapezoidal rule: half the intervals to the neighbours in the same run
Eigen::VectorXd sample_durations(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs);

}  // namespace sparflow
