/// Hidden effects: leakage and compression of oil.
#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

constexpr double kLineTime = 0.04;  // [s] of a line and its oil

class Leakage final : public HiddenLaw {
 public:
  explicit Leakage(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        area_a_(c.cylinder().area_piston()),
        area_b_(c.cylinder().area_rod()),
        conductance_(c.size * c.draw(0.4, 1.0) * kLpm / (100.0 * kBar)) {}
  void drift(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    // The oil's volume delays its pressure by the line's time constant; a leak that follows the force of its own acceleration at
    // once has no stable motion.
    force_ = started_ ? force_ + (c.force - force_) * (1.0 - std::exp(-s.h / kLineTime)) : c.force;
    started_ = true;
    if (c.side != 0 && law_ != 2) return;  // Laws 0 and 1 leak past the closed spool.
    const bool on_a = force_ >= 0.0;
    const double load = on_a ? force_ / area_a_ : -force_ / area_b_;
    // Laminar through gaps; law 1: through an orifice with the same flow at 100 bar.
    const double flow = law_ == 1 ? conductance_ * 100.0 * kBar * std::sqrt(load / (100.0 * kBar))
                                  : conductance_ * load;
    c.drift += on_a ? -flow / area_a_ : flow / area_b_;
    equivalent_.add(flow, load);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"k", conductance_, "m^3/s/Pa", equivalent_.value(conductance_)}};
  }

 private:
  std::size_t at_;
  int law_;
  double area_a_, area_b_, conductance_;
  double force_ = 0.0;  ///< [N] through the oil's volume
  bool started_ = false;
  Equivalent equivalent_;
};

class Compressibility final : public HiddenLaw {
 public:
  explicit Compressibility(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        area_a_(c.cylinder().area_piston()),
        area_b_(c.cylinder().area_rod()),
        inverse_modulus_(c.size * c.draw(1.5, 4.0) * 1e-9) {
    const Range range = c.machine->joints[static_cast<std::size_t>(c.cylinder().joint)].position;
    const double a = cylinder_length<double>(*c.machine, c.at, range.lo);
    const double b = cylinder_length<double>(*c.machine, c.at, range.hi);
    shortest_ = c.cylinder().length_at_zero_stroke.value_or(std::min(a, b));
    travel_ = c.cylinder().stroke.value_or(std::abs(b - a));
    hose_ = c.draw(0.03, 0.1) * travel_;
  }
  void drift(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    // The loaded oil column is compressed; its pressure is filtered over 40 ms, the time constant of the line.
    const int side = c.side != 0 ? c.side : (c.force >= 0.0 ? 1 : -1);
    const double pressure = side > 0 ? c.pressure_a : c.pressure_b;
    if (side != side_) {
      side_ = side;
      smooth_ = pressure;
    }
    const double area = side > 0 ? area_a_ : area_b_;
    const double stroke = std::clamp(c.length - shortest_, 0.0, travel_);
    const double column = side > 0 ? stroke : travel_ - stroke;
    double softness = inverse_modulus_;
    if (law_ == 1)  // Free air: softer at low pressure, the same at 100 bar.
      softness *= 0.8 + 0.4 / (1.0 + std::max(0.0, pressure) / (100.0 * kBar));
    // The line limits the speed: the volume of a pressure step is delivered completely, but later.
    const double give = (column + hose_) * softness;  // [m/Pa]
    const double most = kFastest / give;
    const double slope = std::clamp((pressure - smooth_) / kFilter, -most, most);
    smooth_ += slope * s.h;
    const double flow = area * give * slope;
    c.drift += (side > 0 ? -1.0 : 1.0) * flow / area;
    equivalent_.add(flow, area * (column + 0.05 * travel_) * slope);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"1/E", inverse_modulus_, "1/Pa", equivalent_.value(inverse_modulus_)}};
  }

 private:
  static constexpr double kFilter = kLineTime;
  static constexpr double kFastest = 0.01;  // [m/s]
  std::size_t at_;
  int law_, side_ = 0;
  double area_a_, area_b_, inverse_modulus_, shortest_ = 0.0, travel_ = 1.0, hose_ = 0.0,
                                             smooth_ = 0.0;
  Equivalent equivalent_;
};

/// Whether a cylinder holds a load; one about a vertical axis does not, so that it neither leaks nor compresses oil.
bool carries_load(const Machine& machine, int i) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(i)];
  const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
  if (!c.hydraulic()) return false;
  if (joint.type != JointType::kRevolute || c.joint > 0) return true;
  const Eigen::Vector3d axis = joint.origin.linear() * joint.axis;
  return std::abs(axis.dot(machine.gravity.normalized())) < 0.9;
}

}  // namespace

std::vector<LawEntry> volume_laws() {
  const auto at = HiddenPlace::kCylinder;
  return {{"leakage",
           at,
           true,
           {"laminar past the closed spool", "orifice past the closed spool",
            "laminar past the piston, moving too"},
           "k [m^3/s/Pa] per load pressure",
           make_law<Leakage>,
           carries_load},
          {"compressibility",
           at,
           true,
           {"constant bulk modulus", "softer at low pressure"},
           "1/E [1/Pa]; volume of the fed (at rest: loaded) chamber and its hose",
           make_law<Compressibility>,
           carries_load}};
}

}  // namespace sparflow::simulator
