#pragma once
/// A physical effect that a model may lack: what it is called, what it does, and where. One file an effect, one
/// line in registry.cpp; fit, compare, diagnose, optimise, pages and help all work from this interface.
///
/// Signs. A force effect adds to the force the cylinder must carry (measured force = static force + effects;
/// friction while extending is positive). A pressure effect adds to a chamber, a pump effect to the pump.
#include <Eigen/Dense>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "models/effects/series.h"
#include "models/machine/machine.h"
#include "models/math/jet.h"

namespace sparflow {

enum class EffectStage { kForce, kFlow, kPressure, kPump, kSensor };
enum class EffectPlace { kMachine, kJoint, kCylinder, kPump };
const char* effect_stage_name(EffectStage stage);  ///< "force" ...

struct EffectParameter {
  std::string name;
  std::string unit;      ///< as shown and read, "bar/(l/min)^2"
  double si = 1.0;       ///< SI value = shown value * si
  double lower, upper;   ///< [SI] beyond these a value is not plausible
  double typical = 0.0;  ///< [SI] of a clear effect
  std::string meaning;
  /// Whether the effect is proportional to it. One that is not is searched over `grid` (then refined).
  bool linear = true;
  std::vector<double> grid;  ///< [SI] empty for linear ones
  bool choice = false;  ///< the grid's values name variants of the law: nothing lies between them
  /// Of linear ones: the effect is whole without it, and a search pays for it only where it says something.
  bool optional = false;
};

struct EffectInfo {
  std::string id;
  std::string title;  ///< "Coulomb friction"
  EffectStage stage = EffectStage::kForce;
  EffectPlace place = EffectPlace::kCylinder;
  std::vector<EffectParameter> parameters;  ///< linear ones first
  std::string equation;                     ///< one line of text
  std::vector<std::string> signals;         ///< what a log must hold, in words: "chamber pressures"
  std::vector<std::string> confused_with;   ///< ids or words
  /// Id of the plainer effect that this one contains; that one is tried first.
  std::string refines = {};
  std::string separated_by;  ///< the motion that tells them apart
  std::string citation;      ///< author (year), equation or chapter
  /// Share by which other published laws of the same effect differ in these parameters when both are fitted to the
  /// same data; part of every interval. Measured on simulated logs with other laws (bench/blind_test).
  double form_error = 0.02;
  /// What a motion's energy sees of it: "force", "pressure", "pump", "limit" or "nothing" with the reason.
  std::string in_motion;
};

/// One instant of a machine, T = double or Jet. By joint: q ...; by cylinder: the rest.
template <class T>
struct Instant {
  const Machine* machine = nullptr;
  double payload = 0.0;  ///< [kg]
  double oil = 40.0;     ///< [degC]
  std::vector<T> q, qd, qdd;
  std::vector<T> static_torque;  ///< [N m] or [N] by joint
  std::vector<T> length, rate;   ///< [m], dx/dq
  std::vector<T> speed;          ///< [m/s]
  std::vector<T> static_force;   ///< [N]
  std::vector<T> force;          ///< [N] with force effects, once they are added
  std::vector<int> side;         ///< +1 extends, -1 retracts, 0 rests
  std::vector<T> flow;           ///< [m^3/s] into the working chamber, >= 0
  std::vector<T> return_flow;    ///< [m^3/s] out of the other, >= 0
  std::vector<T> pressure;       ///< [Pa] working pressure
  std::vector<T> pump_flow;      ///< [m^3/s] by pump
  std::vector<T> pump_pressure;  ///< [Pa] by pump, before pump effects
  /// Cylinder that leads by pump, -1 = standby. The smooth law calls once for each candidate instead.
  std::vector<int> leader;
};

class Effect {
 public:
  virtual ~Effect() = default;
  virtual const EffectInfo& info() const = 0;

  /// Places of a machine where it can sit: indices of joints, cylinders or pumps, {-1} for the whole machine;
  /// empty when it cannot (pad friction without a telescope).
  virtual std::vector<int> places(const Machine& machine) const;

  // --- laws without memory; `p` holds the parameters [SI], results are added ---------------------------

  /// Effects that are another machine: masses, tilt. Derivatives then come with the machine.
  virtual bool changes_machine() const { return false; }
  virtual void change_machine(Machine& /*machine*/, int /*at*/,
                              std::span<const double> /*p*/) const {}

