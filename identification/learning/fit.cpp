#include "identification/learning/fit.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>

#include "identification/data_checks/set_aside.h"
#include "identification/learning/fit_pass.h"
#include "identification/signals/apply_effects.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Progress = std::function<void(double, const std::string&)>;

std::vector<MachineSignals> all_with_effects(const CraneModel& model,
                                             std::span<const MachineSignals> signals) {
  std::vector<MachineSignals> out;
  out.reserve(signals.size());
  for (const MachineSignals& s : signals) out.push_back(with_effects(model, s));
  return out;
}

/// Whether no effect has contributed anything to the signals.
bool has_no_effects(const MachineSignals& s) {
  const auto none = [](const CylinderSignals& c) {
    return c.pressure_effect.size() + c.return_effect.size() + c.pressure_sensor_effect.size() +
               c.demand_effect.size() + c.flow_effect.size() + c.reached.size() ==
           0;
  };
  return !s.of_effective_machine && std::all_of(s.cylinders.begin(), s.cylinders.end(), none) &&
         std::all_of(s.pumps.begin(), s.pumps.end(),
                     [](const PumpSignals& p) { return p.pressure_effect.size() == 0; });
}

/// Learns a model from the samples that count, with the options' effects.
FitPass learn(const Machine& machine, const std::vector<MachineSignals>& plain,
              std::vector<Mask> counts, const FitOptions& options, const Progress& progress) {
  FitPass pass;
  pass.model = CraneModel::untrained(machine);
  pass.model.effects = options.effects;
  // A copy of a long log is the larger part of the memory, so one is made only where effects change it.
  const bool as_they_are =
      pass.model.effects.empty() && std::all_of(plain.begin(), plain.end(), has_no_effects);
  std::vector<MachineSignals> signals;
  if (!as_they_are) signals = all_with_effects(pass.model, plain);
  const TrainingData data{as_they_are ? &plain : &signals, std::move(counts)};
  learn_processes(data, options, pass, progress);
  learn_valves(data, options.valve, pass);
  const std::vector<std::string> notes = pass.notes;
  learn_pumps(data, options, pass);
  const bool again = std::any_of(signals.begin(), signals.end(), [](const MachineSignals& s) {
    return std::any_of(s.pumps.begin(), s.pumps.end(),
                       [](const PumpSignals& p) { return p.pressure_effect.size() > 0; });
  });
  if (!again) return pass;
  // Effects on a pump's pressure depend on its demand and so on the margins; both are updated alternately until converged.
  constexpr int kTurns = 6;
  for (int turn = 0; turn < kTurns; ++turn) {
    const CraneModel before = pass.model;
    signals = all_with_effects(before, plain);
    pass.notes = notes;
    learn_pumps(data, options, pass);
    double change = 0.0;
    for (std::size_t i = 0; i < before.cylinders.size(); ++i)
      change =
          std::max(change, std::abs(pass.model.cylinders[i].margin - before.cylinders[i].margin));
    for (std::size_t p = 0; p < before.pumps.size(); ++p)
      change = std::max(change, std::abs(pass.model.pumps[p].standby - before.pumps[p].standby));
    if (change < options.settled) break;
  }
  return pass;
}

/// Signals of all logs of one use, and what is faulty in them.
struct LogSignals {
  std::vector<MachineSignals> signals;
  std::vector<BadChannelOfLog> bad;
};

void add_log(const Machine& machine, const Log& log, const FitOptions& options, Staying staying,
             LogSignals& out) {
  CheckedSignals one = checked_signals(machine, log, options.signals, options.bad_data,
                                       options.check_data ? staying : Staying::kAll);
  out.signals.push_back(std::move(one.signals));
  for (BadChannel& b : one.bad) {
    const bool in_errors = stays(b, staying);
    out.bad.push_back({log.file, std::move(b), in_errors});
  }
}

LogSignals all_signals(const Machine& machine, const std::vector<Log>& logs,
                       const FitOptions& options, Staying staying) {
  LogSignals out;
  for (const Log& log : logs) add_log(machine, log, options, staying, out);
  return out;
}

/// The same; each log is emptied when its signals are there.
LogSignals all_signals(const Machine& machine, std::vector<Log>&& logs, const FitOptions& options,
                       Staying staying) {
  LogSignals out;
  for (Log& log : logs) {
    const Log one = std::move(log);
    log = Log();
    add_log(machine, one, options, staying, out);
  }
  return out;
}

