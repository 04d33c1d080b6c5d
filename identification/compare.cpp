#include "identification/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "models/error.h"
#include "models/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const FieldUnit kNewton{"N", 1.0};
const FieldUnit kBarUnit{"bar", units::kBar};
const FieldUnit kFlowUnit{"l/min", units::kLitrePerMinute};

ComparedSeries series_for(std::string stage, std::string at, const FieldUnit& unit, Index n) {
  ComparedSeries s;
  s.stage = std::move(stage);
  s.at = std::move(at);
  s.unit = unit;
  s.measured = s.predicted = VectorXd::Constant(n, kNaN);
  s.regime = Eigen::VectorXi::Zero(n);
  s.regimes = {"extend", "retract"};
  return s;
}

void put(ComparedSeries& s, Index k, double measured, double predicted, int regime) {
  if (!std::isfinite(measured) || !std::isfinite(predicted)) return;
  s.measured[k] = measured;
  s.predicted[k] = predicted;
  s.regime[k] = regime;
}

/// Everything the pressure stages say of one log, in one pass of the chain.
struct ChainPass {
  std::vector<ComparedSeries> pressure, pump;        ///< by cylinder, by pump
  std::vector<bool> pressure_missing, pump_missing;  ///< a process that was needed is not learned
};

class Comparison {
 public:
  Comparison(const CraneModel& model, const MachineSignals& signals, const Mask* only)
      : model_(model), machine_(model.machine), signals_(signals), only_(only) {}

  std::vector<ComparedSeries> series(std::set<std::string>& notes) {
    std::vector<ComparedSeries> out;
    for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) force(i, out, notes);
    for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) flow(i, out, notes);
    pressures(out, notes);
    return out;
  }

  /// Adds this log's energy to the scores (one a pump).
  void energy(std::vector<EnergyScore>& scores);

 private:
  bool counts(Index k) const { return signals_.usable[k] && (only_ == nullptr || (*only_)[k]); }
  bool process_learned(std::size_t i, int direction) const {
    const CylinderModel& c = model_.cylinders[i];
    return !(direction > 0 ? c.extend : c.retract).empty();
  }
  void force(std::size_t i, std::vector<ComparedSeries>& out, std::set<std::string>& notes);
  void flow(std::size_t i, std::vector<ComparedSeries>& out, std::set<std::string>& notes);
  void pressures(std::vector<ComparedSeries>& out, std::set<std::string>& notes);
  void judge_sample(Index k, const MachineState& state, ChainPass& pass) const;
  /// Signed speeds that make the chain see flow and direction of the signals. [m/s]
  void speeds_from_signals(Index k, std::vector<double>& speed, std::vector<double>& force) const;
  /// The same with flow from the command by the valve gains. @return false where that cannot be told
  bool speeds_from_commands(Index k, const Pump& pump, std::vector<double>& speed) const;
  void pump_sample(Index k, std::size_t p, const PumpState& state, ChainPass& pass) const;

  const CraneModel& model_;
  const Machine& machine_;
  const MachineSignals& signals_;
  const Mask* only_;
};

void Comparison::force(std::size_t i, std::vector<ComparedSeries>& out,
                       std::set<std::string>& notes) {
  const CylinderSignals& c = signals_.cylinders[i];
  const std::string& name = machine_.cylinders[i].name;
  if (!c.has_force()) {
    notes.insert(
        fmt::format("force of {}: not compared, needs pA_{}_bar and pB_{}_bar (or force_{}_N)",
                    name, name, name, name));
    return;
  }
  ComparedSeries s = series_for("force", name, kNewton, signals_.samples());
  for (Index k = 0; k < signals_.samples(); ++k) {
    if (counts(k) && c.moving[k])
      put(s, k, c.force[k], c.static_force[k], c.speed[k] > 0.0 ? 0 : 1);
  }
  out.push_back(std::move(s));
}

