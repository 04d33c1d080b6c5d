#pragma once
/// Interface of a hidden effect: the hooks by which it changes a step of the plant, each called once in every step, in
/// the order of their declaration.
#include <memory>
#include <numbers>
#include <vector>

#include "simulator/hidden_effects/body_forces.h"
#include "simulator/hidden_effects/crane_laws.h"
#include "simulator/hidden_effects/hidden_effect.h"
#include "simulator/hidden_effects/plant_state.h"

namespace sparflow::simulator {

/// Logged values of one run, on the log's time grid, before noise. [Pa], [rad] or [m], [-]
struct Recording {
  double rate = 50.0;
  std::vector<double> time, payload, oil;
  std::vector<std::vector<double>> q;                       ///< by joint
  std::vector<std::vector<double>> command;                 ///< by cylinder
  std::vector<std::vector<double>> pressure_a, pressure_b;  ///< by cylinder
  std::vector<std::vector<double>> pump;                    ///< by pump
  std::vector<std::vector<double>> noise_a, noise_b, noise_pump,
      noise_q;  ///< noise that is added at the end
};

/// Quantities from which a law draws its strength.
struct LawContext {
  const Machine* machine = nullptr;
  const CraneLaws* laws = nullptr;
  Random* random = nullptr;
  int at = -1;          ///< joint, cylinder or pump
  std::string channel;  ///< of a sensor fault
  double size = 1.0;
  int law = 0;
  double payload = 0.0;         ///< [kg] usual_payload()
  double sensor_noise = 0.8e5;  ///< [Pa] standard deviation of pressure sensors

  const Cylinder& cylinder() const { return machine->cylinders[static_cast<std::size_t>(at)]; }
  const Joint& joint() const { return machine->joints[static_cast<std::size_t>(at)]; }
  const Pump& pump() const { return machine->pumps[static_cast<std::size_t>(at)]; }
  double draw(double lo, double hi) { return random->uniform(lo, hi); }
};

/// Least-squares estimate of a text-book parameter from the simulated action of an effect:
/// sum(effect * regressor) / sum(regressor^2).
class Equivalent {
 public:
  void add(double effect, double regressor) {
    effect_ += effect * regressor;
    square_ += regressor * regressor;
  }
  double value(double otherwise) const { return square_ > 0.0 ? effect_ / square_ : otherwise; }

 private:
  double effect_ = 0.0, square_ = 0.0;
};

class HiddenLaw {
 public:
  virtual ~HiddenLaw() = default;
  /// Changes base laws so that the effect can be seen; also applied to the reference crane, which lacks the effect.
  virtual void prepare_crane(CraneLaws& /*laws*/) const {}
  virtual void change_machine(Machine& /*machine*/) const {
  }                                     ///< changes the bodies of body_forces.h
  virtual void payload(PlantState&) {}  ///< changes s.payload to the true payload
  /// Sets the opening of every cylinder's valve, which is preset to the command.
  virtual void opening(PlantState&) {}
  virtual void flow(PlantState&) {}  ///< sets the flow, which is preset to opening times valve gain
  virtual void drift(PlantState&) {}  ///< adds to the cylinders' drift
  /// Adds to s.q_load; the joint loads are those of the step before.
  virtual void posture(PlantState&) {}
  virtual void force(PlantState&, BodyForces&) {}  ///< adds to the cylinders' force
  virtual void return_line(PlantState&) {}         ///< adds to return_pressure
  virtual void pilot(PlantState&) {}               ///< changes pilot_pressure
  virtual void demand(PlantState&) {}              ///< changes line_drop, margin, asked
  virtual void pump(PlantState&) {}  ///< changes the pumps' pressure, which is preset to the demand
  virtual void sensors(const PlantState&, SensorState&) {}  ///< changes readings, without noise
  virtual void recording(Recording&, Random&) {}  ///< changes whole channels: delays, stuck values
  virtual bool needs_inertia() const { return false; }
  /// Dead band [-] that the operator skips with the lever.
  virtual double lever_deadband(int /*cylinder*/, int /*side*/) const { return 0.0; }
  /// True parameters; valid after the run, because equivalents are estimated from it.
  virtual std::vector<HiddenParameter> parameters() const = 0;
};

inline int sign_of(double v) { return v > 0.0 ? 1 : (v < 0.0 ? -1 : 0); }

enum class HiddenPlace { kMachine, kJoint, kCylinder, kPump, kChannel };

/// A row of the table of effects.
struct LawEntry {
  std::string id;
  HiddenPlace place;
  bool in_catalogue;
  std::vector<std::string> laws;
  std::string parameters;
  std::unique_ptr<HiddenLaw> (*make)(LawContext&);
  bool (*fits)(const Machine&, int) = nullptr;  ///< whether a place is possible; nullptr: all are
};

/// The tables of the files in laws/, one for each file.
std::vector<LawEntry> friction_laws();
std::vector<LawEntry> contact_laws();
std::vector<LawEntry> mass_laws();
std::vector<LawEntry> pressure_laws();
std::vector<LawEntry> valve_laws();
std::vector<LawEntry> volume_laws();
std::vector<LawEntry> pump_laws();
std::vector<LawEntry> sensor_laws();
std::vector<LawEntry> outside_hydraulic_laws();
std::vector<LawEntry> outside_mechanical_laws();
const std::vector<LawEntry>& all_laws();
const LawEntry& law_entry(const std::string& id);

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kMoving =
    2e-3;  ///< [m/s] samples from here on count as moving, as in the error measures

/// Area [m^2] that converts a force into a pressure; a typical one for a drive without hydraulics.
inline double drive_area(const Cylinder& c) { return c.hydraulic() ? c.area_piston() : 0.01; }
/// Conditions for the place of an effect: cylinder `i` is hydraulic, pump `p` is load sensing.
inline bool hydraulic(const Machine& machine, int i) {
  return machine.cylinders[static_cast<std::size_t>(i)].hydraulic();
}
inline bool load_sensing(const Machine& machine, int p) {
  return machine.pumps[static_cast<std::size_t>(p)].type == PumpType::kLoadSensing;
}

template <class Law>
std::unique_ptr<HiddenLaw> make_law(LawContext& context) {
  return std::make_unique<Law>(context);
}

}  // namespace sparflow::simulator
