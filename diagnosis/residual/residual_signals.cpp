#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
}  // namespace

std::vector<SignalColumn> channel_signals(const Evidence& evidence, const EvidenceChannel& channel,
                                          const ResidualModelOptions& options) {
  std::vector<SignalColumn> out;
  const Machine& machine = *evidence.series[0].machine;
  // A signal from a sensor of the channel itself is left out, because it would explain that sensor's noise.
  const bool pressures = channel.kind != EvidenceKind::kForce &&
                         channel.kind != EvidenceKind::kFlow && channel.kind != EvidenceKind::kPump;
  const auto shares_sensor = [&](std::size_t cylinder, bool pressure) {
    if (pressures && static_cast<int>(cylinder) == channel.index)
      return true;  // inputs of the pressure model
    const bool own =
        channel.kind != EvidenceKind::kPump && static_cast<int>(cylinder) == channel.index;
    if (channel.kind == EvidenceKind::kPump) return pressure;
    return own &&
           (pressure ? channel.kind != EvidenceKind::kFlow : channel.kind == EvidenceKind::kFlow);
  };
  const auto add = [&](const std::string& name, auto&& of) {
    VectorXd v = VectorXd::Zero(channel.rows());
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      const MachineSeries& s = evidence.series[static_cast<std::size_t>(channel.log[b])];
      for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
        v[i] = of(s, channel.sample[static_cast<std::size_t>(i)], channel.blocks[b], i);
        if (!std::isfinite(v[i])) v[i] = 0.0;
      }
    }
    if (v.maxCoeff() > v.minCoeff()) out.push_back({name, std::move(v)});
  };
  const auto at = [](const VectorXd& v, Index k) { return k < v.size() ? v[k] : 0.0; };
  // for the cylinder of a speed channel, the commanded flow, because the measured flow contains the speed's noise
  std::vector<SectionFit> sections;
  const auto own = static_cast<std::size_t>(channel.index);
  if (channel.kind == EvidenceKind::kFlow) {
    sections.reserve(evidence.series.size());
    for (const MachineSeries& s : evidence.series) {
      const VectorXd& command = s.cylinders[own].command;
      sections.push_back(command.size() > 0 ? fit_gains(s, channel.index, command) : SectionFit{});
    }
  }
  const auto flow_of = [&](const MachineSeries& s, std::size_t i, Index k) {
    const CylinderSeries& c = s.cylinders[i];
    if (sections.empty() || i != own) return c.flow[k];
    const double u = at(c.command, k);
    return sections[static_cast<std::size_t>(&s - evidence.series.data())].gain(u) * std::abs(u) *
           supply_area(machine.cylinders[i], u > 0.0 ? 1 : -1);
  };
  for (int j = 0; j < machine.joint_count(); ++j) {
    add("q_" + machine.joints[static_cast<std::size_t>(j)].name,
        [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return s.q(k, j); });
  }
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const std::string& name = machine.cylinders[i].name;
    using C = const CylinderSeries;
    const auto cylinder = [&](const std::string& text, auto of) {
      add(text, [&, of](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
        return of(s.cylinders[i], k);
      });
    };
    if (!shares_sensor(i, false)) {
      cylinder("v_" + name, [&](C& c, Index k) { return c.speed[k]; });
      cylinder("a_" + name, [&](C& c, Index k) { return c.acceleration[k]; });
    }
    if (!(pressures && static_cast<int>(i) == channel.index)) {
      cylinder("F_" + name, [&](C& c, Index k) { return c.static_force[k]; });
      cylinder("u_" + name, [&](C& c, Index k) { return at(c.command, k); });
    }
    if (!shares_sensor(i, true)) {
      cylinder("pA_" + name, [&](C& c, Index k) { return at(c.pressure_a, k); });
      cylinder("pB_" + name, [&](C& c, Index k) { return at(c.pressure_b, k); });
    }
    cylinder("du/dt_" + name, [&](C& c, Index k) {
      return c.command.size() > k + 1 && k > 0 ? c.command[k + 1] - c.command[k - 1] : 0.0;
    });
  }
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
    if (channel.kind == EvidenceKind::kPump) continue;
    add("p_" + machine.pumps[p].name, [&](const MachineSeries& s, Index k, const NoiseBlock&,
                                          Index) { return at(s.pumps[p].pressure, k); });
  }
  // hydraulic power of each pump, and that power with a lag: engines, thermal valves and power controllers respond late
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
    if (channel.kind == EvidenceKind::kPump) continue;
    std::vector<VectorXd> power;
    power.reserve(evidence.series.size());
    for (const MachineSeries& s : evidence.series) {
      power.emplace_back(VectorXd::Zero(s.samples()));
      for (Index k = 0; k < s.samples(); ++k) {
        double flow = 0.0;
        for (const int i : machine.pumps[p].feeds)
          flow += flow_of(s, static_cast<std::size_t>(i), k);
        power.back()[k] = at(s.pumps[p].pressure, k) * flow;
      }
    }
    const auto add_power = [&](const std::string& name, const std::vector<VectorXd>& of) {
      add(name, [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
        return of[static_cast<std::size_t>(&s - evidence.series.data())][k];
      });
    };
    const std::string name = "power of " + machine.pumps[p].name;
    add_power(name, power);
    for (const double late : options.power_lags) {
      std::vector<VectorXd> lagged;
      lagged.reserve(power.size());
      for (std::size_t l = 0; l < power.size(); ++l)
        lagged.push_back(first_order_lag(evidence.series[l], power[l], late));
      add_power(fmt::format("{} with a lag of {:.1f} s", name, late), lagged);
    }
  }
  if (channel.kind == EvidenceKind::kFlow) {
    for (const double width : options.backlashes) {
      std::vector<VectorXd> side;
      side.reserve(evidence.series.size());
      for (const MachineSeries& s : evidence.series)
        side.push_back(side_of_play(s.cylinders[own].command, s.samples(), width));
      add(fmt::format("u_{} with a backlash of {:.0f} %", machine.cylinders[own].name,
                      100.0 * width),
          [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
            return side[static_cast<std::size_t>(&s - evidence.series.data())][k];
          });
    }
  }
  if (channel.kind == EvidenceKind::kFlow && machine.pump_of_cylinder(channel.index) >= 0) {
    const auto pump = static_cast<std::size_t>(machine.pump_of_cylinder(channel.index));
    add("pressure drop over the spool",
        [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
          const CylinderSeries& c = s.cylinders[own];
          const double u = at(c.command, k);
          if (u == 0.0) return 0.0;
          return at(s.pumps[pump].pressure, k) - at(u > 0.0 ? c.pressure_a : c.pressure_b, k);
        });
  }
  add("total flow", [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
    double sum = 0.0;
    for (std::size_t i = 0; i < s.cylinders.size(); ++i) sum += flow_of(s, i, k);
    return sum;
  });
  add("payload",
      [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return at(s.payload, k); });
  add("oil",
      [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return at(s.oil, k); });
  add("time", [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return s.time[k]; });
  add("time since the motion's start",
      [&](const MachineSeries&, Index, const NoiseBlock& b, Index i) {
        return std::min(options.start_rows, static_cast<double>(i - b.first));
      });
  return out;
}

}  // namespace sparflow