std::vector<DataSource> sources(const std::vector<Log>& logs, const char* use) {
  std::vector<DataSource> out;
  out.reserve(logs.size());
  for (const Log& log : logs) out.push_back({log.file, log.sha256, log.samples(), use});
  return out;
}

/// What a report says of a log without its samples: name, number of samples, filter.
MachineSignals outline_of(const MachineSignals& signals) {
  MachineSignals out;
  out.file = signals.file;
  out.sha256 = signals.sha256;
  out.step = signals.step;
  out.window = signals.window;
  out.order = signals.order;
  out.time = signals.time;
  return out;
}

/// @return usable samples away from the runs' ends, where one-sided windows give inaccurate speeds
std::vector<Mask> inside(const std::vector<MachineSignals>& signals) {
  std::vector<Mask> out;
  out.reserve(signals.size());
  for (const MachineSignals& s : signals) out.push_back(s.usable && !s.edge);
  return out;
}

/// @param left_out [logs] masks; empty = none
std::vector<Mask> inside_without(const std::vector<MachineSignals>& signals,
                                 const std::vector<Mask>& left_out) {
  std::vector<Mask> counts = inside(signals);
  for (std::size_t l = 0; l < left_out.size(); ++l) counts[l] = counts[l] && !left_out[l];
  return counts;
}

/// Judges a model that is learned without the held-out blocks of motion on these blocks.
/// @param signals lent to the comparison where they come back as they were, which spares a copy
std::optional<CompareResult> judge_held_out(const Machine& machine,
                                            std::vector<MachineSignals>& signals,
                                            const FitOptions& options,
                                            std::vector<std::string>& notes) {
  const std::vector<Mask> held = held_out_samples(signals, options);
  if (std::none_of(held.begin(), held.end(), [](const Mask& m) { return m.any(); })) {
    notes.push_back(
        "no error on held-out motions: the logs hold too few separate motions; give --test logs");
    return std::nullopt;
  }
  FitOptions without = options;
  if (!options.effects_held_out.empty()) without.effects = options.effects_held_out;
  const FitPass pass = learn(machine, signals, inside_without(signals, held), without, {});
  CompareOptions compare_options;
  compare_options.signals = options.signals;
  compare_options.find_regions = false;
  if (options.keep_held_out_series) {
    return compare_signals(pass.model, signals, held, compare_options);
  }
  const bool lent = pass.model.effects.empty();  // effects change what they act on
  std::vector<MachineSignals> given;
  if (lent) given.swap(signals);
  CompareResult result = lent ? compare_signals(pass.model, std::move(given), held, compare_options)
                              : compare_signals(pass.model, signals, held, compare_options);
  for (LogComparison& log : result.logs) {
    log.series.clear();
    MachineSignals outline = outline_of(log.signals);
    if (lent) signals.push_back(std::move(log.signals));
    log.signals = std::move(outline);
  }
  return result;
}

struct FitInputs {
  LogSignals logs, tests;
  std::vector<DataSource> data;  ///< of both
};

}  // namespace

CraneModel fit_forces_and_flows(const Machine& machine, const std::vector<MachineSignals>& signals,
                                const std::vector<Mask>& left_out, const FitOptions& options) {
  FitPass pass;
  pass.model = CraneModel::untrained(machine);
  pass.model.effects = options.effects;
  const std::vector<MachineSignals> with = all_with_effects(pass.model, signals);
  TrainingData data{&with, inside_without(signals, left_out)};
  learn_valves(data, options.valve, pass);
  return std::move(pass.model);
}

namespace {

/// Blocks of motion whose number, counted over all logs, is `which` modulo `every`.
std::vector<Mask> every_nth_block(const std::vector<MachineSignals>& signals,
                                  const FitOptions& options, int every, int which) {
  std::vector<Mask> held;
  int block = 0, taken = 0;
  for (const MachineSignals& s : signals) {
    held.push_back(Mask::Constant(s.samples(), false));
    if (every < 2) continue;
    for (const SampleRange& r : motion_blocks(s, options.hold_out_block_s)) {
      if (block++ % every != which) continue;
      held.back().segment(r.begin, r.size()).setConstant(true);
      ++taken;
    }
  }
  if (taken < options.hold_out_least) {
    for (Mask& m : held) m.setConstant(false);
  }
  return held;
}

}  // namespace

std::vector<Mask> held_out_samples(const std::vector<MachineSignals>& signals,
                                   const FitOptions& options) {
  return every_nth_block(signals, options, options.hold_out_every, options.hold_out_every / 2);
}

