#pragma once
/// Learns a pump's margins and standby pressure from the exact law
///   p = max(standby, max over active cylinders i of (P_i + c_i)),  c_i >= 0   (paper eqs. 14-16)
/// by robust least squares. The maximum is not smoothed, because it is the law. The objective is piecewise smooth and not
/// convex, so each unknown is searched globally with the others fixed, cyclically until none changes.
///
/// Bias of the maximum: with P_i = model + error, the expected maximum is larger than the maximum of the expectations;
/// near a tie the margins would absorb about 0.4 to 0.6 standard deviations of the model's error. The error of a pressure
/// model is independent of its prediction, so leaving out the samples whose predictions are nearly tied removes the bias
/// without a selection effect. The last step leaves them out as long as enough samples remain.
#include <Eigen/Dense>
#include <limits>
#include <string>
#include <vector>

namespace sparflow {

struct PumpSamples {
  Eigen::MatrixXd
      working_pressure;  ///< [samples x cylinders] P_i of the model [Pa]; used where active
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> active;  ///< [samples x cylinders]
  Eigen::VectorXd pressure;  ///< [samples] measured at the pump [Pa]
  /// [cylinders] for warnings; if empty, "cylinder 1", "cylinder 2" ...
  std::vector<std::string> names = {};
};

struct LearnPumpOptions {
  double data_sheet_standby = 0.0;  ///< [Pa] used when the log shows no standby; 0 = unknown
  double max_pressure = 0.0;        ///< [Pa] of the pressure cut-off; 0 = none
  /// Samples above this share of `max_pressure` are left out.
  /// @threshold [1] 0.8..1; chosen: near the pressure cut-off the pump does not follow the load
  double cut_off_share = 0.98;
  /// Least number of usable samples.
  /// @threshold [samples] 2..1000; chosen: the robust standard deviation of fewer is no estimate
  int fewest_samples = 10;
  /// Near tie: the two largest terms are closer than this many robust standard deviations.
  /// @threshold [1] 0..5; chosen: beyond it the model's error hardly ever exchanges the leader
  double tie_gap_stds = 2.0;
  /// Largest ratio of all samples of a leader to those without near ties, for the ties to be left
  /// out.
  /// @threshold [1] 1..100; chosen: at least a fifth of the samples remains
  std::size_t tie_ratio = 5;
  /// Least number of samples as load-sensing leader for an identified margin.
  /// @threshold [samples] 5..1000; chosen: their median scatters by about a quarter of a standard
  /// deviation
  int min_leading = 20;
  /// Robust standard deviations beyond which a sample is left out at the end.
  /// @threshold [1] 3..20; chosen: beyond noise of any usual distribution
  double outlier_threshold = 6.0;
  /// Quantile of the pressure from which the search for standby starts, without idle samples.
  /// @threshold [1] 0..0.2; chosen: the lowest pressure but for outliers
  double initial_standby_quantile = 0.02;
  /// Quantile of the distances p - P_i from which the search for a margin starts.
  /// @threshold [1] 0..0.5; chosen: a margin that almost all samples of the cylinder allow
  double initial_margin_quantile = 0.1;
  /// Quantile of the distances to the leader that bounds a margin that is not identified.
  /// @threshold [1] 0..0.2; chosen: the smallest distance would depend on a single sample
  double bound_quantile = 0.02;
  /// Quantile of the pressure that is the highest possible standby, without samples at standby.
  /// @threshold [1] 0..0.2; chosen: the lowest measured pressure but for outliers
  double lowest_quantile = 0.01;
};

struct LearnedMargin {
  double margin = 0.0;      ///< [Pa] c_i >= 0
  bool identified = false;  ///< false: see `upper_bound`
  int active = 0;           ///< samples in which the cylinder is active
  int leading = 0;          ///< samples in which P_i + c_i is the pump pressure
  double standard_error =
      std::numeric_limits<double>::infinity();  ///< [Pa] from the spread of its samples
  /// [Pa] With a larger margin the cylinder would be the leader in samples where the pump pressure follows another.
  /// Infinity when it is never active together with another cylinder.
  double upper_bound = std::numeric_limits<double>::infinity();
};

struct LearnedPump {
  double standby = 0.0;  ///< [Pa]; of a constant-pressure supply its pressure
  bool standby_identified = false;
  int standby_leading = 0;             ///< samples at standby
  std::vector<LearnedMargin> margins;  ///< by cylinder
  double rmse = 0.0;  ///< [Pa] over all samples but `invalid` and `saturated`, outliers included
  double robust_std = 0.0;  ///< [Pa]
  int given = 0, invalid = 0, saturated = 0, outliers = 0;
  int sweeps = 0;
  bool converged = false;
  std::vector<std::string> warnings;
};

/// A margin that is not identified is set to the median of the identified ones (0 if there is none), at most its
/// upper bound. Samples with NaN in a required value are left out. Deterministic.
/// @throws InputError when fewer than `fewest_samples` can be used
LearnedPump learn_pump(const PumpSamples& samples, const LearnPumpOptions& options = {});

/// Learns a constant-pressure supply: one robust constant, no margins.
/// @throws InputError when fewer than `fewest_samples` can be used
LearnedPump learn_constant_pump(const Eigen::Ref<const Eigen::VectorXd>& pressure,
                                const LearnPumpOptions& options = {});

}  // namespace sparflow
