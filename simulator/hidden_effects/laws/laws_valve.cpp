/// Hidden effects: valve, between lever and flow.
#include <algorithm>
#include <cmath>
#include <deque>

#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

constexpr double kClosed = 0.002;  // [-] opening below which a spool's lands overlap

class Deadband final : public HiddenLaw {
 public:
  explicit Deadband(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), law_(c.law), extend_(c.size * c.draw(0.04, 0.13)) {
    retract_ = c.random->chance(0.5) ? extend_ : c.size * c.draw(0.03, 0.13);
  }
  void opening(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    const double u = std::abs(c.opening), gap = c.opening > 0.0 ? extend_ : retract_;
    double open = std::max(0.0, u - gap);
    if (law_ == 1) open = std::max(0.0, u - gap) / (1.0 - gap);
    if (law_ == 2) {  // Smooth knee, with a width of a fifth of the dead band.
      const double w = 0.1 * gap;
      open += w * std::log1p(std::exp(-std::abs(u - gap) / w));
      if (open < kClosed) open = 0.0;
    }
    c.opening = sign_of(c.opening) * open;
  }
  double lever_deadband(int cylinder, int side) const override {
    if (static_cast<std::size_t>(cylinder) != at_) return 0.0;
    return side > 0 ? extend_ : (side < 0 ? retract_ : 0.0);
  }
  std::vector<HiddenParameter> parameters() const override {
    const double full = law_ == 1 ? 1.0 : 0.0;
    return {{"u0_extend", extend_, "-", extend_},
            {"u0_retract", retract_, "-", retract_},
            {"full_flow", full, "-", full}};
  }

 private:
  std::size_t at_;
  int law_;
  double extend_, retract_;
};

class Lag final : public HiddenLaw {
 public:
  explicit Lag(LawContext& c)
      : at_(static_cast<std::size_t>(c.at)), law_(c.law), time_(c.size * c.draw(0.12, 0.3)) {}
  void opening(PlantState& s) override {
    CylinderState& c = s.cylinders[at_];
    const double lever = c.opening;
    if (law_ == 1) {  // pure delay
      queue_.push_back(lever);
      const auto late = static_cast<std::size_t>(std::lround(time_ / s.h));
      while (queue_.size() > late + 1) queue_.pop_front();
      spool_ = queue_.size() > late ? queue_.front() : 0.0;
    } else if (law_ == 0) {
      spool_ += (lever - spool_) * (1.0 - std::exp(-s.h / time_));
    } else {  // pilot stage and main stage
      const double share = 1.0 - std::exp(-2.0 * s.h / time_);
      pilot_ += (lever - pilot_) * share;
      spool_ += (pilot_ - spool_) * share;
    }
    c.opening = std::abs(spool_) < kClosed ? 0.0 : spool_;
  }
  void demand(PlantState& s) override {
    // Law 0: the electronic pump control follows the lever, not the spool.
    CylinderState& c = s.cylinders[at_];
    if (law_ == 0) c.asked = sign_of(c.command);
  }
  std::vector<HiddenParameter> parameters() const override {
    const double pure = law_ == 1 ? 1.0 : 0.0;
    return {{"tau", time_, "s", time_}, {"delay", pure, "-", pure}};
  }

 private:
  std::size_t at_;
  int law_;
  double time_, spool_ = 0.0, pilot_ = 0.0;
  std::deque<double> queue_;
};

