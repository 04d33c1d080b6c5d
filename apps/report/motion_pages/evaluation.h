#pragma once
/// A motion that someone else made, priced by the exact law: text, JSON and page of `evaluate`.
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

struct MotionEvaluation {
  std::string file;
  bool from_positions =
      false;  ///< the file gives no speeds; they were found by smoothing positions
  Trajectory motion;
  MotionEnergy energy;
  std::vector<LimitCheck> checks;  ///< most violated first
  std::vector<std::string> notes;  ///< whole sentences
};

/// Whether every limit is kept, by the measure of `optimize`.
bool limits_kept(const MotionEvaluation& evaluation);

/// @param problem payload, idle power, limits and obstacles that the motion is judged by
Page evaluation_page(const CraneModel& model, const MotionProblem& problem,
                     const MotionEvaluation& evaluation);

/// Returns the evaluation as JSON (keys: docs/commands.md).
std::string evaluation_json(const CraneModel& model, const MotionProblem& problem,
                            const MotionEvaluation& evaluation);

/// Returns the evaluation as text of one screen.
std::string evaluation_table(const CraneModel& model, const MotionProblem& problem,
                             const MotionEvaluation& evaluation);

}  // namespace sparflow
