#include "identification/log/log_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "models/math/nan.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

// Limits beyond which the unit must be wrong: no machine turns a joint four times, has 1000 bar or strokes of 50 m.
constexpr double kLargestAngle = 8.0 * std::numbers::pi;
constexpr double kLargestLength = 50.0;
constexpr double kLargestPressure = 1000.0 * units::kBar;
constexpr double kPsi = 6894.757293168361;  // [Pa]
constexpr double kLowestPressure =
    -2.0 * units::kBar;  // absolute zero is -1 bar gauge; sensors drift
constexpr double kLargestCommand = 1.5;
constexpr double kRangeTolerance = 0.02;  // of the range, the accuracy of geometry from drawings
constexpr double kStuck = 2.0;            // [s] of equal values on a sensor with noise
constexpr Eigen::Index kStuckSamples = 20;

constexpr double kLowPressures = 40.0 * units::kBar;  // 40 MPa (400 bar) taken for bar
/// Range of static force over measured force when MPa are taken for bar: ten, with a tolerance for friction, dynamics and
/// inaccurate masses.
constexpr Range kTenfold{5.0, 20.0};
constexpr Eigen::Index kBalanceSamples = 200;  // evenly over the log, enough for a mean force

struct Extent {
  double lo = 0.0, hi = 0.0;
  bool any = false;
};

Extent extent_of(const Channel& channel) {
  Extent e;
  for (Eigen::Index i = 0; i < channel.values.size(); ++i) {
    if (!channel.valid[i]) continue;
    const double v = channel.values[i];
    e = e.any ? Extent{std::min(e.lo, v), std::max(e.hi, v), true} : Extent{v, v, true};
  }
  return e;
}

double largest(const Extent& e) { return std::max(std::abs(e.lo), std::abs(e.hi)); }

/// @return whether most samples of a revolute joint lie outside its range and all lie inside when taken as degrees
bool looks_like_degrees(const Channel& channel, Range range, const Extent& e) {
  const double tolerance = kRangeTolerance * (range.hi - range.lo);
  if (!(tolerance > 0.0)) return false;
  Eigen::Index outside = 0, valid = 0;
  for (Eigen::Index i = 0; i < channel.values.size(); ++i) {
    if (!channel.valid[i]) continue;
    ++valid;
    outside += channel.values[i] < range.lo - tolerance || channel.values[i] > range.hi + tolerance;
  }
  return 2 * outside > valid && e.lo * units::kDegree >= range.lo - tolerance &&
         e.hi * units::kDegree <= range.hi + tolerance;
}

/// A range that the machine file gives for a channel, in SI.
struct FileRange {
  Range range;
  const char* of_what;  ///< "the joint's range"
  const char* unit;     ///< the SI unit, as messages show it
};

/// Warns of valid samples outside the range by more than the tolerance.
void check_range(const Channel& channel, const FileRange& file, Log* log) {
  const Range& range = file.range;
  const double tolerance = kRangeTolerance * (range.hi - range.lo);
  if (!(tolerance > 0.0)) return;
  Eigen::Index outside = 0, valid = 0;
  for (Eigen::Index i = 0; i < channel.values.size(); ++i) {
    if (!channel.valid[i]) continue;
    ++valid;
    const double v = channel.values[i];
    if (v < range.lo - tolerance || v > range.hi + tolerance) ++outside;
  }
  if (outside == 0) return;
  const Extent e = extent_of(channel);
  log->warnings.push_back(
      fmt::format("{}: {:.3g} % of the samples lie outside {} of the machine file ({:.4g} to "
                  "{:.4g} {}, measured "
                  "{:.4g} to {:.4g}); check sign, zero and unit",
                  channel.column, 100.0 * static_cast<double>(outside) / static_cast<double>(valid),
                  file.of_what, range.lo, range.hi, file.unit, e.lo, e.hi));
}

/// Warns of a long stretch of equal values on a channel that otherwise seldom repeats one.
void check_stuck(const Channel& channel, Log* log) {
  Eigen::Index equal_steps = 0, steps = 0, best_begin = 0, best = 0, begin = 0;
  for (Eigen::Index i = 1; i < channel.values.size(); ++i) {
    if (!channel.valid[i] || !channel.valid[i - 1]) {
      begin = i;
      continue;
    }
    ++steps;
    if (channel.values[i] != channel.values[i - 1]) {
      begin = i;
      continue;
    }
    ++equal_steps;
    if (i - begin > best) best = i - begin, best_begin = begin;
  }
  if (steps < kStuckSamples) return;
  if (equal_steps == steps) {
    log->warnings.push_back(
        fmt::format("{}: the same value in all samples; is the sensor connected?", channel.column));
    return;
  }
  const double from = log->time[best_begin], to = log->time[best_begin + best];
  const bool noisy = 2 * (equal_steps - best) < steps - best;
  if (best >= kStuckSamples && to - from > kStuck && noisy) {
    log->warnings.push_back(
        fmt::format("{}: exactly the same value from {:.2f} to {:.2f} s; did the sensor hang?",
                    channel.column, from, to));
  }
}

