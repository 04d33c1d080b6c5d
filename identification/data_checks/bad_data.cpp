#include "identification/data_checks/bad_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/data_checks/bad_data_checks.h"
#include "identification/data_checks/sensor_slips.h"
#include "models/machine/linkage.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// @return stroke of a cylinder over its joint's whole range [m]
double full_stroke(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (c.stroke) return *c.stroke;
  const Range range = machine.joints[static_cast<std::size_t>(c.joint)].position;
  return std::abs(stroke_at(machine, cylinder, range.hi) - stroke_at(machine, cylinder, range.lo));
}

/// Sets scale, largest rate, display unit and thresholds of a position or stroke.
void describe_position(const CheckContext& context, CheckedChannel& c) {
  const Machine& machine = context.machine;
  const bool stroke = c.channel->role == Role::kStroke;
  const int joint = stroke ? machine.cylinders[static_cast<std::size_t>(c.channel->index)].joint
                           : c.channel->index;
  c.cylinder = stroke ? c.channel->index : machine.cylinder_of_joint(joint);
  const Joint& j = machine.joints[static_cast<std::size_t>(joint)];
  const double range = j.position.hi - j.position.lo;
  c.family = "position";
  c.scale = stroke ? full_stroke(machine, c.channel->index) : range;
  const double limit = std::max(std::abs(j.velocity.lo), std::abs(j.velocity.hi));
  // The largest speed of a stroke is that of the joint by the mean lever.
  c.fastest = limit * (range > 0.0 ? c.scale / range : 1.0);
  if (j.type == JointType::kRevolute && !stroke) {
    c.field = units::kDegree;
    c.field_unit = "deg";
  } else {
    c.field = 1e-3;
    c.field_unit = "mm";
  }
  const SavitzkyGolay filter(context.log.time, context.log.runs, context.signals.window);
  const double gain = filter.noise_gain(1);
  c.least_noise = gain > 0.0 ? context.options.least_speed_share * c.fastest / gain : 0.0;
  c.least_jump = context.options.jump_speed_ratio * c.fastest * context.log.step;
}

CheckedChannel describe(const CheckContext& context, const Channel& channel) {
  CheckedChannel c;
  c.channel = &channel;
  c.field_unit = channel.unit;
  const auto pressure = [&] {
    c.field = units::kBar;
    c.field_unit = "bar";
    c.least_noise = context.options.least_pressure;
    c.least_jump = context.options.pressure_jump_ratio * context.options.least_pressure;
  };
  switch (channel.role) {
    case Role::kJointPosition:
    case Role::kStroke:
      describe_position(context, c);
      break;
    case Role::kPressureA:
    case Role::kPressureB:
      c.cylinder = channel.index;
      c.family = "pressure";
      pressure();
      break;
    case Role::kPumpPressure:
      c.family = "pressure";
      pressure();
      break;
    case Role::kReturnPressure:  // often a sensor of another range, so it has no peers
      pressure();
      break;
    case Role::kCommand:
      c.cylinder = channel.index;
      c.field_unit = "";
      c.least_noise = context.options.least_command;
      c.least_jump = context.options.command_jump_ratio * context.options.least_command;
      break;
    case Role::kOilTemperature:
      c.field_unit = "degC";
      c.least_noise = context.options.least_oil;
      c.least_jump = context.options.least_oil_jump;
      break;
    default:
      c.cylinder = channel.role == Role::kPayload ? -1 : channel.index;
      break;
  }
  return c;
}

/// @return affected stretches, from their first to their last sample [s]
std::vector<std::pair<double, double>> stretches_of(const Log& log, const Mask& affected) {
  std::vector<std::pair<double, double>> out;
  for (Index k = 0; k < affected.size(); ++k) {
    if (!affected[k]) continue;
    const double t = log.time[k];
    if (k > 0 && affected[k - 1]) {
      out.back().second = t;
    } else {
      out.emplace_back(t, t);
    }
  }
  return out;
}

BadChannel report(const CheckContext& context, std::size_t i, Finding found) {
  BadChannel bad;
  const Index n = context.log.samples();
  bad.channel = context.channels[i].channel->signal;
  bad.kind = found.kind;
  Index first = 0, last = n - 1;
  while (first < last && !found.affected[first]) ++first;
  while (last > first && !found.affected[last]) --last;
  bad.from_s = context.log.time[first];
  bad.to_s = context.log.time[last];
  bad.share = static_cast<double>(found.affected.cast<Index>().sum()) / static_cast<double>(n);
  bad.evidence = std::move(found.evidence);
  bad.remedy = std::move(found.remedy);
  bad.file = context.log.file;
  bad.unit = context.channels[i].field_unit;
  bad.time = context.log.time;
  bad.values = context.channels[i].channel->values / context.channels[i].field;
  bad.stretches = stretches_of(context.log, found.affected);
  return bad;
}

