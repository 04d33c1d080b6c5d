#pragma once
/// A log seen through its machine: for each sample what the joints and cylinders did, what the static model
/// says about it, and what was measured. Every stage of fitting, comparing and diagnosing starts here, so
/// that all of them mean the same thing by "moving", "extending" and "load".
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
  SegmentOptions motion;       ///< what counts as moving, as commanded and as one motion
};

/// One cylinder, all vectors [samples]. An empty vector: the log does not measure it. NaN: not valid there.
struct CylinderSignals {
  Eigen::VectorXd length;                  ///< [m] pin to pin
  Eigen::VectorXd rate;                    ///< dx/dq [m/rad] or [-]
  Eigen::VectorXd speed;                   ///< dx/dt [m/s], positive extending
  Eigen::VectorXd acceleration;            ///< d2x/dt2 [m/s^2]
  Eigen::VectorXd static_force;            ///< [N] by virtual work, positive pushes the rod in
  Eigen::VectorXd command;                 ///< [-] as logged
  Eigen::VectorXd pressure_a, pressure_b;  ///< [Pa] piston side, rod side, as logged
  Eigen::VectorXd pressure_a_smooth, pressure_b_smooth;  ///< [Pa] through the position's filter
  Eigen::VectorXd force;          ///< [N] measured: pA A_A - pB A_B, or the log's own force
  Eigen::VectorXd force_smooth;   ///< [N] through the position's filter
  Eigen::VectorXd measured_flow;  ///< [m^3/s] magnitude, as logged

  /// +1 extending, -1 retracting, 0 at rest. The command's side where commands are logged (a pump serves
  /// the side that is asked for, also while lag or load still move the rod the other way), else the speed's.
  Eigen::VectorXi direction;
  /// Fast enough and, where commands are logged, commanded (identification/log/segments.h): what force errors
  /// are taken on.
  Mask moving;
  /// Moving, and towards the side of the command: what pressures and valve gains are learned on.
  Mask driven;
  /// [m^3/s] into the chamber the direction selects, area * dx/dt towards it, never negative; 0 at rest.
  Eigen::VectorXd flow;
  /// [Pa] measured in the chamber the direction selects; NaN at rest. Empty when neither is measured.
  Eigen::VectorXd working_pressure;
  Eigen::VectorXd working_pressure_smooth;  ///< [Pa] the same through the filter

  // What a model's effects say, by apply_effects (identification/signals/apply_effects.h); until then as without any.
  Eigen::VectorXd model_force;      ///< [N] static force + force effects: what the processes see
  Eigen::VectorXd predicted_force;  ///< [N] what a sensor of the force reads: + sensor effects
  // Empty = none.
  Eigen::VectorXd pressure_effect;  ///< [Pa] working pressure beyond the process
  Eigen::VectorXd return_effect;  ///< [Pa] return chamber; the process says what reaches the supply
  Eigen::VectorXd pressure_sensor_effect;  ///< [Pa] what its sensor reads beyond that
  Eigen::VectorXd demand_effect;           ///< [Pa] asked of the pump beyond pressure and margin
  Eigen::VectorXd flow_effect;             ///< [m/s] rod speed beyond valve gain * command

  bool has_command() const { return command.size() > 0; }
  bool has_force() const { return force.size() > 0; }
  bool has_pressure() const { return working_pressure.size() > 0; }
};

struct PumpSignals {
  Eigen::VectorXd pressure;         ///< [Pa]; empty: not measured
  Eigen::VectorXd pressure_smooth;  ///< [Pa]
  Eigen::VectorXd pressure_effect;  ///< [Pa] beyond the maximum of the demands; empty = none
};

/// A column the program has no meaning for.
struct CandidateSignal {
  std::string name;  ///< without unit
  std::string unit;  ///< "" when unknown
  Eigen::VectorXd values;
};

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
  Eigen::VectorXd oil;              ///< [degC]; empty: not measured
  Eigen::VectorXd return_pressure;  ///< [Pa]; empty: not measured
  std::vector<CylinderSignals> cylinders;
  std::vector<PumpSignals> pumps;
  std::vector<CandidateSignal> candidates;
  std::vector<SampleRange> runs;  ///< gap-free stretches
  std::vector<Segment> segments;  ///< motion and rest in turn, covering every sample
  double window = 0.0;            ///< [s] full width of the filter used
  Mask edge;                      ///< within half a filter window of a run's end
  Mask usable;                    ///< pose, speed and payload are known
  bool of_effective_machine =
      false;  ///< apply_effects has set speeds and flows by an effect's machine
  std::vector<std::string> notes;  ///< plain sentences: what was missing, converted, left out

  Eigen::Index samples() const { return time.size(); }

  // Defaulted where they are defined: compiled once, not in every file that copies one.
  MachineSignals();
  MachineSignals(const MachineSignals&);
  MachineSignals(MachineSignals&&) noexcept;
  MachineSignals& operator=(const MachineSignals&);
  MachineSignals& operator=(MachineSignals&&) noexcept;
  ~MachineSignals();
};

/// @throws InputError when a stroke lies outside what the linkage can reach at every sample
MachineSignals make_signals(const Machine& machine, const Log& log,
                            const SignalOptions& options = {});

/// The same log through another filter; what effects have added (apply_effects) is gone.
/// @param window_s full width [s], > 0
MachineSignals smoothed_anew(const Machine& machine, const MachineSignals& signals, double window_s,
                             const SignalOptions& options = {});

/// Joint coordinates of a series of strokes [m], NaN where no joint coordinate has that stroke: Newton's
/// method from the sample before, the bracketed `joint_at_stroke` where that fails. Error below 1e-10 rad.
/// @param unreachable gets the number of samples without a joint coordinate
Eigen::VectorXd joints_at_strokes(const Machine& machine, int cylinder,
                                  const Eigen::VectorXd& strokes,
                                  Eigen::Index* unreachable = nullptr);

/// Time each sample stands for [s]: half the intervals to its neighbours in the same run (trapezoidal rule).
Eigen::VectorXd sample_durations(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs);

}  // namespace sparflow
