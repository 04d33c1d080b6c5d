#include <limits>

#include "models/effects/builtin.h"
#include "models/effects/memory.h"

namespace sparflow {
namespace {

/// Half the span of the difference that stands for the time derivative: near the middle of plausible delays
/// (20..200 ms), so that neither end is off by its curvature.
constexpr double kHalfSpan_s = 0.08;

Eigen::VectorXd time_derivative(const MachineSeries& log, const Eigen::VectorXd& x) {
  Eigen::VectorXd d =
      (delayed(log, x, -kHalfSpan_s) - delayed(log, x, kHalfSpan_s)) / (2.0 * kHalfSpan_s);
  for (const auto& [first, last] : log.runs) {  // no other side to look at near the ends
    for (Eigen::Index k = first; k < last; ++k) {
      if (log.time[k] - log.time[first] < kHalfSpan_s ||
          log.time[last - 1] - log.time[k] < kHalfSpan_s) {
        d[k] = std::numeric_limits<double>::quiet_NaN();
      }
    }
  }
  return d;
}

/// To first order in the delay d. Positions late: q_log(t) = q(t - d), so the force carried now is that of the
/// pose logged d later, F_static(q_log(t + d)) = F_static + d dF_static/dt; the logged speed is v - d dv/dt.
/// Pressures late: the measured force is that of d ago, F_static - d dF_static/dt; speeds are right.
class SensorDelay final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "sensor_delay",
        .title = "positions and pressures are not of the same instant",
        .stage = EffectStage::kSensor,
        .place = EffectPlace::kMachine,
        .parameters = {{"delay", "ms", 1e-3, 0.0, 0.5, 0.1, "age of the late channels", true, {}},
                       {"late",
                        "-",
                        1.0,
                        -1.0,
                        1.0,
                        1.0,
                        "1 positions are late, -1 forces or pressures are late",
                        false,
                        {1.0, -1.0}}},
        .equation =
            "F = F_static + late delay dF_static/dt; v = dx/dt - delay dv/dt where positions "
            "are late",
        .signals = {"cylinder force or both chamber pressures", "position",
                    "command, for the flow"},
        .confused_with = {"inertia", "viscous_friction", "valve_lag"},
        .separated_by =
            "reversals at several speeds: a delay follows the speed times the slope of "
            "the static force, inertia the acceleration",
        .citation =
            "first-order Taylor expansion in the delay; Ljung (1999), System "
            "Identification, on unknown time delays",
        .in_motion = "nothing: the log is late, not the machine"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kForce, EvidenceKind::kFlow};
  }

  bool columns(const MachineSeries& log, EvidenceKind kind, int index, int,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(index)];
    if (kind == EvidenceKind::kForce) {
      columns.resize(log.samples(), 1);
      columns.col(0) = shape[0] * time_derivative(log, c.static_force);
      return true;
    }
    if (kind != EvidenceKind::kFlow || !(shape[0] > 0.0)) return false;
    columns.resize(log.samples(), 1);
    columns.col(0) = -shape[0] * time_derivative(log, c.speed);
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_sensor_delay() { return std::make_unique<SensorDelay>(); }

}  // namespace sparflow
