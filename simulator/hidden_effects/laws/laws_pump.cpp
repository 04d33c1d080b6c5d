/// Hidden effects: pump control.
#include <algorithm>
#include <cmath>

#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

class PumpLag final : public HiddenLaw {
 public:
  explicit PumpLag(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), law_(c.law), time_(c.size * c.draw(0.15, 0.4)) {}
  void pump(PlantState& s) override {
    PumpState& p = s.pumps[at_];
    if (!started_) {
      value_ = swash_ = p.pressure;
      started_ = true;
    }
    if (law_ == 0) {
      value_ += (p.pressure - value_) * (1.0 - std::exp(-s.h / time_));
    } else if (law_ ==
               1) {  // second order, overdamped: one slow and one fast pole, the same mean delay
      swash_ += (p.pressure - swash_) * (1.0 - std::exp(-s.h / (0.2 * time_)));
      value_ += (swash_ - value_) * (1.0 - std::exp(-s.h / (0.8 * time_)));
    } else {  // First order, a tenth slower down and a tenth faster up.
      const double tau = time_ * (p.pressure > value_ ? 0.9 : 1.1);
      value_ += (p.pressure - value_) * (1.0 - std::exp(-s.h / tau));
    }
    p.pressure = value_;
  }
  std::vector<HiddenParameter> parameters() const override { return {{"tau", time_, "s", time_}}; }

 private:
  std::size_t at_;
  int law_;
  double time_, value_ = 0.0, swash_ = 0.0;
  bool started_ = false;
};

double usual_flow(const LawContext& c) {
  double sum = 0.0;
  for (const int i : c.pump().feeds)
    sum += c.laws->cylinders[static_cast<std::size_t>(i)].direction[0].valve_gain;
  const double most = c.pump().max_flow > 0.0 ? c.pump().max_flow : sum;
  return 0.7 * std::min(sum, most);
}

class FlowMargin final : public HiddenLaw {
 public:
  explicit FlowMargin(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)),
        feeds_(c.pump().feeds),
        law_(c.law),
        usual_(usual_flow(c)),
        rise_(c.size * c.draw(6.0, 15.0) * kBar) {}
  void demand(PlantState& s) override {
    double flow = 0.0;
    for (const int i : feeds_) flow += s.cylinders[static_cast<std::size_t>(i)].flow;
    const double r = flow / usual_;
    double p = rise_ * r * r;
    if (law_ == 1) p = rise_ * std::pow(r, 1.8);
    if (law_ == 2) p = rise_ * (0.12 * r + 0.88 * r * r);
    for (const int i : feeds_) s.cylinders[static_cast<std::size_t>(i)].margin += p;
    equivalent_.add(p, flow * flow);
  }
  std::vector<HiddenParameter> parameters() const override {
    const double k = rise_ / (usual_ * usual_);
    return {{"k", k, "Pa/(m^3/s)^2", equivalent_.value(k)}};
  }

 private:
  std::size_t at_;
  std::vector<int> feeds_;
  int law_;
  double usual_, rise_;
  Equivalent equivalent_;
};

class TorqueLimit final : public HiddenLaw {
 public:
  explicit TorqueLimit(LawContext& c) : at_(static_cast<std::size_t>(c.at)), law_(c.law) {
    // Corner power of usual work: three quarters of the largest flow at a third of the largest pressure.
    const double corner = usual_flow(c) * 0.36 * c.pump().max_pressure;
    power_ = corner * (1.0 - c.size * c.draw(0.25, 0.45));
    most_ = usual_flow(c) / 0.7;
  }
  void pump(PlantState& s) override {
    PumpState& p = s.pumps[at_];
    if (p.flow <= 0.0) return;
    p.pressure = std::min(p.pressure, limit(p.flow));
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"power", power_, "W", power_}};
  }

 private:
  double limit(double flow) const {
    if (law_ == 0) return power_ / flow;
    // Law 1: two springs give three straight pieces within a few per cent of the hyperbola.
    const double at[5] = {0.15, 0.3, 0.5, 0.75, 1.05};
    const double r = flow / most_;
    if (r <= at[0] || r >= at[4]) return power_ / flow;
    int k = 0;
    while (r > at[k + 1]) ++k;
    const double a = 1.0 / at[k], b = 1.0 / at[k + 1];
    return power_ / most_ * (a + (b - a) * (r - at[k]) / (at[k + 1] - at[k])) * 0.97;
  }
  std::size_t at_;
  int law_;
  double power_ = 0.0, most_ = 1.0;
};

}  // namespace

std::vector<LawEntry> pump_laws() {
  const auto at = HiddenPlace::kPump;
  return {{"pump_lag",
           at,
           true,
           {"first order", "second order, overdamped", "slower down than up"},
           "tau [s] mean delay",
           make_law<PumpLag>,
           load_sensing},
          {"flow_dependent_margin",
           at,
           true,
           {"quadratic", "power 1.8", "laminar share 12 %"},
           "k [Pa/(m^3/s)^2] of the summed flow",
           make_law<FlowMargin>,
           load_sensing},
          {"torque_limit",
           at,
           true,
           {"hyperbola", "straight pieces of two springs"},
           "power [W]; pump pressure = min(demand, power / flow)",
           make_law<TorqueLimit>,
           load_sensing}};
}

}  // namespace sparflow::simulator
