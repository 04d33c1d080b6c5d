/// Hidden effects: pressure losses in lines and valves.
#include <algorithm>
#include <cmath>
#include <utility>

#include "models/machine/linkage.h"
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

/// Return flow [m^3/s] of a usual simultaneous move.
double usual_return(const LawContext& c) {
  double most = 0.0;
  for (int i = 0; i < c.machine->cylinder_count(); ++i) {
    const Cylinder& drive = c.machine->cylinders[static_cast<std::size_t>(i)];
    if (!drive.hydraulic()) continue;
    const auto& law = c.laws->cylinders[static_cast<std::size_t>(i)].direction;
    most = std::max({most, law[0].valve_gain * drive.area_rod() / drive.area_piston(),
                     0.7 * law[1].valve_gain * drive.area_piston() / drive.area_rod()});
  }
  return most;
}

class ReturnBackPressure final : public HiddenLaw {
 public:
  explicit ReturnBackPressure(LawContext& c)
      : law_(c.law), usual_(usual_return(c)), rise_(c.size * c.draw(8.0, 25.0) * kBar) {}
  void return_line(PlantState& s) override {
    double flow = 0.0;
    for (const CylinderState& c : s.cylinders) flow += c.return_flow;
    const double r = flow / usual_;
    double p = rise_ * r * r;
    if (law_ == 1) p = rise_ * std::pow(r, 1.75);          // Blasius pipe
    if (law_ == 2) p = rise_ * (0.15 * r + 0.85 * r * r);  // cooler and filter
    for (CylinderState& c : s.cylinders)
      if (c.side != 0) c.return_pressure += p;
    equivalent_.add(p, flow * flow);
  }
  std::vector<HiddenParameter> parameters() const override {
    const double k = rise_ / (usual_ * usual_);
    return {{"k", k, "Pa/(m^3/s)^2", equivalent_.value(k)}};
  }

 private:
  int law_;
  double usual_, rise_;
  Equivalent equivalent_;
};

class LineLoss final : public HiddenLaw {
 public:
  explicit LineLoss(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        usual_(0.6 * std::max(c.laws->cylinders[at_].direction[0].valve_gain,
                              c.laws->cylinders[at_].direction[1].valve_gain)),
        loss_(c.size * c.draw(8.0, 25.0) * kBar),
        laminar_(c.draw(0.1, 0.25)) {}
  void demand(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    const double r = c.flow / usual_;
    double p = loss_ * r * r;                                              // orifice
    if (law_ == 1) p = loss_ * (laminar_ * r + (1.0 - laminar_) * r * r);  // hose and orifice
    if (law_ == 2)
      p = loss_ * (std::sqrt(0.01 + r * r * r * r) - 0.1);  // orifice, laminar at small flow
    c.line_drop += p;
    if (std::abs(c.speed) > kMoving) equivalent_.add(p, c.flow * c.flow);
  }
  std::vector<HiddenParameter> parameters() const override {
    const double k = loss_ / (usual_ * usual_);
    return {{"k", k, "Pa/(m^3/s)^2", equivalent_.value(k)}};
  }

 private:
  std::size_t at_;
  int law_;
  double usual_, loss_, laminar_;
  Equivalent equivalent_;
};

/// Least-squares line y = a + b x.
class StraightLine {
 public:
  void add(double y, double x) { n_ += 1.0, x_ += x, y_ += y, xx_ += x * x, xy_ += x * y; }
  /// @param otherwise returned when x varied too little to determine it
  std::pair<double, double> line(std::pair<double, double> otherwise) const {
    const double variance = n_ > 0.0 ? xx_ / n_ - x_ / n_ * x_ / n_ : 0.0;
    if (variance < 1e-4 * xx_ / std::max(1.0, n_) || variance <= 0.0) return otherwise;
    const double b = (xy_ / n_ - x_ / n_ * y_ / n_) / variance;
    return {y_ / n_ - b * x_ / n_, b};
  }