void Comparison::flow(std::size_t i, std::vector<ComparedSeries>& out,
                      std::set<std::string>& notes) {
  const CylinderSignals& c = signals_.cylinders[i];
  const Cylinder& cylinder = machine_.cylinders[i];
  const CylinderModel& m = model_.cylinders[i];
  if (!cylinder.hydraulic()) {
    notes.insert(
        fmt::format("flow and pressures of {}: not compared, the machine file gives it no bore",
                    cylinder.name));
    return;
  }
  if (!c.has_command()) {
    notes.insert(fmt::format("flow of {} from its command: not compared, needs u_{}", cylinder.name,
                             cylinder.name));
  } else if (m.valve_gain_extend <= 0.0 && m.valve_gain_retract <= 0.0) {
    notes.insert(
        fmt::format("flow of {} from its command: not compared, the model has no valve gain for it",
                    cylinder.name));
  } else {
    ComparedSeries s = series_for("flow", cylinder.name, kFlowUnit, signals_.samples());
    for (Index k = 0; k < signals_.samples(); ++k) {
      if (!counts(k) || !c.moving[k]) continue;
      const bool extend = c.direction[k] > 0;
      const double gain = extend ? m.valve_gain_extend : m.valve_gain_retract;
      if (gain > 0.0) put(s, k, c.flow[k], gain * std::abs(c.command[k]), extend ? 0 : 1);
    }
    out.push_back(std::move(s));
  }
  if (c.measured_flow.size() > 0) {
    ComparedSeries s = series_for("flow_sensor", cylinder.name, kFlowUnit, signals_.samples());
    for (Index k = 0; k < signals_.samples(); ++k) {
      if (counts(k) && c.moving[k]) {
        put(s, k, std::abs(c.measured_flow[k]), c.flow[k], c.direction[k] > 0 ? 0 : 1);
      }
    }
    out.push_back(std::move(s));
  }
}

void Comparison::speeds_from_signals(Index k, std::vector<double>& speed,
                                     std::vector<double>& force) const {
  // A cylinder that is asked for but stands (start, dead band) demands pressure without flow.
  constexpr double kStanding = 1e-8;
  for (std::size_t i = 0; i < speed.size(); ++i) {
    const CylinderSignals& c = signals_.cylinders[i];
    const int direction = c.direction[k];
    force[i] = c.static_force[k];
    speed[i] = direction == 0 ? 0.0 : direction * std::max(kStanding, c.speed[k] * direction);
  }
}

bool Comparison::speeds_from_commands(Index k, const Pump& pump, std::vector<double>& speed) const {
  std::fill(speed.begin(), speed.end(), 0.0);
  for (const int fed : pump.feeds) {
    const auto i = static_cast<std::size_t>(fed);
    const CylinderSignals& c = signals_.cylinders[i];
    if (!c.has_command() || !std::isfinite(c.command[k])) return false;
    if (c.direction[k] == 0) continue;
    const bool extend = c.direction[k] > 0;
    const CylinderModel& m = model_.cylinders[i];
    const double gain = extend ? m.valve_gain_extend : m.valve_gain_retract;
    const Cylinder& cylinder = machine_.cylinders[i];
    if (gain <= 0.0 || !cylinder.hydraulic()) return false;
    speed[i] = gain * c.command[k] / (extend ? cylinder.area_piston() : cylinder.area_rod());
  }
  return true;
}

void Comparison::pump_sample(Index k, std::size_t p, const PumpState& state,
                             ChainPass& pass) const {
  const Pump& pump = machine_.pumps[p];
  bool moving = false;
  for (const int i : pump.feeds) {
    const CylinderSignals& c = signals_.cylinders[static_cast<std::size_t>(i)];
    moving = moving || c.moving[k];
    if (pump.type == PumpType::kLoadSensing && c.direction[k] != 0 &&
        !process_learned(static_cast<std::size_t>(i), c.direction[k])) {
      pass.pump_missing[p] = true;
      return;
    }
  }
  if (!moving) return;
  int regime = 0;  // standby
  for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
    if (pump.feeds[f] == state.leader) regime = static_cast<int>(f) + 1;
  }
  put(pass.pump[p], k, signals_.pumps[p].pressure[k], state.pressure, regime);
}

void Comparison::judge_sample(Index k, const MachineState& state, ChainPass& pass) const {
  for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) {
    const CylinderSignals& c = signals_.cylinders[i];
    if (!c.has_pressure() || !c.moving[k]) continue;
    if (!process_learned(i, c.direction[k])) {
      pass.pressure_missing[i] = true;
      continue;
    }
    const CylinderState& s = state.cylinders[i];
    put(pass.pressure[i], k, c.working_pressure[k], s.pressure, c.direction[k] > 0 ? 0 : 1);
    const CylinderModel& m = model_.cylinders[i];
    const double noise = (c.direction[k] > 0 ? m.extend : m.retract).parameters().noise_std;
    pass.pressure[i].deviation[k] = std::hypot(s.pressure_std, noise);
  }
  for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
    if (signals_.pumps[p].pressure.size() > 0) pump_sample(k, p, state.pumps[p], pass);
  }
}