/// Warns of jumps faster than ten times the joint's velocity limit and larger than a hundredth of its range.
void check_jumps(const Channel& channel, const Joint& joint, Log* log) {
  const double speed = 10.0 * std::max(std::abs(joint.velocity.lo), std::abs(joint.velocity.hi));
  const double smallest = 0.01 * (joint.position.hi - joint.position.lo);
  if (!(speed > 0.0) || !(smallest > 0.0)) return;
  int jumps = 0;
  Eigen::Index first = 0;
  for (const SampleRange& run : log->runs) {
    for (Eigen::Index i = run.begin + 1; i < run.end; ++i) {
      if (!channel.valid[i] || !channel.valid[i - 1]) continue;
      const double step = std::abs(channel.values[i] - channel.values[i - 1]);
      if (step > smallest && step > speed * (log->time[i] - log->time[i - 1]) && jumps++ == 0) {
        first = i;
      }
    }
  }
  if (jumps == 0) return;
  log->warnings.push_back(fmt::format(
      "{}: {} {} faster than ten times the joint's velocity limit, the first at {:.2f} s "
      "(line {}); outliers, or a wrong unit of time?",
      channel.column, jumps, jumps == 1 ? "jump" : "jumps", log->time[first],
      log->line[static_cast<std::size_t>(first)]));
}

void check_position(const Channel& channel, const Machine& machine, const Extent& e, Log* log) {
  const Joint& joint = machine.joints[static_cast<std::size_t>(channel.index)];
  const bool revolute = joint.type == JointType::kRevolute;
  if (largest(e) > (revolute ? kLargestAngle : kLargestLength)) {
    log->warnings.push_back(
        fmt::format("{}: values up to {:.4g} {}; are they in {}? Then name the column {}_{}",
                    channel.column, largest(e), channel.unit, revolute ? "degrees" : "millimetres",
                    channel.signal, revolute ? "deg" : "mm"));
    return;
  }
  if (revolute && looks_like_degrees(channel, joint.position, e)) {
    log->warnings.push_back(fmt::format(
        "{}: values from {:.4g} to {:.4g}, the joint ranges from {:.4g} to {:.4g} rad; are they in "
        "degrees? Then name the column {}_deg",
        channel.column, e.lo, e.hi, joint.position.lo, joint.position.hi, channel.signal));
    return;
  }
  check_range(channel, {joint.position, "the joint's range", revolute ? "rad" : "m"}, log);
  check_jumps(channel, joint, log);
}

void check_pressure(const Channel& channel, const Extent& e, Log* log) {
  if (largest(e) > kLargestPressure) {
    // The largest unit in which no value is beyond what machines have.
    const char* unit = "Pa";
    for (const auto& [name, pascals] : {std::pair{"psi", kPsi}, std::pair{"kPa", 1e3}}) {
      if (largest(e) * pascals / units::kBar > kLargestPressure) continue;
      unit = name;
      break;
    }
    log->warnings.push_back(
        fmt::format("{}: values up to {:.4g} bar; are they in {}? Then name the column {}_{}",
                    channel.column, largest(e) / units::kBar, unit, channel.signal, unit));
  } else if (e.lo < kLowestPressure) {
    log->warnings.push_back(
        fmt::format("{}: values down to {:.4g} bar, below vacuum; check the sensor's zero",
                    channel.column, e.lo / units::kBar));
  }
  check_stuck(channel, log);
}

/// @return joint coordinate of one sample from its channel or from its cylinder's stroke; NaN when unknown
double joint_position(const Machine& machine, const Log& log, int joint, Eigen::Index k) {
  if (const Channel* q = log.find(Role::kJointPosition, joint)) return q->values[k];
  const int cylinder = machine.cylinder_of_joint(joint);
  const Channel* x = cylinder >= 0 ? log.find(Role::kStroke, cylinder) : nullptr;
  if (x == nullptr || !x->valid[k]) return kNaN;
  return joint_at_stroke(machine, cylinder, x->values[k]);
}

