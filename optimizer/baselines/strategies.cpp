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
      options_(std::move(options)),
      own_progress_(options_.optimize.progress) {}

void OptimumSearch::tell(WorkProgress progress) {
  options_.optimize.progress = [own = own_progress_, also = std::move(progress)](
                                   double share, const std::string& what) {
    if (own) own(share, what);
    if (also) also(share, what);
  };
}

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
  return kept_outcome(options_, fmt::format("solve {}", ++solves_), [&] {
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
  });
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

std::vector<StrategyOutcome> motions_near_shortest(const CraneModel& model,
                                                   const MotionProblem& problem,
                                                   const BaselineSet& baselines, double shortest) {
  /// Multiple of the shortest duration up to which a baseline starts the search of the fastest motion.
  /// @threshold [1] 1..5; chosen: a slower one is no neighbour of it
  constexpr double kNearTheFastest = 1.5;
  std::vector<StrategyOutcome> near;
  for (const std::string& kind : BaselineSet::kinds()) {
    const double own = baselines.shortest(kind);
    if (kind == kSequential || own <= 0.0 || own >= kNearTheFastest * shortest) continue;
    near.push_back(outcome_of(model, problem, baselines.at(kind, own), own));
  }
  return near;
}

namespace {

/// A comparison while it is filled; the row at equal duration comes first, the one at own durations last.
class ComparedStrategies {
 public:
  /// All must outlive this.
  ComparedStrategies(const CraneModel& model, const MotionProblem& problem,
                     const std::vector<SeedMotion>& seeds, const StrategyOptions& options);

  void find_shortest();
  /// Searches for the fastest motion from the baselines near the shortest duration.
  void find_fastest();
  void add_equal_time();
  /// Long durations come first: each optimum starts the next, and overlaps appear as the duration is shortened.
  void add_factors();
  void add_own_time();
  StrategyComparison finished();

 private:
  bool stopped() const { return options_.optimize.interrupted && options_.optimize.interrupted(); }
  /// Number of parts of about the same work: what is known of paths, each solve of a search, the orders.
  int parts() const {
    return 1 + (options_.shortest_time ? 1 : 0) +
           (options_.equal_time ? 2 + (options_.least_control ? 1 : 0) : 0) +
           static_cast<int>(options_.factors.size()) + (options_.own_time ? 1 : 0);
  }
  /// Progress of the next part.
  WorkProgress next_part() {
    const double one = 1.0 / parts();
    const int before = part_++;
    return part_of(options_.progress, one * before, std::min(1.0, one * (before + 1)));
  }
  /// [s] unit of the durations; one second where no motion is known
  double anchor() const { return out_.shortest > 0.0 ? out_.shortest : 1.0; }
  void take_shortest(double duration, const std::string& of);
  bool keeps_limits(const SeedMotion& seed) const;
  /// All strategies at one duration. @param factor see StrategyRow  @param thorough see OptimumSearch::at
  StrategyRow row_at(const std::string& name, double factor, double duration, bool thorough);

