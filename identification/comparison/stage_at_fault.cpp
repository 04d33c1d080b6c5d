#include "identification/comparison/stage_at_fault.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/comparison/compare.h"
#include "identification/comparison/error_ranking.h"
#include "identification/comparison/report_numbers.h"
#include "identification/signals/apply_effects.h"
#include "models/chain/pump_law.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The inherited error of a series: the change of its prediction that the errors of the stages before cause. NaN where the
/// measured inputs are unknown.
class Inheritance {
 public:
  Inheritance(const CraneModel& model, const LogComparison& log)
      : model_(model), signals_(log.signals) {}

  double at(const ComparedSeries& series, Index k) const {
    if (series.stage == "pressure") {
      const int i = model_.machine.cylinder_index(series.at);
      return pressure(i, k);
    }
    if (series.stage == "pump") return pump(model_.machine.pump_index(series.at), k);
    return 0.0;
  }

 private:
  const VectorXd& predicted_force(const CylinderSignals& c) const {
    return c.model_force.size() > 0 ? c.model_force : c.static_force;
  }

  const GaussianProcess& process(int cylinder, int direction) const {
    const CylinderModel& m = model_.cylinders[static_cast<std::size_t>(cylinder)];
    return direction > 0 ? m.extend : m.retract;
  }

  double pressure(int cylinder, Index k) const {
    const CylinderSignals& c = signals_.cylinders[static_cast<std::size_t>(cylinder)];
    if (c.force_smooth.size() == 0 || c.direction[k] == 0) return kNaN;
    const GaussianProcess& p = process(cylinder, c.direction[k]);
    if (p.empty()) return kNaN;
    return p.mean(c.flow[k], predicted_force(c)[k]) - p.mean(c.flow[k], c.force_smooth[k]);
  }

  double pump(int pump_index, Index k) const {
    const Pump& pump = model_.machine.pumps[static_cast<std::size_t>(pump_index)];
    if (pump.type == PumpType::kConstantPressure) return 0.0;
    const double standby = model_.pumps[static_cast<std::size_t>(pump_index)].standby;
    PumpLaw predicted(standby), measured(standby);
    for (const int i : pump.feeds) {
      const CylinderSignals& c = signals_.cylinders[static_cast<std::size_t>(i)];
      if (c.direction[k] == 0) continue;
      if (!c.has_pressure()) return kNaN;
      const GaussianProcess& p = process(i, c.direction[k]);
      if (p.empty()) return kNaN;
      double added = model_.cylinders[static_cast<std::size_t>(i)].margin;
      if (c.demand_effect.size() > 0) added += c.demand_effect[k];
      double by_model = p.mean(c.flow[k], predicted_force(c)[k]);
      by_model += working_pressure_effect(model_, signals_, i, k);
      predicted.add(i, by_model + added);
      measured.add(i, c.working_pressure_smooth[k] + added);
    }
    return predicted.pressure() - measured.pressure();
  }

  const CraneModel& model_;
  const MachineSignals& signals_;
};

std::string amount(double value, const std::string& unit) {
  if (unit == "N" && std::abs(value) >= 1e3) return plain_number(value / 1e3, 3) + " kN";
  return plain_number(value, 3) + " " + unit;
}

/// Splits the error of one quantity. @param score of the quantity
StageSplit split(const CraneModel& model, const CompareResult& result, const StageScore& score,
                 const StageAtFaultOptions& options) {
  const std::string &stage = score.stage, &at = score.at, &regime = score.regime;
  StageSplit out;
  out.stage = stage;
  out.at = at;
  out.regime = regime;
  double error = 0.0, own = 0.0, inherited = 0.0, sum = 0.0, squares = 0.0, n = 0.0;
  FieldUnit unit;
  for (const LogComparison& log : result.logs) {
    const Inheritance before(model, log);
    for (const ComparedSeries& s : log.series) {
      if (s.stage != stage || s.at != at) continue;
      unit = s.unit;
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k])) continue;
        // Outside the training data neither of the two predictions is reliable.
        if (s.extrapolated.size() > 0 && s.extrapolated[k]) continue;
        if (!regime.empty() && s.regimes[static_cast<std::size_t>(s.regime[k])] != regime) continue;
        const double e = s.predicted[k] - s.measured[k], from_before = before.at(s, k);
        if (!std::isfinite(from_before)) continue;
        error += e * e;
        own += (e - from_before) * (e - from_before);
        inherited += from_before * from_before;
        sum += s.measured[k];
        squares += s.measured[k] * s.measured[k];
        n += 1.0;
      }
    }
  }
  out.n = static_cast<long>(n);
  if (n < 2.0) return out;
  out.unit = unit.name;
  out.error = std::sqrt(error / n) / unit.si;
  out.own = std::sqrt(own / n) / unit.si;
  out.inherited = std::sqrt(inherited / n) / unit.si;
  out.spread = std::sqrt(std::max(0.0, squares / n - sum * sum / n / n)) / unit.si;
  const double noise = sensor_noise(model.machine, result, score);
  if (std::isfinite(noise)) out.noise = noise / unit.si;
  // A law that was learned with wrong inputs compensates their error; its error with right inputs is then not its own.
  out.compensates = out.own > options.compensation_ratio * out.error &&
                    out.inherited > options.compensation_ratio * out.error;
  out.words = quantity_name(stage, at, regime);
  return out;
}

