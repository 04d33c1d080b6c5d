#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "identification/learning/find_branch_corner.h"
#include "identification/learning/fit_pass.h"
#include "identification/learning/learn_loads_beyond.h"
#include "identification/signals/apply_effects.h"
#include "models/hydraulics/return_rise.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Samples of one pressure model in order of time, with positions that identify unbroken stretches.
struct ProcessData {
  GpDataset set;
  std::vector<Index> position;  ///< running number over all logs, with a gap between logs
  VectorXd measured;  ///< [Pa] measured, less the effects on the supply chamber; as `back`
  VectorXd back;  ///< [Pa] contribution of effects to the return chamber; empty where there is none
  bool has_back() const { return (back.array() != 0.0).any(); }

  /// Subtracts the part of `back` that reaches the supply chamber by the pressure model learned so far.
  void subtract_back(const Cylinder& cylinder, int side, const GaussianProcess& process) {
    for (Index k = 0; k < back.size(); ++k) {
      const double q = set.flow[k], f = set.force[k];
      set.pressure[k] = measured[k] - supply_rise<double>({process, cylinder, side},
                                                          process.mean(q, f), q, f, back[k]);
    }
  }
  /// The same before a pressure model exists: all of it when moving against the load, nothing with the load.
  void subtract_back(const Cylinder& cylinder, int side) {
    const double supply = side > 0 ? cylinder.area_piston() : cylinder.area_rod();
    const double other = side > 0 ? cylinder.area_rod() : cylinder.area_piston();
    for (Index k = 0; k < back.size(); ++k) {
      const double load = std::max(0.0, side * set.force[k] / supply);
      set.pressure[k] = measured[k] - std::clamp(other / supply * back[k], -load, load);
    }
  }
};

/// Groups of samples that a law is judged on when it is learned without them: the logs, or the blocks of motion of a
/// single log. @param log [samples]  @param row [samples] within its log
std::vector<int> groups_of(const TrainingData& data, const std::vector<std::size_t>& log,
                           const std::vector<Index>& row, double block_s) {
  const bool several = !log.empty() && log.front() != log.back();
  std::vector<int> out;
  if (several) {
    for (const std::size_t l : log) out.push_back(static_cast<int>(l));
    return out;
  }
  if (log.empty()) return out;
  const std::vector<SampleRange> blocks = motion_blocks((*data.signals)[log.front()], block_s);
  std::size_t block = 0;
  for (const Index k : row) {
    while (block + 1 < blocks.size() && k >= blocks[block].end) ++block;
    out.push_back(static_cast<int>(block));
  }
  return out;
}

/// Collects the samples that move in the direction of the command. Pressures are used as logged, because the Gaussian
/// process averages white noise itself and a filter would smooth the steps at starts and stops.
ProcessData process_data(const Machine& machine, const TrainingData& data, int cylinder,
                         bool extend, double block_s) {
  std::vector<double> flow, force, pressure, back;
  std::vector<std::size_t> log;
  std::vector<Index> row;
  ProcessData out;
  out.set.name = process_name(machine, cylinder, extend);
  Index offset = 0;
  for (std::size_t l = 0; l < data.signals->size(); ++l) {
    const MachineSignals& s = (*data.signals)[l];
    const CylinderSignals& c = s.cylinders[static_cast<std::size_t>(cylinder)];
    for (Index k = 0; k < s.samples() && c.has_pressure(); ++k) {
      if (!data.counts[l][k] || !c.driven[k] || (c.direction[k] > 0) != extend) continue;
      const double own = c.working_pressure[k] - or_zero(c.pressure_effect, k) -
                         or_zero(c.pressure_sensor_effect, k);
      if (!std::isfinite(own + or_zero(c.return_effect, k)) || !std::isfinite(c.model_force[k]))
        continue;
      flow.push_back(c.flow[k]);
      force.push_back(c.model_force[k]);
      pressure.push_back(own);
      back.push_back(or_zero(c.return_effect, k));
      out.position.push_back(offset + k);
      log.push_back(l);
      row.push_back(k);
    }
    offset += s.samples() + 2;
  }
  const auto n = static_cast<Index>(flow.size());
  out.set.flow = Eigen::Map<Eigen::ArrayXd>(flow.data(), n);
  out.set.force = Eigen::Map<Eigen::ArrayXd>(force.data(), n);
  out.set.pressure = Eigen::Map<Eigen::ArrayXd>(pressure.data(), n);
  out.set.group = groups_of(data, log, row, block_s);
  out.back = Eigen::Map<VectorXd>(back.data(), n);
  if (!out.has_back()) {
    out.back.resize(0);
  } else {
    out.measured = out.set.pressure.matrix();
    out.subtract_back(machine.cylinders[static_cast<std::size_t>(cylinder)], extend ? 1 : -1);
  }
  return out;
}