 private:
  double n_ = 0.0, x_ = 0.0, y_ = 0.0, xx_ = 0.0, xy_ = 0.0;
};

class Counterbalance final : public HiddenLaw {
 public:
  explicit Counterbalance(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), law_(c.law), slope_(c.draw(0.15, 0.33)) {
    // The valve is on the chamber that holds the load most of the time.
    const Cylinder& drive = c.cylinder();
    BodyForces bodies(*c.machine);
    JointLoads loads;
    std::vector<double> q;
    for (const Joint& j : c.machine->joints) q.push_back(0.5 * (j.position.lo + j.position.hi));
    bodies.gravity(q.data(), 0.5 * c.payload, loads);
    const auto j = static_cast<std::size_t>(drive.joint);
    const double rate = linkage_rates(*c.machine, c.at, q[j]).d1;
    const double weight = loads.gravity[j] / rate;
    lowering_ = weight >= 0.0 ? -1 : 1;
    holding_area_ = lowering_ < 0 ? drive.area_piston() : drive.area_rod();
    fed_area_ = lowering_ < 0 ? drive.area_rod() : drive.area_piston();
    tank_ = c.laws->cylinders[at_].rest_tank;
    // The setting is such that lowering the usual load still needs some tens of bar of supply pressure.
    opening_ = slope_ * std::abs(weight) / holding_area_ + c.size * c.draw(25.0, 60.0) * kBar;
  }
  void prepare_crane(CraneLaws& laws) const override {
    laws.cylinders[at_].direction[lowering_ > 0 ? 0 : 1].counterbalance = false;
  }
  void pilot(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    if (c.side != lowering_) return;
    const double load = std::max(0.0, -c.side * c.force / holding_area_);
    double p = opening_ - slope_ * load;
    if (law_ == 1)
      p += 0.08 * opening_ * std::tanh(c.flow / 5e-4);  // The spool opens against its spring.
    if (law_ == 2)
      p = opening_ * 0.05 * std::log1p(std::exp(p / (0.05 * opening_)));  // rounded knee
    c.pilot_pressure = std::max(c.pilot_pressure, std::max(p, 0.0));
    const double static_supply = (c.side * c.force + holding_area_ * c.return_pressure) / fed_area_;
    if (std::abs(c.speed) > kMoving && c.pilot_pressure > std::max(static_supply, tank_))
      rise_.add(c.pilot_pressure - tank_, load);
  }
  std::vector<HiddenParameter> parameters() const override {
    // Only samples above the pressure of an unloaded chamber without the valve; a line over the load is fitted to them.
    const auto [setting, slope] = rise_.line({opening_ - tank_, -slope_});
    return {{"setting", opening_, "Pa", setting}, {"slope", slope_, "-", -slope}};
  }

 private:
  std::size_t at_;
  int law_, lowering_ = -1;
  double opening_ = 0.0, slope_, holding_area_ = 1.0, fed_area_ = 1.0, tank_ = 0.0;
  StraightLine rise_;
};

class OilTemperature final : public HiddenLaw {
 public:
  explicit OilTemperature(LawContext& c) : law_(c.law), laws_(c.laws) {
    // Ratio of the viscosities at 30 and 50 degC.
    const double ratio = 1.0 + c.size * (c.draw(2.2, 3.2) - 1.0);
    beta_ = std::log(ratio) / 20.0;
    for (int i = 0; i < c.machine->cylinder_count(); ++i) {
      const Cylinder& d = c.machine->cylinders[static_cast<std::size_t>(i)];
      ratio_.push_back(d.hydraulic() ? d.area_rod() / d.area_piston() : 1.0);
    }
  }
  void prepare_crane(CraneLaws& laws) const override {
    // Long thin return hoses, where half of the loss is laminar.
    for (std::size_t i = 0; i < laws.cylinders.size(); ++i) {
      for (std::size_t d = 0; d < 2; ++d) {
        DirectionLaws& law = laws.cylinders[i].direction[d];
        const double full = law.valve_gain * (d == 0 ? ratio_[i] : 1.0 / ratio_[i]);
        law.return_laminar = kLaminarLoss / full;
      }
    }
  }
  void return_line(PlantState& s) override {
    const double thinner = viscosity(s.oil) - 1.0;
    for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
      CylinderState& c = s.cylinders[i];
      if (c.side == 0) continue;
      c.return_pressure += laws_->cylinders[i].direction[c.side > 0 ? 0 : 1].return_laminar *
                           c.return_flow * thinner;
    }
  }
  std::vector<HiddenParameter> parameters() const override {
    // Slope per kelvin at 40 degC; a piecewise linear table has no curvature there.
    const double middle = std::sinh(10.0 * beta_) / 10.0;
    const double slope = kLaminarLoss * (law_ == 2 ? middle : beta_);
    return {{"beta", beta_, "1/K", law_ == 2 ? 0.0 : beta_},
            {"return_slope", slope, "Pa/K", slope}};
  }

