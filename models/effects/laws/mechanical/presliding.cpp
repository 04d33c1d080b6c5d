#include <algorithm>
#include <cmath>

#include "models/effects/builtin.h"

namespace sparflow {
namespace {

/// Friction by P. Dahl (1968), dF/dx = (Fc - F sign(v)) / distance, integrated exactly over a step of one direction.
/// After a reversal the force takes some distance to reach its full value with the other sign; without reversals it is
/// Fc sign(v).
class Presliding final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "presliding",
        .title = "presliding friction (Dahl)",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters =
            {{"Fc", "N", 1.0, 0.0, 100e3, 8e3, "friction force in full sliding", true, {}},
             {"distance",
              "mm",
              1e-3,
              0.2e-3,
              50e-3,
              4e-3,
              "travel after a reversal by which 1 - 1/e (63 %) of the change of force is done",
              false,
              {1e-3, 2e-3, 4e-3, 8e-3, 16e-3}}},
        .equation = "F = F_static + z, dz/dx = (Fc - z sign(v)) / distance",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"coulomb_friction", "stribeck_friction"},
        .refines = "coulomb_friction",
        .separated_by = "small reversals, and full strokes for comparison",
        .citation =
            "P. R. Dahl (1968), A solid friction model, Aerospace Corporation TOR-0158; "
            "Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE TAC 40(3)",
        .form_error = 0.3,
        .in_motion = "force: as Coulomb friction, since its memory lasts a few millimetres"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    out[i] += p[0] * s.side[i];
  }
  SPARFLOW_EFFECT_LAW(add_force)

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kForce || measured.index != at) return false;
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    columns.setZero(log.samples(), 1);
    for (const auto& [first, last] : log.runs) {
      double state =
          0.0;  // The state before the run is unknown; its influence decays within a few distances.
      double before = std::nan("");
      for (Eigen::Index k = first; k < last; ++k) {
        const double x = c.length[k];
        if (std::isfinite(x)) {
          if (std::isfinite(before) && x != before) {
            const double target = x > before ? 1.0 : -1.0;
            state = target + (state - target) * std::exp(-std::abs(x - before) / shape[0]);
          }
          before = x;
        }
        columns(k, 0) = state;
      }
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_presliding() { return std::make_unique<Presliding>(); }

}  // namespace sparflow
