#pragma once
/// Starts with modes and phases that a search for one window of durations makes itself, beside the seeds it is given:
/// sequential motions, and the cheapest paths of the joint grid.
#include <vector>

#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Whether only the duration counts, not the energy.
bool time_is_everything(const MotionProblem& problem);

/// Whether the phases of two plans have the same modes in the same order, however long they last.
bool same_plan(const PhasePlan& a, const PhasePlan& b);

/// Refers to its arguments.
class StartCandidates {
 public:
  StartCandidates(const CraneModel& model, const MotionProblem& problem,
                  const std::vector<SeedMotion>& seeds, const TimeWindow& time,
                  const OptimizeOptions& options)
      : model_(model), problem_(problem), seeds_(seeds), time_(time), options_(options) {}

  /// All of them, each once. Where time is short, those of slower motions are among them, shortened to this duration.
  std::vector<ModeCandidate> all() const;

 private:
  bool short_of_time() const;
  std::vector<ModeCandidate> sequences(double duration) const;
  std::vector<ModeCandidate> grid_candidates(double wanted) const;
  void drop_repeated(std::vector<ModeCandidate>& candidates) const;

  const CraneModel& model_;
  const MotionProblem& problem_;
  const std::vector<SeedMotion>& seeds_;
  const TimeWindow& time_;
  const OptimizeOptions& options_;
};

}  // namespace sparflow
