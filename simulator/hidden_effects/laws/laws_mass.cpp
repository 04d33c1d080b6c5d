/// Hidden effects: masses, direction of gravity and postures that differ from the machine file.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/machine/kinematics.h"
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Vector [m] from a joint to the next one (or the tip), in the joint's frame.
Eigen::Vector3d bone(const Machine& machine, int joint) {
  const auto next = static_cast<std::size_t>(joint) + 1;
  Eigen::Vector3d d = Eigen::Vector3d::Zero();
  if (next < machine.joints.size()) d = machine.joints[next].origin.translation();
  if (next == machine.joints.size() && machine.tip.joint == joint) d = machine.tip.xyz;
  const Joint& own = machine.joints[static_cast<std::size_t>(joint)];
  if (d.norm() < 1e-6 && own.type == JointType::kPrismatic) d = own.axis;
  if (d.norm() < 1e-6) d = Eigen::Vector3d::UnitX();
  return d;
}

/// Unit vector across a link in the plane in which its joint, or of a sliding one the joint before, turns it.
Eigen::Vector3d across(const Machine& machine, int joint) {
  const Joint& own = machine.joints[static_cast<std::size_t>(joint)];
  Eigen::Vector3d axis = own.axis;
  if (own.type == JointType::kPrismatic)
    axis = joint > 0 ? (own.origin.linear().transpose() *
                        machine.joints[static_cast<std::size_t>(joint) - 1].axis)
                           .eval()
                     : Eigen::Vector3d::Zero().eval();
  const Eigen::Vector3d d = axis.cross(bone(machine, joint));
  return d.norm() > 1e-6 ? d.normalized() : Eigen::Vector3d::Zero().eval();
}

double mass_beyond(const Machine& machine, int joint) {
  double mass = 0.0;
  for (const Link& l : machine.links)
    if (l.joint >= joint || l.slides_with >= joint) mass += l.mass;
  return std::max(mass, 20.0);
}

/// A joint's axis in the base frame with every joint in the middle of its range.
Eigen::Vector3d axis_in_base(const Machine& machine, int joint) {
  Eigen::VectorXd q(machine.joint_count());
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Range r = machine.joints[static_cast<std::size_t>(k)].position;
    q[k] = 0.5 * (r.lo + r.hi);
  }
  return forward_kinematics<double>(machine, q)[static_cast<std::size_t>(joint)].rotation *
         machine.joints[static_cast<std::size_t>(joint)].axis;
}

/// Whether gravity loads a joint, which it does not on a vertical slewing axis that comes first.
bool feels_weight(const Machine& machine, int joint) {
  for (int k = 0; k <= joint; ++k) {
    const bool turns = machine.joints[static_cast<std::size_t>(k)].type == JointType::kRevolute;
    const Eigen::Vector3d axis = axis_in_base(machine, k);
    if (turns ? axis.cross(machine.gravity).norm() > 1e-3
              : std::abs(axis.dot(machine.gravity)) > 1e-3)
      return true;
  }
  return false;
}

/// First revolute joint with a horizontal axis, -1 = none.
int luffing_joint(const Machine& machine) {
  for (int k = 0; k < machine.joint_count(); ++k) {
    if (machine.joints[static_cast<std::size_t>(k)].type == JointType::kRevolute &&
        axis_in_base(machine, k).cross(machine.gravity).norm() > 1e-3)
      return k;
  }
  return -1;
}

class UnmodelledMass final : public HiddenLaw {
 public:
  explicit UnmodelledMass(LawContext& c) : joint_(c.at), law_(c.law) {
    const double reach = bone(*c.machine, c.at).norm();
    mass_ = c.size * c.draw(0.07, 0.12) * mass_beyond(*c.machine, c.at);
    cog_ = c.draw(0.25, 0.8) * std::max(reach, 0.5);
    if (law_ == 2) beside_ = c.random->sign() * c.draw(0.2, 0.5) * cog_;
  }
  void change_machine(Machine& machine) const override {
    const Eigen::Vector3d along = bone(machine, joint_).normalized();
    if (law_ != 1) {
      const Eigen::Vector3d centre = along * cog_ + across(machine, joint_) * beside_;
      machine.links.push_back({"hidden mass", joint_, mass_, centre});
    } else {  // Two parts with the same total mass and moment.
      machine.links.push_back({"hidden mass", joint_, 0.5 * mass_, along * (0.7 * cog_)});
      machine.links.push_back({"hidden mass", joint_, 0.5 * mass_, along * (1.3 * cog_)});
    }
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"mass", mass_, "kg", mass_},
            {"moment", mass_ * cog_, "kg m", mass_ * cog_},
            {"cross_moment", mass_ * beside_, "kg m", mass_ * beside_},
            {"cog", cog_, "m", cog_}};
  }

 private:
  int joint_, law_;
  double mass_, cog_;
  double beside_ = 0.0;  ///< [m] of the centre, from the line of the link
};

class PayloadError final : public HiddenLaw {
 public:
  explicit PayloadError(LawContext& c)
      : law_(c.law),
        mass_(c.size * c.random->sign() * c.draw(0.06, 0.20) * std::max(c.payload, 200.0)) {
    if (law_ == 1) mass_ = std::abs(mass_);
  }
  void payload(PlantState& s) override {
    s.payload += mass_;
    // Law 1: a grab or rope that the log does not contain, and a scale that reads 1 % too little.
    if (law_ == 1) s.payload += 0.01 * (s.payload - mass_);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"mass", mass_, "kg", mass_}};
  }

 private:
  int law_;
  double mass_;
};

