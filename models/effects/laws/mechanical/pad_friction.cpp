#include <cmath>

#include "models/effects/builtin.h"
#include "models/machine/kinematics.h"
#include "models/math/jet.h"

namespace sparflow {
namespace {

/// [N m] This rounds |moment| where the moment changes sign; moments are of the order of kN m.
/// @threshold [N m] 0..1000; numerical: a per cent of usual moments
constexpr double kRounding = 10.0;

/// Distance of a sliding joint's frame from its parent's; the guide lies somewhere along it. [m]
double guide_length(const Machine& machine, int joint) {
  return machine.joints[static_cast<std::size_t>(joint)].origin.translation().norm();
}

/// Bending moment of everything that slides with `joint` about a point of its guide, across the sliding
/// direction. [N m], >= 0
/// @param back [m] the point's distance behind the joint's frame at zero travel
template <class T>
T bending_moment(const Instant<T>& s, int joint, double back) {
  using std::sqrt;
  const Machine& machine = *s.machine;
  const auto k = static_cast<std::size_t>(joint);
  const Eigen::Matrix<T, Eigen::Dynamic, 1> q =
      Eigen::Map<const Eigen::Matrix<T, Eigen::Dynamic, 1>>(s.q.data(),
                                                            static_cast<Eigen::Index>(s.q.size()));
  const std::vector<Frame<T>> frames = forward_kinematics<T>(machine, q);
  const Vector3<T> axis = frames[k].rotation * machine.joints[k].axis.cast<T>();
  const Vector3<T> pads = frames[k].position - axis * (q[joint] + T(back));
  const Vector3<T> gravity = machine.gravity.cast<T>();
  Vector3<T> moment = Vector3<T>::Zero();
  const auto carry = [&](double mass, const Vector3<T>& p) {
    moment += (p - pads).cross(gravity).eval() * T(mass);
  };
  for (const Link& link : machine.links) {
    if (link.slides_with == joint) {
      carry(link.mass,
            point_in_base(frames, link.joint, link.cog) + axis * (T(link.fraction) * q[joint]));
    } else if (link.joint >= joint) {
      Vector3<T> p = point_in_base(frames, link.joint, link.cog);
      if (link.slides_with >= 0) {
        const auto m = static_cast<std::size_t>(link.slides_with);
        p += (frames[m].rotation * machine.joints[m].axis.cast<T>()).eval() *
             (T(link.fraction) * q[link.slides_with]);
      }
      carry(link.mass, p);
    }
  }
  if (s.payload > 0.0 && machine.tip.joint >= joint) {
    carry(s.payload, point_in_base(frames, machine.tip.joint, machine.tip.xyz));
  }
  moment -= (axis * axis.dot(moment)).eval();
  return sqrt(moment.dot(moment) + T(kRounding * kRounding)) - T(kRounding);
}

class PadFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "pad_friction",
        .title = "telescope pad friction",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters = {{"mu_by_spacing",
                        "1/m",
                        1.0,
                        0.0,
                        2.0,
                        0.1,
                        "friction coefficient (both pads together) per distance of the pads",
                        true,
                        {}},
                       {"back",
                        "m",
                        1.0,
                        0.0,
                        20.0,
                        0.0,
                        "distance of the loaded pad behind the joint's frame at zero travel",
                        false,
                        {0.0, 1.0, 2.0, 4.0}}},
        .equation = "F = F_static + mu_by_spacing |bending moment about the pad| sign(v)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"coulomb_friction", "load_friction"},
        .separated_by = "extending and retracting over the whole reach at two luffing angles",
        .citation =
            "statics of a guided beam with Coulomb friction at its pads (C. A. Coulomb 1785)",
        .form_error = 0.1,
        .in_motion = "force"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    std::vector<int> sliding;
    for (int i = 0; i < machine.cylinder_count(); ++i) {
      const int j = machine.cylinders[static_cast<std::size_t>(i)].joint;
      const bool carried =
          j > 0 && machine.joints[static_cast<std::size_t>(j)].type == JointType::kPrismatic;
      if (carried) sliding.push_back(i);
    }
    return sliding;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  std::vector<double> grid(const MachineSeries& log, int at, int) const override {
    const int joint = log.machine->cylinders[static_cast<std::size_t>(at)].joint;
    const double length = guide_length(*log.machine, joint);
    /// Length of a guide below which its place is not searched.
    /// @threshold [m] 0..1; chosen: the pads' lever then changes by less than their own length
    constexpr double kShortestGuide = 0.05;
    if (length < kShortestGuide) return {0.0};
    return {0.0, 0.25 * length, 0.5 * length, 0.75 * length, length};
  }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    if (p[0] == 0.0 || s.side[i] == 0) return;
    const int joint = s.machine->cylinders[i].joint;
    out[i] += (p[0] * s.side[i]) * bending_moment(s, joint, p[1]);
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_pad_friction() { return std::make_unique<PadFriction>(); }

}  // namespace sparflow
