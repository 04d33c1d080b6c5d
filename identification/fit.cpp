#include "identification/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "identification/robust.h"
#include "models/error.h"
#include "models/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Progress = std::function<void(double, const std::string&)>;

std::string process_name(const Machine& machine, int cylinder, bool extend) {
  return machine.cylinders[static_cast<std::size_t>(cylinder)].name +
         (extend ? " extend" : " retract");
}

/// What is learned from: signals of all logs and the samples of each that count.
struct TrainingData {
  const std::vector<MachineSignals>* signals = nullptr;
  std::vector<Mask> counts;
};

/// Samples of one process in order of time, with places by which stretches can be told.
struct ProcessData {
  GpDataset set;
  std::vector<Index> position;  ///< running number over all logs, a gap between logs
};

GpDataset rows_of(const GpDataset& all, const std::vector<Index>& rows) {
  return {all.name, all.flow(rows), all.force(rows), all.pressure(rows)};
}

/// Driven samples: they move, and towards the side of the command. Pressures as logged: a process averages
/// white noise itself, and a filter would blur the steps at starts and stops.
ProcessData process_data(const Machine& machine, const TrainingData& data, int cylinder,
                         bool extend) {
  std::vector<double> flow, force, pressure;
  ProcessData out;
  out.set.name = process_name(machine, cylinder, extend);
  Index offset = 0;
  for (std::size_t l = 0; l < data.signals->size(); ++l) {
    const MachineSignals& s = (*data.signals)[l];
    const CylinderSignals& c = s.cylinders[static_cast<std::size_t>(cylinder)];
    for (Index k = 0; k < s.samples() && c.has_pressure(); ++k) {
      if (!data.counts[l][k] || !c.driven[k] || (c.direction[k] > 0) != extend) continue;
      if (!std::isfinite(c.working_pressure[k])) continue;
      flow.push_back(c.flow[k]);
      force.push_back(c.static_force[k]);
      pressure.push_back(c.working_pressure[k]);
      out.position.push_back(offset + k);
    }
    offset += s.samples() + 2;
  }
  const auto n = static_cast<Index>(flow.size());
  out.set.flow = Eigen::Map<Eigen::ArrayXd>(flow.data(), n);
  out.set.force = Eigen::Map<Eigen::ArrayXd>(force.data(), n);
  out.set.pressure = Eigen::Map<Eigen::ArrayXd>(pressure.data(), n);
  return out;
}

/// Every `step`-th sample, evenly over each unbroken stretch and at least one of it, so that a short motion
/// under a rare load is not lost.
std::vector<Index> thinned(const std::vector<Index>& position, int step) {
  std::vector<Index> rows;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= position.size(); ++i) {
    if (i < position.size() && position[i] == position[i - 1] + 1) continue;
    const std::size_t length = i - begin;
    const std::size_t picks = std::max<std::size_t>(1, length / static_cast<std::size_t>(step));
    for (std::size_t k = 0; k < picks; ++k) {
      rows.push_back(static_cast<Index>(begin + (2 * k + 1) * length / (2 * picks)));
    }
    begin = i;
  }
  return rows;
}

/// Everything one pass of learning leaves behind.
struct FitPass {
  CraneModel model;
  std::vector<ProcessFit> processes;
  std::vector<std::optional<LearnedPump>> pumps;
  std::vector<ValveFit> valves;
  std::vector<std::string> notes;
};

void take(FitPass& pass, std::size_t i, LearnedGp learned) {
  ProcessFit& fitted = pass.processes[i];
  fitted.report = std::move(learned.report);
  if (!fitted.report.failure.empty()) return;
  CylinderModel& c = pass.model.cylinders[static_cast<std::size_t>(fitted.cylinder)];
  (fitted.extend ? c.extend : c.retract) = GaussianProcess(std::move(learned.parameters));
}

VectorXd residuals(const ProcessData& data, const GaussianProcess& process) {
  VectorXd residual(data.set.pressure.size());
  for (Index k = 0; k < residual.size(); ++k) {
    residual[k] = data.set.pressure[k] - process.mean(data.set.flow[k], data.set.force[k]);
  }
  return residual;
}

