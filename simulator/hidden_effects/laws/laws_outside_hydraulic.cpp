/// Hidden effects outside the catalogue: valves, pump, sensors. The right verdict is "unknown".
#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

std::vector<HiddenParameter> one(const char* name, double value, const char* unit) {
  return {{name, value, unit, value}};
}

class PumpRipple final : public HiddenLaw {
 public:
  explicit PumpRipple(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        amplitude_(c.size * c.draw(5.0, 10.0) * kBar),
        hz_(c.draw(0.7, 1.8)),
        phase_(c.draw(0.0, kTwoPi)) {}
  void pump(PlantState& s) override {
    double wave = std::sin(kTwoPi * hz_ * s.t + phase_);
    if (law_ == 1) wave = 0.8 * wave + 0.3 * std::sin(2.0 * (kTwoPi * hz_ * s.t + phase_));
    s.pumps[at_].pressure += amplitude_ * wave;
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"amplitude", amplitude_, "Pa", amplitude_}, {"frequency", hz_, "Hz", hz_}};
  }

 private:
  std::size_t at_;
  int law_;
  double amplitude_, hz_, phase_;
};

/// Limit cycle of the pump control that grows while there is flow and decays at standby; its frequency varies.
class PumpHunting final : public HiddenLaw {
 public:
  explicit PumpHunting(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        amplitude_(c.size * c.draw(6.0, 12.0) * kBar),
        hz_(c.draw(1.5, 3.0)) {}
  void pump(PlantState& s) override {
    PumpState& p = s.pumps[at_];
    // Averaged Van der Pol oscillator, whose amplitude reaches 1 within some cycles.
    const double goal = p.leader >= 0 ? 1.0 : 0.0;
    level_ += (goal - level_) * s.h / 0.4;
    angle_ += s.h * kTwoPi * hz_ * (0.7 + 0.5 * p.demand / 200e5);
    p.pressure += amplitude_ * level_ * std::sin(angle_);
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"amplitude", amplitude_, "Pa", amplitude_}, {"frequency", hz_, "Hz", hz_}};
  }

 private:
  std::size_t at_;
  double amplitude_, hz_, level_ = 0.0, angle_ = 0.0;
};

class PoseMargin final : public HiddenLaw {
 public:
  explicit PoseMargin(LawContext& c)
      : feeds_(c.pump().feeds),
        law_(c.law),
        rise_(c.random->sign() * c.size * c.draw(8.0, 14.0) * kBar) {
    joint_ = static_cast<std::size_t>(c.random->below(c.machine->joint_count()));
    range_ = c.machine->joints[joint_].position;
  }
  void demand(PlantState& s) override {
    const double x = (s.q[joint_] - range_.lo) / (range_.hi - range_.lo);
    double share = std::sin(kTwoPi * 1.2 * x);
    if (law_ == 1) share = x > 0.5 ? 1.0 : 0.0;  // A hose kinks beyond a posture.
    for (const int i : feeds_) s.cylinders[static_cast<std::size_t>(i)].margin += rise_ * share;
  }
  std::vector<HiddenParameter> parameters() const override { return one("rise", rise_, "Pa"); }

 private:
  std::vector<int> feeds_;
  int law_;
  double rise_;
  std::size_t joint_ = 0;
  Range range_;
};

/// Hysteresis between lever and spool.
class SpoolHysteresis final : public HiddenLaw {
 public:
  explicit SpoolHysteresis(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), law_(c.law), width_(c.size * c.draw(0.08, 0.16)) {}
  void opening(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    if (c.command == 0.0) {
      spool_ = 0.0;  // At zero the centring spring overcomes the friction.
    } else if (law_ == 0) {
      spool_ = std::clamp(spool_, c.command - 0.5 * width_, c.command + 0.5 * width_);
    } else {  // Prandtl-Ishlinskii model with two play operators.
      inner_ = std::clamp(inner_, c.command - 0.3 * width_, c.command + 0.3 * width_);
      outer_ = std::clamp(outer_, c.command - 0.8 * width_, c.command + 0.8 * width_);
      spool_ = 0.5 * (inner_ + outer_);
    }
    if (c.command == 0.0) inner_ = outer_ = 0.0;
    c.opening = spool_ * c.command > 0.0 ? spool_ : 0.0;
  }
  std::vector<HiddenParameter> parameters() const override { return one("width", width_, "-"); }

 private:
  std::size_t at_;
  int law_;
  double width_, spool_ = 0.0, inner_ = 0.0, outer_ = 0.0;
};

