#pragma once
/// Savitzky-Golay smoothing and differentiation: a polynomial fitted to the samples in a window of time.
/// Source: A. Savitzky, M. J. E. Golay, "Smoothing and differentiation of data by simplified least squares
/// procedures", Anal. Chem. 36 (1964) 1627-1639; end points by evaluating the end window's polynomial, as in
/// P. A. Gorry, Anal. Chem. 62 (1990) 570-573. Uneven sampling: the same least squares in real time.
///
/// Every signal that is compared with another goes through the same filter: an acceleration that is
/// filtered against a force that is not makes inertia come out 15-19 % too large.
#include <Eigen/Dense>
#include <vector>

#include "identification/log/log.h"

namespace sparflow {

struct SmoothingOptions {
  double window_s = 0.0;  ///< [s] full width; 0 = choose from sampling and noise
  int order = 3;          ///< of the polynomial, 1..4
};

/// A channel with its first and second derivative in time; NaN where too little data lies near.
struct Smoothed {
  Eigen::VectorXd value;
  Eigen::VectorXd first;   ///< [unit/s]
  Eigen::VectorXd second;  ///< [unit/s^2]
};

/// The filter of one log: fixed window, order and times, applied to any channel. Immutable, safe to share.
/// Windows never reach across a gap between runs nor across a hole (NaN) in the channel; at the ends of a
/// stretch the window keeps its width and lies one-sided. A window holds at least order + 2 samples (it is
/// widened where sampling is coarse); a stretch with fewer than order + 1 samples gives NaN.
class SavitzkyGolay {
 public:
  /// @param time [s] strictly increasing  @param window_s full width [s], > 0
  SavitzkyGolay(Eigen::VectorXd time, std::vector<SampleRange> runs, double window_s,
                int order = 3);

  /// @param values [samples], NaN = missing  @param derivative 0, 1 or 2
  /// @return [samples] in unit/s^derivative
  Eigen::VectorXd apply(const Eigen::Ref<const Eigen::VectorXd>& values, int derivative) const;
  /// Value and both derivatives in one pass.
  Smoothed smooth(const Eigen::Ref<const Eigen::VectorXd>& values) const;

  double window() const { return window_s_; }
  int order() const { return order_; }
  /// Standard deviation of the output per unit of white noise on evenly sampled input, inside a run:
  /// the root of the sum of squared coefficients. @param derivative 0, 1 or 2
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
  std::vector<bool> even_;  ///< a run: its step is constant to one part in a thousand
  double window_s_ = 0.0;
  int order_ = 3;
  double step_ = 0.0;  ///< [s] median
  int half_ = 0;       ///< samples either side in evenly sampled runs
  /// Column i: weights giving the value (first, second derivative) at sample i of a window of 2 half_ + 1
  /// samples; column half_ serves the inside, the others the ends. Derivatives per sample step.
  Eigen::MatrixXd weights_[3];
};

/// Window that serves the velocities of these positions best.
///   For each window w of a grid (0.2 to 0.4 s at 50 Hz, from 0.1 s at 100 Hz and faster): risk(w) = variance of the noise that passes
///   + mean (v_w - v_0)^2 - variance of the noise in v_w - v_0,
/// v_0 the velocity by the shortest window: an unbiased estimate of the mean squared error of v_w up to the bias
/// of v_0. The noise is taken from third differences (median, so that motion does not count). The risks of the
/// channels, each relative to its risk at the shortest window, are added and the smallest sum wins.
/// @param positions [samples x joints], NaN = missing  @return full width [s]
double choose_window(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                     const Eigen::MatrixXd& positions, int order = 3);

/// Shortest window at which noise is no part of what a force is regressed on: its variance in the accelerations is
/// below a thousandth of theirs (noise in a regressor makes its parameter too small by that share: Fuller (1987),
/// Measurement Error Models, ch. 1). Smoothing rounds off starts and stops, and a law fitted to the smoothed force
/// discounts what happens there; at this window every sample of a motion counts.
/// @return full width [s], `longest` when no shorter one will do
double sharpest_window(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                       const Eigen::MatrixXd& positions, double longest, int order = 3);

/// Accelerations by the filter where they change, and by ones up to three times as wide everywhere else: most of a motion is
/// steady, and there the narrow window passes noise only. As a regressor that noise makes an inertia too small, on slow
/// machines by a third (Fuller (1987), ch. 1). Where a wider window differs from the narrow one by more than their noise
/// (and half the wide window about it) it is not taken. Source: O. Lepski (1991), Theory Probab. Appl. 35(3), 454-466.
/// @param positions [samples] of one joint  @param second [samples] by `filter`; changed in place
void quieten_acceleration(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                          const Eigen::VectorXd& positions, const SavitzkyGolay& filter,
                          Eigen::Ref<Eigen::VectorXd> second);

/// The filter for a log: the window of the options, or the one `choose_window` finds for the log's joint
/// positions and strokes.
SavitzkyGolay make_filter(const Log& log, const SmoothingOptions& options = {});

}  // namespace sparflow