/// Failed pressure compensator: the flow follows the pressure drop over the spool, which another cylinder of the pump raises.
class LostCompensator final : public HiddenLaw {
 public:
  explicit LostCompensator(LawContext& c)
      : machine_(c.machine),
        at_(static_cast<std::size_t>(c.at)),
        law_(c.law),
        size_(std::min(1.0, c.size)),
        share_(c.draw(0.7, 1.0)) {}
  void flow(PlantState& s) override {
    const int p = machine_->pump_of_cylinder(static_cast<int>(at_));
    CylinderState& c = s.cylinders[at_];
    if (p < 0 || c.side == 0) return;
    const double chamber = c.side > 0 ? c.pressure_a : c.pressure_b;
    const double over = std::max(2e5, s.pumps[static_cast<std::size_t>(p)].pressure - chamber) /
                        std::max(1e5, c.margin);
    // root of the drop; law 1: in proportion to it where it is small, as in a laminar gap
    const double free =
        law_ == 1 ? over * std::sqrt((1.0 + kLaminar) / (over + kLaminar)) : std::sqrt(over);
    // A compensator that still yields a little leaves a smaller power; the valve's own limits keep the flow within twice its value.
    const double gain = std::clamp(std::pow(free, size_), 0.5, 2.0);
    smooth_ += (gain - smooth_) * std::min(1.0, s.h / 0.08);
    c.flow *= 1.0 + share_ * (smooth_ - 1.0);
  }
  // The published law's share of the flow depends on the valve's gain, which is learned beside it, so that no value is comparable.
  std::vector<HiddenParameter> parameters() const override { return {}; }

 private:
  static constexpr double kLaminar = 0.05;  // [-] drop of the transition over the margin
  const Machine* machine_;
  std::size_t at_;
  int law_;
  double size_, share_, smooth_ = 1.0;
};

class Saturation final : public HiddenLaw {
 public:
  explicit Saturation(LawContext& c) : feeds_(c.pump().feeds), law_(c.law) {
    double sum = 0.0, single = 0.0;
    for (const int i : feeds_) {
      const auto& d = c.laws->cylinders[static_cast<std::size_t>(i)].direction;
      const double gain = std::max(d[0].valve_gain, d[1].valve_gain);
      sum += gain;
      single = std::max(single, gain);
    }
    const double most = std::min(sum, c.pump().max_flow > 0.0 ? c.pump().max_flow : sum);
    limit_ = most * (1.0 - c.size * c.draw(0.3, 0.5));
    (void)single;
  }
  void flow(PlantState& s) override {
    double sum = 0.0;
    for (const int i : feeds_) sum += s.cylinders[static_cast<std::size_t>(i)].flow;
    if (sum <= 0.0) return;
    double given = std::min(sum, limit_);
    if (law_ == 1) given = sum / std::pow(1.0 + std::pow(sum / limit_, 16.0), 1.0 / 16.0);
    for (const int i : feeds_) s.cylinders[static_cast<std::size_t>(i)].flow *= given / sum;
  }
  std::vector<HiddenParameter> parameters() const override {
    return {{"limit", limit_, "m^3/s", limit_}};
  }

 private:
  std::vector<int> feeds_;
  int law_;
  double limit_ = 0.0;
};

bool shares_pump(const Machine& machine, int i) {
  const int p = machine.pump_of_cylinder(i);
  if (p < 0 || !hydraulic(machine, i)) return false;
  const Pump& pump = machine.pumps[static_cast<std::size_t>(p)];
  return pump.feeds.size() > 1 && pump.type == PumpType::kLoadSensing;
}

}  // namespace

std::vector<LawEntry> valve_laws() {
  return {{"valve_deadband",
           HiddenPlace::kCylinder,
           true,
           {"|u| - u0", "(|u| - u0) / (1 - u0)", "smooth knee"},
           "u0_extend, u0_retract [-], full_flow 1: rescaled",
           make_law<Deadband>,
           hydraulic},
          {"valve_lag",
           HiddenPlace::kCylinder,
           true,
           {"first order, pump follows the lever", "pure delay", "two stages"},
           "tau [s] (two stages: their sum), delay 1: pure delay",
           make_law<Lag>,
           hydraulic},
          {"valve_pressure_drop",
           HiddenPlace::kCylinder,
           true,
           {"root of the pressure drop", "laminar at small drops"},
           "",
           make_law<LostCompensator>,
           shares_pump},
          {"flow_saturation",
           HiddenPlace::kPump,
           true,
           {"limit shared in proportion", "soft knee"},
           "limit [m^3/s]",
           make_law<Saturation>}};
}

}  // namespace sparflow::simulator
