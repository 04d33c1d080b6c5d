#pragma once
/// The exact law of the chain with its exact first derivatives: `Jet`s of the law that the optimiser smooths
/// (models/chain/smooth_effects.h), with the direction of each cylinder prescribed as it moves and the exact maximum of the
/// demands, so that nothing is smoothed. Derivatives do not exist where a cylinder comes to rest (its flow has a kink there, and
/// its pressure jumps) and where two demands are equal: there those of rest and of the first demand are given.
#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/chain/smooth_effects.h"
#include "models/effects/effective_machine.h"
#include "models/math/error.h"

namespace sparflow {

/// Evaluates the law; each thread needs its own object.
class ChainDerivatives {
 public:
  /// @param model must outlive the object
  /// @throws InputError when the machine has more joints than `Jet` can hold (7 with accelerations, else 10)
  explicit ChainDerivatives(const CraneModel& model);

  double oil = 40.0;  ///< [degC]

  /// @param joints motion of the joints  @param payload [kg]  @throws std::domain_error when a four-bar cannot close at q
  void evaluate(const JointState& joints, double payload);

  int joints() const { return n_; }
  /// Whether anything depends on accelerations; otherwise the Jets have no such variables.
  bool uses_acceleration() const { return law_.uses_acceleration(); }
  /// Values with derivatives in the order (q, qd) or (q, qd, qdd), each by joint. Its `pump_pressure` is that before effects on the
  /// pumps, as these see it; pump_pressure() has them.
  const Instant<Jet>& instant() const { return law_.instant(); }
  const Jet& pump_pressure(int p) const { return law_.pump_pressure(p); }  ///< [Pa] with effects
  const Jet& power() const { return law_.power(); }                        ///< [W]

 private:
  /// The model, if a Jet can hold the variables of its machine.
  static const CraneModel& that_fits(const CraneModel& model);

  int n_;
  Chain chain_;
  SmoothEffects law_;
  std::vector<CylinderMode> modes_;
  std::vector<double> z_;
};

inline const CraneModel& ChainDerivatives::that_fits(const CraneModel& model) {
  const int n = model.machine.joint_count(), without = Jet::kMax / 2;
  const bool inertia =
      sparflow::uses_acceleration(*effective_machine(model.machine, model.effects), model.effects);
  const int most = inertia ? Jet::kMax / 3 : without;
  if (n <= most) return model;
  throw InputError(
      {}, "joints",
      fmt::format("machine {} has {} joints; expected at most {} for derivatives{}; {}take "
                  "differences of the law's values",
                  model.machine.name, n, most, inertia ? " of a law with inertia" : "",
                  inertia && n <= without ? "remove what depends on accelerations, or " : ""));
}

inline ChainDerivatives::ChainDerivatives(const CraneModel& model)
    : n_(model.machine.joint_count()), chain_(model), law_(that_fits(model)) {
  law_.smoothing.pressure = 0.0;
  modes_.resize(model.cylinders.size());
  z_.resize(static_cast<std::size_t>(law_.size()));
}

inline void ChainDerivatives::evaluate(const JointState& joints, double payload) {
  chain_.oil = law_.oil = oil;
  const MachineState& state = chain_.evaluate(joints, payload);
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    const CylinderState& c = state.cylinders[i];
    modes_[i] = !c.moving       ? CylinderMode::kRest
                : c.speed > 0.0 ? CylinderMode::kExtend
                                : CylinderMode::kRetract;
  }
  const auto n = static_cast<std::ptrdiff_t>(n_);
  std::copy_n(joints.q, n, z_.begin());
  std::copy_n(joints.qd, n, z_.begin() + n);
  if (law_.uses_acceleration()) {
    if (joints.qdd != nullptr) {
      std::copy_n(joints.qdd, n, z_.begin() + 2 * n);
    } else {
      std::fill(z_.begin() + 2 * n, z_.end(), 0.0);
    }
  }
  law_.evaluate(z_.data(), payload, modes_.data(), true);
}

}  // namespace sparflow
