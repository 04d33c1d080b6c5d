#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/learning/fit_pass.h"
#include "identification/signals/apply_effects.h"
#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// @return [Pa] measured pressure less the effects that act on it after the maximum
VectorXd without_effect(const PumpSignals& pump) {
  if (pump.pressure.size() == 0 || pump.pressure_effect.size() == 0) return pump.pressure;
  return pump.pressure - pump.pressure_effect;
}

/// Collects the samples in which every cylinder is either driven or not commanded, with the model's working pressures.
PumpSamples pump_samples(const FitPass& pass, const TrainingData& data, int index) {
  const Machine& machine = pass.model.machine;
  const Pump& pump = machine.pumps[static_cast<std::size_t>(index)];
  const std::size_t fed = pump.feeds.size();
  std::vector<double> pressure, working;
  std::vector<char> active;
  for (std::size_t l = 0; l < data.signals->size(); ++l) {
    const MachineSignals& s = (*data.signals)[l];
    const VectorXd measured = without_effect(s.pumps[static_cast<std::size_t>(index)]);
    for (Index k = 0; k < measured.size(); ++k) {
      if (!data.counts[l][k] || !std::isfinite(measured[k])) continue;
      std::vector<double> p(fed, 0.0);
      bool clear = true;
      for (std::size_t f = 0; f < fed && clear; ++f) {
        const auto i = static_cast<std::size_t>(pump.feeds[f]);
        const CylinderSignals& c = s.cylinders[i];
        if (c.direction[k] == 0) continue;
        const CylinderModel& m = pass.model.cylinders[i];
        const GaussianProcess& process = c.direction[k] > 0 ? m.extend : m.retract;
        clear = c.driven[k] && !process.empty();
        if (!clear) continue;
        p[f] = process.mean(c.flow[k], c.model_force[k]) +
               working_pressure_effect(pass.model, s, pump.feeds[f], k) +
               or_zero(c.demand_effect, k);
        clear = std::isfinite(p[f]);
      }
      if (!clear) continue;
      pressure.push_back(measured[k]);
      for (std::size_t f = 0; f < fed; ++f) {
        working.push_back(p[f]);
        active.push_back(s.cylinders[static_cast<std::size_t>(pump.feeds[f])].direction[k] != 0);
      }
    }
  }
  const auto n = static_cast<Index>(pressure.size()), m = static_cast<Index>(fed);
  PumpSamples out;
  for (const int i : pump.feeds)
    out.names.push_back(machine.cylinders[static_cast<std::size_t>(i)].name);
  out.pressure = Eigen::Map<VectorXd>(pressure.data(), n);
  out.working_pressure.resize(n, m);
  out.active.resize(n, m);
  for (Index k = 0; k < n; ++k) {
    for (Index f = 0; f < m; ++f) {
      out.working_pressure(k, f) = working[static_cast<std::size_t>(k * m + f)];
      out.active(k, f) = active[static_cast<std::size_t>(k * m + f)] != 0;
    }
  }
  return out;
}

}  // namespace

void learn_valves(const TrainingData& data, const LearnValveOptions& options, FitPass& pass) {
  const Machine& machine = pass.model.machine;
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    if (!machine.cylinders[static_cast<std::size_t>(i)].hydraulic()) continue;
    for (const bool extend : {true, false}) {
      std::vector<double> command, flow;
      for (std::size_t l = 0; l < data.signals->size(); ++l) {
        const MachineSignals& s = (*data.signals)[l];
        const CylinderSignals& c = s.cylinders[static_cast<std::size_t>(i)];
        for (Index k = 0; k < s.samples() && c.has_command(); ++k) {
          if (!data.counts[l][k] || !c.driven[k] || (c.direction[k] > 0) != extend) continue;
          const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
          const double area = extend ? cylinder.area_piston() : -cylinder.area_rod();
          const double own = c.flow[k] - area * or_zero(c.flow_effect, k);
          if (!std::isfinite(own)) continue;
          command.push_back(c.opening()[k]);
          flow.push_back(own);
        }
      }
      if (command.empty()) continue;
      const auto n = static_cast<Index>(command.size());
      ValveFit fitted{i, extend, {}};
      const std::string name = process_name(machine, i, extend);
      try {
        fitted.valve = learn_valve(Eigen::Map<VectorXd>(command.data(), n),
                                   Eigen::Map<VectorXd>(flow.data(), n), options);
      } catch (const InputError& error) {
        pass.notes.push_back(fmt::format("valve gain of {}: not learned, {}", name, error.what()));
        continue;
      }
      for (const std::string& w : fitted.valve.warnings)
        pass.notes.push_back("valve " + name + ": " + w);
      CylinderModel& c = pass.model.cylinders[static_cast<std::size_t>(i)];
      (extend ? c.valve_gain_extend : c.valve_gain_retract) = fitted.valve.gain;
      pass.valves.push_back(std::move(fitted));
    }
  }
}

void learn_pumps(const TrainingData& data, const FitOptions& options, FitPass& pass) {
  const Machine& machine = pass.model.machine;
  pass.pumps.resize(machine.pumps.size());
  for (int p = 0; p < machine.pump_count(); ++p) {
    const Pump& pump = machine.pumps[static_cast<std::size_t>(p)];
    const PumpSamples samples = pump_samples(pass, data, p);
    const bool sensing = pump.type == PumpType::kLoadSensing;
    LearnPumpOptions o = options.pump;
    o.data_sheet_standby = pump.standby;
    o.max_pressure = pump.max_pressure;
    try {
      if (sensing) {
        pass.pumps[static_cast<std::size_t>(p)] = learn_pump(samples, o);
      } else {
        std::vector<double> all;
        for (std::size_t l = 0; l < data.signals->size(); ++l) {
          const VectorXd v = without_effect((*data.signals)[l].pumps[static_cast<std::size_t>(p)]);
          for (Index k = 0; k < v.size(); ++k) {
            if (data.counts[l][k] && std::isfinite(v[k])) all.push_back(v[k]);
          }
        }
        pass.pumps[static_cast<std::size_t>(p)] = learn_constant_pump(
            Eigen::Map<VectorXd>(all.data(), static_cast<Index>(all.size())), o);
      }
    } catch (const InputError& error) {
      pass.notes.push_back(
          fmt::format("pump {}: not learned, {}; standby {:.1f} bar of the machine file is kept",
                      pump.name, error.what(), pump.standby / units::kBar));
      continue;
    }
    const LearnedPump& learned = *pass.pumps[static_cast<std::size_t>(p)];
    pass.model.pumps[static_cast<std::size_t>(p)].standby = learned.standby;
    for (const std::string& w : learned.warnings)
      pass.notes.push_back("pump " + pump.name + ": " + w);
    if (!sensing) continue;
    for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
      pass.model.cylinders[static_cast<std::size_t>(pump.feeds[f])].margin =
          learned.margins[f].margin;
    }
  }
}

}  // namespace sparflow
