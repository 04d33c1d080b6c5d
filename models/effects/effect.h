#pragma once
/// A physical effect that a model may lack: its names, its law and its places on a machine. Each effect has one file and
/// one line in registry.cpp; fit, compare, diagnose, optimise, pages and help all work from this interface.
///
/// Signs: a force effect adds to the force the cylinder must carry (measured force = static force + effects, so that
/// friction while extending is positive). A pressure effect adds to a chamber's pressure, a pump effect to the pump's.
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
  double lower, upper;   ///< [SI] bounds of plausible values
  double typical = 0.0;  ///< [SI] value at which the effect is clearly visible
  std::string meaning;
  /// Whether the effect is proportional to the parameter. One that is not is searched over `grid`, then refined.
  bool linear = true;
  std::vector<double> grid;  ///< [SI] empty for linear ones
  /// Whether the grid's values name variants of the law, between which no value has a meaning.
  bool choice = false;
  /// A parameter without which the effect is complete; a search adds it only where the log determines it. A nonlinear one is absent
  /// where it is zero; an effect has all of its optional nonlinear parameters or none, except those whose grid contains zero.
  bool optional = false;
  std::vector<std::string> variants =
      {};  ///< of a choice: the law with each value of `grid`, in words
};

/// Whether an optional parameter takes no part in an effect; no output names it then.
inline bool is_absent(const EffectParameter& p, double value) { return p.optional && value == 0.0; }

/// The variant of the law that a value of a choice names, in words; "" for every other parameter.
std::string variant_text(const EffectParameter& p, double value);

struct EffectInfo {
  std::string id;
  std::string title;  ///< "Coulomb friction"
  EffectStage stage = EffectStage::kForce;
  EffectPlace place = EffectPlace::kCylinder;
  std::vector<EffectParameter> parameters;  ///< linear ones first
  std::string equation;                     ///< one line of text
  std::vector<std::string> signals;  ///< what a log must contain, in words: "chamber pressures"
  std::vector<std::string> confused_with;  ///< ids or words
  /// Id of the simpler effect that this one contains as a special case; that one is tried first.
  std::string refines = {};
  std::string separated_by;  ///< the motion that distinguishes them
  std::string citation;      ///< author (year), equation or chapter
  /// [-] Share by which other published laws of the same effect differ in these parameters when both are fitted to
  /// the same data (model-form error); it widens every interval. Measured on simulated logs with other laws
  /// (bench/blind_test).
  double form_error = 0.02;
  /// Where it acts on a motion's energy: "force", "pressure", "pump", "limit" or "nothing" with the reason.
  std::string in_motion;
};

/// State of a machine at one instant, T = double or Jet. Vectors are by joint down to `static_torque`, then by cylinder
/// unless a pump is named.
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
  std::vector<T> force;          ///< [N] static force plus force effects, once these are added
  std::vector<int> side;         ///< +1 extends, -1 retracts, 0 rests
  std::vector<T> flow;           ///< [m^3/s] into the supply chamber, >= 0
  std::vector<T> return_flow;    ///< [m^3/s] out of the return chamber, >= 0
  std::vector<T> pressure;       ///< [Pa] working pressure
  std::vector<T> pump_flow;      ///< [m^3/s] by pump
  std::vector<T> pump_pressure;  ///< [Pa] by pump, before pump effects
  /// Load-sensing leader of each pump, -1 = standby. The smooth law evaluates once for each candidate instead.
  std::vector<int> leader;
};

class SectionPool;  // valve_flow.h

/// One measured quantity of a log: what `kind` says of cylinder or pump `index`.
struct MeasuredQuantity {
  EvidenceKind kind;
  int index;  ///< cylinder, or pump where the kind is one of the pump
  /// Linear parameters [SI] at which a signature holds that is not proportional to them; empty: at typical values.
  std::span<const double> about = {};
  /// Gathers the valve sections of several logs, which then have the same gains in all of them; null: of each log by itself.
  SectionPool* sections = nullptr;
};

class Effect {
 public:
  virtual ~Effect() = default;
  virtual const EffectInfo& info() const = 0;

  /// Places of a machine where the effect can act: indices of joints, cylinders or pumps, {-1} for the whole machine;
  /// empty where it cannot (pad friction without a telescope).
  virtual std::vector<int> places(const Machine& machine) const;

  // --- laws without memory; `p` holds the parameters [SI], results are added ---------------------------