  /// Force on each cylinder. [N]
  virtual void add_force(const Instant<double>&, int, std::span<const double>,
                         std::span<double>) const {}
  virtual void add_force(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {}
  /// Working pressure of each moving cylinder, seen at the cylinder and by the pump. [Pa]
  virtual void add_pressure(const Instant<double>&, int, std::span<const double>,
                            std::span<double>) const {}
  virtual void add_pressure(const Instant<Jet>&, int, std::span<const double>,
                            std::span<Jet>) const {}
  /// Return chamber of each moving cylinder. What of it reaches the supply the cylinder's learned pressure says
  /// (models/hydraulics/return_rise.h). [Pa]
  virtual void add_return(const Instant<double>&, int, std::span<const double>,
                          std::span<double>) const {}
  virtual void add_return(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {
  }
  /// What a cylinder asks of its pump beyond working pressure and margin. [Pa]
  virtual void add_demand(const Instant<double>&, int, std::span<const double>,
                          std::span<double>) const {}
  virtual void add_demand(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {
  }
  /// Pressure of each pump, after the maximum. [Pa]
  virtual void add_pump(const Instant<double>&, int, std::span<const double>,
                        std::span<double>) const {}
  virtual void add_pump(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {}

  /// Largest flow of pump `pump` that this effect leaves [m^3/s]; infinity = no say. A motion keeps below it.
  virtual double flow_limit(const Machine& /*machine*/, int /*pump*/, int /*at*/,
                            std::span<const double> /*p*/) const {
    return std::numeric_limits<double>::infinity();
  }

  /// What is left of a cylinder's command behind this effect of its valve (a dead band); [samples], [-], in place.
  virtual void shape_opening(int /*cylinder*/, int /*at*/, std::span<const double> /*p*/,
                             Eigen::VectorXd& /*opening*/) const {}

  /// Text (YAML) that defines a user's effect, so that a model file can carry it; empty: built in.
  virtual std::string definition() const { return {}; }

  // --- logs --------------------------------------------------------------------------------------------

  /// Kinds of evidence this effect can show in.
  virtual std::vector<EvidenceKind> shows_in() const = 0;
  /// What one unit (SI) of each linear parameter adds to the measured quantity `kind` of cylinder or pump
  /// `index`, not filtered. The default evaluates the laws above sample by sample.
  /// @param shape values of the nonlinear parameters, in their order
  /// @param columns [samples x linear parameters], resized; NaN where not valid
  /// @return false when the effect does not touch this quantity or the log lacks what it needs
  virtual bool columns(const MachineSeries& log, EvidenceKind kind, int index, int at,
                       std::span<const double> shape, Eigen::MatrixXd& columns) const;
  /// Values of the nonlinear parameter `shape_index` (counted among those) to search on this log [SI]. The
  /// default is the parameter's own grid; limits and thresholds depend on what the log reaches. Empty: the log
  /// lacks what the effect needs.
  virtual std::vector<double> grid(const MachineSeries& log, int at, int shape_index) const;
  /// Whether columns() are made of filtered derivatives alone (inertia) and must not be filtered again.
  virtual bool columns_filtered() const { return false; }
  /// Whether columns() hold readings as they are, with their noise: what is smoothed compares with them only after the
  /// same filter.
  virtual bool columns_of_readings() const { return false; }
};

/// Parameters of an effect that is part of a model.
struct AppliedEffect {
  const Effect* effect = nullptr;
  int at = -1;                 ///< joint, cylinder or pump as info().place says; -1 = machine
  std::vector<double> values;  ///< [SI] by parameter
  std::vector<double> lower95, upper95;           ///< [SI] intervals; empty = not known
  std::string key(const Machine& machine) const;  ///< "coulomb_friction:boom"
};

/// "id:at" or "id". @param at -1 = machine
std::string effect_key(const EffectInfo& info, const Machine& machine, int at);

}  // namespace sparflow

/// Gives a class that has `template <class T> void NAME_law(const Instant<T>&, int, std::span<const double>,
/// std::span<T>) const` both overloads of a law.
#define SPARFLOW_EFFECT_LAW(NAME)                                                               \
  void NAME(const Instant<double>& s, int at, std::span<const double> p, std::span<double> out) \
      const override {                                                                          \
    NAME##_law<double>(s, at, p, out);                                                          \
  }                                                                                             \
  void NAME(const Instant<Jet>& s, int at, std::span<const double> p, std::span<Jet> out)       \
      const override {                                                                          \
    NAME##_law<Jet>(s, at, p, out);                                                             \
  }
