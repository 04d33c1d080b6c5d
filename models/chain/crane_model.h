#pragma once
/// The one model object: a machine and what was learned about it. Identification, optimiser and pages all
/// evaluate this, so whatever is learned once is seen by all of them. Immutable once built.
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/hydraulics/gaussian_process.h"
#include "models/machine/machine.h"
#include "models/machine/static_force.h"

namespace sparflow {

/// What was learned about one cylinder.
struct CylinderModel {
  GaussianProcess extend;   ///< working pressure on the piston side, p(Q, F); empty = not learned
  GaussianProcess retract;  ///< working pressure on the rod side
  double margin = 0.0;      ///< [Pa] c_i >= 0 of paper eq. 15
  double valve_gain_extend = 0.0;   ///< [m^3/s] flow at full command; 0 = not learned
  double valve_gain_retract = 0.0;  ///< [m^3/s]
};

/// What was learned about one pump.
struct PumpModel {
  double standby =
      0.0;  ///< [Pa] load sensing: least pressure; constant-pressure supply: its pressure
};

/// One log the model has seen.
struct DataSource {
  std::string file;    ///< name without folder
  std::string sha256;  ///< of the file's bytes
  long rows = 0;
  std::string use;  ///< "train" or "test"
};

/// Quality of one stage, as `compare` reports it.
struct StageQuality {
  std::string stage;  ///< force, flow, pressure, pump, energy
  std::string at;     ///< "<cylinder>", "<cylinder> extend", "<pump>"
  std::string data;   ///< "train" or "test"
  double rmse = 0.0;  ///< in `unit`
  std::string unit;
  double fit_percent = 0.0;
  long n = 0;
};

/// A parameter of an effect as it was when a step was made.
struct StepParameter {
  std::string name;
  std::string unit;                                           ///< as shown, "bar/(l/min)^2"
  double value = 0.0;                                         ///< [SI]
  double lower95 = std::numeric_limits<double>::quiet_NaN();  ///< [SI] NaN = not known
  double upper95 = std::numeric_limits<double>::quiet_NaN();  ///< [SI]
};

/// One step of extending a model: what was added or taken back, from which data, with which gain. A record, so it
/// may name effects this model no longer has.
struct ModelStep {
  std::string added;             ///< "coulomb_friction:boom", empty when the step only removes
  std::string removed;           ///< the same of an effect taken back, usually empty
  std::string date;              ///< "2025-03-14", empty = not recorded
  std::vector<DataSource> data;  ///< logs it was learned and judged on
  std::vector<StepParameter> parameters;    ///< of the added effect
  std::vector<StageQuality> before, after;  ///< on data held out
  std::string stopped_because;  ///< why no step followed, with the last one; empty = one may follow
};

struct CraneModel {
  Machine machine;                       ///< as its file says; `effective_machine` has the effects'
  std::vector<CylinderModel> cylinders;  ///< by cylinder
  std::vector<PumpModel> pumps;          ///< by pump
  std::vector<AppliedEffect>
      effects;  ///< physical effects beyond paper eqs. 2-16, in the order added
  /// Effects that users describe in YAML and that the model file carries, in the model or not: who reads the file
  /// can choose them.
  std::vector<const Effect*> user_effects;
  std::vector<ModelStep> steps;  ///< how they came in
  std::vector<DataSource> data;
  std::vector<StageQuality> quality;

  /// A model of which nothing is learned yet: margins 0, standby from the machine file
  /// (a constant-pressure supply: its largest pressure).
  static CraneModel untrained(Machine machine);
  /// Whether every hydraulic cylinder has both pressure processes.
  bool complete() const;
  /// Names of what is missing ("boom retract"), for a message.
  std::vector<std::string> missing() const;

