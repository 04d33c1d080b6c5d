#include <type_traits>

#include "models/effects/builtin.h"
#include "models/machine/inertial_derivatives.h"
#include "models/machine/inertial_torque.h"
#include "models/math/jet.h"

namespace sparflow {
namespace {

/// [-] Masses are known to a few per cent and inertias to a factor; a scale below an eighth has another cause (a
/// structure that oscillates).
/// @threshold [1] 0..1; chosen: a structure that oscillates explains smaller scales
constexpr double kLeastShare = 0.125;

class Inertia final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "inertia",
        .title = "inertial forces",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kMachine,
        .parameters = {{"scale",
                        "-",
                        1.0,
                        kLeastShare,
                        2.5,
                        1.0,
                        "1: the machine file's masses and inertias",
                        true,
                        {}}},
        .equation = "F = F_static + scale (M(q) qdd + C(q, qd) qd) / (dx/dq)",
        .signals = {"cylinder force or both chamber pressures", "position",
                    "sampling fast enough for accelerations"},
        .confused_with = {"sensor_delay", "viscous_friction"},
        .separated_by = "the same stroke at three accelerations",
        .citation =
            "Luh, Walker, Paul (1980), J. Dyn. Syst. Meas. Control 102(2); Craig (2005), "
            "Introduction to Robotics, sec. 6.5",
        .form_error = 0.03,
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool columns_filtered() const override { return true; }
  double inertial_share(std::span<const double> p) const override { return p[0]; }

  template <class T>
  void add_force_law(const Instant<T>& s, int, std::span<const double> p, std::span<T> out) const {
    if (p[0] == 0.0) return;
    using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;
    if constexpr (std::is_same_v<T, Jet>) {
      const std::vector<Jet> fast =
          inertial_torque_of_variables(*s.machine, s.q, s.qd, s.qdd, s.payload);
      if (!fast.empty()) {
        for (std::size_t i = 0; i < out.size(); ++i)
          out[i] +=
              p[0] * fast[static_cast<std::size_t>(s.machine->cylinders[i].joint)] / s.rate[i];
        return;
      }
    }
    const auto n = static_cast<Eigen::Index>(s.q.size());
    const Vector torque = inertial_torque<T>(*s.machine, Eigen::Map<const Vector>(s.q.data(), n),
                                             Eigen::Map<const Vector>(s.qd.data(), n),
                                             Eigen::Map<const Vector>(s.qdd.data(), n), s.payload);
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] += p[0] * torque[s.machine->cylinders[i].joint] / s.rate[i];
    }
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_inertia() { return std::make_unique<Inertia>(); }

}  // namespace sparflow
