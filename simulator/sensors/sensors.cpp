#include "simulator/sensors/sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/units.h"

namespace sparflow::plant {
namespace {

constexpr double kShortestGap = 0.04, kLongestGap = 0.4;  // [s] of a channel that drops out

}  // namespace

Sensors::Sensors(const Machine& machine, const PlantParameters& parameters, std::uint64_t seed)
    : machine_(machine),
      sensors_(parameters.sensors),
      hook_mass_(parameters.pendulum.rope_length > 0.0 && machine.gravity.norm() > 0.0 &&
                         machine.tip.joint >= 0
                     ? parameters.pendulum.hook_mass
                     : 0.0),
      random_(seed, "sensors") {
  for (const Joint& j : machine.joints)
    add_channel(fmt::format("q_{}_{}", j.name, j.type == JointType::kRevolute ? "rad" : "m"),
                SensedKind::kPosition, 1.0);
  for (const Cylinder& c : machine.cylinders) add_channel("u_" + c.name, SensedKind::kExact, 1.0);
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c) {
    const Cylinder& drive = machine.cylinders[c];
    if (drive.hydraulic()) {
      add_channel(fmt::format("pA_{}_bar", drive.name), SensedKind::kPressure, units::kBar,
                  parameters.pressure_offset[c]);
      add_channel(fmt::format("pB_{}_bar", drive.name), SensedKind::kPressure, units::kBar);
    } else {
      add_channel(fmt::format("force_{}_N", drive.name), SensedKind::kForce, 1.0);
    }
  }
  for (const Pump& p : machine.pumps)
    add_channel(fmt::format("p_{}_bar", p.name), SensedKind::kPressure, units::kBar);
  if (!machine.pumps.empty()) add_channel("p_return_bar", SensedKind::kPressure, units::kBar);
  add_channel("payload_kg", SensedKind::kExact, 1.0);
  if (!machine.pumps.empty()) add_channel("oil_C", SensedKind::kExact, 1.0);
}

void Sensors::add_channel(const std::string& name, SensedKind kind, double scale, double offset) {
  channels_.push_back({name, kind, scale, offset});
}

std::vector<double> Sensors::values(const Record& r) const {
  std::vector<double> v = r.q;
  v.insert(v.end(), r.command.begin(), r.command.end());
  for (std::size_t c = 0; c < machine_.cylinders.size(); ++c) {
    if (machine_.cylinders[c].hydraulic()) {
      v.push_back(r.pressure_a[c]);
      v.push_back(r.pressure_b[c]);
    } else {
      v.push_back(r.force[c]);
    }
  }
  v.insert(v.end(), r.pump_pressure.begin(), r.pump_pressure.end());
  if (!machine_.pumps.empty()) v.push_back(r.tank_pressure);
  v.push_back(std::max(r.payload, hook_mass_));
  if (!machine_.pumps.empty()) v.push_back(std::round(10.0 * r.oil_temperature) / 10.0);
  return v;
}

double Sensors::sensed(SensedKind kind, double value) {
  double noise = 0.0, step = 0.0;
  if (kind == SensedKind::kPosition) {
    noise = sensors_.position_noise;
    step = sensors_.position_step;
  } else if (kind == SensedKind::kPressure) {
    noise = sensors_.pressure_noise;
    step = sensors_.pressure_step;
  } else if (kind == SensedKind::kForce) {
    largest_force_ = std::max(largest_force_, std::abs(value));
    noise = sensors_.force_noise * largest_force_;
  }
  // drawn even where it is not used, so that another noise changes no other channel
  const double draw = kind == SensedKind::kExact ? 0.0 : random_.normal();
  value += noise * draw;
  return step > 0.0 ? step * std::round(value / step) : value;
}

std::vector<double> Sensors::sense(const Record& record) {
  past_.emplace_back(record.t, values(record));
  const double late = record.t - sensors_.delay;
  while (past_.size() > 2 && past_[1].first <= late) past_.pop_front();
  const auto& [t0, before] = past_.front();
  const auto& [t1, after] = past_.size() > 1 ? past_[1] : past_.front();
  const double share = t1 > t0 ? std::clamp((late - t0) / (t1 - t0), 0.0, 1.0) : 0.0;
  const double step = past_.size() > 1 ? record.t - past_[past_.size() - 2].first : 0.0;
  std::vector<double> told(channels_.size());
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    SensedChannel& channel = channels_[c];
    const bool delayed =
        channel.kind == SensedKind::kPressure || channel.kind == SensedKind::kForce;
    const double value =
        delayed ? before[c] + share * (after[c] - before[c]) : past_.back().second[c];
    told[c] = sensed(channel.kind, value + channel.offset);
    if (channel.kind != SensedKind::kExact && sensors_.drop_out > 0.0) {
      if (random_.chance(sensors_.drop_out * step))
        channel.gap_until = record.t + random_.uniform(kShortestGap, kLongestGap);
    }
    if (record.t < channel.gap_until) told[c] = std::numeric_limits<double>::quiet_NaN();
  }
  return told;
}

}  // namespace sparflow::plant
