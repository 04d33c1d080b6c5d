/// Hidden effects: friction in cylinders and pins.
#include <algorithm>
#include <cmath>

#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

/// Smooth sign(v): 0 at rest, 1 within 1 % at three times `width` [m/s].
double soft_sign(double v, double width) { return std::tanh(v / width); }

/// Deflection of a bristle in units of its break-away deflection (-1..1).
class Bristle {
 public:
  explicit Bristle(double distance) : distance_(distance) {}
  double step(double speed, double h) {
    const double end = speed > 0.0 ? 1.0 : -1.0;
    if (speed != 0.0) value_ = end + (value_ - end) * std::exp(-std::abs(speed) * h / distance_);
    return value_;
  }

 private:
  double distance_;  ///< [m]
  double value_ = 0.0;
};

class OnCylinder : public HiddenLaw {
 protected:
  explicit OnCylinder(const LawContext& c) : at_(static_cast<std::size_t>(c.at)), law_(c.law) {}
  CylinderState& here(PlantState& s) const { return s.cylinders[at_]; }
  void book(const CylinderState& c, double force, double regressor) {
    if (std::abs(c.speed) > kMoving) equivalent_.add(force, regressor);
  }
  std::size_t at_;
  int law_;
  Equivalent equivalent_;
};

class Coulomb final : public OnCylinder {
 public:
  explicit Coulomb(LawContext& c)
      : OnCylinder(c),
        force_(c.size * c.draw(2.0, 8.0) * kBar * drive_area(c.cylinder())),
        width_(c.draw(0.3e-3, 1.0e-3)),
        bristle_(c.draw(0.05e-3, 0.3e-3)) {}
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = here(s);
    double f = 0.0;
    if (law_ == 0) {
      f = force_ * soft_sign(c.speed, width_);
    } else if (law_ == 1) {  // LuGre: at rest the force is that of the bristles' state.
      f = force_ * bristle_.step(c.speed, s.h);
    } else {  // tanh with a shallow Stribeck dip.
      f = force_ * soft_sign(c.speed, width_) *
          (1.0 + 0.12 * std::exp(-std::pow(c.speed / 4e-3, 2)));
    }
    c.force += f;
    book(c, f, sign_of(c.speed));
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"Fc", force_, "N", equivalent_.value(force_)}};
  }

 private:
  double force_, width_;
  Bristle bristle_;
};

class Viscous final : public OnCylinder {
 public:
  explicit Viscous(LawContext& c) : OnCylinder(c) {
    const Valve* valve = c.machine->valve_of_cylinder(c.at);
    const double area = drive_area(c.cylinder());
    reference_speed_ =
        valve && c.cylinder().hydraulic()
            ? 0.6 * valve->max_flow_extend / area
            : c.machine->joints[static_cast<std::size_t>(c.cylinder().joint)].velocity.hi;
    coefficient_ = c.size * c.draw(3.0, 10.0) * kBar * area / reference_speed_;
    power_ = c.draw(0.85, 0.95);
  }
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = here(s);
    const double v = std::abs(c.speed);
    double f = coefficient_ * v;
    if (law_ == 1) {  // Shear-thinning seal film with the same force at the reference speed.
      f = coefficient_ * reference_speed_ * std::pow(v / reference_speed_, power_);
    } else if (law_ == 2) {  // Film that thickens with speed, so that the force saturates slightly.
      f = coefficient_ * v / (1.0 + 0.15 * v / reference_speed_);
    }
    f *= sign_of(c.speed);
    c.force += f;
    book(c, f, c.speed);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"B", coefficient_, "N s/m", equivalent_.value(coefficient_)}};
  }

 private:
  double coefficient_, reference_speed_, power_;
};

class Stribeck final : public OnCylinder {
 public:
  explicit Stribeck(LawContext& c)
      : OnCylinder(c),
        force_(c.size * c.draw(6.0, 10.0) * kBar * drive_area(c.cylinder())),
        speed_(c.draw(6e-3, 16e-3)) {}
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = here(s);
    const double r = std::abs(c.speed) / speed_;
    double dip = std::exp(-r);
    if (law_ == 1) dip = 1.0 / (1.0 + r * r);  // Hess and Soom (1990)
    if (law_ == 2) dip = 1.0 - std::tanh(0.8 * r);
    const double f = force_ * soft_sign(c.speed, 0.4e-3) * dip;
    c.force += f;
    book(c, f, sign_of(c.speed) * std::exp(-r));
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"Fs", force_, "N", equivalent_.value(force_)}, {"vs", speed_, "m/s", speed_}};
  }

 private:
  double force_, speed_;
};

