#pragma once
/// What a change of a model did to its errors on data that took no part: whether they fell where the change acts, and
/// whether any other error, or that of the energy, grew by more than chance between motions.
#include <string>
#include <vector>

#include "identification/comparison/compare.h"

namespace sparflow {

/// An error that a change made larger beyond its noise.
struct HarmedError {
  std::string stage, at, regime;     ///< as in StageScore; energy of a pump: stage "energy"
  double before = 0.0, after = 0.0;  ///< RMS error, SI; of the energy: relative error
  std::string sentence;              ///< "the error of force main grew from 1.84 to 2.36 kN"
};

/// RMS error after / before. 1 = nothing changed, below 1 = better.
struct ErrorChange {
  /// Geometric mean over everything compared, weighted with the number of samples.
  double overall = 1.0;
  /// Of all quantities together that the change acts on; of several stages their geometric mean; without any, as
  /// overall.
  double own = 1.0;
  std::vector<HarmedError> harmed;
  /// Standard error of log(overall), from block of motion to block of motion.
  double overall_deviation = 0.0;

  /// Not better where it acts, or worse elsewhere, or worse on the whole by more than learning again moves.
  bool worse() const;
};

/// @param before, after on the same samples
/// @param stage where the change acts: force, flow, pressure, pump; else (a sensor) wherever a prediction moved
/// @param at its cylinder or pump; empty (a joint, the whole machine): wherever a prediction of the stage moved
///
/// Where a change acts on several quantities, one of them counts as harmed when all such take back more than a quarter
/// of the squared error that the others win.
/// Noise: both models' squared errors in each block of motion, paired; the mean difference must exceed two standard
/// errors over the blocks, and the RMS error grow by a tenth (the energy's by 0.2 % of the energy). Where fewer than four
/// blocks show a quantity, pieces of one second take their place; what fewer than four of those show is left to chance.
/// Pressures count where both models were learned: outside, an error says nothing about a law.
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::string& stage,
                         const std::string& at = "");

/// Of several changes together, each of which acts in its own stage.
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::vector<std::string>& stages,
                         const std::string& at = "");

}  // namespace sparflow
