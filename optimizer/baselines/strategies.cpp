#include "optimizer/baselines/strategies.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "models/math/error.h"
#include "optimizer/crane/instants.h"
#include "optimizer/solve/optimize_outcome.h"

namespace sparflow {
namespace {

/// Sets peak and mean pressures of the pumps.
void add_pump_pressures(const CraneModel& model, double payload, StrategyOutcome& outcome) {
  const std::size_t pumps = model.pumps.size();
  outcome.peak_pressure.assign(pumps, 0.0);
  outcome.mean_pressure.assign(pumps, 0.0);
  if (!outcome.found()) return;
  /// Parts of a mesh interval at which mean and peak pressures are taken.
  /// @threshold [1] 1..64; chosen: reported figures only; pressures vary little within an interval
  constexpr int kParts = 4;
  std::vector<double> delivering(pumps, 0.0);
  Chain chain(model);
  for_each_instant(
      outcome.motion, kParts,
      [&](const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
          double step) {
        const MachineState& s = chain.evaluate({q.data(), qd.data(), qdd.data()}, payload);
        for (std::size_t p = 0; p < pumps; ++p) {
          outcome.peak_pressure[p] = std::max(outcome.peak_pressure[p], s.pumps[p].pressure);
          if (s.pumps[p].flow <= 0.0) continue;
          delivering[p] += step;
          outcome.mean_pressure[p] += step * s.pumps[p].pressure;
        }
      });
  for (std::size_t p = 0; p < pumps; ++p) {
    if (delivering[p] > 0.0) outcome.mean_pressure[p] /= delivering[p];
  }
}

StrategyOutcome outcome_of(const CraneModel& model, const MotionProblem& problem,
                           const BaselineMotion& m, double shortest) {
  StrategyOutcome o{m.kind, m.detail, m.motion, m.duration, shortest, m.why, "", m.energy, {}, {}};
  add_pump_pressures(model, problem.payload, o);
  return o;
}

double longest_wanted(const MotionProblem& problem) {
  return std::isfinite(problem.duration.max) ? problem.duration.max
                                             : std::numeric_limits<double>::infinity();
}

}  // namespace

const StrategyOutcome* StrategyRow::find(const std::string& kind) const {
  for (const StrategyOutcome& o : outcomes) {
    if (o.kind == kind) return &o;
  }
  return nullptr;
}

const StrategyRow* StrategyComparison::row(const std::string& name) const {
  for (const StrategyRow& r : rows) {
    if (r.name == name) return &r;
  }
  return nullptr;
}

std::vector<StrategyOutcome> baseline_outcomes(const CraneModel& model,
                                               const MotionProblem& problem,
                                               const BaselineSet& baselines, double duration) {
  std::vector<StrategyOutcome> all;
  for (const std::string& kind : BaselineSet::kinds()) {
    const BaselineMotion m = baselines.at(kind, duration);
    all.push_back(outcome_of(model, problem, m, m.shortest));
  }
  return all;
}

OptimumSearch::OptimumSearch(const CraneModel& model, const MotionProblem& problem,
                             const std::vector<SeedMotion>& seeds, const BaselineSet& baselines,
                             StrategyOptions options)
    : model_(model),
      problem_(problem),
      seeds_(seeds),
      baselines_(baselines),
      options_(std::move(options)) {}

std::vector<SeedMotion> OptimumSearch::starts_from(const std::vector<StrategyOutcome>& known,
                                                   bool thorough) const {
  std::vector<SeedMotion> from;
  // Seeds come first, because the first starts are also solved with the smooth law.
  for (std::size_t i = 0;
       thorough && i < std::min(seeds_.size(), static_cast<std::size_t>(options_.smooth_seeds));
       ++i)
    from.push_back(seeds_[i]);
  for (const StrategyOutcome& o : known) {
    // Strokes in proportion differ little from joints in proportion, so one of them is enough as start.
    if (o.found() && o.kind != kActuatorLine)
      from.push_back({o.detail.empty() ? o.kind : o.kind + " (" + o.detail + ")", o.motion,
                      o.shortest, false});
  }
  // The last optima are driven faster or slower, because a shorter duration may need their overlaps.
  for (std::size_t i = 0; i < std::min<std::size_t>(2, earlier_.size()); ++i)
    from.push_back(earlier_[earlier_.size() - 1 - i]);
  return from;
}

StrategyOutcome OptimumSearch::solved(const std::string& kind, const MotionProblem& problem,
                                      const std::vector<SeedMotion>& from, const TimeWindow& time,
                                      bool thorough) {
  StrategyOutcome o;
  o.kind = kind;
  o.duration = time.guess;
  OptimizeOptions options = options_.optimize;
  options.smooth_starts = thorough ? options_.smooth_seeds : 0;
  if (!thorough) {
    options.sequential_starts = options.grid_starts = 0;
    options.sequence_rounds = std::min(options.sequence_rounds, 1);
    options.searched_starts = 1;
  }
  if (from.empty()) {
    o.why = "no motion to start from";
    return o;
  }
  const OptimizeResult r = optimize_in(model_, problem, from, time, options);
  if (r.best_start < 0) {
    o.why = r.message;
    if (!r.checks.empty()) o.worst = limit_text(worst_limit(r.checks));
    return o;
  }
  o.motion = r.motion;
  o.duration = r.duration;
  o.energy = r.energy;
  o.detail = r.starts[static_cast<std::size_t>(r.best_start)].seed;
  return o;
}

StrategyOutcome OptimumSearch::at(double duration, const std::vector<StrategyOutcome>& known,
                                  bool thorough) {
  StrategyOutcome best = solved(kOptimal, problem_, starts_from(known, thorough),
                                TimeWindow::fixed(duration), thorough);
  for (const StrategyOutcome& o : known) {
    /// Relative difference up to which two durations are equal.
    /// @threshold [1] 0..1e-6; numerical: rounding
    constexpr double kSameDuration = 1e-9;
    if (!o.found() || std::abs(o.duration - duration) > kSameDuration * duration) continue;
    if (best.found() && best.energy.total <= o.energy.total) continue;
    best.motion = o.motion;
    best.energy = o.energy;
    best.detail = o.kind + " (" + o.detail + ")";
  }
  best.duration = duration;
  if (best.found()) {
    best.why.clear();
    best.worst.clear();
    earlier_.push_back({"optimum at another duration", best.motion, 0.0, false});
  }
  add_pump_pressures(model_, problem_.payload, best);
  return best;
}

StrategyOutcome OptimumSearch::at_own_best(double first, double idle_power) {
  MotionProblem priced = problem_;
  priced.idle_power = idle_power;
  const std::vector<StrategyOutcome> known = baseline_outcomes(model_, problem_, baselines_, first);
  StrategyOutcome best =
      solved(kOptimal, priced, starts_from(known, true), {first, 0.2 * first, 10.0 * first}, true);
  const auto cost = [&](const StrategyOutcome& o) {
    return o.energy.total + idle_power * o.duration;
  };
  for (const StrategyOutcome& o : known) {
    if (!o.found() || (best.found() && cost(best) <= cost(o))) continue;
    best = o;
    best.kind = kOptimal;
    best.detail = o.kind + " (" + o.detail + ")";
  }
  add_pump_pressures(model_, problem_.payload, best);
  return best;
}

StrategyOutcome OptimumSearch::fastest(const std::vector<StrategyOutcome>& first) {
  MotionProblem timed = problem_;
  timed.objective.energy = 0.0;
  timed.objective.time = 1e3;
  timed.idle_power = 0.0;
  double guess = std::numeric_limits<double>::infinity();
  for (const StrategyOutcome& o : first) {
    if (o.found()) guess = std::min(guess, o.duration);
  }
  for (const SeedMotion& s : seeds_) {
    if (s.shortest_duration > 0.0) guess = std::min(guess, s.shortest_duration);
  }
  if (!std::isfinite(guess)) {
    StrategyOutcome none;
    none.kind = kMinimumTime;
    none.why = "no motion to start from";
    return none;
  }
  StrategyOutcome best = solved(kMinimumTime, timed, starts_from(first, true),
                                {guess, 0.2 * guess, 1.5 * guess}, false);
  for (const StrategyOutcome& o : first) {
    if (!o.found() || (best.found() && best.duration <= o.duration)) continue;
    best = o;
    best.kind = kMinimumTime;
    best.detail = o.kind;
  }
  best.shortest = best.found() ? best.duration : 0.0;
  add_pump_pressures(model_, problem_.payload, best);
  return best;
}

StrategyOutcome OptimumSearch::gentlest(double duration,
                                        const std::vector<StrategyOutcome>& known) {
  MotionProblem gentle = problem_;
  gentle.objective.energy = 0.0;
  gentle.objective.commands = 1e3;
  StrategyOutcome best =
      solved(kMinimumControl, gentle, starts_from(known, true), TimeWindow::fixed(duration), false);
  best.duration = duration;
  add_pump_pressures(model_, problem_.payload, best);
  return best;
}

StrategyComparison compare_strategies(const CraneModel& model, const MotionProblem& problem,
                                      const std::vector<SeedMotion>& seeds,
                                      const StrategyOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<std::string> missing = model.missing();
  if (!missing.empty()) {
    throw InputError({problem.file, 0, 0}, "model",
                     fmt::format("the model has no working pressure for {}; fit it on a log in "
                                 "which that movement occurs",
                                 fmt::join(missing, ", ")));
  }
  StrategyComparison out;
  out.problem = problem.name;
  out.file = problem.file;
  out.payload = problem.payload;
  out.idle_power = options.idle_power;
  std::vector<Eigen::VectorXd> ends;
  ends.reserve(seeds.size());
  for (const SeedMotion& s : seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  const BaselineSet baselines(model, problem, ends, options.baselines);
  std::vector<double> shortest;
  for (const std::string& kind : BaselineSet::kinds()) {
    shortest.push_back(baselines.shortest(kind));
    if (shortest.back() <= 0.0) continue;
    if (out.shortest > 0.0 && out.shortest <= shortest.back()) continue;
    out.shortest = shortest.back();
    out.shortest_of = kind;
  }
  for (const SeedMotion& s : seeds) {
    if (s.shortest_duration <= 0.0) continue;
    if (out.shortest > 0.0 && out.shortest <= s.shortest_duration) continue;
    if (worst_excess(check_limits(model, problem, with_duration(s.motion, s.shortest_duration),
                                  options.optimize.refine)) > options.optimize.limit_tolerance)
      continue;
    out.shortest = s.shortest_duration;
    out.shortest_of = s.name;
  }
  OptimumSearch search(model, problem, seeds, baselines, options);
  StrategyOutcome fastest;
  fastest.kind = kMinimumTime;
  if (options.shortest_time && out.shortest > 0.0) {
    std::vector<StrategyOutcome> first;
    for (std::size_t i = 0; i < shortest.size(); ++i) {
      const std::string& kind = BaselineSet::kinds()[i];
      /// Multiple of the shortest duration below which a baseline starts the search of the fastest motion.
      /// @threshold [1] 1..5; chosen: a slower one is no neighbour of it
      constexpr double kNearTheFastest = 1.5;
      if (shortest[i] > 0.0 && shortest[i] < kNearTheFastest * out.shortest && kind != kSequential)
        first.push_back(outcome_of(model, problem, baselines.at(kind, shortest[i]), shortest[i]));
    }
    fastest = search.fastest(first);
    if (fastest.found() && fastest.duration < out.shortest) {
      out.shortest = fastest.duration;
      out.shortest_of = kMinimumTime;
    }
  }
  const auto rows_at = [&](const std::string& name, double factor, double duration, bool thorough) {
    StrategyRow row{name, factor, duration, baseline_outcomes(model, problem, baselines, duration)};
    for (std::size_t i = 0; i < shortest.size(); ++i) row.outcomes[i].shortest = shortest[i];
    std::vector<StrategyOutcome> known = row.outcomes;
    if (fastest.found()) known.push_back(fastest);
    if (thorough && options.least_control && factor == 0.0) {
      row.outcomes.push_back(search.gentlest(duration, known));
      known.push_back(row.outcomes.back());
    }
    if (thorough && fastest.found() && factor == 0.0) row.outcomes.push_back(fastest);
    row.outcomes.push_back(search.at(duration, known, thorough));
    row.outcomes.back().shortest = out.shortest;
    return row;
  };
  const double anchor = out.shortest > 0.0 ? out.shortest : 1.0;
  if (options.equal_time) {
    // With a free duration all strategies get twice the shortest one, within the problem's range.
    const double duration =
        problem.duration.fixed()
            ? problem.duration.min
            : std::clamp(2.0 * anchor, problem.duration.min, longest_wanted(problem));
    out.rows.push_back(rows_at("equal", 0.0, duration, true));
    for (BaselineMotion& m : baselines.orders_at(duration)) {
      const bool found = m.found();
      m.motion = Trajectory{};
      if (found) m.why = "kept";
      out.orders.push_back(std::move(m));
    }
    const StrategyRow& row = out.rows.back();
    if (!row.outcomes.back().found()) out.message = row.outcomes.back().why;
  }
  // Long durations come first: each optimum starts the next, and overlaps appear as the duration is shortened.
  std::vector<double> factors = options.factors;
  std::sort(factors.rbegin(), factors.rend());
  const auto stopped = [&] {
    return options.optimize.interrupted && options.optimize.interrupted();
  };
  for (const double factor : factors) {
    if (out.shortest <= 0.0 || stopped()) break;
    /// Multiple of the shortest duration up to which the search is thorough.
    /// @threshold [1] 1..5; chosen: where time is short, optima differ from those at longer durations, of which one
    /// starts the next
    constexpr double kThoroughUpTo = 1.5;
    out.rows.push_back(rows_at(fmt::format("{:g} x shortest", factor), factor, factor * anchor,
                               factor <= kThoroughUpTo || factor == factors.front()));
  }
  if (options.own_time && out.shortest > 0.0 && !stopped()) {
    StrategyRow row{"own", 0.0, 0.0, {}};
    double first = 2.0 * anchor, least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < shortest.size(); ++i) {
      const BaselineMotion m = baselines.at_own_best(BaselineSet::kinds()[i], options.idle_power);
      row.outcomes.push_back(outcome_of(model, problem, m, shortest[i]));
      const double cost = m.energy.total + options.idle_power * m.duration;
      if (m.found() && cost < least) {
        least = cost;
        first = m.duration;
      }
    }
    row.outcomes.push_back(
        options.idle_power > 0.0
            ? search.at_own_best(first, options.idle_power)
            : search.at(anchor, baseline_outcomes(model, problem, baselines, anchor), true));
    row.outcomes.back().shortest = out.shortest;
    out.rows.push_back(std::move(row));
  }
  if (out.shortest <= 0.0 && out.message.empty())
    out.message = "no kind of motion tried reaches the goal within the limits at any duration";
  out.interrupted = stopped();
  out.solve_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

}  // namespace sparflow
