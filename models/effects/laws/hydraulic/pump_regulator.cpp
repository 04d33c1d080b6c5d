#include "models/effects/laws/hydraulic/pump_regulator.h"

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

/// Damping ratio of the pressure in front of closed valves.
/// @threshold [1] 0.3..1; chosen: little overshoot, as regulators are set
constexpr double kDamping = 0.7;
/// Pressure drop at which a valve passes its full flow, as a share of the margin that it asks for.
/// @threshold [1] 0.2..1; chosen: the rest of the margin is lost between pump and valve and in the compensator
constexpr double kDropOverMargin = 0.5;
/// Longest step of the integration over the regulator's time constant.
/// @threshold [1] 0.05..1; numerical: halving it changes the pressure by less than 1 % of the margin
constexpr double kLongestStep = 0.5;
/// Pressure to which the flow balance of a step is solved.
/// @threshold [Pa] 1e-3..1e3; numerical: far below what a sensor resolves
constexpr double kSolved = 1.0;
/// Largest number of trials of that solution.
/// @threshold [1] 10..200; numerical: halving the bracket alone ends sooner
constexpr int kMostTrials = 60;

/// One section at one instant.
struct Section {
  double load = 0.0, margin = 0.0;  ///< [Pa]
  double rate = 0.0;                ///< [Pa/s] its full flow over the line's capacity
};

class Line {
 public:
  Line(double standby, const PumpRegulator& r) : standby_(standby), r_(r) {}

  void set(double pressure) {
    pressure_ = pressure;
    integral_ = pressure / r_.rest;
  }

  /// Implicit in the pressure, so that a short line needs no short steps.
  double step(const std::vector<Section>& open, double dt) {
    double low = 0.0, high = std::max(pressure_, standby_);
    for (const Section& s : open) high = std::max(high, s.load + s.margin);
    double at_low = excess(open, dt, low), at_high = excess(open, dt, high);
    for (int i = 0; i < kMostTrials && at_high < 0.0; ++i) {
      low = high, at_low = at_high;
      high *= 2.0;  // no threshold: a bracket that holds the solution
      at_high = excess(open, dt, high);
    }
    double p = high;
    // Illinois' regula falsi: the balance bends like a root where a valve begins to pass
    for (int i = 0, side = 0; i < kMostTrials && high - low > kSolved; ++i) {
      p = at_high > at_low ? low - at_low * (high - low) / (at_high - at_low) : 0.5 * (low + high);
      const double here = excess(open, dt, p);
      if (here > 0.0) {
        high = p, at_high = here;
        if (side > 0) at_low *= 0.5;
        side = 1;
      } else {
        low = p, at_low = here;
        if (side < 0) at_high *= 0.5;
        side = -1;
      }
      if (std::abs(here) * dt < kSolved) break;
    }
    const double e = error(open, p), asked = integral_ + 2.0 * kDamping * e / r_.tau;
    integral_ += dt * (e / (r_.tau * r_.tau) + (held(asked) - asked) / r_.tau);
    return pressure_ = p;
  }

 private:
  /// [Pa/s] of what the regulator asks for, what the pump delivers
  double held(double asked) const { return std::clamp(asked, 0.0, r_.most_flow / r_.capacity); }

  /// A closed check valve lets the line sense no more than its own pressure.
  double error(const std::vector<Section>& open, double p) const {
    double set = standby_;
    for (const Section& s : open) set = std::max(set, std::min(p, s.load) + s.margin);
    return set - p;
  }

  /// [Pa/s] by which a pressure at the end of the step is too high.
  double excess(const std::vector<Section>& open, double dt, double p) const {
    double out = (p - pressure_) / dt + p / r_.rest -
                 held(integral_ + 2.0 * kDamping * error(open, p) / r_.tau);
    for (const Section& s : open) out += s.rate * passed_share(p - s.load, s.margin);
    return out;
  }

  double standby_;
  PumpRegulator r_;
  double pressure_ = 0.0;  ///< [Pa]
  double integral_ = 0.0;  ///< [Pa/s] flow of the pump without the proportional part, over C
};

}  // namespace

double passed_share(double drop, double margin) {
  return std::sqrt(std::clamp(drop / (kDropOverMargin * margin), 0.0, 1.0));
}

Eigen::VectorXd regulated_pressure(const MachineSeries& log, double standby,
                                   const std::vector<OpenSection>& sections,
                                   const PumpRegulator& regulator, const Eigen::VectorXd& start) {
  Eigen::VectorXd out = start;
  Line line(standby, regulator);
  std::vector<Section> open;
  open.reserve(sections.size());
  for (const auto& [first, last] : log.runs) {
    line.set(start[first]);
    for (Eigen::Index k = first + 1; k < last; ++k) {
      open.clear();
      for (const OpenSection& s : sections) {
        if (!std::isfinite(s.load[k]) || !(s.margin[k] > 0.0)) continue;
        open.push_back({s.load[k], s.margin[k], s.flow[k] / regulator.capacity});
      }
      const double dt = log.time[k] - log.time[k - 1];
      const int parts =
          std::max(1, static_cast<int>(std::ceil(dt / (kLongestStep * regulator.tau))));
      for (int i = 0; i < parts; ++i) out[k] = line.step(open, dt / parts);
    }
  }
  return out;
}

}  // namespace sparflow
