#pragma once
/// Savitzky-Golay smoothing and differentiation: a polynomial is fitted to the samples in a window of time.
/// Source: A. Savitzky, M. J. E. Golay, "Smoothing and differentiation of data by simplified least squares
/// procedures", Anal. Chem. 36 (1964) 1627-1639; end points by evaluating the end window's polynomial, as in
/// P. A. Gorry, Anal. Chem. 62 (1990) 570-573. Uneven sampling uses the same least squares with the actual times.
///
/// Signals that are compared with each other need the same filter: comparing a filtered acceleration with an unfiltered
/// force makes an estimated inertia 15-19 % too large.
#include <Eigen/Dense>
#include <vector>

#include "identification/log/log.h"

namespace sparflow {

struct SmoothingOptions {
  double window_s = 0.0;  ///< [s] full width; 0 = chosen from sampling and noise
  int order = 3;          ///< of the polynomial, 1..4
};

/// A channel with its first and second time derivatives; NaN where too few samples lie in the window.
struct Smoothed {
  Eigen::VectorXd value;
  Eigen::VectorXd first;   ///< [unit/s]
  Eigen::VectorXd second;  ///< [unit/s^2]
};

/// The filter of one log with fixed window, order and times, for all its channels. Immutable, safe to share.
/// Windows do not reach across a gap between runs or a hole (NaN) in the channel; at the ends of a stretch the window
/// keeps its width and becomes one-sided. A window holds at least order + 2 samples (it is widened where sampling is
/// coarse); a stretch with fewer than order + 1 samples gives NaN.
class SavitzkyGolay {
 public:
  /// @param time [s] strictly increasing  @param window_s full width [s], > 0
  SavitzkyGolay(Eigen::VectorXd time, std::vector<SampleRange> runs, double window_s,
                int order = 3);

  /// @param values [samples], NaN = missing  @param derivative 0, 1 or 2
  /// @return [samples] in unit/s^derivative
  Eigen::VectorXd apply(const Eigen::Ref<const Eigen::VectorXd>& values, int derivative) const;
  /// Computes value and both derivatives in one pass.
  Smoothed smooth(const Eigen::Ref<const Eigen::VectorXd>& values) const;

  double window() const { return window_s_; }
  int order() const { return order_; }
  /// @param derivative 0, 1 or 2
  /// @return standard deviation of the output for white noise of unit standard deviation on evenly sampled input inside a
  ///   run: the root of the sum of squared coefficients
  double noise_gain(int derivative) const;

 private:
  void smooth_stretch(const Eigen::Ref<const Eigen::VectorXd>& values, SampleRange stretch,
                      bool even, Smoothed* out) const;
  void smooth_even(const Eigen::Ref<const Eigen::VectorXd>& values, SampleRange stretch,
                   Smoothed* out) const;
  void smooth_uneven(const Eigen::Ref<const Eigen::VectorXd>& values, SampleRange stretch,
                     Smoothed* out) const;

  Eigen::VectorXd time_;
  std::vector<SampleRange> runs_;
  std::vector<bool> even_;  ///< [runs] whether the step is constant to one part in a thousand
  double window_s_ = 0.0;
  int order_ = 3;
  double step_ = 0.0;  ///< [s] median
  int half_ = 0;       ///< samples either side in evenly sampled runs
  /// Column i holds the weights of the value (first, second derivative) at sample i of a window of 2 half_ + 1 samples;
  /// column half_ is used inside a run, the others at its ends. Derivatives are per sample step.
  Eigen::MatrixXd weights_[3];
};

/// Chooses the window with the smallest estimated mean squared error of the velocities. For each window w of a grid (0.2
/// to 0.4 s at 50 Hz, from 0.1 s at 100 Hz and faster)
///   risk(w) = noise variance of v_w + mean (v_w - v_0)^2 - noise variance of (v_w - v_0),
/// where v_0 is the velocity by the shortest window: an unbiased estimate of the mean squared error of v_w up to the bias
/// of v_0. The noise is estimated from third differences (by their median, which motion hardly affects). The risks of the
/// channels, each relative to its risk at the shortest window, are added; the window with the smallest sum is taken.
/// @param positions [samples x joints], NaN = missing  @return full width [s]
double choose_window(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                     const Eigen::MatrixXd& positions, int order = 3);

/// Shortest window at which the noise variance of the accelerations is below a thousandth of their own: noise in a
/// regressor biases its parameter towards zero by that share (Fuller (1987), Measurement Error Models, ch. 1). A longer
/// window would smooth starts and stops and so reduce their weight in a law that is fitted to the smoothed force.
/// @return full width [s], `longest` when no shorter one suffices
double sharpest_window(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                       const Eigen::MatrixXd& positions, double longest, int order = 3);

/// Replaces accelerations where they are steady by those of windows up to three times as wide, because there the narrow
/// window passes mostly noise. As a regressor that noise makes an inertia too small, on slow machines by a third
/// (Fuller (1987), ch. 1). The narrow window is kept wherever a wider one differs from it by more than the noise, and
/// within half the wide window of such a sample. Source: O. Lepski (1991), Theory Probab. Appl. 35(3), 454-466.
/// @param positions [samples] of one joint  @param second [samples] by `filter`; changed in place
void quieten_acceleration(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                          const Eigen::VectorXd& positions, const SavitzkyGolay& filter,
                          Eigen::Ref<Eigen::VectorXd> second);

/// @return the filter for a log, with the window of the options or, if that is 0, the one that `choose_window` finds for
///   the log's joint positions and strokes
SavitzkyGolay make_filter(const Log& log, const SmoothingOptions& options = {});

}  // namespace sparflow
