#include "identification/comparison/error_ranking.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "identification/comparison/compare.h"
#include "identification/comparison/report_numbers.h"
#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Factor on measured minus smoothed signal as an estimate of the sensor noise.
/// @threshold [1] 1..1.5; chosen: the smoothed signal keeps a part of the noise, so the difference is too small by about
/// this factor
constexpr double kNoiseAllowance = 1.1;
/// Least number of samples from which the noise is estimated.
/// @threshold [samples] 5..1000; chosen: the median of fewer is uncertain by more than a fifth
constexpr std::size_t kFewestForNoise = 20;

/// Measured minus smoothed signal; empty where the log or the stage has none, as of flows, whose speed is smoothed already.
VectorXd roughness(const Machine& machine, const MachineSignals& signals, const ComparedSeries& s) {
  if (s.stage == "pump") {
    const auto p = static_cast<std::size_t>(machine.pump_index(s.at));
    return signals.pumps[p].pressure - signals.pumps[p].pressure_smooth;
  }
  const auto i = static_cast<std::size_t>(machine.cylinder_index(s.at));
  const CylinderSignals& c = signals.cylinders[i];
  if (s.stage == "force") return c.force - c.force_smooth;
  if (s.stage == "pressure") return c.working_pressure - c.working_pressure_smooth;
  return {};
}

/// Calls visit(log, series, sample) for each compared sample of a quantity.
template <class F>
void for_each_sample(const CompareResult& result, const StageScore& score, const F& visit) {
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (s.stage != score.stage || s.at != score.at) continue;
      for (Index k = 0; k < s.measured.size(); ++k) {
        if (!std::isfinite(s.measured[k])) continue;
        if (!score.regime.empty() &&
            s.regimes[static_cast<std::size_t>(s.regime[k])] != score.regime)
          continue;
        visit(log, s, k);
      }
    }
  }
}

/// Standard deviation of the measured values, at least a share of their RMS.
double scale_of(const CompareResult& result, const StageScore& score, double level_share) {
  double sum = 0.0, squares = 0.0, n = 0.0;
  for_each_sample(result, score, [&](const LogComparison&, const ComparedSeries& s, Index k) {
    sum += s.measured[k];
    squares += s.measured[k] * s.measured[k];
    n += 1.0;
  });
  if (n == 0.0) return kNaN;
  const double variance = std::max(0.0, squares / n - sum * sum / n / n);
  return std::max(std::sqrt(variance), level_share * std::sqrt(squares / n));
}

Grade grade_of(double unexplained, const RankingOptions& options) {
  if (unexplained <= options.good_share) return Grade::kGood;
  return unexplained > options.poor_share ? Grade::kPoor : Grade::kFair;
}

std::string amount_of(const StageScore& s) {
  if (s.unit.name == "N" && s.rmse >= 1e3)
    return fmt::format("{} kN RMS", plain_number(s.rmse / 1e3, 3));
  return fmt::format("{} {} RMS", plain_number(s.rmse / s.unit.si, 3), s.unit.name);
}

RankedError ranked(const Machine& machine, const CompareResult& result, const StageScore& score,
                   const RankingOptions& options) {
  RankedError r;
  r.stage = score.stage;
  r.at = score.at;
  r.regime = score.regime;
  r.words = quantity_name(r.stage, r.at, r.regime);
  r.amount = amount_of(score);
  r.error = score.rmse;
  r.noise = sensor_noise(machine, result, score);
  r.scale = scale_of(result, score, options.level_share);
  const double noise = std::isfinite(r.noise) ? r.noise : 0.0;
  const double beyond = std::sqrt(std::max(0.0, score.rmse * score.rmse - noise * noise));
  // where nothing was measured but zero, an error explains nothing of it
  const double share = r.scale > 0.0 ? beyond / r.scale : 1.0;
  r.unexplained = beyond > 0.0 ? share : 0.0;
  r.grade = grade_of(r.unexplained, options);
  return r;
}

RankedError ranked(const EnergyScore& e, const RankingOptions& options) {
  RankedError r;
  r.stage = "energy";
  r.at = e.pump;
  r.words = quantity_name("energy", e.pump, "");
  const double percent = std::round(1e4 * e.relative_error) / 100.0;
  r.amount = fmt::format("{:+.2f} %", percent == 0.0 ? 0.0 : percent);
  r.error = e.predicted - e.measured;
  r.noise = kNaN;
  r.scale = options.energy_share * e.measured;
  r.unexplained = std::abs(e.relative_error) / options.energy_share;
  r.grade = grade_of(r.unexplained, options);
  return r;
}

/// Whether the larger part of a quantity's error comes with its inputs from the stage before.
bool inherits(const CompareResult& result, const RankedError& r) {
  if (r.stage == "energy") return true;  // both energies have the same flow
  return std::any_of(result.fault.stages.begin(), result.fault.stages.end(),
                     [&](const StageSplit& s) {
                       return s.stage == r.stage && s.at == r.at && s.regime == r.regime &&
                              !s.compensates && s.inherited > s.own;
                     });
}

/// Whether `before` is the stage from which `r` has its inputs.
bool feeds(const Machine& machine, const RankedError& before, const RankedError& r) {
  if (r.stage == "pressure") return before.stage == "force" && before.at == r.at;
  if (r.stage == "energy") return before.stage == "pump" && before.at == r.at;
  if (r.stage != "pump" || before.stage != "pressure") return false;
  const std::vector<int>& fed =
      machine.pumps[static_cast<std::size_t>(machine.pump_index(r.at))].feeds;
  return std::find(fed.begin(), fed.end(), machine.cylinder_index(before.at)) != fed.end();
}

