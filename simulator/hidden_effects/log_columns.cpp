#include "simulator/hidden_effects/log_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow::simulator {
namespace {

constexpr double kOilNoise = 0.12;    // [K] standard deviation
constexpr double kForceNoise = 0.01;  // [-] of a drive's RMS force

using Columns = std::vector<std::vector<double>>;

void add_to(Columns& values, const Columns& noise) {
  for (std::size_t c = 0; c < values.size(); ++c)
    for (std::size_t i = 0; i < values[c].size(); ++i) values[c][i] += noise[c][i];
}

}  // namespace

LogRecorder::LogRecorder(const Machine& machine, const LogRequest& request, std::size_t rows)
    : machine_(machine), request_(request) {
  r_.rate = request.rate;
  r_.q.resize(machine.joints.size());
  for (auto* c : {&r_.command, &r_.pressure_a, &r_.pressure_b, &force_})
    c->resize(machine.cylinders.size());
  r_.pump.resize(machine.pumps.size());
  for (auto* group : {&r_.q, &r_.command, &r_.pressure_a, &r_.pressure_b, &r_.pump, &force_})
    for (auto& column : *group) column.reserve(rows);
}

void LogRecorder::add(const PlantState& state, const SensorState& sensors, double payload) {
  r_.time.push_back(static_cast<double>(r_.time.size()) / request_.rate);
  r_.payload.push_back(payload);
  r_.oil.push_back(state.oil);
  for (std::size_t k = 0; k < r_.q.size(); ++k) r_.q[k].push_back(sensors.q[k]);
  for (std::size_t i = 0; i < r_.command.size(); ++i) {
    r_.command[i].push_back(state.cylinders[i].command);
    r_.pressure_a[i].push_back(sensors.pressure_a[i]);
    r_.pressure_b[i].push_back(sensors.pressure_b[i]);
    force_[i].push_back(state.cylinders[i].force);
  }
  for (std::size_t p = 0; p < r_.pump.size(); ++p) r_.pump[p].push_back(sensors.pump[p]);
}

void LogRecorder::finish(std::vector<std::unique_ptr<HiddenLaw>>& hidden, Random& random) {
  const auto white = [&](const Columns& like, Columns& noise, auto level) {
    noise.resize(like.size());
    for (std::size_t c = 0; c < like.size(); ++c) {
      noise[c].resize(like[c].size());
      const double sigma = level(c) * request_.noise_factor;
      for (double& v : noise[c]) v = sigma * random.normal();
    }
  };
  white(r_.q, r_.noise_q, [&](std::size_t k) {
    return machine_.joints[k].type == JointType::kRevolute ? kAngleNoise : kTravelNoise;
  });
  const auto pressure = [](std::size_t) { return kPressureNoise; };
  white(r_.pressure_a, r_.noise_a, pressure);
  white(r_.pressure_b, r_.noise_b, pressure);
  white(r_.pump, r_.noise_pump, pressure);
  for (auto& law : hidden) law->recording(r_, random);
  add_to(r_.q, r_.noise_q);
  add_to(r_.pressure_a, r_.noise_a);
  add_to(r_.pressure_b, r_.noise_b);
  add_to(r_.pump, r_.noise_pump);
  for (double& t : r_.oil) t += kOilNoise * random.normal();
  for (std::size_t i = 0; i < force_.size(); ++i) {
    if (machine_.cylinders[i].hydraulic()) continue;
    double square = 0.0;
    for (const double f : force_[i]) square += f * f;
    const double sigma = kForceNoise * request_.noise_factor *
                         std::sqrt(square / std::max(1.0, static_cast<double>(force_[i].size())));
    for (double& f : force_[i]) f += sigma * random.normal();
  }
}

GeneratedLog LogRecorder::log() const {
  GeneratedLog log;
  const auto add = [&](std::string name, const std::vector<double>& values, double unit,
                       int decimals, double least) {
    const double scale = std::pow(10.0, decimals);
    std::vector<double> column(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      column[i] = std::round(std::max(values[i] / unit, least) * scale) / scale;
    log.names.push_back(std::move(name));
    log.decimals.push_back(decimals);
    log.columns.push_back(std::move(column));
  };
  constexpr double kAny = -1e300;
  const LogChannels& has = request_.channels;
  add("t_s", r_.time, 1.0, 3, kAny);
  for (std::size_t k = 0; k < r_.q.size(); ++k) {
    const Joint& joint = machine_.joints[k];
    const int drive = machine_.cylinder_of_joint(static_cast<int>(k));
    if (has.strokes && drive >= 0) {
      std::vector<double> x(r_.q[k].size());
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = stroke_at(machine_, drive, r_.q[k][i]);
      add("x_" + machine_.cylinders[static_cast<std::size_t>(drive)].name + "_m", x, 1.0, 5, kAny);
    } else {
      add("q_" + joint.name + (joint.type == JointType::kRevolute ? "_rad" : "_m"), r_.q[k], 1.0, 4,
          kAny);
    }
  }
  for (std::size_t i = 0; has.commands && i < r_.command.size(); ++i)
    add("u_" + machine_.cylinders[i].name, r_.command[i], 1.0, 4, kAny);
  // A transducer of 0..400 bar cannot read a negative pressure.
  constexpr double kNoSuction = 0.0;
  for (std::size_t i = 0; i < r_.command.size(); ++i) {
    const std::string& name = machine_.cylinders[i].name;
    if (!machine_.cylinders[i].hydraulic()) {
      add("force_" + name + "_N", force_[i], 1.0, 3, kAny);
      continue;
    }
    add("pA_" + name + "_bar", r_.pressure_a[i], kBar, 1, kNoSuction);
    if (has.pressure_b) add("pB_" + name + "_bar", r_.pressure_b[i], kBar, 1, kNoSuction);
  }
  for (std::size_t p = 0; has.pumps && p < r_.pump.size(); ++p)
    add("p_" + machine_.pumps[p].name + "_bar", r_.pump[p], kBar, 1, kNoSuction);
  if (has.payload) add("payload_kg", r_.payload, 1.0, 0, kAny);
  if (has.oil) add("oil_C", r_.oil, 1.0, 1, kAny);
  return log;
}

const std::vector<double>* GeneratedLog::find(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? nullptr : &columns[static_cast<std::size_t>(at - names.begin())];
}

std::string csv_text(const GeneratedLog& log) {
  fmt::memory_buffer out;
  fmt::format_to(std::back_inserter(out), "{}\n", fmt::join(log.names, ","));
  for (std::size_t row = 0; row < log.rows(); ++row) {
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      fmt::format_to(std::back_inserter(out), "{}{:.{}f}", c == 0 ? "" : ",", log.columns[c][row],
                     log.decimals[c]);
    }
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

void write_csv(const GeneratedLog& log, const std::string& path) {
  write_file_atomically(path, csv_text(log));
}

}  // namespace sparflow::simulator
