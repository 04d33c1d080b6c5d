#pragma once
/// Thresholds of the regression: model-form error, null distribution, least-squares comparison.

namespace sparflow {

struct RegressionOptions {
  /// Least model-form error of the fitted law of a loss, a valve or a sensor, as a share of the
  /// effect.
  /// @threshold [1] 0..1; chosen: weights are exact, and friction laws declare their own model-form
  /// error; the other laws are simplified and are not taken as better than a tenth
  double least_form_error = 0.1;
  /// Share of the model-form error of a law that suspect and reference logs both have which is another one in the suspect logs: what
  /// is the same in both is estimated from both and makes no difference.
  /// @threshold [1] 0..1; tuned: at 1 a dead band that is twice that of the references stays unsaid (plant 545); the clean logs
  /// of plants 521, 523, 545, 562, 563 and 581 to 585 have no difference with it
  double shared_form_share = 0.5;
  /// Bound of the relative change of an effect's exponent (see other_power).
  /// @threshold [1] 0..1; derived: covers the published exponents, v^0.85 instead of v for friction
  /// (0.15) and Q^1.75 instead of Q^2 for pipes (0.125)
  double largest_power_change = 0.2;
  /// Quantile at which a candidate's gains on flipped residuals are compared with those on normal
  /// innovations, which gives its NullDistribution::scale.
  /// @threshold [1] 0..1; chosen: the upper decile, which is far out and still has 30 of 300 draws
  /// above
  double scale_quantile = 0.9;
  /// Least advantage by least squares, as a share of the rows (see least_squares_advantage).
  /// @threshold [1] 0..1; chosen: an effect that contains another is never worse, because its
  /// further parameters explain a few motions by chance
  double least_advantage = 0.05;
  /// Least advantage by least squares in its standard errors over motions.
  /// @threshold [1] 0..; derived: a normal error exceeds two standard errors in 2.3 % of cases
  double advantage_standard_errors = 2.0;
};

}  // namespace sparflow
