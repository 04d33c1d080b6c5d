#include "identification/log_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/units.h"

namespace sparflow {
namespace {

// No loader crane turns a boom four times, carries 1000 bar or strokes 50 m: beyond, the unit is wrong.
constexpr double kLargestAngle = 8.0 * std::numbers::pi;
constexpr double kLargestLength = 50.0;
constexpr double kLargestPressure = 1000.0 * units::kBar;
constexpr double kLowestPressure =
    -2.0 * units::kBar;  // absolute zero is -1 bar gauge; sensors drift
constexpr double kLargestCommand = 1.5;
constexpr double kRangeTolerance = 0.02;  // of the range; geometry from drawings is not better
constexpr double kStuck = 2.0;            // [s] of exactly equal values on a sensor that has noise
constexpr Eigen::Index kStuckSamples = 20;

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

/// Share of valid samples outside `range` by more than the tolerance, and how far at most.
void check_range(const Channel& channel, Range range, const char* of_what, double unit_shown,
                 const char* unit_name, Log* log) {
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
                  of_what, range.lo / unit_shown, range.hi / unit_shown, unit_name,
                  e.lo / unit_shown, e.hi / unit_shown));
}

/// The longest stretch of exactly equal values, on a channel that otherwise hardly ever repeats one.
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

/// Jumps no joint can make: ten times its velocity limit, and more than a hundredth of its range.
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
  check_range(channel, joint.position, "the joint's range", 1.0, revolute ? "rad" : "m", log);
  check_jumps(channel, joint, log);
}

void check_pressure(const Channel& channel, const Extent& e, Log* log) {
  if (largest(e) > kLargestPressure) {
    log->warnings.push_back(
        fmt::format("{}: values up to {:.4g} bar; are they in Pa? Then name the column {}_Pa",
                    channel.column, largest(e) / units::kBar, channel.signal));
  } else if (e.lo < kLowestPressure) {
    log->warnings.push_back(
        fmt::format("{}: values down to {:.4g} bar, below vacuum; check the sensor's zero",
                    channel.column, e.lo / units::kBar));
  }
  check_stuck(channel, log);
}

}  // namespace

void check_plausible(const Machine& machine, Log* log) {
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
          check_range(channel, {0.0, *cylinder.stroke}, "the cylinder's stroke", 1.0, "m", log);
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
