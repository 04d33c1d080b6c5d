#include <algorithm>

#include "models/effects/builtin.h"
#include "models/effects/memory.h"

namespace sparflow {
namespace {

/// Positions late by d: q_log(t) = q(t - d), so the force carried now is that of the pose logged d later,
/// F_static(q_log(t + d)), and the logged speed is that of d ago. Forces late: the measured force is that of d ago.
class SensorDelay final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "sensor_delay",
        .title = "positions and pressures are not of the same instant",
        .stage = EffectStage::kSensor,
        .place = EffectPlace::kMachine,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.7,
                        1.35,
                        1.0,
                        "share of the shift that is seen, about 1",
                        true,
                        {}},
                       {"delay",
                        "ms",
                        1e-3,
                        0.0,
                        0.5,
                        0.1,
                        "age of the late channels",
                        false,
                        {0.015, 0.025, 0.04, 0.06, 0.08, 0.1, 0.13, 0.16, 0.2, 0.25, 0.32}},
                       {"late",
                        "-",
                        1.0,
                        -1.0,
                        1.0,
                        1.0,
                        "1 positions are late, -1 forces or pressures are late",
                        false,
                        {1.0, -1.0},
                        true}},
        .equation =
            "F(t) = F_static(t + late delay); positions late: dx/dt logged is that of delay ago",
        .signals = {"cylinder force or both chamber pressures", "position",
                    "command, for the flow"},
        .confused_with = {"inertia", "viscous_friction", "valve_lag"},
        .separated_by =
            "reversals at several speeds: a delay follows the speed times the slope of "
            "the static force, inertia the acceleration",
        .citation = "Ljung (1999), System Identification, on unknown time delays",
        .form_error = 0.05,
        .in_motion = "nothing: the log is late, not the machine"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kForce, EvidenceKind::kFlow, EvidenceKind::kPump};
  }

  bool columns(const MachineSeries& log, EvidenceKind kind, int index, int,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const bool positions = shape[1] > 0.0;
    if (kind == EvidenceKind::kPump)
      return !positions && switching_late(log, static_cast<std::size_t>(index), shape[0], columns);
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(index)];
    const double shift = positions ? -shape[0] : shape[0];
    if (kind == EvidenceKind::kForce) {
      columns = delayed(log, c.static_force, shift) - c.static_force;
      return true;
    }
    if (kind != EvidenceKind::kFlow || !positions) return false;
    columns = c.speed - delayed(log, c.speed, shift);
    return true;
  }

 private:
  /// Pump and chambers are late together, but not the commands that choose what a pump follows: it seems to follow
  /// the choice of `delay` ago.
  static bool switching_late(const MachineSeries& log, std::size_t pump, double delay,
                             Eigen::MatrixXd& columns) {
    const Eigen::VectorXd& demand = log.pumps[pump].demand;
    if (demand.size() == 0) return false;
    columns = delayed(log, demand, delay) - demand;
    for (const auto& [first, last] : log.runs) {
      Eigen::Index before = first;
      for (Eigen::Index k = first; k < last; ++k) {
        while (before < k && log.time[before] < log.time[k] - delay) ++before;
        bool switched = false;
        for (const int i : log.machine->pumps[pump].feeds) {
          const Eigen::VectorXi& d = log.cylinders[static_cast<std::size_t>(i)].direction;
          for (Eigen::Index j = std::max(first, before - 1); j < k; ++j)
            switched = switched || d[j] != d[k];
        }
        if (!switched) columns(k, 0) = 0.0;
      }
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_sensor_delay() { return std::make_unique<SensorDelay>(); }

}  // namespace sparflow