void Comparison::pressures(std::vector<ComparedSeries>& out, std::set<std::string>& notes) {
  const Index n = signals_.samples();
  ChainPass pass;
  for (const Cylinder& cylinder : machine_.cylinders) {
    pass.pressure.push_back(series_for("pressure", cylinder.name, kBarUnit, n));
    pass.pressure.back().deviation = VectorXd::Constant(n, kNaN);
  }
  for (const Pump& pump : machine_.pumps) {
    pass.pump.push_back(series_for("pump", pump.name, kBarUnit, n));
    pass.pump.back().regimes = {pump.type == PumpType::kLoadSensing ? "standby" : "constant"};
    for (const int i : pump.feeds) {
      pass.pump.back().regimes.push_back(machine_.cylinders[static_cast<std::size_t>(i)].name);
    }
  }
  pass.pressure_missing.assign(machine_.cylinders.size(), false);
  pass.pump_missing.assign(machine_.pumps.size(), false);
  Chain chain(model_);
  std::vector<double> speed(machine_.cylinders.size()), force(machine_.cylinders.size());
  for (Index k = 0; k < n; ++k) {
    if (!counts(k)) continue;
    speeds_from_signals(k, speed, force);
    judge_sample(k, chain.evaluate_pressures(speed.data(), force.data(), true), pass);
  }
  for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) {
    const Cylinder& cylinder = machine_.cylinders[i];
    if (!cylinder.hydraulic()) continue;
    const CylinderSignals& c = signals_.cylinders[i];
    for (const bool bore : {true, false}) {
      if ((bore ? c.pressure_a : c.pressure_b).size() > 0) continue;
      notes.insert(fmt::format("pressure of {} {}: not compared, needs p{}_{}_bar", cylinder.name,
                               bore ? "extending" : "retracting", bore ? "A" : "B", cylinder.name));
    }
    if (pass.pressure_missing[i]) {
      notes.insert(
          fmt::format("pressure of {}: compared only where its process is learned", cylinder.name));
    }
    if (c.has_pressure()) out.push_back(std::move(pass.pressure[i]));
  }
  for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
    if (signals_.pumps[p].pressure.size() == 0) {
      notes.insert(fmt::format("pressure and energy of pump {}: not compared, needs p_{}_bar",
                               machine_.pumps[p].name, machine_.pumps[p].name));
      continue;
    }
    if (pass.pump_missing[p]) {
      notes.insert(fmt::format(
          "pump {}: compared only where the processes of all cylinders it serves are learned",
          machine_.pumps[p].name));
    }
    out.push_back(std::move(pass.pump[p]));
  }
  if (machine_.pumps.empty())
    notes.insert("pump and energy: not compared, the machine has no pump");
}

void Comparison::energy(std::vector<EnergyScore>& scores) {
  const VectorXd duration = sample_durations(signals_.time, signals_.runs);
  Chain chain(model_);
  std::vector<double> speed(machine_.cylinders.size()), force(machine_.cylinders.size());
  for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
    const Pump& pump = machine_.pumps[p];
    const VectorXd& pressure = signals_.pumps[p].pressure;
    if (pressure.size() == 0) continue;
    double from_commands = 0.0;
    bool commanded = true;
    for (Index k = 0; k < signals_.samples(); ++k) {
      if (!counts(k) || !std::isfinite(pressure[k])) continue;
      bool learned = true;
      for (const int i : pump.feeds) {
        const int direction = signals_.cylinders[static_cast<std::size_t>(i)].direction[k];
        learned = learned && (pump.type == PumpType::kConstantPressure || direction == 0 ||
                              process_learned(static_cast<std::size_t>(i), direction));
      }
      if (!learned) continue;
      speeds_from_signals(k, speed, force);
      const PumpState state = chain.evaluate_pressures(speed.data(), force.data()).pumps[p];
      scores[p].measured += pressure[k] * state.flow * duration[k];
      scores[p].predicted += state.pressure * state.flow * duration[k];
      scores[p].duration += duration[k];
      commanded = commanded && speeds_from_commands(k, pump, speed);
      if (!commanded) continue;
      const PumpState asked = chain.evaluate_pressures(speed.data(), force.data()).pumps[p];
      from_commands += asked.pressure * asked.flow * duration[k];
    }
    if (!commanded || !scores[p].from_commands) {
      scores[p].from_commands.reset();
    } else {
      *scores[p].from_commands += from_commands;
    }
  }
}

