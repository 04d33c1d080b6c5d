#include <algorithm>
#include <cmath>
#include <vector>

#include "models/effects/builtin.h"
#include "models/effects/memory.h"
#include "models/effects/valve_flow.h"

namespace sparflow {
namespace {

// no threshold: upper bound of a number in a file
constexpr double kMostJoints = 30.0;  ///< The parameter `late` numbers joints up to here.

/// With positions late by d, q_log(t) = q(t - d), the force at t is that of the pose logged d later,
/// F_static(q_log(t + d)), and the logged speed is that at t - d. With one position late this holds for that joint
/// alone. With forces late the measured force is that at t - d.
class SensorDelay final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "sensor_delay",
        .title = "sensor delay",
        .stage = EffectStage::kSensor,
        .place = EffectPlace::kMachine,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.75,
                        1.5,
                        1.0,
                        "share of the shift that shows in the log, about 1",
                        true,
                        {}},
                       {"delay",
                        "ms",
                        1e-3,
                        0.0,
                        0.5,
                        0.1,
                        "delay of the late channels",
                        false,
                        {0.015, 0.025, 0.04, 0.06, 0.08, 0.1, 0.13, 0.16, 0.2, 0.25, 0.32}},
                       {"late",
                        "-",
                        1.0,
                        -1.0,
                        kMostJoints + 1.0,
                        1.0,
                        "1: all positions are late; -1: forces or pressures are late; 2, 3 ...: "
                        "only the position of the first, second ... joint is late",
                        false,
                        {1.0, -1.0},
                        true,
                        false,
                        {"all positions", "forces or pressures"}}},
        .equation =
            "F(t) = F_static(t + late delay); positions late: dx/dt logged at t is that at t - "
            "delay",
        .signals = {"cylinder force or both chamber pressures", "position",
                    "command, for the flow"},
        .confused_with = {"inertia", "viscous_friction", "valve_lag"},
        .separated_by =
            "reversals at several speeds: a delay acts in proportion to speed times slope of "
            "the static force, inertia to acceleration",
        .citation = "Ljung (1999), System Identification, on unknown time delays",
        .form_error = 0.05,
        .in_motion = "nothing: the delay is the sensor's, not the machine's"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kForce, EvidenceKind::kFlow, EvidenceKind::kPump};
  }

  std::vector<double> grid(const MachineSeries& log, int at, int shape_index) const override {
    std::vector<double> values = Effect::grid(log, at, shape_index);
    const Eigen::Index joints = log.q.cols();
    if (shape_index == 0 || joints < 2) return values;
    for (Eigen::Index k = 0; k < joints; ++k) values.push_back(2.0 + static_cast<double>(k));
    return values;
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const bool positions = shape[1] > 0.0;
    const auto alone = static_cast<Eigen::Index>(std::lround(shape[1])) - 2;  // < 0: all
    if (measured.kind == EvidenceKind::kPump)
      return !positions &&
             switching_late(log, static_cast<std::size_t>(measured.index), shape[0], columns);
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(measured.index)];
    const double shift = positions ? -shape[0] : shape[0];
    if (measured.kind == EvidenceKind::kForce) {
      if (alone >= 0) return pose_late_in_one(log, c, alone, shape[0], columns);
      columns = delayed(log, c.static_force, shift) - c.static_force;
      return true;
    }
    if (measured.kind != EvidenceKind::kFlow || !positions) return false;
    const int joint = log.machine->cylinders[static_cast<std::size_t>(measured.index)].joint;
    if (alone >= 0 && joint != alone) return false;
    return speed_late(log, measured, shape[0], columns);
  }

 private:
  /// The logged speed is that of `delay` ago, and thus follows the command of then. The column is made of the command and not
  /// of the speed that it is to explain: with a share s the latter would be compared as (1 - s) v(t) + s v(t + delay), a mean
  /// that smooths noise and oscillations away, so that the likelihood would favour half a delay whether anything is late or not.
  static bool speed_late(const MachineSeries& log, const MeasuredQuantity& measured, double delay,
                         Eigen::MatrixXd& columns) {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(measured.index)];
    const Eigen::VectorXd& opening = c.reached.size() > 0   ? c.reached
                                     : c.opening.size() > 0 ? c.opening
                                                            : c.command;
    if (opening.size() == 0) return false;
    columns = late_flow(
        log, measured.index, opening,
        [&](const Eigen::VectorXd& x) { return delayed(log, x, delay); }, measured.sections);
    return true;
  }

  /// The delay of one position acts to first order, because an angle 0.2 s late is wrong by some hundredths [rad].
  static bool pose_late_in_one(const MachineSeries& log, const CylinderSeries& c,
                               Eigen::Index joint, double delay, Eigen::MatrixXd& columns) {
    if (joint >= c.static_slope.cols()) return false;
    const Eigen::VectorXd q = log.q.col(joint);
    columns = c.static_slope.col(joint).cwiseProduct(delayed(log, q, -delay) - q);
    return true;
  }

  /// Pressures of pump and chambers are equally late, but the commands that decide which cylinders demand flow are not: the
  /// logged pump pressure follows the commands of `delay` ago.
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