 private:
  static constexpr double kReference = 40.0;           // [degC]
  static constexpr double kLaminarLoss = 16.0 * kBar;  // at full flow and 40 degC
  double viscosity(double oil) const {
    if (law_ == 0) return std::exp(-beta_ * (oil - kReference));
    if (law_ == 1) {  // Walther: log log viscosity is linear in log T; same slope at 40 degC.
      const double log_mu = std::log10(46.0 + 0.7);  // ISO VG 46
      const double m =
          beta_ / std::log(10.0) * (273.15 + kReference) * 46.0 / (46.7 * log_mu) * 46.7 / 46.0;
      const double scaled = log_mu * std::pow((273.15 + kReference) / (273.15 + oil), m);
      return (std::pow(10.0, scaled) - 0.7) / 46.0;
    }
    // Piecewise linear table.
    const double at[4] = {10.0, 30.0, 50.0, 80.0};
    for (int k = 0; k < 3; ++k) {
      if (oil <= at[k + 1] || k == 2) {
        const double a = std::exp(-beta_ * (at[k] - kReference));
        const double b = std::exp(-beta_ * (at[k + 1] - kReference));
        return a + (b - a) * (oil - at[k]) / (at[k + 1] - at[k]);
      }
    }
    return 1.0;
  }
  int law_;
  const CraneLaws* laws_;
  double beta_;
  std::vector<double> ratio_;
};

bool any_hydraulic(const Machine& machine, int) {
  for (const Cylinder& c : machine.cylinders)
    if (c.hydraulic()) return true;
  return false;
}
bool fed_by_load_sensing_pump(const Machine& machine, int i) {
  const int p = machine.pump_of_cylinder(i);
  return hydraulic(machine, i) && p >= 0 &&
         machine.pumps[static_cast<std::size_t>(p)].type == PumpType::kLoadSensing;
}

}  // namespace

std::vector<LawEntry> pressure_laws() {
  return {{"return_back_pressure",
           HiddenPlace::kMachine,
           true,
           {"orifice", "power 1.75 (Blasius)", "laminar share 15 %"},
           "k [Pa/(m^3/s)^2] of the summed return flow",
           make_law<ReturnBackPressure>,
           any_hydraulic},
          {"line_loss",
           HiddenPlace::kCylinder,
           true,
           {"orifice", "hose and orifice", "orifice, laminar at small flow"},
           "k [Pa/(m^3/s)^2] between pump and cylinder (sensors at the cylinder)",
           make_law<LineLoss>,
           fed_by_load_sensing_pump},
          {"counterbalance",
           HiddenPlace::kCylinder,
           true,
           {"linear in load", "with a flow-dependent opening", "soft knee"},
           "setting [Pa] supply pressure without load, slope [-] its fall with load pressure; the "
           "reference crane "
           "has no such valve on this side",
           make_law<Counterbalance>,
           hydraulic},
          {"oil_temperature",
           HiddenPlace::kMachine,
           true,
           {"exponential", "Walther (ASTM D341)", "piecewise linear table"},
           "beta [1/K], return_slope [Pa/K] fall of every section's laminar loss at full flow and "
           "40 degC",
           make_law<OilTemperature>,
           any_hydraulic}};
}

}  // namespace sparflow::simulator
