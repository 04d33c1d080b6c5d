#pragma once
/// Sequential against simultaneous against energy-optimal: the baselines and the optimum of one problem, at equal
/// time, at each one's own best time and at multiples of the shortest time.
#include <functional>
#include <string>
#include <vector>

#include "optimizer/baselines/baselines.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

inline constexpr const char* kOptimal = "optimal";
inline constexpr const char* kMinimumTime = "minimum_time";  ///< in its own, the shortest time
inline constexpr const char* kMinimumControl =
    "minimum_control";  ///< least integral of squared commands

/// One way of moving at one duration.
struct StrategyOutcome {
  std::string kind;    ///< key of a baseline (optimizer/baselines/baselines.h) or kOptimal
  std::string detail;  ///< order of the joints, end posture, or the optimum's start
  Trajectory motion;   ///< empty when there is none
  double duration = 0.0;
  double shortest = 0.0;  ///< [s] of this way, 0 = not known or at none
  std::string why;        ///< why there is no motion
  std::string worst;      ///< and the limit broken worst: which, where, when; may be empty
  MotionEnergy energy;
  std::vector<double> peak_pressure;  ///< [Pa] by pump
  std::vector<double> mean_pressure;  ///< [Pa] by pump, over the time in which it delivers
  bool found() const { return motion.size() > 1; }
};

/// All ways at one duration, or each at its own.
struct StrategyRow {
  std::string name;       ///< "equal", "own", "1.2 x shortest"
  double factor = 0.0;    ///< of the shortest time, 0 = not asked that way
  double duration = 0.0;  ///< [s], 0 = each its own
  std::vector<StrategyOutcome> outcomes;
  const StrategyOutcome* find(const std::string& kind) const;
};

struct StrategyComparison {
  std::string problem, file;
  std::string message;      ///< why there is nothing, when rows are empty
  double payload = 0.0;     ///< [kg]
  double idle_power = 0.0;  ///< [W]
  double shortest = 0.0;    ///< [s] least duration in which any way tried keeps all limits
  std::string shortest_of;  ///< and which way that is
  std::vector<StrategyRow> rows;
  std::vector<BaselineMotion> orders;  ///< every order at equal time, without their motions
  double solve_s = 0.0;
  const StrategyRow* row(const std::string& name) const;
};

struct StrategyOptions {
  bool equal_time = true;
  bool own_time = false;        ///< needs idle power
  std::vector<double> factors;  ///< of the shortest time
  double idle_power = 0.0;      ///< [W]
  bool shortest_time =
      true;  ///< solve for the shortest time, else take the baselines' and the seeds'
  bool least_control = true;  ///< solve for the least squared commands in equal time
  int smooth_seeds = 2;  ///< seeds given to a thorough search, solved through the smooth law too
  BaselineOptions baselines;
  OptimizeOptions optimize;
};

/// Energy-optimal motion at one duration from every baseline that keeps the limits then, the seeds and earlier motions.
class OptimumSearch {
 public:
  /// References must outlive the object.
  OptimumSearch(const CraneModel& model, const MotionProblem& problem,
                const std::vector<SeedMotion>& seeds, const BaselineSet& baselines,
                StrategyOptions options);

  /// @param known motions of this duration that keep the limits: none of them may be cheaper than the result
  /// @param thorough also the seeds, some through the smooth law; false: from `known` and earlier optima only
  StrategyOutcome at(double duration, const std::vector<StrategyOutcome>& known, bool thorough);
  /// The duration at which energy + idle power x time is least, near `first`.
  StrategyOutcome at_own_best(double first, double idle_power);
  /// The fastest motion. @param first motions to begin with, the fastest of their kind
  StrategyOutcome fastest(const std::vector<StrategyOutcome>& first);
  /// The motion of this duration with the least integral of the squared valve commands (Nurmi and Mattila's
  /// and everybody's regular cost), whatever it costs in energy.
  StrategyOutcome gentlest(double duration, const std::vector<StrategyOutcome>& known);

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
  std::vector<SeedMotion> earlier_;  // optima at other durations, the latest last
};

/// Baselines at one duration as outcomes with their pressures.
std::vector<StrategyOutcome> baseline_outcomes(const CraneModel& model,
                                               const MotionProblem& problem,
                                               const BaselineSet& baselines, double duration);

/// @throws InputError when the model lacks a pressure process; nothing for an infeasible problem (see `message`)
StrategyComparison compare_strategies(const CraneModel& model, const MotionProblem& problem,
                                      const std::vector<SeedMotion>& seeds,
                                      const StrategyOptions& options);

/// For child processes: plain binary, same program at both ends.
std::string packed(const StrategyComparison& comparison);
StrategyComparison unpacked_comparison(const std::string& bytes);

}  // namespace sparflow
