#include "optimizer/baselines/strategies_summary.h"

#include <algorithm>
#include <limits>

namespace sparflow {

double cost_with_idling(const StrategyOutcome& outcome, double idle_power) {
  return outcome.energy.total + idle_power * outcome.duration;
}

PairedSummary paired(const std::vector<StrategyComparison>& all, const std::string& row,
                     const std::string& kind, const std::string& against) {
  /// Relative difference of costs up to which two strategies count as equal.
  /// @threshold [1] 0..0.1; chosen: below what solver and mesh leave
  constexpr double kSame = 1e-3;
  PairedSummary s;
  s.kind = kind;
  s.against = against;
  std::vector<double> ratios, differences;
  for (const StrategyComparison& c : all) {
    const StrategyRow* r = c.row(row);
    if (r == nullptr) continue;
    const StrategyOutcome* one = r->find(kind);
    const StrategyOutcome* other = r->find(against);
    const bool has_one = one != nullptr && one->found();
    const bool has_other = other != nullptr && other->found();
    if (has_one && !has_other) ++s.only_kind;
    if (!has_one && has_other) ++s.only_against;
    if (!has_one || !has_other) continue;
    // At equal durations idling is the same for both.
    const double idle = r->duration > 0.0 ? 0.0 : c.idle_power;
    const double a = cost_with_idling(*one, idle), b = cost_with_idling(*other, idle);
    if (!(b > 0.0)) continue;
    ++s.n;
    ratios.push_back(a / b - 1.0);
    differences.push_back(a - b);
    if (ratios.back() < -kSame) ++s.cheaper;
    if (ratios.back() > kSame) ++s.dearer;
  }
  s.median = quantile(ratios, 0.5);
  s.lower = quantile(ratios, 0.25);
  s.upper = quantile(ratios, 0.75);
  s.least = quantile(ratios, 0.0);
  s.largest = quantile(ratios, 1.0);
  s.test = signed_rank_test(differences);
  return s;
}

std::vector<std::string> row_names(const std::vector<StrategyComparison>& all) {
  std::vector<std::string> names;
  for (const StrategyComparison& c : all) {
    for (const StrategyRow& r : c.rows) {
      if (std::find(names.begin(), names.end(), r.name) == names.end()) names.push_back(r.name);
    }
  }
  return names;
}

std::string strategy_title(const std::string& kind) {
  if (kind == kSequential) return "one cylinder after another";
  if (kind == kJointLine) return "simultaneous, best end";
  if (kind == kNearestJointLine) return "simultaneous, nearest end";
  if (kind == kActuatorLine) return "cylinder strokes in proportion";
  if (kind == kTipLine) return "tip on a straight line";
  if (kind == kBestTipLine) return "tip line, best redundancy";
  if (kind == kMinimumTime) return "shortest time";
  if (kind == kMinimumControl) return "least squared commands";
  if (kind == kOptimal) return "energy-optimal";
  return kind;
}

}  // namespace sparflow
