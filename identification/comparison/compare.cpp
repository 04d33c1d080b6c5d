#include "identification/comparison/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "identification/comparison/compare_stages.h"
#include "identification/comparison/report_numbers.h"
#include "identification/data_checks/set_aside.h"
#include "identification/signals/apply_effects.h"
#include "models/math/error.h"
#include "models/math/nan.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Half width of the 95 % interval of a normal distribution. [standard deviations]
constexpr double kNormal95 = 1.959964;

/// Scores one quantity over all logs.
StageScore score(const std::vector<LogComparison>& logs, const std::string& stage,
                 const std::string& at, const std::string& regime) {
  StageScore out;
  out.stage = stage;
  out.at = at;
  out.regime = regime;
  double sum = 0.0, sum_y = 0.0, squares = 0.0;
  double outside_squares = 0.0;
  long inside = 0, judged = 0, outside = 0, ranged = 0;
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
        if (s.extrapolated.size() > 0) {
          ++ranged;
          if (s.extrapolated[k]) {
            ++outside;
            outside_squares += e * e;
          }
        }
        if (s.deviation.size() > 0) {
          ++judged;
          if (std::abs(e) <= kNormal95 * s.deviation[k]) ++inside;
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
  const double part = static_cast<double>(outside);
  out.extrapolated_percent = ranged > 0 ? 100.0 * part / static_cast<double>(ranged) : kNaN;
  out.extrapolated_error_percent =
      ranged > 0 && squares > 0.0 ? 100.0 * outside_squares / squares : kNaN;
  return out;
}

/// Notes pressures with large errors outside the training data, where an error says nothing about the law.
void extrapolation_notes(const CraneModel& model, const std::vector<StageScore>& scores,
                         const CompareNoteOptions& options, std::set<std::string>& notes) {
  for (const StageScore& s : scores) {
    if (!(s.extrapolated_percent >= options.extrapolated_percent)) continue;
    if (!(s.extrapolated_error_percent > options.extrapolated_ratio * s.extrapolated_percent))
      continue;
    const bool extend = s.regime == "extend";
    const auto i = static_cast<std::size_t>(model.machine.cylinder_index(s.at));
    const CylinderModel& c = model.cylinders[i];
    const GpParameters& p = (extend ? c.extend : c.retract).parameters();
    notes.insert(fmt::format(
        "pressure of {} {}: {:.0f} % of the samples lie outside what it was learned from "
        "({:.1f}..{:.1f} l/min, "
        "{}..{} kN) and hold {:.0f} % of its squared error; fit with such motions",
        s.at, extend ? "extending" : "retracting", s.extrapolated_percent,
        p.flow_min / units::kLitrePerMinute, p.flow_max / units::kLitrePerMinute,
        fixed_number(p.force_min / 1e3, 1), fixed_number(p.force_max / 1e3, 1),
        s.extrapolated_error_percent));
  }
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
  return fmt::format("pump {} (leader {})", s.at, name);
}

/// A pool holds quantities whose squared errors may be added; forces of cylinders of different size may not.
void set_pool(ErrorGroup& group) {
  group.pool = group.stage == "force" ? "force " + group.at : group.stage;
  const std::string what = group.stage == "flow_sensor" ? "flow sensor" : group.stage;
  group.pool_words = group.stage == "force" ? fmt::format("the force error of {}", group.at)
                                            : fmt::format("the {} error", what);
}

/// Collects the compared samples of one regime over all logs, with every signal that all of them have.
ErrorGroup gather(const Machine& machine, const std::vector<LogComparison>& logs,
                  const ComparedSeries& like, std::size_t regime, bool with_signals) {
  ErrorGroup group;
  group.stage = like.stage;
  group.at = like.at;
  group.regime = like.regimes[regime];
  group.words = regime_words(like, regime);
  group.unit = like.unit.name;
  group.scale = like.unit.si;
  set_pool(group);
  const auto each_row = [&](const ComparedSeries& s, const auto& use) {
    for (Index k = 0; k < s.measured.size(); ++k)
      if (std::isfinite(s.measured[k]) && s.regime[k] == static_cast<int>(regime)) use(k);
  };
  const auto each_series = [&](const auto& use) {
    for (const LogComparison& log : logs) {
      for (const ComparedSeries& s : log.series)
        if (s.stage == like.stage && s.at == like.at) use(log.signals, s);
    }
  };
  Index count = 0, row = 0;
  each_series([&](const MachineSignals&, const ComparedSeries& s) {
    each_row(s, [&](Index) { ++count; });
  });
  group.squared_error.resize(count);
  bool first = true;
  each_series([&](const MachineSignals& signals, const ComparedSeries& s) {
    const Index before = row;
    each_row(s, [&](Index k) {
      const double e = s.predicted[k] - s.measured[k];
      group.squared_error[row++] = e * e;
    });
    if (!with_signals) return;
    for_each_regime_signal(machine, signals, s, [&](RegimeSignal&& signal) {
      auto known = std::find_if(group.signals.begin(), group.signals.end(),
                                [&](const RegimeSignal& g) { return g.key == signal.key; });
      if (known == group.signals.end()) {
        if (!first) return;
        group.signals.push_back(
            {signal.key, signal.words, signal.unit, signal.scale, VectorXd::Constant(count, kNaN)});
        known = group.signals.end() - 1;
      }
      Index at = before;
      each_row(s, [&](Index k) { known->values[at++] = signal.values[k]; });
    });
    first = false;
  });
  return group;
}

/// @param result must outlive the groups
ErrorGroups error_groups(const Machine& machine, const CompareResult& result) {
  struct Asked {
    const ComparedSeries* series;
    std::size_t regime;
    double severity;  ///< NaN: not known
  };
  std::vector<Asked> asked;
  std::set<std::pair<std::string, std::string>> seen;
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (!seen.insert({s.stage, s.at}).second) continue;
      // Pools are searched by the share of the error in the quantity's scale, by which the ranking judges, noise included.
      double severity = 0.0;
      for (const RankedError& r : result.ranking.errors) {
        const StageScore* of = result.find(r.stage, r.at, r.regime);
        if (r.stage == s.stage && r.at == s.at && of != nullptr && r.scale > 0.0)
          severity = std::max(severity, std::min(1.0, of->rmse / r.scale));
      }
      for (std::size_t r = 0; r < s.regimes.size(); ++r) asked.push_back({&s, r, severity});
    }
  }
  const std::size_t count = asked.size();
  return {count, [&machine, &result, asked = std::move(asked)](std::size_t i, bool with_signals) {
            const Asked& a = asked[i];
            ErrorGroup group = gather(machine, result.logs, *a.series, a.regime, with_signals);
            if (std::isfinite(a.severity)) group.severity = a.severity;
            return group;
          }};
}