/// @return every `step`-th sample, evenly over each unbroken stretch and at least one of each, so that a short motion
///   under a rare load is represented
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

/// Moves a learned pressure model and its report into the pass. @param samples from which it was learned
void take(FitPass& pass, std::size_t i, LearnedGp learned, const GpDataset& samples,
          const LoadsBeyondOptions& options) {
  ProcessFit& fitted = pass.processes[i];
  fitted.report = std::move(learned.report);
  if (!fitted.report.failure.empty()) return;
  const auto at = static_cast<std::size_t>(fitted.cylinder);
  learned.parameters.beyond =
      learn_loads_beyond(learned.parameters, samples, pass.model.machine.cylinders[at],
                         fitted.extend ? 1 : -1, options);
  CylinderModel& c = pass.model.cylinders[at];
  (fitted.extend ? c.extend : c.retract) = GaussianProcess(std::move(learned.parameters));
}

void subtract_corner(const BranchCorner& corner, GpDataset& set) {
  for (Index k = 0; k < set.pressure.size(); ++k)
    set.pressure[k] -= corner_rise(corner, set.flow[k], set.force[k]).value;
}

/// Data of the processes that are learned in one go.
struct ProcessSets {
  std::vector<GpDataset> sets;
  std::vector<std::size_t> which = {};  ///< [sets] indices into the pass' processes
  /// Whether an existing model and its report stay where a new one cannot be learned.
  bool keep_others = false;
};

/// Learns pressure models in parallel and moves those that could be learned into the pass.
void learn(const ProcessSets& data, const FitOptions& options, FitPass& pass,
           const std::function<void(int, int, const std::string&)>& progress = {}) {
  const auto& [sets, which, keep_others] = data;
  std::vector<GpDataset> asked = sets;
  std::vector<std::optional<SimilarLoads>> similar(sets.size());
  std::vector<BranchCorner> corners(sets.size());
  for (std::size_t k = 0; k < sets.size(); ++k) {
    const ProcessFit& fitted = pass.processes[which[k]];
    const int side = fitted.extend ? 1 : -1;
    const Cylinder& cylinder =
        pass.model.machine.cylinders[static_cast<std::size_t>(fitted.cylinder)];
    similar[k] = similar_loads(sets[k], cylinder, side, options.loads);
    if (similar[k]) {
      asked[k] = at_one_load(std::move(asked[k]), *similar[k]);
      continue;
    }
    corners[k] = find_branch_corner(sets[k], cylinder, side, options.corner);
    if (corners[k].there()) subtract_corner(corners[k], asked[k]);
  }
  std::vector<LearnedGp> learned = learn_gps(asked, options.gp, progress, options.threads);
  for (std::size_t k = 0; k < learned.size(); ++k) {
    const bool there = learned[k].report.failure.empty();
    if (!there && keep_others) continue;
    learned[k].parameters.corner = corners[k];
    if (there && similar[k]) {
      learned[k].parameters = for_any_load(std::move(learned[k].parameters), *similar[k], sets[k]);
    }
    take(pass, which[k], std::move(learned[k]), sets[k], options.loads);
  }
}

VectorXd residuals(const ProcessData& data, const GaussianProcess& process) {
  VectorXd residual(data.set.pressure.size());
  for (Index k = 0; k < residual.size(); ++k) {
    residual[k] = data.set.pressure[k] - process.mean(data.set.flow[k], data.set.force[k]);
  }
  return residual;
}

/// @return thinning step: samples for each independent sample; 1 = all are used
int thinning_step(double autocorrelation, Index samples, const FitOptions& options) {
  if (options.thin_from <= 0.0 || autocorrelation < options.thin_from) return 1;
  const double most = static_cast<double>(samples) / options.thin_least;
  return std::max(1, static_cast<int>(std::lround(std::min(autocorrelation, most))));
}