/// The engine slows down under load, so that the pump's speed and all flows fall after a lag.
class EngineDroop final : public HiddenLaw {
 public:
  explicit EngineDroop(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), droop_(c.size * c.draw(0.25, 0.4)) {
    for (const int i : c.pump().feeds) feeds_.push_back(static_cast<std::size_t>(i));
    full_ = 0.5 * c.pump().max_pressure * std::max(c.pump().max_flow, 1e-4);
  }
  void flow(PlantState& s) override {
    const double load = std::min(1.5, s.pumps[at_].pressure * s.pumps[at_].flow / full_);
    slow_ += (load - slow_) * s.h / 0.7;
    for (const std::size_t i : feeds_)
      s.cylinders[i].flow *= 1.0 - droop_ * std::clamp(slow_, 0.0, 1.0);
  }
  std::vector<HiddenParameter> parameters() const override { return one("droop", droop_, "-"); }

 private:
  std::size_t at_;
  std::vector<std::size_t> feeds_;
  double droop_, full_ = 1.0, slow_ = 0.0;
};

class CubicGain final : public HiddenLaw {
 public:
  explicit CubicGain(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), law_(c.law), share_(c.size * c.draw(0.5, 0.8)) {}
  void flow(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    const double u = std::abs(c.opening);
    // Progressive spool; law 1: S shape.
    const double bend = law_ == 0 ? u * u : 0.6 + 0.6 * std::sin(kTwoPi * u);
    c.flow *= 1.0 - share_ + share_ * bend;
  }
  std::vector<HiddenParameter> parameters() const override { return one("share", share_, "-"); }

 private:
  std::size_t at_;
  int law_;
  double share_;
};

/// Common ground of two sensors: one chamber's reading contains a share of another cylinder's pressure.
class SensorCrosstalk final : public HiddenLaw {
 public:
  explicit SensorCrosstalk(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), share_(c.size * c.draw(0.07, 0.15)) {
    const auto n = c.machine->cylinders.size();
    do {
      from_ = static_cast<std::size_t>(c.random->below(static_cast<int>(n)));
    } while (from_ == at_);
  }
  void sensors(const PlantState& s, SensorState& sensors) override {
    sensors.pressure_a[at_] += share_ * (s.cylinders[from_].pressure_a - 50e5);
  }
  std::vector<HiddenParameter> parameters() const override { return one("share", share_, "-"); }

 private:
  std::size_t at_, from_ = 0;
  double share_;
};

class PressureDrift final : public HiddenLaw {
 public:
  explicit PressureDrift(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        rise_(c.random->sign() * c.size * c.draw(8.0, 15.0) * kBar),
        period_(c.draw(60.0, 120.0)),
        phase_(c.draw(0.0, kTwoPi)) {}
  void sensors(const PlantState& s, SensorState& sensors) override {
    double& p = sensors.pressure_a[at_];
    p += law_ == 0 ? rise_ * (s.t / 150.0 - 0.5)
                   : 0.7 * rise_ * std::sin(kTwoPi * s.t / period_ + phase_);
  }
  std::vector<HiddenParameter> parameters() const override { return one("rise", rise_, "Pa"); }

 private:
  std::size_t at_;
  int law_;
  double rise_, period_, phase_;
};

bool one_of_several(const Machine& machine, int i) {
  return hydraulic(machine, i) && machine.cylinder_count() > 1;
}
}  // namespace

std::vector<LawEntry> outside_hydraulic_laws() {
  const auto cylinder = HiddenPlace::kCylinder, pump = HiddenPlace::kPump;
  return {{"pump_ripple",
           pump,
           false,
           {"sine", "with a harmonic"},
           "amplitude [Pa], frequency [Hz]",
           make_law<PumpRipple>},
          {"pump_hunting",
           pump,
           false,
           {"limit cycle while feeding"},
           "amplitude [Pa], frequency [Hz]",
           make_law<PumpHunting>,
           load_sensing},
          {"pose_margin",
           pump,
           false,
           {"sine over a joint's range", "step at mid range"},
           "rise [Pa]",
           make_law<PoseMargin>,
           load_sensing},
          {"spool_hysteresis",
           cylinder,
           false,
           {"play", "two plays"},
           "width [-]",
           make_law<SpoolHysteresis>,
           hydraulic},
          {"engine_droop",
           pump,
           false,
           {"flow falls with lagged power"},
           "droop [-]",
           make_law<EngineDroop>},
          {"cubic_gain",
           cylinder,
           false,
           {"progressive", "S shape"},
           "share [-]",
           make_law<CubicGain>,
           hydraulic},
          {"sensor_crosstalk",
           cylinder,
           false,
           {"share of another chamber"},
           "share [-]",
           make_law<SensorCrosstalk>,
           one_of_several},
          {"pressure_drift",
           cylinder,
           false,
           {"ramp", "slow wave"},
           "rise [Pa]",
           make_law<PressureDrift>,
           hydraulic}};
}

}  // namespace sparflow::simulator
