/// Hidden effects: guide pads, end stops, constant forces, inertia.
#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

bool on_telescope(const Machine& machine, int cylinder) {
  const int j = machine.cylinders[static_cast<std::size_t>(cylinder)].joint;
  if (machine.joints[static_cast<std::size_t>(j)].type != JointType::kPrismatic) return false;
  for (int k = 0; k < j; ++k)
    if (machine.joints[static_cast<std::size_t>(k)].type == JointType::kRevolute) return true;
  return false;
}

class PadFriction final : public HiddenLaw {
 public:
  explicit PadFriction(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        joint_(c.cylinder().joint),
        law_(c.law),
        mu_(c.size * c.draw(0.06, 0.14)),
        spacing_(c.draw(1.0, 1.5)),
        travel_(c.machine->joints[static_cast<std::size_t>(joint_)].position) {}
  void force(PlantState& s, BodyForces& bodies) override {
    CylinderState& c = s.cylinders[at_];
    if (c.speed == 0.0) return;
    const double moment = std::abs(bodies.bending_moment(s.q.data(), s.payload, joint_));
    double spacing = spacing_;
    if (law_ == 1) {  // The overlap shrinks as the telescope extends.
      const double out =
          (s.q[static_cast<std::size_t>(joint_)] - travel_.lo) / (travel_.hi - travel_.lo);
      spacing = spacing_ * (1.1 - 0.2 * out);
    }
    const double f = mu_ * moment / spacing * std::tanh(c.speed / 0.5e-3);
    c.force += f;
    if (std::abs(c.speed) > kMoving) equivalent_.add(f, moment * sign_of(c.speed));
  }
  std::vector<HiddenParameter> parameters() const override {
    const double per_metre = mu_ / spacing_;
    return {{"mu_by_spacing", per_metre, "1/m", equivalent_.value(per_metre)}};
  }

 private:
  std::size_t at_;
  int joint_, law_;
  double mu_, spacing_;
  Range travel_;
  Equivalent equivalent_;
};

class EndCushion final : public HiddenLaw {
 public:
  explicit EndCushion(LawContext& c) : at_(static_cast<std::size_t>(c.at)), law_(c.law) {
    const Joint& joint = c.machine->joints[static_cast<std::size_t>(c.cylinder().joint)];
    const double a = cylinder_length<double>(*c.machine, c.at, joint.position.lo);
    const double b = cylinder_length<double>(*c.machine, c.at, joint.position.hi);
    shortest_ = std::min(a, b);
    longest_ = std::max(a, b);
    zone_ = c.draw(0.12, 0.2) * (longest_ - shortest_);
    force_ = c.size * c.draw(15.0, 40.0) * kBar * drive_area(c.cylinder());
  }
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = s.cylinders[at_];
    const double out = (c.length - (longest_ - zone_)) / zone_;
    const double in = (shortest_ + zone_ - c.length) / zone_;
    const double depth = std::max(0.0, c.speed > 0.0 ? out : (c.speed < 0.0 ? in : 0.0));
    const double speed = std::abs(c.speed);
    double shape = depth * depth;
    if (law_ == 1) shape = std::pow(depth, 2.5) * (0.6 + 0.4 * speed / (speed + 0.02));
    if (law_ == 2) shape = 0.5 * depth * depth * (1.0 + depth);
    const double f = force_ * shape * sign_of(c.speed);
    c.force += f;
    if (speed > kMoving) equivalent_.add(f, depth * depth * sign_of(c.speed));
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"force", force_, "N", equivalent_.value(force_)}, {"zone", zone_, "m", zone_}};
  }

 private:
  std::size_t at_;
  int law_;
  double shortest_, longest_, zone_, force_;
  Equivalent equivalent_;
};

class ForceOffset final : public HiddenLaw {
 public:
  explicit ForceOffset(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        force_(c.random->sign() * c.size * c.draw(3.0, 8.0) * kBar * drive_area(c.cylinder())) {}
  void force(PlantState& s, BodyForces&) override {
    // Law 1: a spring whose force varies little over the stroke (hose, gas spring).
    CylinderState& c = s.cylinders[at_];
    if (first_ == 0.0) first_ = c.length;
    const double f =
        law_ == 0 ? force_ : force_ * (1.0 + 0.05 * std::tanh((c.length - first_) / 0.5));
    c.force += f;
    equivalent_.add(f, 1.0);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"offset", force_, "N", equivalent_.value(force_)}};
  }

 private:
  std::size_t at_;
  int law_;
  double force_, first_ = 0.0;
  Equivalent equivalent_;
};

class Inertia final : public HiddenLaw {
 public:
  explicit Inertia(LawContext& c)
      : machine_(c.machine), law_(c.law), scale_(1.0 + 0.1 * (c.draw(-1.0, 1.0))) {
    if (c.size < 1.0) scale_ *= c.size;
  }
  bool needs_inertia() const override { return true; }
  void force(PlantState& s, BodyForces&) override {
    for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
      CylinderState& c = s.cylinders[i];
      double f =
          s.inertia[static_cast<std::size_t>(machine_->cylinders[i].joint)] / c.rate * scale_;
      // Law 1: rod and barrel add a few per cent along the cylinder's axis.
      if (law_ == 1) f += 0.02 * std::abs(c.weight) / 9.81 * c.acceleration;
      c.force += f;
    }
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"scale", scale_, "-", scale_}};
  }

 private:
  const Machine* machine_;
  int law_;
  double scale_;
};

}  // namespace

std::vector<LawEntry> contact_laws() {
  const auto at = HiddenPlace::kCylinder;
  return {{"pad_friction",
           at,
           true,
           {"fixed pad spacing", "overlap shrinks as the telescope runs out"},
           "mu_by_spacing [1/m]: friction per bending moment",
           make_law<PadFriction>,
           on_telescope},
          {"end_cushion",
           at,
           true,
           {"quadratic in depth", "power 2.5 and speed", "quadratic to cubic"},
           "force [N] at the stop, zone [m]; both ends, towards the stop only",
           make_law<EndCushion>},
          {"force_offset",
           at,
           true,
           {"constant", "weak spring"},
           "offset [N], positive adds to the load",
           make_law<ForceOffset>},
          {"inertia",
           HiddenPlace::kMachine,
           true,
           {"bodies by d'Alembert", "with the cylinders' own masses"},
           "scale [-]",
           make_law<Inertia>}};
}

}  // namespace sparflow::simulator
