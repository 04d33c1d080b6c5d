#pragma once
/// Compares the errors of a model before and after a change, on test data: whether they fell where the change acts, and
/// whether any other error, or that of the energy, grew significantly given the variation between motions.
#include <string>
#include <vector>

#include "identification/comparison/compare.h"

namespace sparflow {

/// An error that a change increased significantly.
struct HarmedError {
  std::string stage, at, regime;     ///< as in StageScore; energy of a pump: stage "energy"
  double before = 0.0, after = 0.0;  ///< RMS error, SI; of the energy: relative error
  std::string sentence;              ///< "the error of force main grew from 1.84 to 2.36 kN"
};

/// RMS error after / before. 1 = nothing changed, below 1 = better.
struct ErrorChange {
  /// Geometric mean over all compared quantities, weighted with the number of samples.
  double overall = 1.0;
  /// The same for the quantities on which the change acts, pooled by stage; equals `overall` if there are none.
  double own = 1.0;
  std::vector<HarmedError> harmed;
  /// Standard error of log(overall), from the variation between blocks of motion.
  double overall_deviation = 0.0;

  /// @return true when the error where the change acts grew, another error is harmed, or the overall error grew by more
  ///   than refitting alone may change it
  bool worse() const;
};

/// An error is harmed when the mean paired difference of squared errors exceeds two standard errors over the blocks of
/// motion and the RMS error grows by a tenth (the energy's by 0.2 % of the energy). A quantity in fewer than four blocks
/// is tested on pieces of one second instead; with fewer than four of those it is not tested. Where a change acts on
/// several quantities, those that grew count as harmed only if their increase of squared error exceeds a quarter of the
/// decrease of the others. Pressures count within the training range of both models, because extrapolation errors say
/// nothing about a law.
/// @param before, after on the same samples
/// @param stage where the change acts: force, flow, pressure, pump; any other value (a sensor) means every quantity whose
///   prediction changed
/// @param at its cylinder or pump; empty (a joint, the whole machine) means every place where a prediction of the stage
///   changed
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::string& stage,
                         const std::string& at = "");

/// The same for several changes together, each of which acts in its own stage.
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::vector<std::string>& stages,
                         const std::string& at = "");

}  // namespace sparflow