/// @param at the quantity at fault by the ranking; nullptr = none
std::string describe(const StageAtFault& found, const ErrorRanking& ranking, const RankedError* at,
                     const StageAtFaultOptions& options) {
  if (ranking.empty()) return "";
  if (at == nullptr)
    return "No stage stands out: with measured inputs the error of every stage is near its noise.";
  const char* const what =
      ranking.grade() == Grade::kGood ? "The largest error that is left" : "The error";
  if (found.fault <
      0)  // it could not be split, as where all of its samples lie outside the training data
    return fmt::format("{} arises in the {}: {}.", what, at->words, at->amount);
  const StageSplit& f = found.stages[static_cast<std::size_t>(found.fault)];
  std::string text =
      fmt::format("{} arises in the {}: {} RMS of its own", what, f.words, amount(f.own, f.unit));
  if (f.inherited > options.mentioned_share * f.own)
    text += fmt::format(" and {} inherited", amount(f.inherited, f.unit));
  // The following stage that inherits the largest error is named with it.
  const StageSplit* heir = nullptr;
  for (const StageSplit& s : found.stages) {
    const bool next = (f.stage == "force" && s.stage == "pressure" && s.at == f.at) ||
                      (f.stage == "pressure" && s.stage == "pump");
    if (next && !s.compensates && s.inherited > options.mentioned_share * s.error &&
        (heir == nullptr || s.inherited > heir->inherited))
      heir = &s;
  }
  if (heir != nullptr) {
    text += fmt::format("; the {} inherits {} of it, its own error is {}", heir->words,
                        amount(heir->inherited, heir->unit), amount(heir->own, heir->unit));
  }
  // A pressure model that was learned with the wrong force compensates its error, and the sentence explains that.
  const StageSplit* compensates = nullptr;
  for (const StageSplit& s : found.stages) {
    const bool next = f.stage == "force" && s.stage == "pressure" && s.at == f.at;
    if (next && s.compensates && (compensates == nullptr || s.own > compensates->own))
      compensates = &s;
  }
  if (compensates != nullptr) {
    text += fmt::format(
        "; the {} was learned with it and compensates it: its error is {} with the predicted force "
        "and {} with the measured one",
        compensates->words, amount(compensates->error, compensates->unit),
        amount(compensates->own, compensates->unit));
  }
  return text + ".";
}

}  // namespace

std::vector<StageSplit> split_stages(const CraneModel& model, const CompareResult& result,
                                     const StageAtFaultOptions& options) {
  std::vector<StageSplit> out;
  for (const StageScore& score : result.scores) {
    StageSplit s = split(model, result, score, options);
    if (s.n > 1) out.push_back(std::move(s));
  }
  return out;
}

void name_stage_at_fault(const ErrorRanking& ranking, StageAtFault& fault,
                         const StageAtFaultOptions& options) {
  fault.fault = -1;
  const RankedError* at = ranking.at_fault();
  for (std::size_t i = 0; at != nullptr && i < fault.stages.size(); ++i) {
    const StageSplit& s = fault.stages[i];
    if (s.stage == at->stage && s.at == at->at && s.regime == at->regime)
      fault.fault = static_cast<int>(i);
  }
  fault.sentence = describe(fault, ranking, at, options);
}

}  // namespace sparflow
