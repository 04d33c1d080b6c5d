#pragma once
/// The energy-optimal motions of a scenario, by the fitted model, goal by goal in the durations that the scenario gives.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "problems/problem.h"
#include "simulator/benchmark/scenario.h"
#include "simulator/controllers/controller.h"

namespace sparflow {

struct OptimalMotionOptions {
  /// Share of valves' and pumps' flows that the motion may use; the rest is the controller's.
  /// @threshold [1] 0.5..1; chosen: feedback must be able to catch up
  double flow_share = 0.9;
  /// Time from rest to full speed that valves are given: it limits the joints' accelerations.
  /// @threshold [s] 0..5; tuned: prediction_study --ramp on problems/scenarios/tuning (docs/benchmark.md): less tip error and
  /// sway than with a third of it at the same true energy
  double ramp = 2.4;
  /// Width of the moving average that is taken of the motion, which is planned for so much less time.
  /// @threshold [s] 0..5; tuned: prediction_study --smoothing on problems/scenarios/tuning (docs/benchmark.md)
  double smoothing = 1.6;
  /// Where there is no motion with these ramps and average, both are halved as long as the ramps stay above this.
  /// @threshold [s] 0.05..5; chosen: above an operator's lever time; spools and pilot lines follow within 0.4 s
  double shortest_ramp = 0.6;
  /// Mesh intervals.
  /// @threshold [1] 20..500; chosen: two thirds of optimize's, as scenarios are many
  int intervals = 60;
  /// Largest angle of the payload's rope, which is the plant's, along the motion; 0: no limit. [rad]
  double sway_limit = 0.0;
  /// Share of that limit to which the payload may swing when the motion has ended.
  /// @threshold [1] 0.05..1; chosen: half, so that it can be set down
  double sway_end_share = 0.5;
  /// Also an estimated lower bound.
  bool bound = true;
  std::uint64_t seed = 1;
  std::function<bool()> interrupted;
};

struct OptimalLeg {
  Trajectory motion;     ///< empty: there is none
  std::string message;   ///< why
  double energy = 0.0;   ///< [J] as predicted, by the exact law
  double bound = 0.0;    ///< [J] estimated; 0: none
  double solve_s = 0.0;  ///< [s]
};

struct OptimalMotions {
  std::vector<OptimalLeg> legs;
  bool found() const;
  double energy() const;  ///< [J] of all legs; NaN where one is missing
  double bound() const;   ///< [J] of all legs; NaN where one has none
  double solve_s() const;
  std::string message() const;  ///< the first reason
};

OptimalMotions optimal_motions(const benchmark::Scenario& scenario, const CraneModel& model,
                               const OptimalMotionOptions& options);
std::string packed(const OptimalMotions& motions);
OptimalMotions motions_from(const std::string& bytes);

/// One goal as a motion problem. @param from where the machine then stands @param leg number of the goal
MotionProblem problem_of(const benchmark::Scenario& scenario, const CraneModel& model, int leg,
                         const Eigen::VectorXd& from, const OptimalMotionOptions& options);

/// Gives controllers these motions, and new plans on the way.
class ScenarioMotions : public control::MotionSource {
 public:
  /// All must outlive this object.
  ScenarioMotions(const benchmark::Scenario& scenario, const CraneModel& model,
                  const OptimalMotions& motions, const OptimalMotionOptions& options)
      : scenario_(scenario), model_(model), motions_(motions), options_(options) {}
  Trajectory motion(const control::Task& task) override;
  std::optional<Trajectory> motion_from(const control::Task& task, const control::Measurement& now,
                                        const Trajectory& current, double t) override;

 private:
  const benchmark::Scenario& scenario_;
  const CraneModel& model_;
  const OptimalMotions& motions_;
  OptimalMotionOptions options_;
};

}  // namespace sparflow