/// Static and measured cylinder forces, summed over samples and cylinders. [N]
struct ForceBalance {
  double weight = 0.0;     ///< |static force| by virtual work
  double pressures = 0.0;  ///< |pA A_A - pB A_B|
};

ForceBalance force_balance(const Machine& machine, const Log& log) {
  ForceBalance sum;
  StaticForce statics(machine);
  std::vector<double> q(machine.joints.size());
  const Channel* payload = log.find(Role::kPayload);
  const Eigen::Index step = std::max<Eigen::Index>(1, log.samples() / kBalanceSamples);
  for (Eigen::Index k = 0; k < log.samples(); k += step) {
    try {
      for (int j = 0; j < machine.joint_count(); ++j)
        q[static_cast<std::size_t>(j)] = joint_position(machine, log, j, k);
      statics.update(q.data(), payload != nullptr && payload->valid[k] ? payload->values[k] : 0.0,
                     0);
    } catch (const std::domain_error&) {
      continue;  // the linkage does not reach this stroke; make_signals reports it
    }
    for (int i = 0; i < machine.cylinder_count(); ++i) {
      const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
      const Channel* a = log.find(Role::kPressureA, i);
      const Channel* b = log.find(Role::kPressureB, i);
      if (!cylinder.hydraulic() || a == nullptr || b == nullptr) continue;
      const double weight = std::abs(statics.force()[i]);
      const double pressures =
          std::abs(a->values[k] * cylinder.area_piston() - b->values[k] * cylinder.area_rod());
      if (!std::isfinite(weight) || !std::isfinite(pressures)) continue;
      sum.weight += weight;
      sum.pressures += pressures;
    }
  }
  return sum;
}

/// Warns of pressures that are probably in MPa: taken as bar they give a tenth of the static forces.
void check_megapascal(const Machine& machine, Log* log) {
  std::vector<std::string> columns;
  double highest = 0.0;
  const Channel* example = nullptr;
  for (const Channel& c : log->channels) {
    if (c.role != Role::kPressureA && c.role != Role::kPressureB && c.role != Role::kPumpPressure)
      continue;
    const Extent e = extent_of(c);
    if (!e.any) continue;
    highest = std::max(highest, largest(e));
    columns.push_back(c.column);
    if (example == nullptr) example = &c;
  }
  if (example == nullptr || highest >= kLowPressures) return;
  const ForceBalance balance = force_balance(machine, *log);
  if (!(balance.pressures > 0.0)) return;
  const double ratio = balance.weight / balance.pressures;
  if (ratio < kTenfold.lo || ratio > kTenfold.hi) return;
  log->warnings.push_back(fmt::format(
      "{}: no pressure above {:.3g} bar, but the machine's weight asks for {:.2g} times the force "
      "they give; are they in MPa? Then name the columns {}_MPa and so on",
      fmt::join(columns, ", "), highest / units::kBar, ratio, example->signal));
}

}  // namespace

void check_plausible(const Machine& machine, Log* log) {
  check_megapascal(machine, log);
  for (const Channel& channel : log->channels) {
    const Extent e = extent_of(channel);
    if (!e.any) continue;
    switch (channel.role) {
      case Role::kJointPosition:
        check_position(channel, machine, e, log);
        break;
      case Role::kStroke: {
        const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(channel.index)];
        if (largest(e) > kLargestLength) {
          log->warnings.push_back(fmt::format(
              "{}: values up to {:.4g} m; are they in millimetres? Then name the column {}_mm",
              channel.column, largest(e), channel.signal));
        } else if (cylinder.stroke) {
          check_range(channel, {{0.0, *cylinder.stroke}, "the cylinder's stroke", "m"}, log);
        }
        break;
      }
      case Role::kCommand:
        if (largest(e) > kLargestCommand) {
          log->warnings.push_back(
              fmt::format("{}: values up to {:.4g}, expected -1 to 1; are they in percent? Then "
                          "name the column "
                          "{}_percent",
                          channel.column, largest(e), channel.signal));
        }
        break;
      case Role::kPressureA:
      case Role::kPressureB:
      case Role::kPumpPressure:
        check_pressure(channel, e, log);
        break;
      case Role::kReturnPressure:
      case Role::kForce:
      case Role::kFlow:
      case Role::kPayload:
      case Role::kOilTemperature:
      case Role::kCandidate:
        break;
    }
  }
}

}  // namespace sparflow
