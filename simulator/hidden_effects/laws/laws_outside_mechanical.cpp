/// Hidden effects outside the catalogue: structure, guides, load. The right verdict is "unknown".
#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

/// Boom on the oil spring of its cylinder: a lightly damped oscillator driven by the rod's acceleration.
class Vibration final : public HiddenLaw {
 public:
  explicit Vibration(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        hz_(c.draw(1.0, 2.2)),
        damping_(c.draw(0.03, 0.07)) {
    const Valve* valve = c.machine->valve_of_cylinder(c.at);
    const double speed = (valve && c.cylinder().hydraulic()
                              ? 0.5 * valve->max_flow_extend / c.cylinder().area_piston()
                              : 0.1);
    // A stop from half speed excites about this force.
    stiffness_ =
        c.size * c.draw(10.0, 20.0) * kBar * drive_area(c.cylinder()) / speed * kTwoPi * hz_;
  }
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = s.cylinders[at_];
    const double omega = kTwoPi * hz_;
    // Symplectic Euler integration, stable for omega h < 2.
    rate_ += s.h * (-omega * omega * deflection_ - 2.0 * damping_ * omega * rate_ - c.acceleration);
    deflection_ += s.h * rate_;
    double f = -stiffness_ * deflection_;
    if (law_ == 1)
      f *= std::min(1.0, 0.4 + std::abs(f) / (8.0 * kBar *
                                              drive()));  // Play in the pins reduces small forces.
    c.force += f;
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"frequency", hz_, "Hz", hz_}, {"stiffness", stiffness_, "N/m", stiffness_}};
  }

 private:
  double drive() const { return 0.02; }
  std::size_t at_;
  int law_;
  double hz_, damping_, stiffness_ = 0.0, deflection_ = 0.0, rate_ = 0.0;
};

/// Dent in the tube: friction over a part of the stroke.
class FrictionBump final : public HiddenLaw {
 public:
  explicit FrictionBump(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        force_(c.size * c.draw(12.0, 22.0) * kBar * drive_area(c.cylinder())) {
    const Joint& joint = c.machine->joints[static_cast<std::size_t>(c.cylinder().joint)];
    const double a = cylinder_length<double>(*c.machine, c.at, joint.position.lo);
    const double b = cylinder_length<double>(*c.machine, c.at, joint.position.hi);
    centre_ = a + (b - a) * c.draw(0.35, 0.65);
    width_ = std::abs(b - a) * c.draw(0.08, 0.14);
  }
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = s.cylinders[at_];
    const double x = (c.length - centre_) / width_;
    const double shape =
        law_ == 0 ? std::exp(-0.5 * x * x) : std::max(0.0, 1.0 - 0.5 * std::abs(x));
    c.force += force_ * shape * std::tanh(c.speed / 0.5e-3);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"F", force_, "N", force_},
            {"centre", centre_, "m", centre_},
            {"width", width_, "m", width_}};
  }

 private:
  std::size_t at_;
  int law_;
  double force_, centre_ = 0.0, width_ = 1.0;
};

/// Payload on a rope: a pendulum in the arm's plane, driven by the tip's acceleration.
class PayloadSwing final : public HiddenLaw {
 public:
  explicit PayloadSwing(LawContext& c)
      : machine_(c.machine),
        law_(c.law),
        rope_(c.draw(2.5, 6.0)),
        damping_(c.draw(0.01, 0.03)),
        share_(c.size),
        least_(0.4 * c.payload) {}
  void force(PlantState& s, BodyForces&) override {
    const Eigen::Map<const Eigen::VectorXd> q(s.q.data(), static_cast<Eigen::Index>(s.q.size()));
    const Eigen::Vector3d tip = tip_position<double>(*machine_, Eigen::VectorXd(q));
    if (!started_) {
      before_ = before2_ = tip;
      started_ = true;
    }
    const Eigen::Vector3d acceleration = (tip - 2.0 * before_ + before2_) / (s.h * s.h);
    before2_ = before_;
    before_ = tip;
    const double g = machine_->gravity.norm();
    const Eigen::Vector3d up = -machine_->gravity / std::max(g, 1e-6);
    const Eigen::Vector3d level = acceleration - up * acceleration.dot(up);
    // Small angles, in both horizontal directions.
    rate_ += s.h * (-swing_ * (g / rope_) - 2.0 * damping_ * std::sqrt(g / rope_) * rate_ -
                    level / rope_);
    swing_ += s.h * rate_;
    const double mass = std::max(s.payload, least_);
    // The rope pulls the tip sideways with m g times the angle, and downwards a little more while it swings fast.
    const Eigen::Vector3d down = law_ == 1
                                     ? Eigen::Vector3d(-up * rope_ * rate_.squaredNorm() * mass)
                                     : Eigen::Vector3d::Zero();
    const Eigen::Vector3d pull = share_ * (mass * g * swing_ + down);
    const Eigen::Matrix3Xd jacobian = point_jacobian_matrix(*machine_, Eigen::VectorXd(q),
                                                            machine_->tip.joint, machine_->tip.xyz);
    const Eigen::VectorXd torque = -jacobian.transpose() * pull;
    for (std::size_t i = 0; i < s.cylinders.size(); ++i)
      s.cylinders[i].force += torque[machine_->cylinders[i].joint] / s.cylinders[i].rate;
  }
  std::vector<HiddenParameter> parameters() const override { return {{"rope", rope_, "m", rope_}}; }

 private:
  const Machine* machine_;
  int law_;
  double rope_, damping_, share_, least_;
  Eigen::Vector3d swing_ = Eigen::Vector3d::Zero(), rate_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d before_ = Eigen::Vector3d::Zero(), before2_ = Eigen::Vector3d::Zero();
  bool started_ = false;
};

}  // namespace

std::vector<LawEntry> outside_mechanical_laws() {
  const auto cylinder = HiddenPlace::kCylinder;
  return {{"structural_vibration",
           cylinder,
           false,
           {"damped oscillator", "with play"},
           "frequency [Hz], stiffness [N/m]",
           make_law<Vibration>},
          {"friction_bump",
           cylinder,
           false,
           {"Gaussian over the stroke", "triangle"},
           "F [N], centre, width [m] of pin-to-pin length",
           make_law<FrictionBump>},
          {"payload_swing",
           HiddenPlace::kMachine,
           false,
           {"small angles", "with the rope's centripetal pull"},
           "rope [m]",
           make_law<PayloadSwing>,
           [](const Machine& machine, int) {
             return machine.gravity.norm() > 0.0 && machine.tip.joint >= 0;
           }}};
}

}  // namespace sparflow::simulator