  const CraneModel& model_;
  const MotionProblem& problem_;
  const std::vector<SeedMotion>& seeds_;
  const StrategyOptions& options_;
  BaselineSet baselines_;
  std::vector<double> shortest_;  // [s] by kind of baseline
  OptimumSearch search_;
  StrategyOutcome fastest_;
  StrategyComparison out_;
  int part_ = 0;  // of parts(), begun
};

ComparedStrategies::ComparedStrategies(const CraneModel& model, const MotionProblem& problem,
                                       const std::vector<SeedMotion>& seeds,
                                       const StrategyOptions& options)
    : model_(model),
      problem_(problem),
      seeds_(seeds),
      options_(options),
      baselines_(model, problem, end_postures(seeds), options.baselines),
      search_(model, problem, seeds, baselines_, options) {
  fastest_.kind = kMinimumTime;
  out_.problem = problem.name;
  out_.file = problem.file;
  out_.payload = problem.payload;
  out_.idle_power = options.idle_power;
}

void ComparedStrategies::take_shortest(double duration, const std::string& of) {
  out_.shortest = duration;
  out_.shortest_of = of;
}

bool ComparedStrategies::keeps_limits(const SeedMotion& seed) const {
  const Trajectory motion = with_duration(seed.motion, seed.shortest_duration);
  return worst_excess(check_limits(model_, problem_, motion, options_.optimize.refine)) <=
         options_.optimize.limit_tolerance;
}

void ComparedStrategies::find_shortest() {
  const WorkProgress progress = next_part();
  const auto is_shorter = [&](double duration) {
    return duration > 0.0 && !(out_.shortest > 0.0 && out_.shortest <= duration);
  };
  for (const std::string& kind : BaselineSet::kinds()) {
    shortest_.push_back(baselines_.shortest(kind));
    if (is_shorter(shortest_.back())) take_shortest(shortest_.back(), kind);
    if (progress) {
      progress(
          static_cast<double>(shortest_.size()) / static_cast<double>(BaselineSet::kinds().size()),
          kind);
    }
  }
  for (const SeedMotion& s : seeds_) {
    if (is_shorter(s.shortest_duration) && keeps_limits(s))
      take_shortest(s.shortest_duration, s.name);
  }
}

void ComparedStrategies::find_fastest() {
  if (!options_.shortest_time) return;
  search_.tell(next_part());
  if (out_.shortest <= 0.0) return;
  fastest_ = search_.fastest(motions_near_shortest(model_, problem_, baselines_, out_.shortest));
  if (fastest_.found() && fastest_.duration < out_.shortest)
    take_shortest(fastest_.duration, kMinimumTime);
}

StrategyRow ComparedStrategies::row_at(const std::string& name, double factor, double duration,
                                       bool thorough) {
  StrategyRow row{name, factor, duration,
                  baseline_outcomes(model_, problem_, baselines_, duration)};
  for (std::size_t i = 0; i < shortest_.size(); ++i) row.outcomes[i].shortest = shortest_[i];
  std::vector<StrategyOutcome> known = row.outcomes;
  if (fastest_.found()) known.push_back(fastest_);
  if (thorough && options_.least_control && factor == 0.0) {
    search_.tell(next_part());
    row.outcomes.push_back(search_.gentlest(duration, known));
    known.push_back(row.outcomes.back());
  }
  if (thorough && fastest_.found() && factor == 0.0) row.outcomes.push_back(fastest_);
  search_.tell(next_part());
  row.outcomes.push_back(search_.at(duration, known, thorough));
  row.outcomes.back().shortest = out_.shortest;
  return row;
}

void ComparedStrategies::add_equal_time() {
  // With a free duration all strategies get twice the shortest one, within the problem's range.
  const double duration =
      problem_.duration.fixed()
          ? problem_.duration.min
          : std::clamp(2.0 * anchor(), problem_.duration.min, longest_wanted(problem_));
  out_.rows.push_back(row_at("equal", 0.0, duration, true));
  for (BaselineMotion& m : baselines_.orders_at(duration)) {
    const bool found = m.found();
    m.motion = Trajectory{};
    if (found) m.why = "kept";
    out_.orders.push_back(std::move(m));
  }
  if (const WorkProgress progress = next_part()) progress(1.0, "orders of the cylinders");
  const StrategyRow& row = out_.rows.back();
  if (!row.outcomes.back().found()) out_.message = row.outcomes.back().why;
}

void ComparedStrategies::add_factors() {
  /// Multiple of the shortest duration up to which the search is thorough.
  /// @threshold [1] 1..5; chosen: where time is short, optima differ from those at longer durations, of which one
  /// starts the next
  constexpr double kThoroughUpTo = 1.5;
  std::vector<double> factors = options_.factors;
  std::sort(factors.rbegin(), factors.rend());
  for (const double factor : factors) {
    if (out_.shortest <= 0.0 || stopped()) break;
    out_.rows.push_back(row_at(fmt::format("{:g} x shortest", factor), factor, factor * anchor(),
                               factor <= kThoroughUpTo || factor == factors.front()));
  }
}

void ComparedStrategies::add_own_time() {
  if (out_.shortest <= 0.0 || stopped()) return;
  StrategyRow row{"own", 0.0, 0.0, {}};
  double first = 2.0 * anchor(), least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < shortest_.size(); ++i) {
    const BaselineMotion m = baselines_.at_own_best(BaselineSet::kinds()[i], options_.idle_power);
    row.outcomes.push_back(outcome_of(model_, problem_, m, shortest_[i]));
    const double cost = m.energy.total + options_.idle_power * m.duration;
    if (m.found() && cost < least) {
      least = cost;
      first = m.duration;
    }
  }
  search_.tell(next_part());
  row.outcomes.push_back(
      options_.idle_power > 0.0
          ? search_.at_own_best(first, options_.idle_power)
          : search_.at(anchor(), baseline_outcomes(model_, problem_, baselines_, anchor()), true));
  row.outcomes.back().shortest = out_.shortest;
  out_.rows.push_back(std::move(row));
}

StrategyComparison ComparedStrategies::finished() {
  if (out_.shortest <= 0.0 && out_.message.empty())
    out_.message = "no kind of motion tried reaches the goal within the limits at any duration";
  out_.interrupted = stopped();
  return std::move(out_);
}

}  // namespace

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
  ComparedStrategies compared(model, problem, seeds, options);
  compared.find_shortest();
  compared.find_fastest();
  if (options.equal_time) compared.add_equal_time();
  compared.add_factors();
  if (options.own_time) compared.add_own_time();
  StrategyComparison out = compared.finished();
  out.solve_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

}  // namespace sparflow