/// Removes findings on commands whose cylinder has a faulty position, because commands are judged by the motion.
void keep_position_only(const CheckContext& context, std::vector<BadChannel>& bad) {
  std::vector<int> without_position;
  const auto find = [&](const BadChannel& b) -> const CheckedChannel& {
    return *std::find_if(context.channels.begin(), context.channels.end(),
                         [&](const CheckedChannel& c) { return c.channel->signal == b.channel; });
  };
  for (const BadChannel& b : bad) {
    const CheckedChannel& c = find(b);
    if (c.family == "position") without_position.push_back(c.cylinder);
  }
  std::erase_if(bad, [&](const BadChannel& b) {
    const CheckedChannel& c = find(b);
    return c.channel->role == Role::kCommand &&
           std::find(without_position.begin(), without_position.end(), c.cylinder) !=
               without_position.end();
  });
}

/// Removes the noise of channels that are in another unit, whose noise cannot be compared with that of their peers.
void leave_other_units(const Machine& machine, const MachineSignals& signals,
                       std::vector<BadChannel>& bad) {
  const auto noisy = [](const BadChannel& b) { return b.kind == BadDataKind::kNoisy; };
  if (std::none_of(bad.begin(), bad.end(), noisy)) return;
  for (const SensorSlip& slip : find_sensor_slips(machine, signals))
    std::erase_if(bad, [&](const BadChannel& b) {
      return noisy(b) && std::find(slip.channels.begin(), slip.channels.end(), b.channel) !=
                             slip.channels.end();
    });
}

}  // namespace

const char* bad_data_word(BadDataKind kind) {
  switch (kind) {
    case BadDataKind::kStuck:
      return "stuck";
    case BadDataKind::kJumping:
      return "jumping";
    case BadDataKind::kNoisy:
      return "noisy";
    case BadDataKind::kDropOut:
      return "drop_out";
    case BadDataKind::kSaturated:
      return "saturated";
    case BadDataKind::kWild:
      return "wild";
    case BadDataKind::kRippling:
      return "rippling";
  }
  return "";
}

bool is_computed_motion(const Machine& machine, const Log& log) {
  const auto has = [&](const std::string& column) {
    return std::any_of(log.channels.begin(), log.channels.end(),
                       [&](const Channel& c) { return c.column == column; });
  };
  return !machine.joints.empty() && has("power_W") &&
         std::all_of(machine.joints.begin(), machine.joints.end(), [&](const Joint& j) {
           const char* unit = j.type == JointType::kRevolute ? "rad" : "m";
           return has(fmt::format("qd_{}_{}_s", j.name, unit)) &&
                  has(fmt::format("qdd_{}_{}_s2", j.name, unit));
         });
}

std::string bad_channel_sentence(const BadChannel& bad) {
  const char* words[] = {"is stuck",         "jumps",  "is noisy", "drops out", "is cut off",
                         "has wild samples", "ripples"};
  return fmt::format("{} {} between {:.1f} and {:.1f} s ({:.3g} % of the log): {}. {}.",
                     bad.channel, words[static_cast<int>(bad.kind)], bad.from_s, bad.to_s,
                     100.0 * bad.share, bad.evidence, bad.remedy);
}

std::vector<BadChannel> find_bad_channels(const Machine& machine, const Log& log,
                                          const MachineSignals& signals,
                                          const BadDataOptions& options) {
  std::vector<BadChannel> out;
  if (log.samples() < 2) return out;
  CheckContext context{machine, log, signals, options, {}, {}};
  for (const Channel& channel : log.channels) {
    if (channel.role == Role::kCandidate) continue;
    context.channels.push_back(describe(context, channel));
    context.noise.push_back(noise_profile(channel.values, log, options));
  }
  // The first finding of a channel ends its checks: a stuck channel is not reported for the jumps into and out of its value.
  using Check = std::optional<Finding> (*)(const CheckContext&, std::size_t);
  // Likewise blocks are noisy where many samples are wild, so that these come first.
  const Check checks[] = {check_missing, check_stuck, check_stuck_command, check_wild,
                          check_ripple,  check_noise, check_saturated,     check_jumps};
  const bool computed = is_computed_motion(machine, log);
  for (std::size_t i = 0; i < context.channels.size(); ++i) {
    for (const Check check : checks) {
      if (computed && check != &check_missing) continue;
      std::optional<Finding> found = check(context, i);
      if (!found) continue;
      out.push_back(report(context, i, std::move(*found)));
      break;
    }
  }
  keep_position_only(context, out);
  leave_other_units(machine, signals, out);
  std::stable_sort(out.begin(), out.end(),
                   [](const BadChannel& a, const BadChannel& b) { return a.share > b.share; });
  return out;
}

}  // namespace sparflow