/// @return the thinned samples without the outliers of the first fit on all samples. The few that remain are not screened
///   again, since a single motion under a rare load would look like an outlier.
GpDataset thinned_set(const ProcessData& data, const VectorXd& residual, int step,
                      double threshold) {
  const double limit = threshold * robust_std(residual);
  std::vector<Index> rows;
  for (const Index row : thinned(data.position, step)) {
    if (threshold <= 0.0 || std::abs(residual[row]) <= limit) rows.push_back(row);
  }
  return data.set.select(rows);
}

/// Subtracts the effects on the return chambers. Their transmission to the supply follows from the pressure models that are
/// being learned: the slopes over the load, which identify the branch, are known after the first round, the values after
/// the second.
void subtract_backs(const FitOptions& options, std::vector<ProcessData>& samples, FitPass& pass) {
  const auto subtract = [&](std::size_t i) {
    const ProcessFit& fitted = pass.processes[i];
    const auto c = static_cast<std::size_t>(fitted.cylinder);
    const CylinderModel& m = pass.model.cylinders[c];
    samples[i].subtract_back(pass.model.machine.cylinders[c], fitted.extend ? 1 : -1,
                             fitted.extend ? m.extend : m.retract);
  };
  ProcessSets again{{}, {}, true};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!pass.processes[i].report.failure.empty() || !samples[i].has_back()) continue;
    subtract(i);
    again.sets.push_back(samples[i].set);
    again.which.push_back(i);
  }
  if (again.sets.empty()) return;
  learn(again, options, pass);
  for (const std::size_t i : again.which) subtract(i);
}

void process_notes(const Machine& machine, FitPass& pass) {
  for (const ProcessFit& f : pass.processes) {
    const std::string& name = machine.cylinders[static_cast<std::size_t>(f.cylinder)].name;
    const char* what = f.extend ? "extending" : "retracting";
    if (!f.report.failure.empty()) {
      pass.notes.push_back(
          fmt::format("pressure of {} {}: not learned, the logs hold {} sample(s) of this motion "
                      "with a measured pressure; record {} {} "
                      "at several speeds and loads, with p{}_{}_bar",
                      name, what, f.offered, name, what, f.extend ? "A" : "B", name));
    }
    for (const std::string& w : f.report.warnings) {
      pass.notes.push_back(fmt::format("pressure of {} {}: {}", name, what, w));
    }
  }
}

}  // namespace

std::string process_name(const Machine& machine, int cylinder, bool extend) {
  return machine.cylinders[static_cast<std::size_t>(cylinder)].name +
         (extend ? " extend" : " retract");
}

void learn_processes(const TrainingData& data, const FitOptions& options, FitPass& pass,
                     const std::function<void(double, const std::string&)>& progress) {
  const Machine& machine = pass.model.machine;
  std::vector<ProcessData> samples;
  ProcessSets all;
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    if (!machine.cylinders[static_cast<std::size_t>(i)].hydraulic()) continue;
    for (const bool extend : {true, false}) {
      samples.push_back(process_data(machine, data, i, extend, options.hold_out_block_s));
      all.sets.push_back(std::move(samples.back().set));  // lent, because long logs have many
      all.which.push_back(all.which.size());
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
  learn(all, options, pass, tell(0.0));
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].set = std::move(all.sets[i]);
  all.sets.clear();
  subtract_backs(options, samples, pass);

  // Where thinned samples cannot be learned, the first fit is kept.
  ProcessSets again{{}, {}, true};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ProcessFit& fitted = pass.processes[i];
    if (!fitted.report.failure.empty()) continue;
    const CylinderModel& c = pass.model.cylinders[static_cast<std::size_t>(fitted.cylinder)];
    const VectorXd residual = residuals(samples[i], fitted.extend ? c.extend : c.retract);
    fitted.autocorrelation =
        integrated_autocorrelation(residual, samples[i].position, options.autocorrelation);
    fitted.step = thinning_step(fitted.autocorrelation, residual.size(), options);
    if (fitted.step == 1) continue;
    again.sets.push_back(
        thinned_set(samples[i], residual, fitted.step, options.gp.outlier_threshold));
    again.which.push_back(i);
  }
  if (again.sets.empty()) {
    process_notes(machine, pass);
    return;
  }
  FitOptions screened = options;
  screened.gp.outlier_threshold = 0.0;
  learn(again, screened, pass, tell(0.5));
  process_notes(machine, pass);
}

}  // namespace sparflow
