#pragma once
/// Smooth law of the chain for a model with effects that act in a motion: power and pressure of all pumps as functions of
/// z = (q, qd) or (q, qd, qdd), with exact first and second derivatives by `Jet`. A model without such effects uses the
/// faster models/chain/smooth_power.h; the two laws agree when no effect adds anything.
///
/// A cylinder with a prescribed mode moves in one direction. For a free one the law from force to demand, effects
/// included, is evaluated in both directions with speed +-m, m = v tanh(v/eps), and
///   demand d = t^2 [w d+ + (1-w) d-],  t = tanh(v/eps), w = (1+t)/2;
/// flows are blended before, so that effects that sum over cylinders tend to the exact law. An effect on one cylinder may
/// depend on that cylinder's direction, not on those of others. Effects on a pump that depend on its load-sensing leader
/// are weighted by the shares of the soft maximum.
#include <memory>
#include <vector>

#include "models/chain/smooth_power.h"
#include "models/effects/instant.h"

namespace sparflow {

/// Evaluates the law; each thread needs its own object.
class SmoothEffects {
 public:
  /// @param model must outlive the object
  /// @throws InputError when the machine has more joints than `Jet` can hold (7 with accelerations, else 10)
  explicit SmoothEffects(const CraneModel& model);

  /// Whether a model has effects that need this law.
  static bool needed(const CraneModel& model);

  Smoothing smoothing;
  double oil = 40.0;  ///< [degC]

  /// Whether z contains accelerations, because an effect depends on them.
  bool uses_acceleration() const { return with_acceleration_; }
  int size() const { return n_ * (with_acceleration_ ? 3 : 2); }

  /// @param z [size] joint positions, velocities and, if used, accelerations  @param payload [kg]
  /// @param mode by cylinder  @param derivatives false: values alone, the results are constants
  /// @throws std::domain_error when a four-bar cannot close
  void evaluate(const double* z, double payload, const CylinderMode* mode, bool derivatives);

  const Jet& power() const { return power_; }  ///< [W]
  const Jet& pump_pressure(int p) const {
    return pressure_[static_cast<std::size_t>(p)];
  }  ///< [Pa]
  /// All quantities of the last evaluation; of a free cylinder those of its first direction.
  const Instant<Jet>& instant() const { return first_; }

 private:
  /// Quantities of a cylinder that do not depend on the direction being evaluated.
  struct Cylinder {
    CylinderMode mode = CylinderMode::kFree;
    bool demands = false;  ///< hydraulic, moving and fed by a load-sensing pump
    int side = 0;          ///< direction of the mode, or of the speed of a free cylinder
    bool both = false;     ///< the other direction has a share as well
    Jet share;             ///< of `side`
    Jet activity;          ///< t^2
    Jet size;              ///< m, smooth |v|
    Jet demand;            ///< [Pa]
    Jet lead;              ///< share in the soft maximum of its pump
  };
  void set_state(const double* z, double payload, const CylinderMode* mode, bool derivatives);
  void set_cylinder(std::size_t i);
  /// Evaluates force to demand with free cylinders in their first direction, or in the other one where it has a share.
  void evaluate_side(bool other);
  void add_demands();
  void soft_maximum(std::size_t pump);
  void pumps();
  /// What the effects add to a pump's pressure if `leader` is its load-sensing leader. [Pa]
  Jet pump_effects(std::size_t pump, int leader, Instant<Jet>& s);

  const CraneModel* model_;
  std::shared_ptr<const Machine> machine_;
  std::vector<AppliedEffect> laws_;
  int n_;
  bool with_acceleration_;
  StaticForce statics_;
  std::vector<int> pump_of_;
  std::vector<Cylinder> cylinders_;
  Instant<Jet> first_, other_;
  std::vector<Jet> added_, demand_first_, demand_other_, added_pump_, pressure_, standby_share_;
  Jet power_;
  bool any_both_ = false;
};

}  // namespace sparflow