/// Sums over all logs of one quantity.
StageScore score(const std::vector<LogComparison>& logs, const std::string& stage,
                 const std::string& at, const std::string& regime) {
  StageScore out;
  out.stage = stage;
  out.at = at;
  out.regime = regime;
  double sum = 0.0, sum_y = 0.0, squares = 0.0;
  long inside = 0, judged = 0;
  std::vector<double> measured;
  for (const LogComparison& log : logs) {
    for (const ComparedSeries& s : log.series) {
      if (s.stage != stage || s.at != at) continue;
      out.unit = s.unit;
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k])) continue;
        if (!regime.empty() && s.regimes[static_cast<std::size_t>(s.regime[k])] != regime) continue;
        const double e = s.predicted[k] - s.measured[k];
        sum += e;
        squares += e * e;
        sum_y += s.measured[k];
        measured.push_back(s.measured[k]);
        if (s.deviation.size() > 0) {
          ++judged;
          if (std::abs(e) <= 1.959964 * s.deviation[k]) ++inside;
        }
      }
    }
  }
  out.n = static_cast<long>(measured.size());
  if (out.n == 0) return out;
  const double n = static_cast<double>(out.n), mean = sum_y / n;
  double spread = 0.0;
  for (const double y : measured) spread += (y - mean) * (y - mean);
  out.rmse = std::sqrt(squares / n);
  out.bias = sum / n;
  out.fit_percent = spread > 0.0 ? 100.0 * (1.0 - std::sqrt(squares / spread)) : kNaN;
  out.within_95_percent =
      judged > 0 ? 100.0 * static_cast<double>(inside) / static_cast<double>(judged) : kNaN;
  return out;
}

std::vector<StageScore> scores(const Machine& machine, const std::vector<LogComparison>& logs) {
  std::vector<StageScore> out;
  const auto add = [&](const char* stage, const std::string& at, const std::string& regime) {
    StageScore s = score(logs, stage, at, regime);
    if (s.n > 0) out.push_back(std::move(s));
  };
  for (const char* stage : {"force", "flow", "flow_sensor"}) {
    for (const Cylinder& c : machine.cylinders) add(stage, c.name, "");
  }
  for (const Cylinder& c : machine.cylinders) {
    add("pressure", c.name, "extend");
    add("pressure", c.name, "retract");
  }
  for (const Pump& p : machine.pumps) add("pump", p.name, "");
  return out;
}

std::string regime_words(const ComparedSeries& s, std::size_t regime) {
  const std::string& name = s.regimes[regime];
  if (s.stage != "pump") return s.at + (name == "extend" ? " extending" : " retracting");
  if (regime == 0) return "pump " + s.at + (name == "standby" ? " at standby" : "");
  return fmt::format("pump {} led by {}", s.at, name);
}

/// Shares are among quantities that can be added up: forces of cylinders of different size cannot.
void set_pool(ErrorGroup& group) {
  group.pool = group.stage == "force" ? "force " + group.at : group.stage;
  const std::string what = group.stage == "flow_sensor" ? "flow sensor" : group.stage;
  group.pool_words = group.stage == "force" ? fmt::format("the force error of {}", group.at)
                                            : fmt::format("the {} error", what);
}

/// The compared samples of one regime over all logs with every signal that all of them have.
ErrorGroup gather(const Machine& machine, const std::vector<LogComparison>& logs,
                  const ComparedSeries& like, std::size_t regime) {
  ErrorGroup group;
  group.stage = like.stage;
  group.at = like.at;
  group.regime = like.regimes[regime];
  group.words = regime_words(like, regime);
  group.unit = like.unit.name;
  group.scale = like.unit.si;
  set_pool(group);
  std::vector<double> errors;
  std::vector<std::vector<double>> columns;
  bool first = true;
  for (const LogComparison& log : logs) {
    for (const ComparedSeries& s : log.series) {
      if (s.stage != like.stage || s.at != like.at) continue;
      const std::vector<RegimeSignal> signals = regime_signals(machine, log.signals, s);
      if (first) {
        for (const RegimeSignal& signal : signals) {
          group.signals.push_back({signal.key, signal.words, signal.unit, signal.scale, {}});
        }
        columns.resize(group.signals.size());
        first = false;
      }
      const std::size_t before = errors.size();
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k]) || s.regime[k] != static_cast<int>(regime)) continue;
        const double e = s.predicted[k] - s.measured[k];
        errors.push_back(e * e);
      }
      for (std::size_t c = 0; c < columns.size(); ++c) {
        columns[c].resize(errors.size(), kNaN);
        for (const RegimeSignal& signal : signals) {
          if (signal.key != group.signals[c].key) continue;
          std::size_t row = before;
          for (Index k = 0; k < s.measured.size(); ++k) {
            if (!std::isfinite(s.measured[k]) || s.regime[k] != static_cast<int>(regime)) continue;
            columns[c][row++] = signal.values[k];
          }
        }
      }
    }
  }
  group.squared_error = Eigen::Map<VectorXd>(errors.data(), static_cast<Index>(errors.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    group.signals[c].values =
        Eigen::Map<VectorXd>(columns[c].data(), static_cast<Index>(columns[c].size()));
  }
  return group;
}

