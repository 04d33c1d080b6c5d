#include "optimizer/baselines/pareto.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "optimizer/grid/energy_grid.h"

namespace sparflow {
namespace {

/// Multiple of the shortest duration at which motions count as arbitrarily slow.
/// @threshold [1] 10..1000; derived: losses fall with the flow squared: a thousandth of those of the fastest motion
/// is left
constexpr double kVerySlow = 30.0;
/// Parabolas for each idle power.
/// @threshold [1] 0..10; chosen: the second one corrects what the curve's steps hide from the first
constexpr int kParabolas = 2;
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

namespace {

/// A curve while it is filled, and the searches that fill it.
class CurveSearch {
 public:
  /// All must outlive this.
  CurveSearch(const CraneModel& model, const MotionProblem& problem,
              const std::vector<SeedMotion>& seeds, const ParetoOptions& options)
      : model_(model),
        problem_(problem),
        seeds_(seeds),
        options_(options),
        baselines_(model, problem, end_postures(seeds), options.strategies.baselines),
        search_(model, problem, seeds, baselines_, options.strategies) {}

  ParetoCurve filled();

 private:
  bool stopped() {
    const std::function<bool()>& stop = options_.strategies.optimize.interrupted;
    return curve_.interrupted = curve_.interrupted || (stop && stop());
  }
  /// Number of solves, should every idle power ask for all its durations.
  int most_solves() const {
    return 1 + options_.points + kParabolas * static_cast<int>(options_.idle_powers.size());
  }
  /// Lets the next solve tell its progress. @param what its words begin with
  void begin_solve(const std::string& what);
  void tell(double share, const std::string& what) {
    if (options_.progress) go_on_ = go_on_ && !stopped() && options_.progress(share, what);
  }
  double shortest_known() const;  ///< [s] of baselines and seeds; 0 = none
  /// Energies of motions without a limit of time. @param shortest [s]
  void set_limits(double shortest);
  ParetoPoint point_at(double duration, bool thorough);
  /// Points are dense near the shortest duration, where the curve is steep; each optimum starts the next.
  /// @param low shortest duration [s]
  void add_points(double low);
  /// Adds durations at which energy + idle power x time is least, by parabolas through the points around it.
  void add_idle_points();
  /// Where a shorter duration has the cheaper motion, that motion is driven slower.
  void drive_shorter_slower();

