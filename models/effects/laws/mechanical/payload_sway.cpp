#include <cmath>

#include "models/effects/builtin.h"
#include "models/effects/memory.h"
#include "models/machine/kinematics.h"

namespace sparflow {
namespace {

/// A payload on a rope does not follow the tip at once. For small deflections its horizontal acceleration w is that of
/// the tip, a, through the second-order lag of a pendulum,
///   w'' / omega^2 + 2 zeta w' / omega + w = a,   omega^2 = g / rope,
/// and the machine accelerates it with payload * w instead of payload * a. The law is the difference to a payload that
/// is fixed to the tip, which `inertia` has: it vanishes with the rope's length.
class PayloadSway final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "payload_sway",
        .title = "sway of the payload",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kMachine,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.4,
                        1.6,
                        1.0,
                        "share of the logged payload that hangs on the rope, 1: all of it",
                        true,
                        {}},
                       {"rope",
                        "m",
                        1.0,
                        0.2,
                        20.0,
                        1.5,
                        "length from the tip to the payload's centre of mass",
                        false,
                        {0.3, 0.4, 0.5, 0.63, 0.8, 1.0, 1.26, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.3,
                         8.0, 10.0}},
                       {"damping",
                        "-",
                        1.0,
                        0.005,
                        0.5,
                        0.02,
                        "damping ratio of the free sway",
                        false,
                        {0.03}}},
        .equation =
            "F = F_static + J^T share payload (w - a_tip), w'' rope/g + 2 damping w' "
            "sqrt(rope/g) + w = a_tip (horizontal)",
        .signals = {"cylinder force or both chamber pressures", "position", "payload"},
        .confused_with = {"inertia", "structural_flex"},
        .separated_by =
            "a stop after a move with a payload: the force goes on swinging with the "
            "pendulum's period",
        .citation =
            "Abdel-Rahman, Nayfeh, Masoud (2003), Dynamics and control of cranes: a review, "
            "J. Vib. Control 9, sec. 2",
        .form_error = 0.1,
        .in_motion =
            "nothing: motions are planned for a payload that follows the tip; over a motion "
            "from rest to rest the sway takes up no work but its damping"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return machine.tip.joint < 0 || machine.gravity.norm() == 0.0 ? std::vector<int>{}
                                                                  : std::vector<int>{-1};
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool columns_filtered() const override { return true; }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kForce) return false;
    const auto cylinder = static_cast<std::size_t>(measured.index);
    const Machine& machine = *log.machine;
    const int joint = machine.cylinders[cylinder].joint;
    if (joint > machine.tip.joint) return false;
    Eigen::MatrixX3d lever(log.samples(), 3), acceleration(log.samples(), 3);
    tip_motion(log, joint, lever, acceleration);
    const double frequency = std::sqrt(machine.gravity.norm() / shape[0]);
    columns.setZero(log.samples(), 1);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::VectorXd a = acceleration.col(axis);
      const Eigen::VectorXd w = second_order_lag(log, a, frequency, shape[1]);
      columns.col(0).array() += lever.col(axis).array() * (w - a).array();
    }
    columns.col(0).array() *=
        machine.tip.payload_scale * log.payload.array() / log.cylinders[cylinder].rate.array();
    return true;
  }

 private:
  /// Rows: d tip / d q of the joint, and the tip's horizontal acceleration, both in the base frame.
  static void tip_motion(const MachineSeries& log, int joint, Eigen::MatrixX3d& lever,
                         Eigen::MatrixX3d& acceleration) {
    const Machine& machine = *log.machine;
    const int n = machine.joint_count();
    const Eigen::Vector3d down = machine.gravity.normalized();
    ChainGeometry chain(machine);
    Eigen::VectorXd q(n);
    std::vector<Eigen::Vector3d> jacobian(static_cast<std::size_t>(n));
    for (Eigen::Index row = 0; row < log.samples(); ++row) {
      q = log.q.row(row);
      chain.update(machine, q.data());
      const Eigen::Vector3d tip = chain.point(machine.tip.joint, machine.tip.xyz);
      Eigen::Vector3d a = Eigen::Vector3d::Zero();
      for (int k = 0; k < n; ++k) {
        Eigen::Vector3d& column = jacobian[static_cast<std::size_t>(k)];
        column = point_jacobian(chain, machine.tip.joint, tip, k);
        a += column * log.qdd(row, k);
        for (int i = 0; i <= k; ++i) {
          const double twice = i < k ? 2.0 : 1.0;
          a += point_hessian(chain, i, column) * (twice * log.qd(row, i) * log.qd(row, k));
        }
      }
      lever.row(row) = jacobian[static_cast<std::size_t>(joint)];
      acceleration.row(row) = a - down * down.dot(a);
    }
  }
};

}  // namespace

std::unique_ptr<Effect> make_payload_sway() { return std::make_unique<PayloadSway>(); }

}  // namespace sparflow