  /// Whether the effect changes the machine (masses, tilt) instead of adding a law; its derivatives are then the
  /// machine's.
  virtual bool changes_machine() const { return false; }
  virtual void change_machine(Machine& /*machine*/, int /*at*/,
                              std::span<const double> /*p*/) const {}

  /// Adds to the force of each cylinder. [N]
  virtual void add_force(const Instant<double>&, int, std::span<const double>,
                         std::span<double>) const {}
  virtual void add_force(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {}
  /// Adds to the working pressure of each moving cylinder, and thereby to its demand on the pump. [Pa]
  virtual void add_pressure(const Instant<double>&, int, std::span<const double>,
                            std::span<double>) const {}
  virtual void add_pressure(const Instant<Jet>&, int, std::span<const double>,
                            std::span<Jet>) const {}
  /// Adds to the pressure in the return chamber of each moving cylinder; how much of it reaches the supply chamber
  /// follows from the cylinder's pressure model (models/hydraulics/return_rise.h). [Pa]
  virtual void add_return(const Instant<double>&, int, std::span<const double>,
                          std::span<double>) const {}
  virtual void add_return(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {
  }
  /// Adds to a cylinder's demand on its pump, beyond working pressure and margin. [Pa]
  virtual void add_demand(const Instant<double>&, int, std::span<const double>,
                          std::span<double>) const {}
  virtual void add_demand(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {
  }
  /// Adds to the pressure of each pump, after the maximum over its demands. [Pa]
  virtual void add_pump(const Instant<double>&, int, std::span<const double>,
                        std::span<double>) const {}
  virtual void add_pump(const Instant<Jet>&, int, std::span<const double>, std::span<Jet>) const {}

  /// Share of the machine's inertial forces that this effect stands for. [-]
  virtual double inertial_share(std::span<const double> /*p*/) const { return 0.0; }

  /// Largest flow that this effect permits pump `pump` [m^3/s], infinity = not limited; motions stay below it.
  virtual double flow_limit(const Machine& /*machine*/, int /*pump*/, int /*at*/,
                            std::span<const double> /*p*/) const {
    return std::numeric_limits<double>::infinity();
  }

  /// Changes a cylinder's command [samples, -] in place into the valve opening that this effect leaves (a dead band).
  virtual void shape_opening(int /*cylinder*/, int /*at*/, std::span<const double> /*p*/,
                             Eigen::VectorXd& /*opening*/) const {}

  /// Delays a cylinder's opening [samples, -], as a dead band leaves it, in place (a valve lag).
  virtual void delay_opening(const MachineSeries& /*log*/, int /*cylinder*/, int /*at*/,
                             std::span<const double> /*p*/, Eigen::VectorXd& /*opening*/) const {}
  /// Whether the rod speed that the effect leaves is that of CylinderSeries::reached: what shape_opening, delay_opening and passed_flow
  /// leave of the command is a product, and no sum of what each takes from the command alone.
  virtual bool acts_on_opening() const { return false; }

  /// Share of a valve's flow [samples, -] that the measured pressure drop over its edge passes; empty: no such law.
  /// The last argument is the pressure lost between valve and cylinder [samples, Pa], which is no drop over the edge; empty: nothing.
  virtual Eigen::VectorXd passed_flow(const MachineSeries& /*log*/, int /*cylinder*/, int /*at*/,
                                      std::span<const double> /*p*/,
                                      const Eigen::VectorXd& /*lost*/) const {
    return {};
  }
  /// Pressure lost between a cylinder's valve and the chamber whose pressure is measured [samples, Pa]; empty: none. The flows are
  /// those that the model's law of passed flows (CylinderSeries::passing) leaves.
  virtual Eigen::VectorXd lost_behind_valve(const MachineSeries& /*log*/, int /*cylinder*/,
                                            int /*at*/, std::span<const double> /*p*/) const {
    return {};
  }

  /// What a pump's pressure shows of a change of its demand [samples, Pa], which it follows late; empty: no such law.
  virtual Eigen::VectorXd followed_demand(const MachineSeries& /*log*/, int /*pump*/, int /*at*/,
                                          std::span<const double> /*p*/,
                                          const Eigen::VectorXd& /*change*/) const {
    return {};
  }

  /// What a pump's pressure loses when the pump delivers no more than `limit` [m^3/s], beside this law [samples, Pa, <= 0 as a rule];
  /// empty: the law knows no flow.
  virtual Eigen::VectorXd lost_at_flow_limit(const MachineSeries& /*log*/, int /*pump*/, int /*at*/,
                                             std::span<const double> /*p*/,
                                             double /*limit*/) const {
    return {};
  }

  /// Whether a variant of the law is only told against a reference log: a part of the model that is learned from the same log may
  /// have the same signature.
  /// The argument has the nonlinear parameters [SI].
  virtual bool needs_reference(std::span<const double> /*shape*/) const { return false; }

  /// YAML text that defines a user's effect, so that a model file can contain it; empty for built-in effects.
  virtual std::string definition() const { return {}; }

  // --- logs --------------------------------------------------------------------------------------------

  /// Evidence channels in which the effect can show.
  virtual std::vector<EvidenceKind> shows_in() const = 0;
  /// Signature of the effect: what one unit (SI) of each linear parameter adds to the measured quantity, not
  /// filtered. The default evaluates the laws above sample by sample.
  /// @param shape values of the nonlinear parameters, in their order
  /// @param columns [samples x linear parameters], resized; NaN where not valid
  /// @return false when the effect does not act on this quantity or the log lacks a channel it needs
  virtual bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
                       std::span<const double> shape, Eigen::MatrixXd& columns) const;
  /// What one unit of each linear parameter adds to the flow over the return edge of cylinder `at` while it moves, beside the flow of
  /// the rod; the learned laws of the chambers' pressures then give other pressures. [samples x linear parameters, m^3/s]
  /// @return false when the effect changes no such flow or the log lacks a channel it needs
  virtual bool return_edge_flow(const MachineSeries& /*log*/, int /*at*/,
                                std::span<const double> /*shape*/,
                                Eigen::MatrixXd& /*columns*/) const {
    return false;
  }
  /// Values of the nonlinear parameter `shape_index` (counted among the nonlinear ones) to search on this log [SI]. The
  /// default is the parameter's own grid; limits and thresholds depend on the range of the log. Empty: the log lacks
  /// what the effect needs.
  virtual std::vector<double> grid(const MachineSeries& log, int at, int shape_index) const;
  /// Whether columns() depend on the linear parameters (MeasuredQuantity::about): a secant, computed anew at the values found.
  virtual bool depends_on_size() const { return false; }
  /// Number of values that columns() take from the measured quantity itself, beside the parameters (states at the beginning of
  /// stretches of motion). A search counts each as a parameter.
  virtual int values_from_measurement(const MachineSeries& /*log*/) const { return 0; }
  /// Whether columns() are computed from filtered derivatives alone (inertia) and must not be filtered again.
  virtual bool columns_filtered() const { return false; }
  /// Whether columns() contain unfiltered measurements with their noise; they are comparable to filtered signals only
  /// after the same filter.
  virtual bool columns_of_readings() const { return false; }
};

/// An effect that is part of a model, with its place and parameters.
struct AppliedEffect {
  const Effect* effect = nullptr;
  int at = -1;                 ///< joint, cylinder or pump as info().place says; -1 = machine
  std::vector<double> values;  ///< [SI] by parameter
  std::vector<double> lower95, upper95;           ///< [SI] intervals; empty = not known
  Eigen::MatrixXd covariance = {};                ///< [SI] of the values; empty = not known
  std::string key(const Machine& machine) const;  ///< "coulomb_friction:boom"
};

/// Columns of what the masses that an effect changes add to a cylinder's inertial force, beside the static force that
/// Effect::columns() contain. They come from filtered accelerations and must not be filtered again. Empty: the effect changes no
/// machine, the quantity is no force, or the model has no inertial forces (MachineSeries::inertia).
/// @return [samples x linear parameters], [N] for each unit (SI) of a parameter; NaN where a pose or an acceleration is not known
Eigen::MatrixXd inertial_columns(const Effect& effect, const MachineSeries& log,
                                 const MeasuredQuantity& measured, int at);

/// "id:at" or "id". @param at -1 = machine
std::string effect_key(const EffectInfo& info, const Machine& machine, int at);

}  // namespace sparflow

// Gives a class that has `template <class T> void NAME_law(const Instant<T>&, int, std::span<const double>,
// std::span<T>) const` both overloads of a law.
#define SPARFLOW_EFFECT_LAW(NAME)                                                               \
  void NAME(const Instant<double>& s, int at, std::span<const double> p, std::span<double> out) \
      const override {                                                                          \
    NAME##_law<double>(s, at, p, out);                                                          \
  }                                                                                             \
  void NAME(const Instant<Jet>& s, int at, std::span<const double> p, std::span<Jet> out)       \
      const override {                                                                          \
    NAME##_law<Jet>(s, at, p, out);                                                             \
  }
