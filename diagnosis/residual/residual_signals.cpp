#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "diagnosis/residual/residual_model.h"
#include "models/effects/hydraulics.h"
#include "models/effects/memory.h"
#include "models/effects/valve_flow.h"

namespace sparflow {

using Eigen::Index;
using Eigen::VectorXd;

namespace {
/// Position of the command inside the backlash, -1 .. 1; springs centre the spool where there is no command. [samples]
VectorXd side_of_play(const VectorXd& command, Index samples, double width) {
  VectorXd side = VectorXd::Zero(samples);
  double spool = 0.0;
  for (Index k = 0; k < std::min(samples, command.size()); ++k) {
    if (!std::isfinite(command[k])) continue;
    spool = command[k] == 0.0
                ? 0.0
                : std::clamp(spool, command[k] - 0.5 * width, command[k] + 0.5 * width);
    side[k] = (command[k] - spool) / (0.5 * width);
  }
  return side;
}

double value_or_zero(const VectorXd& v, Index k) { return k < v.size() ? v[k] : 0.0; }

/// Collects the signals of one channel. Signals that are constant in all rows are left out.
class SignalCollector {
 public:
  /// All must outlive this.
  SignalCollector(const Evidence& evidence, const EvidenceChannel& channel);

  void add_joints();
  void add_motion_and_load(std::size_t cylinder);
  void add_pump_pressure(std::size_t pump);
  /// Hydraulic power of a pump, and that power with a lag: engines, thermal valves and power controllers respond late.
  void add_power(std::size_t pump, std::span<const double> lags);
  /// Position inside a backlash and pressure drop over the spool of a speed channel's valve.
  void add_valve(std::span<const double> backlashes);
  void add_machine_state(double start_rows);
  std::vector<SignalColumn> collected() { return std::move(out_); }

 private:
  bool is_pump() const { return channel_.kind == EvidenceKind::kPump; }
  bool is_return_line() const { return channel_.kind == EvidenceKind::kReturnLine; }
  bool is_flow() const { return channel_.kind == EvidenceKind::kFlow; }
  bool is_pressure() const {
    return channel_.kind != EvidenceKind::kForce && !is_flow() && !is_pump() && !is_return_line();
  }
  bool is_own(std::size_t cylinder) const { return static_cast<int>(cylinder) == channel_.index; }
  /// A signal from a sensor of the channel itself is left out, because it would explain that sensor's noise.
  bool shares_sensor(std::size_t cylinder, bool pressure) const;
  std::size_t log_of(const MachineSeries& s) const {
    return static_cast<std::size_t>(&s - evidence_.series.data());
  }
  /// [m^3/s] of a cylinder at sample `k`; for the cylinder of a speed channel the commanded flow, because the measured
  /// flow contains the speed's noise.
  double flow_of(const MachineSeries& s, std::size_t cylinder, Index k) const;

  /// @param of value by series, sample, block and row
  template <class F>
  void add_by_row(const std::string& name, F&& of);
  /// @param of value by series and sample
  template <class F>
  void add(const std::string& name, F&& of) {
    add_by_row(name,
               [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return of(s, k); });
  }
  /// @param series by log [samples]
  void add_series(const std::string& name, const std::vector<VectorXd>& series) {
    add(name, [&](const MachineSeries& s, Index k) { return series[log_of(s)][k]; });
  }