/// @return quantities with a bias of one sign nearly everywhere, as regions without bounds
std::vector<WorstRegion> biased_everywhere(const std::vector<ComparedPart>& parts,
                                           const ResidualTests& tests,
                                           const CompareNoteOptions& options) {
  std::vector<WorstRegion> out;
  for (const ResidualTest& t : tests.tests) {
    if (!t.depends_on.empty() || t.p_value > tests.alarm ||
        t.share_explained < options.offset_share)
      continue;
    for (const ComparedPart& part : parts) {
      if (part.stage != t.stage || part.at != t.at || part.regime != t.regime) continue;
      const auto positive = (part.error.array() > 0.0).cast<double>().mean();
      if (std::max(positive, 1.0 - positive) < options.one_sided_share) continue;
      WorstRegion w;
      w.stage = t.stage;
      w.at = t.at;
      w.regime = t.regime;
      w.rmse =
          std::sqrt(part.error.squaredNorm() / static_cast<double>(part.error.size())) / part.scale;
      w.unit = t.unit;
      w.share_of_error = w.share_of_samples = 1.0;
      const bool kilo = t.unit == "N" && std::abs(t.size) >= 1e3;
      w.sentence = fmt::format(
          "the {} is predicted {:.3g} {} too {} everywhere: {:.0f} % of its squared error is this "
          "offset (RMSE {:.3g} {})",
          part.words, std::abs(t.size) / (kilo ? 1e3 : 1.0), kilo ? "kN" : t.unit,
          t.size > 0.0 ? "high" : "low", 100.0 * t.share_explained, w.rmse / (kilo ? 1e3 : 1.0),
          kilo ? "kN" : t.unit);
      out.push_back(std::move(w));
    }
  }
  return out;
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
    if (!std::isfinite(s.rmse)) continue;  // not a single sample could be compared
    out.push_back({s.stage, s.regime.empty() ? s.at : s.at + " " + s.regime, data,
                   s.rmse / s.unit.si, s.unit.name, s.fit_percent, s.n});
  }
  for (const EnergyScore& e : result.energy) {
    if (!std::isfinite(e.relative_error)) continue;  // the pump delivered nothing
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
    if (options.find_regions) {
      for (SensorSlip& slip : find_sensor_slips(model.machine, signals[l]))
        result.slips.push_back({signals[l].file, std::move(slip)});
      if (signals[l].slim) signals[l] = without_checked(std::move(signals[l]));
    }
    log.signals = with_effects(model, std::move(signals[l]));
    Comparison comparison(model, log.signals, only.empty() ? nullptr : &only[l]);
    log.series = comparison.series(notes);
    comparison.energy(energy);
    result.samples += only.empty() ? log.signals.samples() : only[l].cast<long>().sum();
    for (const std::string& note : log.signals.notes) notes.insert(log.signals.file + ": " + note);
    result.logs.push_back(std::move(log));
  }
  result.scores = scores(model.machine, result.logs);
  extrapolation_notes(model, result.scores, options.notes, notes);
  for (EnergyScore& e : energy) {
    if (e.duration <= 0.0) continue;
    e.relative_error = e.measured > 0.0 ? (e.predicted - e.measured) / e.measured : kNaN;
    result.energy.push_back(e);
  }
  const bool find_causes = options.find_regions && options.find_causes;
  if (find_causes) result.fault.stages = split_stages(model, result, options.fault);
  result.ranking = rank_errors(model.machine, result, options.ranking);
  if (options.signals.slim) {  // only the scores read it
    for (LogComparison& log : result.logs)
      for (ComparedSeries& s : log.series) s.deviation.resize(0);
  }
  if (options.find_regions) {
    result.worst = worst_regions(error_groups(model.machine, result), options.regions);
  }
  if (find_causes) {
    const std::vector<CompareBlock> blocks = compare_blocks(result, options.tests.blocks.longest_s);
    const std::vector<ComparedPart> parts = compare_parts(model.machine, result, blocks);
    result.tests = test_residuals(parts, static_cast<int>(blocks.size()), options.tests);
    result.regimes = errors_by_regime(result, parts, blocks, options.segments);
    result.segments = worst_segments(model.machine, result, parts, blocks, options.segments);
    const std::vector<WorstRegion> biased = biased_everywhere(parts, result.tests, options.notes);
    result.worst.insert(result.worst.begin(), biased.begin(), biased.end());
    rank(model.machine, result, options);
  }
  result.notes.assign(notes.begin(), notes.end());
  return result;
}

