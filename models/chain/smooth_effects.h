#pragma once
/// The smooth twin of the exact chain for a model with effects that act in a motion: power and pressure of all
/// pumps as functions of z = (q, qd) or (q, qd, qdd), with exact first and second derivatives by `Jet`. A model without
/// such effects has the faster models/chain/smooth_power.h, whose law this is when no effect adds anything.
///
/// A cylinder whose mode is held is on one side. A free one is on both: the whole law from force to demand, effects
/// included, is evaluated for either side with speed +-m, m = v tanh(v/eps), and
///   demand d = t^2 [w d+ + (1-w) d-],  t = tanh(v/eps), w = (1+t)/2;
/// flows are blended before, so that effects that sum over cylinders tend to the exact law. An effect on one
/// cylinder may depend on that cylinder's side, not on the sides of others. Effects on a pump that look at its
/// leading cylinder are weighted by the soft maximum's shares.
#include <memory>
#include <vector>

#include "models/chain/smooth_power.h"
#include "models/effects/instant.h"

namespace sparflow {

/// A workspace, one a thread.
class SmoothEffects {
 public:
  /// @param model must outlive the object
  /// @throws InputError when the machine has more joints than `Jet` carries (7 with accelerations, else 10)
  explicit SmoothEffects(const CraneModel& model);

  /// Whether a model needs this law at all.
  static bool needed(const CraneModel& model);

  Smoothing smoothing;
  double oil = 40.0;  ///< [degC]

  /// Whether z holds accelerations: some effect depends on them.
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

 private:
  /// What does not depend on the side a free cylinder is on.
  struct Cylinder {
    CylinderMode mode = CylinderMode::kFree;
    bool demands = false;  ///< hydraulic, moving and fed by a load-sensing pump
    int side = 0;          ///< held, or the one the speed points to
    bool both = false;     ///< the other side has a share, too
    Jet share;             ///< of `side`
    Jet activity;          ///< t^2
    Jet size;              ///< m, smooth |v|
    Jet demand;            ///< [Pa]
    Jet lead;              ///< share in the soft maximum of its pump
  };
  void set_state(const double* z, double payload, const CylinderMode* mode, bool derivatives);
  void set_cylinder(std::size_t i);
  /// From force to demand with free cylinders on their first or (those that have one) other side.
  void evaluate_side(bool other);
  void add_demands();
  void soft_maximum(std::size_t pump);
  void pumps();
  /// What the effects add to a pump's pressure if that cylinder leads.
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
