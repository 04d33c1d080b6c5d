#pragma once
/// One hidden effect at work: what it changes at each step of the plant. Hooks are called in this order, once a step.
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
  std::vector<std::vector<double>> q;                                      ///< by joint
  std::vector<std::vector<double>> command;                                ///< by cylinder
  std::vector<std::vector<double>> pressure_a, pressure_b;                 ///< by cylinder
  std::vector<std::vector<double>> pump;                                   ///< by pump
  std::vector<std::vector<double>> noise_a, noise_b, noise_pump, noise_q;  ///< what will be added
};

/// Everything a law may draw its strength from.
struct LawContext {
  const Machine* machine = nullptr;
  const CraneLaws* laws = nullptr;
  Random* random = nullptr;
  int at = -1;          ///< joint, cylinder or pump
  std::string channel;  ///< for sensor faults
  double size = 1.0;
  int law = 0;
  double payload = 0.0;         ///< [kg] largest usual
  double sensor_noise = 0.8e5;  ///< [Pa] standard deviation

  const Cylinder& cylinder() const { return machine->cylinders[static_cast<std::size_t>(at)]; }
  const Joint& joint() const { return machine->joints[static_cast<std::size_t>(at)]; }
  const Pump& pump() const { return machine->pumps[static_cast<std::size_t>(at)]; }
  double draw(double lo, double hi) { return random->uniform(lo, hi); }
};

/// Least-squares value of a text-book parameter from what an effect really did: sum(effect * regressor) /
/// sum(regressor^2).
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
  /// Base laws that the effect needs to be visible; also applied to the reference crane, which lacks the effect.
  virtual void prepare_crane(CraneLaws& /*laws*/) const {}
  virtual void change_machine(Machine& /*machine*/) const {}  ///< bodies the forces come from
  virtual void payload(PlantState&) {}  ///< s.payload is what really hangs there
  virtual void opening(PlantState&) {
  }  ///< command -> opening, every cylinder; s.opening is preset to the command
  virtual void flow(PlantState&) {}   ///< opening -> flow; flow is preset by the valve's gain
  virtual void drift(PlantState&) {}  ///< s.drift += ...
  virtual void posture(PlantState&) {
  }  ///< s.q_load += ...; uses the joint loads of the step before
  virtual void force(PlantState&, BodyForces&) {}  ///< force += ...
  virtual void return_line(PlantState&) {}         ///< return_pressure += ...
  virtual void pilot(PlantState&) {}               ///< pilot_pressure
  virtual void demand(PlantState&) {}              ///< line_drop, margin, asked
  virtual void pump(PlantState&) {}                ///< pressure of pumps, preset to the demand
  virtual void sensors(const PlantState&, SensorState&) {}
  virtual void recording(Recording&, Random&) {}  ///< delays, stuck values
  virtual bool needs_inertia() const { return false; }
  virtual double lever_deadband(int /*cylinder*/, int /*side*/) const {
    return 0.0;
  }                                                             ///< operator jumps over it
  virtual std::vector<HiddenParameter> parameters() const = 0;  ///< after the run
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
  bool (*fits)(const Machine&, int) = nullptr;  ///< nullptr: everywhere
};

/// The tables, one a file.
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
    2e-3;  ///< [m/s] equivalents count samples that move, as the error measures do

/// Area that turns a force into a pressure; of a drive without hydraulics a usual one. [m^2]
inline double drive_area(const Cylinder& c) { return c.hydraulic() ? c.area_piston() : 0.01; }
/// Machines an effect can be hidden in: by cylinder `i`, by pump `p`.
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
