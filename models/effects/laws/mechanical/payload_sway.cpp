#include "models/effects/builtin.h"
#include "models/effects/hanging_load/swing_state.h"
#include "models/effects/tip_motion.h"

namespace sparflow {
namespace {

/// A payload on a rope does not follow the tip at once: it is a spherical pendulum below an accelerated point, of any deflection. The
/// law is the difference to a payload that is fixed to the tip, which static forces and `inertia` have: it vanishes with the
/// rope's length.
class PayloadSway final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "payload_sway",
        .title = "sway of the payload",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kMachine,
        .parameters =
            {{"share",
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
              {0.3, 0.4, 0.5, 0.63, 0.8, 1.0, 1.26, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.3, 8.0, 10.0}},
             {"damping",
              "-",
              1.0,
              0.005,
              0.5,
              0.02,
              "damping ratio of the free sway",
              false,
              // A wider peak than a weight without damping has: the search over ropes meets it.
              {0.06}}},
        .equation =
            "F = F_static + J^T share payload rope n'', n'' = G - n (n G + |n'|^2) - "
            "2 damping n' (g/rope)^0.5, G = (g - a_tip) / rope; n = unit vector from tip to "
            "payload, whose acceleration is a_tip + rope n''",
        .signals = {"cylinder force or both chamber pressures", "position", "payload"},
        .confused_with = {"inertia", "structural_flex"},
        .separated_by =
            "a stop after a move with a payload: the force goes on swinging with the "
            "pendulum's period",
        .citation =
            "Abdel-Rahman, Nayfeh, Masoud (2003), Dynamics and control of cranes: a review, "
            "J. Vib. Control 9, sec. 2",
        .form_error = 0.02,
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
  /// The state of the load where the log begins and after each change of payload.
  int values_from_measurement(const MachineSeries& log) const override {
    return 4 * swinging_part_count(log);
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kForce) return false;
    const auto cylinder = static_cast<std::size_t>(measured.index);
    const Machine& machine = *log.machine;
    const int joint = machine.cylinders[cylinder].joint;
    if (joint > machine.tip.joint) return false;
    const TipMotion computed = log.tip.acceleration.rows() > 0 ? TipMotion() : tip_motion(log);
    const TipMotion& tip = log.tip.acceleration.rows() > 0 ? log.tip : computed;
    const std::vector<LoadPart> parts = swinging_parts(log, tip, shape[0], shape[1]);
    const Eigen::MatrixX3d pull =
        pull_of_hanging_weight(log, tip.acceleration, shape[0], shape[1], parts);
    columns =
        tip.jacobian.middleCols<3>(Eigen::Index{3} * joint).cwiseProduct(pull).rowwise().sum();
    columns.col(0).array() *=
        machine.tip.payload_scale * log.payload.array() / log.cylinders[cylinder].rate.array();
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_payload_sway() { return std::make_unique<PayloadSway>(); }

}  // namespace sparflow