  const CraneModel& model_;
  const MotionProblem& problem_;
  const std::vector<SeedMotion>& seeds_;
  const ParetoOptions& options_;
  BaselineSet baselines_;
  OptimumSearch search_;
  StrategyOutcome fastest_;
  int solves_ = 0;     // begun
  bool go_on_ = true;  // as the caller's progress says
  ParetoCurve curve_;
};

double CurveSearch::shortest_known() const {
  double least = 0.0;
  const auto consider = [&](double duration) {
    if (duration > 0.0 && (least == 0.0 || duration < least)) least = duration;
  };
  for (const std::string& kind : BaselineSet::kinds()) consider(baselines_.shortest(kind));
  for (const SeedMotion& s : seeds_) consider(s.shortest_duration);
  return least;
}

void CurveSearch::set_limits(double shortest) {
  for (const auto& [kind, limit] : {std::pair{kSequential, &curve_.sequential_limit},
                                    {kJointLine, &curve_.simultaneous_limit}}) {
    const BaselineMotion slow = baselines_.at(kind, kVerySlow * shortest);
    if (slow.found()) *limit = slow.energy.total;
  }
  EnergyGridOptions grid;
  grid.nodes = options_.grid_nodes;
  if (!stopped() && options_.grid_nodes > 0 && problem_.machine.joint_count() <= grid.most_joints &&
      !problem_.tip_line) {
    const GridPath path = EnergyGrid(model_, problem_, grid).cheapest_path(0.0);
    if (path.found) curve_.grid_limit = path.slow_energy_J;
  }
}

void CurveSearch::begin_solve(const std::string& what) {
  const double one = 1.0 / most_solves();
  const WorkProgress whole = [this](double share, const std::string& words) { tell(share, words); };
  const WorkProgress part =
      part_of(whole, std::min(1.0, one * solves_), std::min(1.0, one * (solves_ + 1)));
  ++solves_;
  search_.tell(
      [part, what](double share, const std::string& start) { part(share, what + ", " + start); });
}

ParetoPoint CurveSearch::point_at(double duration, bool thorough) {
  std::vector<StrategyOutcome> known = baseline_outcomes(model_, problem_, baselines_, duration);
  ParetoPoint p;
  p.duration = duration;
  p.sequential = energy_or_none(known, kSequential);
  p.simultaneous = energy_or_none(known, kJointLine);
  if (fastest_.found()) known.push_back(fastest_);
  const std::string what = fmt::format("{:.2f} s", duration);
  begin_solve(what);
  p.optimal = search_.at(duration, known, thorough);
  tell(std::min(1.0, static_cast<double>(solves_) / most_solves()), what);
  return p;
}

void CurveSearch::add_points(double low) {
  for (int i = options_.points - 1; i >= 0 && go_on_ && !stopped(); --i) {
    const double share = static_cast<double>(i) / std::max(1, options_.points - 1);
    ParetoPoint p = point_at(low * std::pow(options_.longest, std::pow(share, 1.4)),
                             i == options_.points - 1 || i == options_.points / 2 || i <= 1);
    if (p.optimal.found()) curve_.points.push_back(std::move(p));
  }
  std::sort(curve_.points.begin(), curve_.points.end(),
            [](const ParetoPoint& a, const ParetoPoint& b) { return a.duration < b.duration; });
}

/// Abscissa at which the parabola through three points is least, between the outer ones; x[1] where it has no least value.
double least_of_parabola(const std::array<double, 3>& x, const std::array<double, 3>& y) {
  const double left = (y[1] - y[0]) / (x[1] - x[0]), right = (y[2] - y[1]) / (x[2] - x[1]);
  const double bend = (right - left) / (x[2] - x[0]);
  if (!(bend > 0.0)) return x[1];
  return std::clamp(0.5 * (x[0] + x[1]) - 0.5 * left / bend, x[0], x[2]);
}

void CurveSearch::add_idle_points() {
  /// Distance of two durations, in the logarithm, below which a further point tells nothing.
  /// @threshold [1] 1e-4..0.1; chosen: near the optimum the cost changes with the square of it
  constexpr double kNear = 0.01;
  for (const double power : options_.idle_powers) {
    for (int round = 0; round < kParabolas && go_on_ && !stopped(); ++round) {
      const std::vector<ParetoPoint>& all = curve_.points;
      const auto cost = [&](std::size_t i) {
        return all[i].optimal.energy.total + power * all[i].duration;
      };
      std::size_t best = 0;
      for (std::size_t i = 1; i < all.size(); ++i) {
        if (cost(i) < cost(best)) best = i;
      }
      if (best == 0 || best + 1 >= all.size()) break;
      std::array<double, 3> x{}, y{};
      for (std::size_t k = 0; k < 3; ++k) {
        x[k] = std::log(all[best + k - 1].duration);
        y[k] = cost(best + k - 1);
      }
      const double at = least_of_parabola(x, y);
      const bool known = std::any_of(x.begin(), x.end(),
                                     [&](double other) { return std::abs(at - other) < kNear; });
      if (known) break;
      ParetoPoint p = point_at(std::exp(at), false);
      if (!p.optimal.found()) break;
      curve_.points.push_back(std::move(p));
      std::sort(curve_.points.begin(), curve_.points.end(),
                [](const auto& a, const auto& b) { return a.duration < b.duration; });
    }
  }
}

void CurveSearch::drive_shorter_slower() {
  for (std::size_t i = 1; i < curve_.points.size() && go_on_; ++i) {
    ParetoPoint& p = curve_.points[i];
    const StrategyOutcome& before = curve_.points[i - 1].optimal;
    if (p.optimal.energy.total <= before.energy.total) continue;
    const std::vector<SeedMotion> from = {{"shorter time", before.motion, 0.0, false}};
    OptimizeOptions with_modes = options_.strategies.optimize;
    with_modes.smooth_starts = with_modes.sequential_starts = 0;
    with_modes.grid_starts = with_modes.sequence_rounds = 0;
    const StrategyOutcome slower =
        kept_outcome(options_.strategies, fmt::format("driven slower {}", i), [&] {
          const OptimizeResult r = optimize_at(model_, problem_, from, p.duration, with_modes);
          StrategyOutcome o;
          if (r.best_start < 0) return o;
          o.motion = r.motion;
          o.energy = r.energy;
          return o;
        });
    if (!slower.found() || slower.energy.total >= p.optimal.energy.total) continue;
    p.optimal.motion = slower.motion;
    p.optimal.energy = slower.energy;
    p.optimal.detail = "shorter time";
  }
}

ParetoCurve CurveSearch::filled() {
  curve_.sequential_limit = curve_.simultaneous_limit = curve_.grid_limit = kNone;
  const double anchor = shortest_known();
  if (anchor <= 0.0) {
    curve_.message = "no kind of motion tried reaches the goal within the limits at any duration";
    return std::move(curve_);
  }
  set_limits(anchor);
  // The fastest motion is solved first, because the curve begins there.
  begin_solve("fastest");
  fastest_ = search_.fastest(motions_near_shortest(model_, problem_, baselines_, anchor));
  double low = fastest_.found() ? std::min(anchor, fastest_.duration) : anchor;
  if (!problem_.duration.fixed()) low = std::max(low, problem_.duration.min);
  add_points(low);
  if (curve_.points.empty()) {
    curve_.message = stopped() ? "interrupted before any motion was found"
                               : "no motion was found at any duration tried";
    return std::move(curve_);
  }
  curve_.shortest = curve_.points.front().duration;
  add_idle_points();
  drive_shorter_slower();
  curve_.idle = idle_choices(curve_.points, options_.idle_powers);
  curve_.interrupted = stopped() || !go_on_;
  return std::move(curve_);
}

}  // namespace

ParetoCurve energy_against_time(const CraneModel& model, const MotionProblem& problem,
                                const std::vector<SeedMotion>& seeds,
                                const ParetoOptions& options) {
  return CurveSearch(model, problem, seeds, options).filled();
}

}  // namespace sparflow