std::vector<std::vector<Mask>> held_out_folds(const std::vector<MachineSignals>& signals,
                                              const FitOptions& options, int count) {
  const auto any = [](const std::vector<Mask>& held) {
    return std::any_of(held.begin(), held.end(), [](const Mask& m) { return m.any(); });
  };
  std::vector<std::vector<Mask>> folds;
  if (!any(held_out_samples(signals, options))) return folds;
  for (int f = 0; f < count; ++f) {
    std::vector<Mask> held = every_nth_block(signals, options, count, f);
    if (any(held)) folds.push_back(std::move(held));
  }
  return folds;
}

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

double integrated_autocorrelation(const VectorXd& residual, const std::vector<Index>& position,
                                  const AutocorrelationOptions& options) {
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
    if (pairs < options.fewest_pairs_to_thin) break;
    const double correlation = product / (static_cast<double>(pairs) * power);
    if (correlation < options.gone) break;
    sum += 2.0 * correlation;
  }
  return sum;
}

namespace {

/// Gives memory that was freed back to the system. The threads that learned keep it otherwise, a fifth of what a log of two
/// million rows takes, while the comparisons need as much anew.
void give_back_memory() { ::malloc_trim(0); }

FitResult fit_signals(const Machine& machine, FitInputs inputs, const FitOptions& options,
                      const Progress& progress) {
  const auto tell = [&](double share, const std::string& what) {
    if (progress) progress(share, what);
  };
  std::vector<MachineSignals>& signals = inputs.logs.signals;
  const bool hold_out = inputs.tests.signals.empty() && options.hold_out_every > 1;
  FitPass pass =
      learn(machine, signals, inside(signals), options, [&](double share, const std::string& what) {
        tell(0.05 + (hold_out ? 0.4 : 0.8) * share, what);
      });

  FitResult result;
  result.notes = std::move(pass.notes);
  give_back_memory();
  if (hold_out) {
    tell(0.5, "held-out motions");
    result.held_out = judge_held_out(machine, signals, options, result.notes);
  }
  tell(0.9, "errors");
  give_back_memory();
  CompareOptions compare_options;
  compare_options.signals = options.signals;
  if (!inputs.tests.signals.empty()) {
    result.test = compare_signals(pass.model, std::move(inputs.tests.signals), {}, compare_options);
    result.test->bad_data = std::move(inputs.tests.bad);
  }
  result.train = compare_signals(pass.model, std::move(signals), {}, compare_options);
  result.train.bad_data = std::move(inputs.logs.bad);

  result.model = std::move(pass.model);
  result.processes = std::move(pass.processes);
  result.pumps = std::move(pass.pumps);
  result.valves = std::move(pass.valves);
  result.model.data.insert(result.model.data.end(), inputs.data.begin(), inputs.data.end());
  const auto keep = [&](const CompareResult& r, const char* name) {
    const std::vector<StageQuality> q = stage_quality(r, name);
    result.model.quality.insert(result.model.quality.end(), q.begin(), q.end());
  };
  keep(result.train, "train");
  if (result.test) keep(*result.test, "test");
  if (result.held_out) keep(*result.held_out, "held out");
  tell(1.0, "done");
  return result;
}

/// @param logs,test_logs vectors of logs; moved from where they are given as values
template <class Logs>
FitResult fit_logs(const Machine& machine, Logs&& logs, Logs&& test_logs, const FitOptions& options,
                   const Progress& progress) {
  if (logs.empty()) throw InputError({}, "log", "no log to learn from; give at least one");
  const auto start = std::chrono::steady_clock::now();
  if (progress) progress(0.0, "speeds and forces");
  FitInputs inputs;
  inputs.data = sources(logs, "train");
  for (DataSource& d : sources(test_logs, "test")) inputs.data.push_back(std::move(d));
  inputs.logs = all_signals(machine, std::forward<Logs>(logs), options, Staying::kNothing);
  inputs.tests =
      all_signals(machine, std::forward<Logs>(test_logs), options, Staying::kJumpsAndRipples);
  FitResult result = fit_signals(machine, std::move(inputs), options, progress);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

FitResult fit(const Machine& machine, const std::vector<Log>& logs,
              const std::vector<Log>& test_logs, const FitOptions& options,
              const Progress& progress) {
  return fit_logs(machine, logs, test_logs, options, progress);
}

FitResult fit(const Machine& machine, std::vector<Log>&& logs, std::vector<Log>&& test_logs,
              const FitOptions& options, const Progress& progress) {
  return fit_logs(machine, std::move(logs), std::move(test_logs), options, progress);
}

}  // namespace sparflow