  // Defaulted where they are defined: compiled once, not in every file that copies one.
  CraneModel();
  CraneModel(const CraneModel&);
  CraneModel(CraneModel&&) noexcept;
  CraneModel& operator=(const CraneModel&);
  CraneModel& operator=(CraneModel&&) noexcept;
  ~CraneModel();
};

/// One cylinder at one instant, exact law (paper eqs. 2-13) and the model's effects.
struct CylinderState {
  double length = 0.0;  ///< [m] pin to pin
  double rate = 0.0;    ///< dx/dq [m/rad] or [-]
  double speed = 0.0;   ///< dx/dt [m/s], positive extending
  double force = 0.0;   ///< static force of the effective machine [N], positive pushes the rod in
  double total_force =
      0.0;                ///< [N] the same with what the force effects add: what the processes see
  double flow = 0.0;      ///< [m^3/s] into the working chamber, never negative
  double pressure = 0.0;  ///< [Pa] working pressure, 0 at rest
  double pressure_std = 0.0;  ///< [Pa] of the process' mean; 0 at rest
  bool moving = false;
};

/// One pump at one instant (paper eqs. 14-16).
struct PumpState {
  double flow = 0.0;      ///< [m^3/s]
  double pressure = 0.0;  ///< [Pa]
  int leader = -1;  ///< the cylinder that sets the pressure, -1 = standby or constant pressure
};

struct MachineState {
  std::vector<CylinderState> cylinders;
  std::vector<PumpState> pumps;
  double power = 0.0;  ///< [W] sum over pumps of pressure times flow

  /// Power lost in the valve of a cylinder, (p_pump - P_i) Q_i. [W]
  double throttling(const Machine& machine, int cylinder) const;
};

/// |dx/dt| up to which a cylinder counts as at rest [m/s]: swallows rounding, no more.
inline constexpr double kRestSpeed = 1e-9;

/// Evaluates the exact chain; a workspace, one a thread, no allocation after construction.
///
/// With the model's effects: static forces of the effective machine (models/effects/effective_machine.h), + force
/// effects, flows, working pressure p(Q, F total) + what the effects on the return chambers do to it
/// (models/hydraulics/return_rise.h) + pressure effects of the moving hydraulic cylinders, demand =
/// working pressure + margin + demand effects, pump = max(standby, demands) + pump effects. An effect of a stage
/// sees what earlier effects of its stage do not add: all of a stage start from the same state.
/// Effects with memory (lags, delays) and of flow and sensors say nothing here.
class Chain {
 public:
  /// @param model must outlive the chain
  explicit Chain(const CraneModel& model);

  double oil = 40.0;  ///< [degC] for effects that look at the oil's temperature

  /// @param q, qd by joint  @param payload [kg]  @param with_std also predictive standard deviations
  /// @param rest_speed |dx/dt| up to which a cylinder counts as at rest [m/s]. The exact law knows only
  ///        zero; the default merely swallows rounding. Measured speeds need a threshold above noise.
  /// @param qdd by joint, for inertia; nullptr = 0
  /// @throws std::domain_error when a four-bar cannot close at q
  const MachineState& evaluate(const double* q, const double* qd, double payload,
                               bool with_std = false, double rest_speed = kRestSpeed,
                               const double* qdd = nullptr);

  /// The pressure stages alone and without effects, from given speeds and total forces of all cylinders [m/s],
  /// [N]: for logs, where effects are series (identification/signals/series.h).
  /// @param added_pressure [Pa] by cylinder, added to its working pressure; nullptr = 0
  /// @param added_demand [Pa] by cylinder, asked of the pump on top; nullptr = 0
  /// @param added_return [Pa] by cylinder, added to its return chamber; nullptr = 0
  const MachineState& evaluate_pressures(const double* speed, const double* force,
                                         bool with_std = false, double rest_speed = kRestSpeed,
                                         const double* added_pressure = nullptr,
                                         const double* added_demand = nullptr,
                                         const double* added_return = nullptr);

  /// The machine whose forces these are.
  const Machine& machine() const { return *machine_; }

 private:
  void set_flow(std::size_t cylinder, double rest_speed);
  void set_pressure(std::size_t cylinder, bool with_std);
  void raise_by_return(std::size_t cylinder, double rise);
  void add_force_effects(const double* q, const double* qd, const double* qdd, double payload);
  void add_pressure_effects();
  void pump_stage(const double* added_demand);
  void add_pump_effects();

  const CraneModel* model_;
  std::shared_ptr<const Machine> machine_;
  StaticForce statics_;
  MachineState state_;
  std::vector<AppliedEffect> laws_;  // those that act in a motion
  Instant<double> instant_;
  std::vector<double> added_, added_pump_;
};

}  // namespace sparflow
