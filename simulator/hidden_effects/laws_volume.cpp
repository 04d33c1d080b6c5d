/// Oil that goes elsewhere: leakage and compression.
#include <algorithm>
#include <cmath>

#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

constexpr double kBar = 1e5;
constexpr double kLpm = 1.0 / 60000.0;

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
    if (c.side != 0 && law_ != 2) return;  // laws 0, 1: past the closed spool
    const bool on_a = c.force >= 0.0;
    const double load = on_a ? c.force / area_a_ : -c.force / area_b_;
    // through gaps, laminar; law 1: through an orifice, the same at 100 bar
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
  Equivalent equivalent_;
};

class Compressibility final : public HiddenLaw {
 public:
  explicit Compressibility(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        area_a_(c.cylinder().area_piston()),
        area_b_(c.cylinder().area_rod()),
        stiffness_(c.size * c.draw(2.0, 6.0) * area_a_ / 0.02 * 1e-11) {}
  void drift(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    // the column that carries the load yields; filtered over 40 ms, the line's own time
    const int side = c.side != 0 ? c.side : (c.force >= 0.0 ? 1 : -1);
    const double pressure = side > 0 ? c.pressure_a : c.pressure_b;
    if (side != side_) {
      side_ = side;
      smooth_ = pressure;
    }
    const double slope = (pressure - smooth_) / kFilter;
    smooth_ += slope * s.h;
    double volume_per_pressure = stiffness_;
    if (law_ == 1)  // free air: softer at low pressure, the same at 100 bar
      volume_per_pressure *= 0.8 + 0.4 / (1.0 + std::max(0.0, pressure) / (100.0 * kBar));
    const double flow = volume_per_pressure * slope;
    c.drift += side > 0 ? -flow / area_a_ : flow / area_b_;
    if (c.side != 0) equivalent_.add(flow, slope);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"V_over_E", stiffness_, "m^3/Pa", equivalent_.value(stiffness_)}};
  }

 private:
  static constexpr double kFilter = 0.04;  // [s]
  std::size_t at_;
  int law_, side_ = 0;
  double area_a_, area_b_, stiffness_, smooth_ = 0.0;
  Equivalent equivalent_;
};

bool hydraulic(const Machine& machine, int i) {
  return machine.cylinders[static_cast<std::size_t>(i)].hydraulic();
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
           hydraulic},
          {"compressibility",
           at,
           true,
           {"constant bulk modulus", "softer at low pressure"},
           "V_over_E [m^3/Pa] of the fed (at rest: loaded) chamber",
           make_law<Compressibility>,
           hydraulic}};
}

}  // namespace sparflow::simulator
