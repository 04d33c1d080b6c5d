#pragma once
/// Compares the errors of a model before and after a change, on test data: whether they fell where the change acts, and
/// whether any other error, or that of the energy, grew significantly given the variation between motions.
#include <string>
#include <vector>

#include "identification/comparison/compare.h"

namespace sparflow {

struct ErrorChangeOptions {
  /// The blocks of motion between which the noise of a change is estimated.
  BlockOptions blocks;
  /// Least growth of an RMS error that counts as harm.
  /// @threshold [1] 1..2; chosen: refitting alone moves centres and length-scales, which changes
  /// errors near the sensor noise by some percent
  double large_change = 1.1;
  /// Least number of blocks from which the noise of a change is estimated.
  /// @threshold [blocks] 2..30; chosen: the RMS of the few samples that a test log may have within
  /// the training range varies by more than a tenth
  int fewest_blocks = 4;
  /// Length of the pieces that replace motions where these are too few.
  /// @threshold [s] 0.2..8; chosen: longer than the filter window, within which errors are
  /// correlated
  double piece_s = 1.0;
  /// Least growth of the mean squared error over its standard error between blocks.
  /// @threshold [1] 1..5; derived: 97.7 % quantile of the normal distribution, one-sided
  double standard_errors = 2.0;
  /// Factor by which refitting alone may change the overall error.
  /// @threshold [1] 1..1.2; chosen: centres and length-scales move when a pressure model is learned
  /// again
  double refit_moves = 1.02;
  /// Ratio of the errors where the change acts above which they grew.
  /// @threshold [1] 0.9..1.1; chosen: 1 means that they grew at all
  double largest_own = 1.0;
  /// Largest increase of squared error where a change acts, as a share of its decrease at other
  /// such places.
  /// @threshold [1] 0..1; chosen: a small increase of one is accepted for a large decrease of
  /// others
  double largest_loss = 0.25;
  /// Time in which the speed of a steady rod changes by less than its median while it moves.
  /// @threshold [s] 0.05..2; chosen: a start or a stop by the lever takes as long
  double unsteady_span = 0.5;
  /// Time after a faster change from which a motion is steady.
  /// @threshold [s] 0.1..10; chosen: a bounce of 1 to 3 Hz has decayed by then
  double settled_s = 1.0;
  /// Least number of steady samples from which their error is told.
  /// @threshold [samples] 10..1000; chosen: one second at 20 Hz
  double fewest_steady = 20.0;
  /// A change acts on a quantity when it moves its prediction by this share of the error.
  /// @threshold [1] 0..0.5; chosen: a smaller change is invisible in the error
  double acts_share = 0.02;
  /// Least growth of the relative energy error that counts.
  /// @threshold [1] 0..0.05; chosen: smaller changes are irrelevant, because flows are known to
  /// some percent only
  double energy_moves = 2e-3;
};

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
  /// The same for forces where it acts, in samples in which the rod has moved steadily for a while: starts, stops and the bounce after
  /// them, which many laws do not concern, may hold nearly all of the squared error. Equals `own` where there are no such samples.
  double own_steady = 1.0;

  /// @return true when the error where the change acts grew, another error is harmed, or the overall error grew by more
  ///   than refitting alone may change it
  bool worse(const ErrorChangeOptions& options = {}) const;
};

/// An error is harmed when the mean paired difference of squared errors exceeds `standard_errors` over the blocks of
/// motion and the RMS error grows by `large_change` (the energy's by `energy_moves`). A quantity in fewer than
/// `fewest_blocks` is tested on pieces of `piece_s` instead; with too few of those it is not tested. Where a change acts
/// on several quantities, those that grew count as harmed only if their increase of squared error exceeds `largest_loss`
/// of the decrease of the others. Pressures count within the training range of both models, because extrapolation errors say
/// nothing about a law.
/// @param before, after on the same samples
/// @param stage where the change acts: force, flow, pressure, pump; any other value (a sensor) means every quantity whose
///   prediction changed
/// @param at its cylinder or pump; empty (a joint, the whole machine) means every place where a prediction of the stage
///   changed
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::string& stage,
                         const std::string& at = "");

/// Where a change acts: its stages, and its cylinder or pump as above.
struct ChangedPlace {
  std::vector<std::string> stages;
  std::string at;
};

/// The same with other thresholds, or for several changes together, each of which acts in its own stage.
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const ChangedPlace& place,
                         const ErrorChangeOptions& options);

/// The same for several changes together, with the usual thresholds.
ErrorChange error_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const std::vector<std::string>& stages,
                         const std::string& at = "");

}  // namespace sparflow