void rank(const Machine& machine, CompareResult& result, const CompareOptions& options) {
  result.ranking = rank_errors(machine, result, options.ranking);
  name_stage_at_fault(result.ranking, result.fault, options.fault);
  const auto by_rank = [&](const auto& a, const auto& b) {
    return result.ranking.place(a.stage, a.at, a.regime) <
           result.ranking.place(b.stage, b.at, b.regime);
  };
  std::stable_sort(result.worst.begin(), result.worst.end(), by_rank);
  std::stable_sort(result.segments.begin(), result.segments.end(), by_rank);
}

void keep_stages(const Machine& machine, const std::vector<std::string>& stages,
                 CompareResult& result) {
  const auto other = [&](const auto& item) {
    return std::find(stages.begin(), stages.end(), item.stage) == stages.end();
  };
  std::erase_if(result.scores, other);
  std::erase_if(result.worst, other);
  std::erase_if(result.tests.tests, other);
  std::erase_if(result.fault.stages, other);
  std::erase_if(result.regimes, other);
  std::erase_if(result.segments, other);
  for (LogComparison& log : result.logs) std::erase_if(log.series, other);
  if (std::find(stages.begin(), stages.end(), "energy") == stages.end()) result.energy.clear();
  rank(machine, result);
}

CompareResult join_results(const Machine& machine, std::vector<CompareResult> parts) {
  CompareResult out;
  for (CompareResult& part : parts) {
    out.samples += part.samples;
    for (LogComparison& log : part.logs) out.logs.push_back(std::move(log));
  }
  out.scores = scores(machine, out.logs);
  out.ranking = rank_errors(machine, out);
  return out;
}

namespace {

/// Makes the signals of a log without what is faulty in it.
void add_log(const CraneModel& model, const Log& log, const CompareOptions& options,
             std::pair<std::vector<MachineSignals>, std::vector<BadChannelOfLog>>& out) {
  constexpr Staying kInErrors = Staying::kJumpsAndRipples;
  CheckedSignals checked =
      checked_signals(model.machine, log, options.signals, options.bad_data, kInErrors);
  out.first.push_back(std::move(checked.signals));
  if (is_computed_motion(model.machine, log)) {
    out.first.back().notes.push_back(
        "the columns are those of a computed motion, so its channels are not judged as sensors");
  }
  for (BadChannel& b : checked.bad) {
    const bool in_errors = stays(b, kInErrors);
    out.second.push_back({log.file, std::move(b), in_errors});
  }
}

}  // namespace

CompareResult compare(const CraneModel& model, const std::vector<Log>& logs,
                      const CompareOptions& options) {
  std::pair<std::vector<MachineSignals>, std::vector<BadChannelOfLog>> seen;
  for (const Log& log : logs) add_log(model, log, options, seen);
  CompareResult result = compare_signals(model, std::move(seen.first), {}, options);
  result.bad_data = std::move(seen.second);
  return result;
}

CompareResult compare(const CraneModel& model, std::vector<Log>&& logs,
                      const CompareOptions& options) {
  std::pair<std::vector<MachineSignals>, std::vector<BadChannelOfLog>> seen;
  for (Log& log : logs) {
    const Log one = std::move(log);
    log = Log();
    add_log(model, one, options, seen);
  }
  CompareResult result = compare_signals(model, std::move(seen.first), {}, options);
  result.bad_data = std::move(seen.second);
  return result;
}

CompareResult::CompareResult() = default;
CompareResult::CompareResult(const CompareResult&) = default;
CompareResult::CompareResult(CompareResult&&) noexcept = default;
CompareResult& CompareResult::operator=(const CompareResult&) = default;
CompareResult& CompareResult::operator=(CompareResult&&) noexcept = default;
CompareResult::~CompareResult() = default;

}  // namespace sparflow
