#include "optimizer/baselines/pareto.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "optimizer/grid/energy_grid.h"

namespace sparflow {
namespace {

/// Multiple of the shortest duration at which motions count as arbitrarily slow.
/// @threshold [1] 10..1000; derived: losses fall with the flow squared: a thousandth of those of the fastest motion
/// is left
constexpr double kVerySlow = 30.0;
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
  curve.sequential_limit = curve.simultaneous_limit = curve.grid_limit = kNone;
  std::vector<Eigen::VectorXd> ends;
  ends.reserve(seeds.size());
  for (const SeedMotion& s : seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  const BaselineSet baselines(model, problem, ends, options.strategies.baselines);
  const std::function<bool()>& stop = options.strategies.optimize.interrupted;
  const auto stopped = [&] { return curve.interrupted = curve.interrupted || (stop && stop()); };
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
    curve.message = "no kind of motion tried reaches the goal within the limits at any duration";
    return curve;
  }
  for (const auto& [kind, limit] :
       {std::pair{kSequential, &curve.sequential_limit}, {kJointLine, &curve.simultaneous_limit}}) {
    const BaselineMotion slow = baselines.at(kind, kVerySlow * anchor);
    if (slow.found()) *limit = slow.energy.total;
  }
  EnergyGridOptions grid;
  grid.nodes = options.grid_nodes;
  if (!stopped() && options.grid_nodes > 0 && problem.machine.joint_count() <= grid.most_joints &&
      !problem.tip_line) {
    const GridPath path = EnergyGrid(model, problem, grid).cheapest_path(0.0);
    if (path.found) curve.grid_limit = path.slow_energy_J;
  }
  OptimumSearch search(model, problem, seeds, baselines, options.strategies);
  StrategyOutcome fastest;
  int done = 0;
  bool go_on = true;
  const auto evaluate = [&](double duration, bool thorough) {
    std::vector<StrategyOutcome> known = baseline_outcomes(model, problem, baselines, duration);
    ParetoPoint p;
    p.duration = duration;
    p.sequential = energy_or_none(known, kSequential);
    p.simultaneous = energy_or_none(known, kJointLine);
    if (fastest.found()) known.push_back(fastest);
    p.optimal = search.at(duration, known, thorough);
    ++done;
    if (options.progress) {
      go_on =
          !stopped() && options.progress(std::min(1.0, static_cast<double>(done) / options.points),
                                         fmt::format("{:.2f} s", duration));
    }
    return p;
  };
  // The fastest motion is solved first, because the curve begins there.
  std::vector<StrategyOutcome> first;
  for (const std::string& kind : BaselineSet::kinds()) {
    const double own = baselines.shortest(kind);
    /// Multiple of the shortest duration up to which a baseline starts the search of the fastest motion.
    /// @threshold [1] 1..5; chosen: a slower one is no neighbour of it
    constexpr double kNearTheShortest = 1.5;
    if (kind == kSequential || own <= 0.0 || own > kNearTheShortest * anchor) continue;
    const BaselineMotion m = baselines.at(kind, own);
    if (m.found())
      first.push_back({kind, m.detail, m.motion, m.duration, own, "", "", m.energy, {}, {}});
  }
  fastest = search.fastest(first);
  double low = fastest.found() ? std::min(anchor, fastest.duration) : anchor;
  if (!problem.duration.fixed()) low = std::max(low, problem.duration.min);
  // Points are dense near the shortest duration, where the curve is steep; each optimum starts the next.
  for (int i = options.points - 1; i >= 0 && go_on && !stopped(); --i) {
    const double share = static_cast<double>(i) / std::max(1, options.points - 1);
    ParetoPoint p = evaluate(low * std::pow(options.longest, std::pow(share, 1.4)),
                             i == options.points - 1 || i == options.points / 2 || i <= 1);
    if (p.optimal.found()) curve.points.push_back(std::move(p));
  }
  std::sort(curve.points.begin(), curve.points.end(),
            [](const ParetoPoint& a, const ParetoPoint& b) { return a.duration < b.duration; });
  if (curve.points.empty()) {
    curve.message = stopped() ? "interrupted before any motion was found"
                              : "no motion was found at any duration tried";
    return curve;
  }
  curve.shortest = curve.points.front().duration;
  // Where a shorter duration has the cheaper motion, that motion is driven slower.
  for (std::size_t i = 1; i < curve.points.size() && go_on; ++i) {
    ParetoPoint& p = curve.points[i];
    const StrategyOutcome& before = curve.points[i - 1].optimal;
    if (p.optimal.energy.total <= before.energy.total) continue;
    const std::vector<SeedMotion> from = {{"shorter time", before.motion, 0.0, false}};
    OptimizeOptions with_modes = options.strategies.optimize;
    with_modes.smooth_starts = with_modes.sequential_starts = 0;
    with_modes.grid_starts = with_modes.sequence_rounds = 0;
    const OptimizeResult r = optimize_at(model, problem, from, p.duration, with_modes);
    if (r.best_start < 0 || r.energy.total >= p.optimal.energy.total) continue;
    p.optimal.motion = r.motion;
    p.optimal.energy = r.energy;
    p.optimal.detail = "shorter time";
  }
  curve.idle = idle_choices(curve.points, options.idle_powers);
  curve.interrupted = stopped() || !go_on;
  return curve;
}

}  // namespace sparflow
