#include "optimizer/pareto.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

constexpr double kVerySlow = 30.0;  // times the shortest: flow losses have vanished
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double energy_or_none(const std::vector<StrategyOutcome>& all, const std::string& kind) {
  for (const StrategyOutcome& o : all) {
    if (o.kind == kind && o.found()) return o.energy.total;
  }
  return kNone;
}

}  // namespace

std::vector<IdleChoice> idle_choices(const std::vector<ParetoPoint>& points,
                                     const std::vector<double>& idle_powers) {
  std::vector<IdleChoice> choices;
  for (const double power : idle_powers) {
    IdleChoice choice{power, 0.0, 0.0, false};
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ParetoPoint& p = points[i];
      if (!p.optimal.found()) continue;
      const double cost = p.optimal.energy.total + power * p.duration;
      if (cost >= least) continue;
      least = cost;
      choice = {power, p.duration, p.optimal.energy.total, i + 1 == points.size()};
    }
    if (std::isfinite(least)) choices.push_back(choice);
  }
  return choices;
}

ParetoCurve energy_against_time(const CraneModel& model, const MotionProblem& problem,
                                const std::vector<SeedMotion>& seeds,
                                const ParetoOptions& options) {
  ParetoCurve curve;
  curve.sequential_limit = curve.simultaneous_limit = kNone;
  std::vector<Eigen::VectorXd> ends;
  for (const SeedMotion& s : seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  const BaselineSet baselines(model, problem, ends, options.strategies.baselines);
  double anchor = 0.0;
  for (const std::string& kind : BaselineSet::kinds()) {
    const double shortest = baselines.shortest(kind);
    if (shortest > 0.0 && (anchor == 0.0 || shortest < anchor)) anchor = shortest;
  }
  for (const SeedMotion& s : seeds) {
    if (s.shortest_duration > 0.0 && (anchor == 0.0 || s.shortest_duration < anchor))
      anchor = s.shortest_duration;
  }
  if (anchor <= 0.0) {
    curve.message = "no way tried reaches the goal within the limits at any duration";
    return curve;
  }
  for (const auto& [kind, limit] :
       {std::pair{kSequential, &curve.sequential_limit}, {kJointLine, &curve.simultaneous_limit}}) {
    const BaselineMotion slow = baselines.at(kind, kVerySlow * anchor);
    if (slow.found()) *limit = slow.energy.total;
  }
  OptimumSearch search(model, problem, seeds, baselines, options.strategies);
  int done = 0;
  bool go_on = true;
  const auto evaluate = [&](double duration, bool thorough) {
    const std::vector<StrategyOutcome> known =
        baseline_outcomes(model, problem, baselines, duration);
    ParetoPoint p;
    p.duration = duration;
    p.sequential = energy_or_none(known, kSequential);
    p.simultaneous = energy_or_none(known, kJointLine);
    p.optimal = search.at(duration, known, thorough);
    ++done;
    if (options.progress) {
      go_on = options.progress(std::min(1.0, static_cast<double>(done) / (options.points + 8)),
                               fmt::format("{:.2f} s", duration));
    }
    return p;
  };
  const auto keep = [&](ParetoPoint p) {
    const bool found = p.optimal.found();
    if (found) curve.points.push_back(std::move(p));
    return found;
  };
  // dense where the curve bends: near the shortest time
  const double low = std::max(anchor, problem.duration.fixed() ? 0.0 : problem.duration.min);
  for (int i = options.points - 1; i >= 0 && go_on; --i) {
    const double share = static_cast<double>(i) / std::max(1, options.points - 1);
    const double duration = low * std::pow(options.longest, std::pow(share, 1.4));
    keep(evaluate(duration, i == options.points - 1 || i <= 2));
  }
  // down to the shortest time: what overlaps may be faster than any line
  double found = curve.points.empty() ? anchor : curve.points.back().duration, ratio = 0.93;
  while (go_on && ratio < 0.985) {
    const double duration = found * ratio;
    if (keep(evaluate(duration, true))) {
      found = duration;
    } else {
      curve.too_short = duration;
      ratio = std::sqrt(ratio);
    }
  }
  std::sort(curve.points.begin(), curve.points.end(),
            [](const ParetoPoint& a, const ParetoPoint& b) { return a.duration < b.duration; });
  if (curve.points.empty()) {
    curve.message = "no motion was found at any duration tried";
    return curve;
  }
  curve.shortest = curve.points.front().duration;
  // A slower motion need not cost more: where a shorter time has the cheaper motion, it is driven slower.
  for (std::size_t i = 1; i < curve.points.size() && go_on; ++i) {
    ParetoPoint& p = curve.points[i];
    const StrategyOutcome& before = curve.points[i - 1].optimal;
    if (p.optimal.energy.total <= before.energy.total) continue;
    const std::vector<SeedMotion> from = {{"shorter time", before.motion, 0.0, false}};
    OptimizeOptions with_modes = options.strategies.optimize;
    with_modes.schedule.clear();
    with_modes.sequential_starts = 0;
    const OptimizeResult r = optimize_at(model, problem, from, p.duration, with_modes);
    if (r.best_start < 0 || r.energy.total >= p.optimal.energy.total) continue;
    p.optimal.motion = r.motion;
    p.optimal.energy = r.energy;
    p.optimal.detail = "shorter time";
  }
  curve.idle = idle_choices(curve.points, options.idle_powers);
  return curve;
}

}  // namespace sparflow