  const Evidence& evidence_;
  const EvidenceChannel& channel_;
  const Machine& machine_;
  std::vector<SectionFit> sections_;  // by log, of a speed channel's valve; else empty
  std::vector<SignalColumn> out_;
};

SignalCollector::SignalCollector(const Evidence& evidence, const EvidenceChannel& channel)
    : evidence_(evidence), channel_(channel), machine_(*evidence.series[0].machine) {
  if (!is_flow()) return;
  sections_.reserve(evidence.series.size());
  for (const MachineSeries& s : evidence.series) {
    const VectorXd& command = s.cylinders[static_cast<std::size_t>(channel.index)].command;
    sections_.push_back(command.size() > 0 ? fit_gains(s, channel.index, command) : SectionFit{});
  }
}

bool SignalCollector::shares_sensor(std::size_t cylinder, bool pressure) const {
  if (is_pump()) return pressure;
  if (is_return_line()) return false;
  if (!is_own(cylinder)) return false;
  if (is_pressure()) return true;  // inputs of the pressure model
  return pressure != is_flow();
}

double SignalCollector::flow_of(const MachineSeries& s, std::size_t cylinder, Index k) const {
  const CylinderSeries& c = s.cylinders[cylinder];
  if (sections_.empty() || !is_own(cylinder)) return c.flow[k];
  const double u = value_or_zero(c.command, k);
  return sections_[log_of(s)].gain(u) * std::abs(u) *
         supply_area(machine_.cylinders[cylinder], u > 0.0 ? 1 : -1);
}

template <class F>
void SignalCollector::add_by_row(const std::string& name, F&& of) {
  VectorXd v = VectorXd::Zero(channel_.rows());
  for (std::size_t b = 0; b < channel_.blocks.size(); ++b) {
    const MachineSeries& s = evidence_.series[static_cast<std::size_t>(channel_.log[b])];
    for (Index i = channel_.blocks[b].first; i < channel_.blocks[b].last; ++i) {
      v[i] = of(s, channel_.sample[static_cast<std::size_t>(i)], channel_.blocks[b], i);
      if (!std::isfinite(v[i])) v[i] = 0.0;
    }
  }
  if (v.maxCoeff() > v.minCoeff()) out_.push_back({name, std::move(v)});
}

void SignalCollector::add_joints() {
  for (int j = 0; j < machine_.joint_count(); ++j) {
    add("q_" + machine_.joints[static_cast<std::size_t>(j)].name,
        [&](const MachineSeries& s, Index k) { return s.q(k, j); });
  }
}

void SignalCollector::add_motion_and_load(std::size_t cylinder) {
  const std::string& name = machine_.cylinders[cylinder].name;
  using C = const CylinderSeries;
  const auto add_of = [&](const std::string& text, auto of) {
    add(text, [&](const MachineSeries& s, Index k) { return of(s.cylinders[cylinder], k); });
  };
  if (!shares_sensor(cylinder, false)) {
    add_of("v_" + name, [](C& c, Index k) { return c.speed[k]; });
    add_of("a_" + name, [](C& c, Index k) { return c.acceleration[k]; });
  }
  if (!(is_pressure() && is_own(cylinder))) {
    add_of("F_" + name, [](C& c, Index k) { return c.static_force[k]; });
    add_of("u_" + name, [](C& c, Index k) { return value_or_zero(c.command, k); });
  }
  if (!shares_sensor(cylinder, true)) {
    add_of("pA_" + name, [](C& c, Index k) { return value_or_zero(c.pressure_a, k); });
    add_of("pB_" + name, [](C& c, Index k) { return value_or_zero(c.pressure_b, k); });
  }
  add_of("du/dt_" + name, [](C& c, Index k) {
    return c.command.size() > k + 1 && k > 0 ? c.command[k + 1] - c.command[k - 1] : 0.0;
  });
}

void SignalCollector::add_pump_pressure(std::size_t pump) {
  if (is_pump()) return;
  add("p_" + machine_.pumps[pump].name,
      [&](const MachineSeries& s, Index k) { return value_or_zero(s.pumps[pump].pressure, k); });
}

void SignalCollector::add_power(std::size_t pump, std::span<const double> lags) {
  if (is_pump()) return;
  std::vector<VectorXd> power;
  power.reserve(evidence_.series.size());
  for (const MachineSeries& s : evidence_.series) {
    power.emplace_back(VectorXd::Zero(s.samples()));
    for (Index k = 0; k < s.samples(); ++k) {
      double flow = 0.0;
      for (const int i : machine_.pumps[pump].feeds)
        flow += flow_of(s, static_cast<std::size_t>(i), k);
      power.back()[k] = value_or_zero(s.pumps[pump].pressure, k) * flow;
    }
  }
  const std::string name = "power of " + machine_.pumps[pump].name;
  add_series(name, power);
  for (const double late : lags) {
    std::vector<VectorXd> lagged;
    lagged.reserve(power.size());
    for (std::size_t l = 0; l < power.size(); ++l)
      lagged.push_back(first_order_lag(evidence_.series[l], power[l], late));
    add_series(fmt::format("{} with a lag of {:.1f} s", name, late), lagged);
  }
}

void SignalCollector::add_valve(std::span<const double> backlashes) {
  if (!is_flow()) return;
  const auto own = static_cast<std::size_t>(channel_.index);
  for (const double width : backlashes) {
    std::vector<VectorXd> side;
    side.reserve(evidence_.series.size());
    for (const MachineSeries& s : evidence_.series)
      side.push_back(side_of_play(s.cylinders[own].command, s.samples(), width));
    add_series(fmt::format("u_{} with a backlash of {:.0f} %", machine_.cylinders[own].name,
                           100.0 * width),
               side);
  }
  if (machine_.pump_of_cylinder(channel_.index) < 0) return;
  const auto pump = static_cast<std::size_t>(machine_.pump_of_cylinder(channel_.index));
  add("pressure drop over the spool", [&](const MachineSeries& s, Index k) {
    const CylinderSeries& c = s.cylinders[own];
    const double u = value_or_zero(c.command, k);
    if (u == 0.0) return 0.0;
    return value_or_zero(s.pumps[pump].pressure, k) -
           value_or_zero(u > 0.0 ? c.pressure_a : c.pressure_b, k);
  });
}

void SignalCollector::add_machine_state(double start_rows) {
  add("total flow", [&](const MachineSeries& s, Index k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < s.cylinders.size(); ++i) sum += flow_of(s, i, k);
    return sum;
  });
  add("payload", [](const MachineSeries& s, Index k) { return value_or_zero(s.payload, k); });
  add("oil", [](const MachineSeries& s, Index k) { return value_or_zero(s.oil, k); });
  add("time", [](const MachineSeries& s, Index k) { return s.time[k]; });
  add_by_row("time since the motion's start",
             [&](const MachineSeries&, Index, const NoiseBlock& b, Index i) {
               return std::min(start_rows, static_cast<double>(i - b.first));
             });
}

}  // namespace

std::vector<SignalColumn> channel_signals(const Evidence& evidence, const EvidenceChannel& channel,
                                          const ResidualModelOptions& options) {
  const Machine& machine = *evidence.series[0].machine;
  SignalCollector signals(evidence, channel);
  signals.add_joints();
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) signals.add_motion_and_load(i);
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) signals.add_pump_pressure(p);
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) signals.add_power(p, options.power_lags);
  signals.add_valve(options.backlashes);
  signals.add_machine_state(options.start_rows);
  return signals.collected();
}

}  // namespace sparflow