/// How many samples one independent sample is worth, as a step; 1 = all are used.
int thinning_step(double autocorrelation, Index samples, double thin_from) {
  if (thin_from <= 0.0 || autocorrelation < thin_from) return 1;
  // Enough must remain to see the shape, however alike the samples are.
  constexpr double kLeast = 400.0;
  const double most = static_cast<double>(samples) / kLeast;
  return std::max(1, static_cast<int>(std::lround(std::min(autocorrelation, most))));
}

/// The thinned samples, without what the first fit, on all of them, calls outliers. Few samples cannot be
/// screened again: a single motion under a rare load would look like one.
GpDataset thinned_set(const ProcessData& data, const VectorXd& residual, int step,
                      double threshold) {
  const double limit = threshold * robust_std(residual);
  std::vector<Index> rows;
  for (const Index row : thinned(data.position, step)) {
    if (threshold <= 0.0 || std::abs(residual[row]) <= limit) rows.push_back(row);
  }
  return rows_of(data.set, rows);
}

void learn_processes(const Machine& machine, const TrainingData& data, const FitOptions& options,
                     FitPass& pass, const Progress& progress) {
  std::vector<ProcessData> samples;
  std::vector<GpDataset> sets;
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    if (!machine.cylinders[static_cast<std::size_t>(i)].hydraulic()) continue;
    for (const bool extend : {true, false}) {
      samples.push_back(process_data(machine, data, i, extend));
      sets.push_back(samples.back().set);
      ProcessFit fitted;
      fitted.cylinder = i;
      fitted.extend = extend;
      fitted.offered = static_cast<long>(samples.back().position.size());
      pass.processes.push_back(fitted);
    }
  }
  const auto tell = [&](double from) {
    return [&progress, from](int done, int total, const std::string& name) {
      if (progress) progress(from + 0.5 * done / total, "pressure of " + name);
    };
  };
  std::vector<LearnedGp> learned = learn_gps(sets, options.gp, tell(0.0), options.threads);
  for (std::size_t i = 0; i < learned.size(); ++i) take(pass, i, std::move(learned[i]));

  std::vector<GpDataset> again;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ProcessFit& fitted = pass.processes[i];
    if (!fitted.report.failure.empty()) continue;
    const CylinderModel& c = pass.model.cylinders[static_cast<std::size_t>(fitted.cylinder)];
    const VectorXd residual = residuals(samples[i], fitted.extend ? c.extend : c.retract);
    fitted.autocorrelation = integrated_autocorrelation(residual, samples[i].position);
    fitted.step = thinning_step(fitted.autocorrelation, residual.size(), options.thin_from);
    if (fitted.step == 1) continue;
    again.push_back(thinned_set(samples[i], residual, fitted.step, options.gp.outlier_threshold));
    which.push_back(i);
  }
  if (again.empty()) return;
  LearnGpOptions screened = options.gp;
  screened.outlier_threshold = 0.0;
  learned = learn_gps(again, screened, tell(0.5), options.threads);
  for (std::size_t i = 0; i < learned.size(); ++i) {
    // A first fit is better than none.
    if (learned[i].report.failure.empty()) take(pass, which[i], std::move(learned[i]));
  }
}