class LoadFriction final : public OnCylinder {
 public:
  explicit LoadFriction(LawContext& c) : OnCylinder(c), share_(c.size * c.draw(0.03, 0.10)) {
    const Joint& joint = c.machine->joints[static_cast<std::size_t>(c.cylinder().joint)];
    pins_ = joint.type == JointType::kRevolute;
  }
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = here(s);
    double f = share_ * std::abs(c.weight) * soft_sign(c.speed, 0.5e-3);
    if (law_ == 1) {
      // Pins of radius r turn with the joint: force = mu r |F| |dtheta/dx|, where the lever arm varies with posture.
      arm_ += 1e-3 * (std::abs(c.rate) - arm_) * (c.speed != 0.0 ? 1.0 : 0.0);
      if (arm_ == 0.0) arm_ = std::abs(c.rate);
      if (pins_) f *= std::pow(arm_ / std::abs(c.rate), 0.3);
    } else if (law_ == 2) {  // Seals: the friction grows a little less than the load.
      f = share_ * 1e5 * std::pow(std::abs(c.weight) / 1e5, 0.9) * soft_sign(c.speed, 0.5e-3);
    }
    c.force += f;
    book(c, f, std::abs(c.weight) * sign_of(c.speed));
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"mu", share_, "-", equivalent_.value(share_)}};
  }

 private:
  double share_, arm_ = 0.0;
  bool pins_ = true;
};

class Presliding final : public OnCylinder {
 public:
  explicit Presliding(LawContext& c)
      : OnCylinder(c),
        force_(c.size * c.draw(2.0, 5.0) * kBar * drive_area(c.cylinder())),
        distance_(c.draw(3e-3, 12e-3)),
        bristle_(distance_) {
    for (int k = 1; k <= kElements; ++k) plays_.push_back({distance_ * 0.5 * k, 0.0});
  }
  void force(PlantState& s, BodyForces&) override {
    CylinderState& c = here(s);
    double state = 0.0;
    if (law_ == 0) {  // Dahl (1968)
      state = bristle_.step(c.speed, s.h);
    } else {  // Maxwell slip: parallel elements that slip one after the other.
      for (Play& p : plays_) {
        p.deflection = std::clamp(p.deflection + c.speed * s.h, -p.yield, p.yield);
        state += p.deflection / p.yield / kElements;
      }
    }
    c.force += force_ * state;
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"Fc", force_, "N", force_}, {"distance", distance_, "m", distance_}};
  }

 private:
  struct Play {
    double yield, deflection;
  };
  static constexpr int kElements = 4;
  double force_, distance_;
  Bristle bristle_;
  std::vector<Play> plays_;
};

}  // namespace

std::vector<LawEntry> friction_laws() {
  const auto at = HiddenPlace::kCylinder;
  return {{"coulomb_friction",
           at,
           true,
           {"smooth tanh", "LuGre bristles", "tanh with a shallow Stribeck dip"},
           "Fc [N]",
           make_law<Coulomb>},
          {"viscous_friction",
           at,
           true,
           {"linear", "power 0.85..0.95 of speed", "slightly saturating"},
           "B [N s/m]",
           make_law<Viscous>},
          {"stribeck_friction",
           at,
           true,
           {"exponential", "Hess-Soom", "tanh"},
           "Fs [N] above sliding, vs [m/s]",
           make_law<Stribeck>},
          {"load_friction",
           at,
           true,
           {"share of the static load", "pins: with the lever arm", "power 0.9 of the load"},
           "mu [-] of |static force|",
           make_law<LoadFriction>},
          {"presliding",
           at,
           true,
           {"Dahl", "Maxwell slip, four elements"},
           "Fc [N] after full slip, distance [m] of memory",
           make_law<Presliding>}};
}

}  // namespace sparflow::simulator