/// Sets each inherited error's source: of the stages that feed it, the one with the largest unexplained share.
void set_sources(const Machine& machine, const CompareResult& result,
                 std::vector<RankedError>& errors) {
  for (RankedError& r : errors) {
    if (!inherits(result, r)) continue;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (!feeds(machine, errors[i], r)) continue;
      if (r.source < 0 ||
          errors[i].unexplained > errors[static_cast<std::size_t>(r.source)].unexplained)
        r.source = static_cast<int>(i);
    }
  }
}

/// Sorts, and renumbers the sources.
std::vector<RankedError> sorted(const std::vector<RankedError>& errors) {
  std::vector<std::size_t> order(errors.size()), place(errors.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    const RankedError &a = errors[i], &b = errors[j];
    if (a.grade != b.grade) return a.grade > b.grade;
    if ((a.source < 0) != (b.source < 0)) return a.source < 0;
    return a.unexplained > b.unexplained;
  });
  for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  std::vector<RankedError> out;
  out.reserve(errors.size());
  for (const std::size_t i : order) {
    out.push_back(errors[i]);
    if (out.back().source >= 0)
      out.back().source = static_cast<int>(place[static_cast<std::size_t>(out.back().source)]);
  }
  return out;
}

std::string headline_of(const ErrorRanking& ranking) {
  if (ranking.empty()) return "Nothing could be compared";
  const RankedError& worst = ranking.errors.front();
  if (worst.grade == Grade::kGood) return "The model follows the measurements in every stage";
  if (worst.stage == "energy" &&
      std::none_of(ranking.errors.begin(), ranking.errors.end(), [](const RankedError& r) {
        return r.stage != "energy" && r.grade != Grade::kGood;
      }))
    return fmt::format("The model follows the measurements, except for the {}: {}", worst.words,
                       worst.amount);
  std::string text = fmt::format("The model {} the {}: {}",
                                 worst.grade == Grade::kPoor ? "misses" : "follows only roughly",
                                 worst.words, worst.amount);
  if (worst.stage != "energy")
    text += fmt::format(", {:.0f} % explained", worst.explained_percent());
  const RankedError* cause = ranking.cause();
  if (cause != &worst) text += fmt::format(", mostly inherited from the {}", cause->words);
  return text;
}

}  // namespace

const char* grade_word(Grade grade) {
  return grade == Grade::kGood ? "good" : grade == Grade::kPoor ? "poor" : "fair";
}

double RankedError::explained_percent() const {
  return std::floor(100.0 * std::max(0.0, 1.0 - unexplained));
}

const RankedError* ErrorRanking::cause() const {
  if (empty()) return nullptr;
  const RankedError* at = &errors.front();
  while (at->source >= 0) at = &errors[static_cast<std::size_t>(at->source)];
  return at;
}

const RankedError* ErrorRanking::at_fault() const {
  const RankedError* found = cause();
  return found != nullptr && found->unexplained > options.least_share_at_fault ? found : nullptr;
}

const RankedError* ErrorRanking::find(const std::string& stage, const std::string& at,
                                      const std::string& regime) const {
  const auto found = std::find_if(errors.begin(), errors.end(), [&](const RankedError& r) {
    return r.stage == stage && r.at == at && r.regime == regime;
  });
  return found == errors.end() ? nullptr : &*found;
}

std::vector<const RankedError*> ErrorRanking::worst_of_stages() const {
  std::vector<const RankedError*> out;
  for (const RankedError& r : errors) {
    if (std::none_of(out.begin(), out.end(),
                     [&](const RankedError* o) { return o->stage == r.stage; }))
      out.push_back(&r);
  }
  return out;
}

std::size_t ErrorRanking::place(const std::string& stage, const std::string& at,
                                const std::string& regime) const {
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const RankedError& r = errors[i];
    if (r.stage == stage && r.at == at &&
        (regime.empty() || r.regime.empty() || r.regime == regime))
      return i;
  }
  return errors.size();
}

ErrorRanking rank_errors(const Machine& machine, const CompareResult& result,
                         const RankingOptions& options) {
  ErrorRanking out;
  out.options = options;
  for (const StageScore& s : result.scores)
    out.errors.push_back(ranked(machine, result, s, options));
  for (const EnergyScore& e : result.energy) {
    if (std::isfinite(e.relative_error)) out.errors.push_back(ranked(e, options));
  }
  set_sources(machine, result, out.errors);
  out.errors = sorted(out.errors);
  out.headline = headline_of(out);
  return out;
}

double sensor_noise(const Machine& machine, const CompareResult& result, const StageScore& score) {
  std::vector<double> rough;
  const LogComparison* of = nullptr;
  VectorXd difference;
  for_each_sample(result, score, [&](const LogComparison& log, const ComparedSeries& s, Index k) {
    if (of != &log) difference = roughness(machine, log.signals, s);
    of = &log;
    if (difference.size() > 0 && std::isfinite(difference[k])) rough.push_back(difference[k]);
  });
  if (rough.size() < kFewestForNoise) return kNaN;
  const Eigen::Map<const VectorXd> r(rough.data(), static_cast<Index>(rough.size()));
  return kNoiseAllowance * robust_std(r);
}

std::string quantity_name(const std::string& stage, const std::string& at,
                          const std::string& regime) {
  const std::string side = regime == "extend"    ? " extending"
                           : regime == "retract" ? " retracting"
                                                 : "";
  if (stage == "pump") return "pressure of pump " + at;
  if (stage == "energy") return "energy of pump " + at;
  if (stage == "pressure") return "working pressure of " + at + side;
  if (stage == "flow") return "flow of " + at + side + " from its command";
  if (stage == "flow_sensor") return "flow of " + at + side + " at its sensor";
  return stage + " of " + at + side;
}

}  // namespace sparflow