void learn_valves(const Machine& machine, const TrainingData& data, FitPass& pass) {
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    if (!machine.cylinders[static_cast<std::size_t>(i)].hydraulic()) continue;
    for (const bool extend : {true, false}) {
      std::vector<double> command, flow;
      for (std::size_t l = 0; l < data.signals->size(); ++l) {
        const MachineSignals& s = (*data.signals)[l];
        const CylinderSignals& c = s.cylinders[static_cast<std::size_t>(i)];
        for (Index k = 0; k < s.samples() && c.has_command(); ++k) {
          if (!data.counts[l][k] || !c.driven[k] || (c.direction[k] > 0) != extend) continue;
          command.push_back(c.command[k]);
          flow.push_back(c.flow[k]);
        }
      }
      if (command.empty()) continue;
      const auto n = static_cast<Index>(command.size());
      ValveFit fitted{i, extend, {}};
      const std::string name = process_name(machine, i, extend);
      try {
        fitted.valve = learn_valve(Eigen::Map<VectorXd>(command.data(), n),
                                   Eigen::Map<VectorXd>(flow.data(), n));
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

/// Samples at which it is beyond doubt which cylinders demand pressure, with the model's pressures.
PumpSamples pump_samples(const FitPass& pass, const TrainingData& data, int index) {
  const Machine& machine = pass.model.machine;
  const Pump& pump = machine.pumps[static_cast<std::size_t>(index)];
  const std::size_t fed = pump.feeds.size();
  std::vector<double> pressure, working;
  std::vector<char> active;
  for (std::size_t l = 0; l < data.signals->size(); ++l) {
    const MachineSignals& s = (*data.signals)[l];
    const VectorXd& measured = s.pumps[static_cast<std::size_t>(index)].pressure;
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
        if (clear) p[f] = process.mean(c.flow[k], c.static_force[k]);
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

void margin_notes(const Machine& machine, const Pump& pump, const LearnedPump& learned,
                  FitPass& pass) {
  for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
    if (learned.margins[f].identified) continue;
    const std::string& name = machine.cylinders[static_cast<std::size_t>(pump.feeds[f])].name;
    pass.notes.push_back(
        fmt::format("margin of {}: it led pump {} in only {} sample(s), {:.1f} bar is assumed; "
                    "record {} moving alone",
                    name, pump.name, learned.margins[f].leading,
                    learned.margins[f].margin / units::kBar, name));
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
          const VectorXd& v = (*data.signals)[l].pumps[static_cast<std::size_t>(p)].pressure;
          for (Index k = 0; k < v.size(); ++k) {
            if (data.counts[l][k] && std::isfinite(v[k])) all.push_back(v[k]);
          }
        }
        pass.pumps[static_cast<std::size_t>(p)] =
            learn_constant_pump(Eigen::Map<VectorXd>(all.data(), static_cast<Index>(all.size())));
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
    margin_notes(machine, pump, learned, pass);
  }
}

void process_notes(const Machine& machine, FitPass& pass) {
  for (const ProcessFit& f : pass.processes) {
    const std::string& name = machine.cylinders[static_cast<std::size_t>(f.cylinder)].name;
    const char* what = f.extend ? "extending" : "retracting";
    if (!f.report.failure.empty()) {
      pass.notes.push_back(
          fmt::format("pressure of {} {}: not learned, the logs hold {} sample(s) of it with a "
                      "measured pressure; record {} {} "
                      "at several speeds and loads, with p{}_{}_bar",
                      name, what, f.offered, name, what, f.extend ? "A" : "B", name));
    }
    for (const std::string& w : f.report.warnings) {
      pass.notes.push_back(fmt::format("pressure of {} {}: {}", name, what, w));
    }
  }
}

FitPass learn(const Machine& machine, const TrainingData& data, const FitOptions& options,
              const Progress& progress) {
  FitPass pass;
  pass.model = CraneModel::untrained(machine);
  learn_processes(machine, data, options, pass, progress);
  process_notes(machine, pass);
  learn_valves(machine, data, pass);
  learn_pumps(data, options, pass);
  return pass;
}

std::vector<MachineSignals> all_signals(const Machine& machine, const std::vector<Log>& logs,
                                        const SignalOptions& options) {
  std::vector<MachineSignals> out;
  for (const Log& log : logs) out.push_back(make_signals(machine, log, options));
  return out;
}

/// Usable samples away from the runs' ends, where one-sided windows make poor speeds.
std::vector<Mask> inside(const std::vector<MachineSignals>& signals) {
  std::vector<Mask> out;
  for (const MachineSignals& s : signals) out.push_back(s.usable && !s.edge);
  return out;
}

/// Every so many-th block of motion over all logs. @return the number of blocks taken
int choose_held_out(const std::vector<MachineSignals>& signals, const FitOptions& options,
                    std::vector<Mask>& held) {
  int block = 0, taken = 0;
  for (const MachineSignals& s : signals) {
    held.push_back(Mask::Constant(s.samples(), false));
    for (const SampleRange& r : motion_blocks(s, options.hold_out_block_s)) {
      if (block++ % options.hold_out_every != options.hold_out_every / 2) continue;
      held.back().segment(r.begin, r.size()).setConstant(true);
      ++taken;
    }
  }
  return taken;
}

/// A figure for data the model has not seen, from whole blocks of motion.
std::optional<CompareResult> judge_held_out(const Machine& machine,
                                            const std::vector<MachineSignals>& signals,
                                            const FitOptions& options,
                                            std::vector<std::string>& notes) {
  std::vector<Mask> held;
  if (choose_held_out(signals, options, held) < 2) {
    notes.push_back("no held-out figure: the logs hold too few separate motions; give --test logs");
    return std::nullopt;
  }
  TrainingData data{&signals, inside(signals)};
  for (std::size_t l = 0; l < held.size(); ++l) data.counts[l] = data.counts[l] && !held[l];
  const FitPass pass = learn(machine, data, options, {});
  CompareOptions compare_options;
  compare_options.signals = options.signals;
  compare_options.find_regions = false;
  return compare_signals(pass.model, signals, held, compare_options);
}

}  // namespace

std::vector<SampleRange> motion_blocks(const MachineSignals& signals, double block_s) {
  std::vector<SampleRange> out;
  for (const Segment& segment : signals.segments) {
    if (!segment.moving) continue;
    const SampleRange r = segment.samples;
    const double lasts = signals.time[r.end - 1] - signals.time[r.begin];
    const auto parts = std::max<Index>(1, std::lround(lasts / block_s));
    for (Index i = 0; i < parts; ++i) {
      out.push_back({r.begin + r.size() * i / parts, r.begin + r.size() * (i + 1) / parts});
    }
  }
  return out;
}

double integrated_autocorrelation(const VectorXd& residual, const std::vector<Index>& position) {
  const Index n = residual.size();
  SPARFLOW_CHECK(static_cast<std::size_t>(n) == position.size(), "one position a residual");
  const double power = n == 0 ? 0.0 : residual.squaredNorm() / static_cast<double>(n);
  if (power <= 0.0) return 1.0;
  double sum = 1.0;
  for (Index lag = 1; lag < n / 4; ++lag) {
    double product = 0.0;
    Index pairs = 0;
    for (Index i = 0; i + lag < n; ++i) {
      if (position[static_cast<std::size_t>(i + lag)] - position[static_cast<std::size_t>(i)] !=
          lag)
        continue;
      product += residual[i] * residual[i + lag];
      ++pairs;
    }
    if (pairs < 20) break;
    const double correlation = product / (static_cast<double>(pairs) * power);
    if (correlation < 0.05) break;
    sum += 2.0 * correlation;
  }
  return sum;
}

FitResult fit(const Machine& machine, const std::vector<Log>& logs,
              const std::vector<Log>& test_logs, const FitOptions& options,
              const Progress& progress) {
  if (logs.empty()) throw InputError({}, "log", "no log to learn from; give at least one");
  const auto start = std::chrono::steady_clock::now();
  const auto tell = [&](double share, const std::string& what) {
    if (progress) progress(share, what);
  };
  tell(0.0, "speeds and forces");
  std::vector<MachineSignals> signals = all_signals(machine, logs, options.signals);
  const bool hold_out = test_logs.empty() && options.hold_out_every > 1;
  const TrainingData data{&signals, inside(signals)};
  FitPass pass = learn(machine, data, options, [&](double share, const std::string& what) {
    tell(0.05 + (hold_out ? 0.4 : 0.8) * share, what);
  });

  FitResult result;
  result.notes = std::move(pass.notes);
  if (hold_out) {
    tell(0.5, "held-out motions");
    result.held_out = judge_held_out(machine, signals, options, result.notes);
  }
  tell(0.9, "errors");
  CompareOptions compare_options;
  compare_options.signals = options.signals;
  if (!test_logs.empty()) {
    result.test = compare_signals(pass.model, all_signals(machine, test_logs, options.signals), {},
                                  compare_options);
  }
  result.train = compare_signals(pass.model, std::move(signals), {}, compare_options);

  result.model = std::move(pass.model);
  result.processes = std::move(pass.processes);
  result.pumps = std::move(pass.pumps);
  result.valves = std::move(pass.valves);
  for (const Log& log : logs)
    result.model.data.push_back({log.file, log.sha256, log.samples(), "train"});
  for (const Log& log : test_logs)
    result.model.data.push_back({log.file, log.sha256, log.samples(), "test"});
  const auto keep = [&](const CompareResult& r, const char* name) {
    const std::vector<StageQuality> q = stage_quality(r, name);
    result.model.quality.insert(result.model.quality.end(), q.begin(), q.end());
  };
  keep(result.train, "train");
  if (result.test) keep(*result.test, "test");
  if (result.held_out) keep(*result.held_out, "held out");
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  tell(1.0, "done");
  return result;
}

}  // namespace sparflow