std::vector<ErrorGroup> error_groups(const Machine& machine, const CompareResult& result) {
  std::vector<ErrorGroup> groups;
  std::set<std::pair<std::string, std::string>> seen;
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (!seen.insert({s.stage, s.at}).second) continue;
      // Pools are ordered by how much of what varies they fail to explain.
      const StageScore whole = score(result.logs, s.stage, s.at, "");
      for (std::size_t r = 0; r < s.regimes.size(); ++r) {
        ErrorGroup group = gather(machine, result.logs, s, r);
        if (std::isfinite(whole.fit_percent)) {
          group.severity = std::min(1.0, 1.0 - whole.fit_percent / 100.0);
        }
        if (group.squared_error.size() > 0) groups.push_back(std::move(group));
      }
    }
  }
  return groups;
}

}  // namespace

const StageScore* CompareResult::find(const std::string& stage, const std::string& at,
                                      const std::string& regime) const {
  for (const StageScore& s : scores) {
    if (s.stage == stage && s.at == at && s.regime == regime) return &s;
  }
  return nullptr;
}

std::vector<StageQuality> stage_quality(const CompareResult& result, const std::string& data) {
  std::vector<StageQuality> out;
  for (const StageScore& s : result.scores) {
    out.push_back({s.stage, s.regime.empty() ? s.at : s.at + " " + s.regime, data,
                   s.rmse / s.unit.si, s.unit.name, s.fit_percent, s.n});
  }
  for (const EnergyScore& e : result.energy) {
    out.push_back({"energy", e.pump, data, 100.0 * std::abs(e.relative_error), "%", kNaN, 1});
  }
  return out;
}

CompareResult compare_signals(const CraneModel& model, std::vector<MachineSignals> signals,
                              const std::vector<Mask>& only, const CompareOptions& options) {
  SPARFLOW_CHECK(only.empty() || only.size() == signals.size(), "one mask a log");
  CompareResult result;
  std::set<std::string> notes;
  std::vector<EnergyScore> energy(model.machine.pumps.size());
  for (std::size_t p = 0; p < energy.size(); ++p) {
    energy[p].pump = model.machine.pumps[p].name;
    energy[p].from_commands = 0.0;
  }
  for (std::size_t l = 0; l < signals.size(); ++l) {
    LogComparison log;
    log.signals = std::move(signals[l]);
    Comparison comparison(model, log.signals, only.empty() ? nullptr : &only[l]);
    log.series = comparison.series(notes);
    comparison.energy(energy);
    result.samples += only.empty() ? log.signals.samples() : only[l].cast<long>().sum();
    for (const std::string& note : log.signals.notes) notes.insert(log.signals.file + ": " + note);
    result.logs.push_back(std::move(log));
  }
  result.scores = scores(model.machine, result.logs);
  for (EnergyScore& e : energy) {
    if (e.duration <= 0.0) continue;
    e.relative_error = e.measured > 0.0 ? (e.predicted - e.measured) / e.measured : kNaN;
    result.energy.push_back(e);
  }
  if (options.find_regions) {
    result.worst = worst_regions(error_groups(model.machine, result), options.regions);
  }
  result.notes.assign(notes.begin(), notes.end());
  return result;
}

CompareResult compare(const CraneModel& model, const std::vector<Log>& logs,
                      const CompareOptions& options) {
  std::vector<MachineSignals> signals;
  for (const Log& log : logs) signals.push_back(make_signals(model.machine, log, options.signals));
  return compare_signals(model, std::move(signals), {}, options);
}

}  // namespace sparflow
