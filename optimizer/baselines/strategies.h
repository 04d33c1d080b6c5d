#pragma once
/// Comparison of strategies: the baselines and the energy-optimal motion of one problem at equal duration, at the best
/// duration of each, and at multiples of the shortest duration.
#include <functional>
#include <string>
#include <vector>

#include "models/math/journal.h"
#include "optimizer/baselines/baselines.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

inline constexpr const char* kOptimal = "optimal";
inline constexpr const char* kMinimumTime = "minimum_time";  ///< the shortest motion found
inline constexpr const char* kMinimumControl =
    "minimum_control";  ///< least integral of squared commands

/// Motion of one strategy at one duration.
struct StrategyOutcome {
  std::string kind;    ///< key of a baseline (optimizer/baselines/baselines.h) or kOptimal
  std::string detail;  ///< order of the joints, goal configuration, or the optimum's start
  Trajectory motion;   ///< empty when there is none
  double duration = 0.0;
  double shortest = 0.0;  ///< shortest duration of this strategy [s], 0 = not known or none
  std::string why;        ///< why there is no motion
  std::string worst;      ///< the most violated limit: which, where, when; may be empty
  MotionEnergy energy;
  std::vector<double> peak_pressure;  ///< [Pa] by pump
  std::vector<double> mean_pressure;  ///< [Pa] by pump, over the time in which it delivers
  bool found() const { return motion.size() > 1; }
};

/// All strategies at one duration, or each at its own.
struct StrategyRow {
  std::string name;       ///< "equal", "own", "1.2 x shortest"
  double factor = 0.0;    ///< duration over the shortest one, 0 = not given by a factor
  double duration = 0.0;  ///< [s], 0 = each strategy has its own
  std::vector<StrategyOutcome> outcomes;
  const StrategyOutcome* find(const std::string& kind) const;
};

struct StrategyComparison {
  std::string problem, file;
  std::string message;      ///< why rows are empty
  double payload = 0.0;     ///< [kg]
  double idle_power = 0.0;  ///< [W]
  double shortest = 0.0;    ///< [s] shortest duration in which any strategy keeps all limits
  std::string shortest_of;  ///< key of that strategy
  std::vector<StrategyRow> rows;
  std::vector<BaselineMotion>
      orders;  ///< sequential motions of every order at equal duration, trajectories removed
  double solve_s = 0.0;      ///< wall time [s]
  bool interrupted = false;  ///< rows may be missing, and the energies of others could still fall
  const StrategyRow* row(const std::string& name) const;
};

struct StrategyOptions {
  bool equal_time = true;
  bool own_time = false;        ///< each strategy at its own best duration; needs idle power
  std::vector<double> factors;  ///< durations in units of the shortest
  double idle_power = 0.0;      ///< [W]
  bool shortest_time =
      true;  ///< optimise the shortest duration, else take that of the baselines and seeds
  bool least_control = true;  ///< solve for the least squared commands at equal duration
  /// Seeds of a thorough search, also solved with the smooth law.
  /// @threshold [1] 0..100; chosen: as many as the optimiser solves with the smooth law
  int smooth_seeds = OptimizeOptions{}.smooth_starts;
  BaselineOptions baselines;
  OptimizeOptions optimize;
  /// Keeps each solve of a search, so that a search that was ended can be resumed; null: none is kept. It must outlive the
  /// search, and belong to these options and to this problem and model.
  Journal* journal = nullptr;
  /// Called as parts of a comparison are done, and within a solve after each of its starts.
  WorkProgress progress;
};

/// Search for the energy-optimal motion from every baseline that keeps the limits, the seeds and earlier optima.
class OptimumSearch {
 public:
  /// References must outlive the object.
  OptimumSearch(const CraneModel& model, const MotionProblem& problem,
                const std::vector<SeedMotion>& seeds, const BaselineSet& baselines,
                StrategyOptions options);

  /// Energy-optimal motion of one duration [s].
  /// @param known motions of this duration that keep the limits; the result costs no more than any of them
  /// @param thorough starts also from the seeds, some with the smooth law; false: from `known` and earlier optima only
  StrategyOutcome at(double duration, const std::vector<StrategyOutcome>& known, bool thorough);
  /// The optimum of the duration at which energy + idle power x time is least. @param first duration [s] to begin with
  StrategyOutcome at_own_best(double first, double idle_power);
  /// The fastest motion. @param first motions to begin with, the fastest of their kind
  StrategyOutcome fastest(const std::vector<StrategyOutcome>& first);
  /// The motion of this duration with the least integral of the squared valve commands, a common cost (Nurmi and Mattila),
  /// whatever its energy.
  StrategyOutcome gentlest(double duration, const std::vector<StrategyOutcome>& known);
  /// Sets to whom the next solves tell their progress, beside the optimiser's own of the options.
  void tell(WorkProgress progress);

 private:
  std::vector<SeedMotion> starts_from(const std::vector<StrategyOutcome>& known,
                                      bool thorough) const;
  StrategyOutcome solved(const std::string& kind, const MotionProblem& problem,
                         const std::vector<SeedMotion>& from, const TimeWindow& time,
                         bool thorough);
  const CraneModel& model_;
  const MotionProblem& problem_;
  const std::vector<SeedMotion>& seeds_;
  const BaselineSet& baselines_;
  StrategyOptions options_;
  WorkProgress own_progress_;        // of the options' optimiser
  std::vector<SeedMotion> earlier_;  // optima at other durations, the latest last
  int solves_ = 0;                   // by which the journal's parts are named
};

/// Baselines at one duration as outcomes with their pressures.
std::vector<StrategyOutcome> baseline_outcomes(const CraneModel& model,
                                               const MotionProblem& problem,
                                               const BaselineSet& baselines, double duration);

/// Baselines at their own shortest duration, where that is near the shortest one known [s]: the search of the fastest
/// motion begins with them.
std::vector<StrategyOutcome> motions_near_shortest(const CraneModel& model,
                                                   const MotionProblem& problem,
                                                   const BaselineSet& baselines, double shortest);

/// @throws InputError when the model lacks a pressure model; an infeasible problem throws nothing (see `message`)
StrategyComparison compare_strategies(const CraneModel& model, const MotionProblem& problem,
                                      const std::vector<SeedMotion>& seeds,
                                      const StrategyOptions& options);

/// The outcome of a part of a search: the one that the options' journal has, else the one computed now, which it keeps
/// unless the search was interrupted.
StrategyOutcome kept_outcome(const StrategyOptions& options, const std::string& part,
                             const std::function<StrategyOutcome()>& compute);

/// Binary packing for child processes and journals; the same program must read it.
std::string packed(const StrategyOutcome& outcome);
StrategyOutcome unpacked_outcome(const std::string& bytes);
std::string packed(const StrategyComparison& comparison);
StrategyComparison unpacked_comparison(const std::string& bytes);

}  // namespace sparflow