class BaseTilt final : public HiddenLaw {
 public:
  explicit BaseTilt(LawContext& c)
      : law_(c.law),
        angle_(c.random->sign() * c.size * c.draw(1.0, 3.0) * kDegree),
        roll_(c.draw(-0.3, 0.3) * angle_) {
    axis_ = axis_in_base(*c.machine, luffing_joint(*c.machine)).normalized();
  }
  void change_machine(Machine& machine) const override {
    // Turning the base about +axis turns gravity about -axis in the base frame.
    machine.gravity = Eigen::AngleAxisd(-angle_, axis_) * machine.gravity;
    if (law_ == 1) {  // The ground is also inclined sideways a little.
      const Eigen::Vector3d forward = axis_.cross(machine.gravity).normalized();
      machine.gravity = Eigen::AngleAxisd(roll_, forward) * machine.gravity;
    }
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"angle", angle_, "rad", angle_}};
  }

 private:
  int law_;
  double angle_, roll_;
  Eigen::Vector3d axis_;
};

class AngleOffset final : public HiddenLaw {
 public:
  explicit AngleOffset(LawContext& c) : joint_(static_cast<std::size_t>(c.at)), law_(c.law) {
    const bool turns = c.joint().type == JointType::kRevolute;
    const double span = c.joint().position.hi - c.joint().position.lo;
    offset_ = c.random->sign() * c.size *
              (turns ? c.draw(0.8, 2.0) * kDegree : c.draw(0.01, 0.02) * span);
    middle_ = 0.5 * (c.joint().position.hi + c.joint().position.lo);
    span_ = span;
  }
  void sensors(const PlantState& s, SensorState& sensors) override {
    // True q = measured q + offset; law 1: the sensor also has a small gain error.
    const double away = law_ == 1 ? 0.1 * offset_ * (s.q[joint_] - middle_) / span_ : 0.0;
    sensors.q[joint_] -= offset_ + away;
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"offset", offset_, "rad or m", offset_}};
  }

 private:
  std::size_t joint_;
  int law_;
  double offset_, middle_, span_;
};

class StructuralFlex final : public HiddenLaw {
 public:
  explicit StructuralFlex(LawContext& c) : law_(c.law) {
    BodyForces bodies(*c.machine);
    JointLoads loads;
    std::vector<double> q;
    for (const Joint& j : c.machine->joints) q.push_back(0.5 * (j.position.lo + j.position.hi));
    bodies.gravity(q.data(), 0.5 * c.payload, loads);
    const int k = luffing_joint(*c.machine);
    const double typical = std::max(1e3, std::abs(loads.gravity[static_cast<std::size_t>(k)]));
    compliance_ = c.size * c.draw(0.8, 2.0) * kDegree / typical;
    for (const Joint& j : c.machine->joints) turns_.push_back(j.type == JointType::kRevolute);
    typical_ = typical;
  }
  void posture(PlantState& s) override {
    for (std::size_t k = 0; k < turns_.size(); ++k) {
      if (!turns_[k]) continue;
      const double torque = s.gravity[k];
      // Law 1: the stiffness is a tenth larger at the typical load.
      const double stiffening = law_ == 1 ? 1.0 + 0.1 * (1.0 - std::abs(torque) / typical_) : 1.0;
      s.q_load[k] -= compliance_ * torque * std::max(0.5, stiffening);
    }
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"kappa_first", compliance_, "rad/(N m)", compliance_},
            {"kappa_rest", compliance_, "rad/(N m)", compliance_}};
  }

 private:
  int law_;
  double compliance_, typical_;
  std::vector<bool> turns_;
};

bool luffs(const Machine& machine, int) { return luffing_joint(machine) >= 0; }
bool luffing(const Machine& machine, int joint) {
  return feels_weight(machine, joint) &&
         machine.joints[static_cast<std::size_t>(joint)].type == JointType::kRevolute;
}
bool has_weight(const Machine& machine, int) {
  return machine.gravity.norm() > 0.0 && luffing_joint(machine) >= 0;
}

}  // namespace

std::vector<LawEntry> mass_laws() {
  return {{"unmodelled_mass",
           HiddenPlace::kJoint,
           true,
           {"point mass along the link", "two parts with the same mass and moment",
            "point mass beside the link"},
           "mass [kg], moment = mass * cog [kg m], cog [m] along the link, cross_moment [kg m] "
           "beside it",
           make_law<UnmodelledMass>,
           feels_weight},
          {"payload_error",
           HiddenPlace::kMachine,
           true,
           {"constant at the tip", "gear not in the log plus a scale 1 % low"},
           "mass [kg] at the tip beyond payload_kg",
           make_law<PayloadError>,
           has_weight},
          {"base_tilt",
           HiddenPlace::kMachine,
           true,
           {"about the arm's horizontal axis", "with a little roll"},
           "angle [rad], positive turns the base about the first horizontal joint axis",
           make_law<BaseTilt>,
           luffs},
          {"angle_offset",
           HiddenPlace::kJoint,
           true,
           {"constant", "with a slight gain error"},
           "offset: true coordinate - measured [rad] or [m]",
           make_law<AngleOffset>,
           luffing},
          {"structural_flex",
           HiddenPlace::kMachine,
           true,
           {"linear in every revolute joint's torque", "slightly stiffening"},
           "kappa_first, kappa_rest [rad/(N m)]: posture of the bodies = q - kappa * torque",
           make_law<StructuralFlex>,
           luffs}};
}

}  // namespace sparflow::simulator
