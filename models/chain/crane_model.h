#pragma once
/// The model: a machine and what was learned about it. Identification, optimiser and pages all evaluate this object, so
/// that they share whatever was learned. It is not changed once it is built.
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/hydraulics/gaussian_process.h"
#include "models/machine/machine.h"
#include "models/machine/static_force.h"

namespace sparflow {

/// What was learned about one cylinder: two pressure models, margin and valve gains.
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
      0.0;  ///< [Pa] load sensing: standby pressure; constant-pressure supply: its pressure
};

/// One log on which the model was learned or judged.
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

/// One step of extending a model: what was added or removed, from which data, with which gain. It is a record and may
/// name effects that the model no longer has.
struct ModelStep {
  std::string added;             ///< "coulomb_friction:boom", empty when the step only removes
  std::string removed;           ///< the same for a removed effect, usually empty
  std::string date;              ///< "2025-03-14", empty = not recorded
  std::vector<DataSource> data;  ///< logs it was learned and judged on
  std::vector<StepParameter> parameters;    ///< of the added effect
  std::vector<StageQuality> before, after;  ///< on data held out
  std::string stopped_because;  ///< in the last step: why no other followed; empty = one may follow
};

struct CraneModel {
  Machine machine;  ///< as in its file; `effective_machine` has the effects applied
  std::vector<CylinderModel> cylinders;  ///< by cylinder
  std::vector<PumpModel> pumps;          ///< by pump
  std::vector<AppliedEffect>
      effects;  ///< physical effects beyond paper eqs. 2-16, in the order added
  /// Effects that users described in YAML and that the model file contains, whether the model uses them or not, so that
  /// later verbs can choose them.
  std::vector<const Effect*> user_effects;
  std::vector<ModelStep> steps;  ///< how the effects were added
  std::vector<DataSource> data;
  std::vector<StageQuality> quality;

  /// A model before anything is learned: margins 0, standby from the machine file
  /// (a constant-pressure supply: its largest pressure).
  static CraneModel untrained(Machine machine);
  /// Whether every hydraulic cylinder has a pressure model in both directions.
  bool complete() const;
  /// Names of what is missing ("boom retract"), for a message.
  std::vector<std::string> missing() const;

  // Defaulted in the source file, so that they are compiled once and not in every file that copies a model.
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
  double total_force = 0.0;   ///< [N] static force plus force effects; input of the pressure models
  double flow = 0.0;          ///< [m^3/s] into the supply chamber, never negative
  double pressure = 0.0;      ///< [Pa] working pressure, 0 at rest
  double pressure_std = 0.0;  ///< [Pa] standard deviation of the pressure model's mean; 0 at rest
  bool moving = false;
};

/// One pump at one instant (paper eqs. 14-16).
struct PumpState {
  double flow = 0.0;      ///< [m^3/s]
  double pressure = 0.0;  ///< [Pa]
  int leader = -1;        ///< load-sensing leader, -1 = standby or constant pressure
};

struct MachineState {
  std::vector<CylinderState> cylinders;
  std::vector<PumpState> pumps;
  double power = 0.0;  ///< [W] sum over pumps of pressure times flow

  /// Power lost in the valve of a cylinder, (p_pump - P_i) Q_i. [W]
  double throttling(const Machine& machine, int cylinder) const;
};

/// |dx/dt| up to which a cylinder counts as at rest [m/s]; it covers rounding only.
/// @threshold [m/s] 0..1e-6; numerical: rounding of a rate times a speed
inline constexpr double kRestSpeed = 1e-9;

/// Motion of the joints at one instant, an array by joint each. Nothing is owned.
struct JointState {
  const double* q = nullptr;    ///< [rad] or [m]
  const double* qd = nullptr;   ///< [rad/s] or [m/s]
  const double* qdd = nullptr;  ///< [rad/s^2] or [m/s^2], for inertia; nullptr = 0
};

/// What effects add to the pressures, an array by cylinder each; nullptr = 0. Nothing is owned. [Pa]
struct AddedPressures {
  const double* pressure = nullptr;  ///< to the working pressure
  const double* demand = nullptr;    ///< to the demand on the pump
  const double* back = nullptr;      ///< to the pressure in the return chamber
};

/// Evaluates the exact law of the chain. Each thread needs its own object; nothing is allocated after construction.
///
/// With the model's effects: static forces of the effective machine (models/effects/effective_machine.h), + force
/// effects, flows, working pressure p(Q, F total) + its rise by effects on the return chambers
/// (models/hydraulics/return_rise.h) + pressure effects of the moving hydraulic cylinders, demand =
/// working pressure + margin + demand effects, pump = max(standby, demands) + pump effects. All effects of a
/// stage start from the same state; none depends on what another one of its stage adds.
/// Effects with memory (lags, delays) and those of the stages flow and sensor do not act here.
class Chain {
 public:
  /// @param model must outlive the chain
  explicit Chain(const CraneModel& model);

  double oil = 40.0;  ///< [degC] oil temperature, for effects that depend on it

  /// @param joints motion of the joints  @param payload [kg]  @param with_std also predictive standard deviations
  /// @param rest_speed |dx/dt| up to which a cylinder counts as at rest [m/s]. The default covers rounding only,
  ///        as the exact law demands. Measured speeds need a threshold above their noise.
  /// @throws std::domain_error when a four-bar cannot close at q
  const MachineState& evaluate(const JointState& joints, double payload, bool with_std = false,
                               double rest_speed = kRestSpeed);

  /// The pressure stages alone and without effects, from given speeds and total forces of all cylinders [m/s],
  /// [N]: for logs, where effects are series (identification/signals/series.h).
  const MachineState& evaluate_pressures(const double* speed, const double* force,
                                         bool with_std = false, double rest_speed = kRestSpeed,
                                         const AddedPressures& added = {});

  /// The effective machine, whose forces are evaluated.
  const Machine& machine() const { return *machine_; }

 private:
  void set_flow(std::size_t cylinder, double rest_speed);
  void set_pressure(std::size_t cylinder, bool with_std);
  void raise_by_return(std::size_t cylinder, double rise);
  void add_force_effects(const JointState& joints, double payload);
  void add_pressure_effects();
  void pump_stage(const double* added_demand);
  void add_pump_effects();

  const CraneModel* model_;
  std::shared_ptr<const Machine> machine_;
  StaticForce statics_;
  MachineState state_;
  std::vector<AppliedEffect> laws_;  // effects that act in a motion
  Instant<double> instant_;
  std::vector<double> added_, added_pump_;
};

}  // namespace sparflow
