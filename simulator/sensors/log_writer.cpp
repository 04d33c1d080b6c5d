#include "simulator/sensors/log_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "models/math/units.h"

namespace sparflow::plant {
namespace {

constexpr double kShortestGap = 0.04, kLongestGap = 0.4;  // [s] of a channel that drops out

}  // namespace

LogWriter::LogWriter(const Machine& machine, const PlantParameters& parameters, std::uint64_t seed,
                     const std::string& remark)
    : machine_(machine), sensors_(parameters.sensors), random_(seed, "sensors") {
  for (const Joint& j : machine.joints)
    add_column(fmt::format("q_{}_{}", j.name, j.type == JointType::kRevolute ? "rad" : "m"),
               Kind::kPosition, 1.0);
  for (const Cylinder& c : machine.cylinders) add_column("u_" + c.name, Kind::kExact, 1.0);
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c) {
    const Cylinder& drive = machine.cylinders[c];
    if (drive.hydraulic()) {
      add_column(fmt::format("pA_{}_bar", drive.name), Kind::kPressure, units::kBar,
                 parameters.pressure_offset[c]);
      add_column(fmt::format("pB_{}_bar", drive.name), Kind::kPressure, units::kBar);
    } else {
      add_column(fmt::format("force_{}_N", drive.name), Kind::kForce, 1.0);
    }
  }
  for (const Pump& p : machine.pumps)
    add_column(fmt::format("p_{}_bar", p.name), Kind::kPressure, units::kBar);
  if (!machine.pumps.empty()) add_column("p_return_bar", Kind::kPressure, units::kBar);
  add_column("payload_kg", Kind::kExact, 1.0);
  if (!machine.pumps.empty()) add_column("oil_C", Kind::kExact, 1.0);
  if (!remark.empty()) text_ = "# " + remark + "\n";
  text_ += "t_s";
  for (const Column& c : columns_) text_ += "," + c.name;
  text_ += "\n";
}

void LogWriter::add_column(const std::string& name, Kind kind, double scale, double offset) {
  columns_.push_back({name, kind, scale, offset});
}

std::vector<double> LogWriter::values(const Record& r) const {
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
  v.push_back(r.payload);
  if (!machine_.pumps.empty()) v.push_back(std::round(10.0 * r.oil_temperature) / 10.0);
  return v;
}

double LogWriter::sensed(Kind kind, double value) {
  double noise = 0.0, step = 0.0;
  if (kind == Kind::kPosition) {
    noise = sensors_.position_noise;
    step = sensors_.position_step;
  } else if (kind == Kind::kPressure) {
    noise = sensors_.pressure_noise;
    step = sensors_.pressure_step;
  } else if (kind == Kind::kForce) {
    largest_force_ = std::max(largest_force_, std::abs(value));
    noise = sensors_.force_noise * largest_force_;
  }
  // drawn even where it is not used, so that another noise changes no other channel
  const double draw = kind == Kind::kExact ? 0.0 : random_.normal();
  value += noise * draw;
  return step > 0.0 ? step * std::round(value / step) : value;
}

void LogWriter::add(const Record& record) {
  past_.emplace_back(record.t, values(record));
  const double late = record.t - sensors_.delay;
  while (past_.size() > 2 && past_[1].first <= late) past_.pop_front();
  const auto& [t0, before] = past_.front();
  const auto& [t1, after] = past_.size() > 1 ? past_[1] : past_.front();
  const double share = t1 > t0 ? std::clamp((late - t0) / (t1 - t0), 0.0, 1.0) : 0.0;
  const double step = past_.size() > 1 ? record.t - past_[past_.size() - 2].first : 0.0;
  fmt::format_to(std::back_inserter(text_), "{:.4f}", record.t);
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    Column& column = columns_[c];
    const bool delayed = column.kind == Kind::kPressure || column.kind == Kind::kForce;
    const double value =
        delayed ? before[c] + share * (after[c] - before[c]) : past_.back().second[c];
    const double told = sensed(column.kind, value + column.offset) / column.scale;
    if (column.kind != Kind::kExact && sensors_.drop_out > 0.0) {
      if (random_.chance(sensors_.drop_out * step))
        column.gap_until = record.t + random_.uniform(kShortestGap, kLongestGap);
    }
    text_ += ',';
    if (record.t < column.gap_until) continue;
    fmt::format_to(std::back_inserter(text_), "{:.6g}", told);
  }
  text_ += '\n';
  ++rows_;
}

std::string LogWriter::text(const std::string& cut) const {
  return cut.empty() ? text_ : text_ + "# " + cut + "\n";
}

}  // namespace sparflow::plant
