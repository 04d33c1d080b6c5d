#pragma once
/// Learns a pump's margins and standby pressure from the exact law
///   p = max(standby, max over active cylinders i of (P_i + c_i)),  c_i >= 0   (paper eqs. 14-16)
/// by robust least squares. No smoothing: the maximum is the law. The objective is piecewise smooth and not
/// convex, so each unknown is searched globally with the others held, in turns until nothing moves.
///
/// On the bias of a maximum. With P_i = model + error, the expected maximum lies above the maximum of the
/// expected: near a tie the margins take up about 0.4 to 0.6 standard deviations of the model's error.
/// A process' error is independent of its prediction, so leaving out the samples in which model says that two
/// terms are nearly tied removes the bias and selects nothing else; they are left out of the last step
/// as long as enough remain.
#include <Eigen/Dense>
#include <limits>
#include <string>
#include <vector>

namespace sparflow {

struct PumpSamples {
  Eigen::MatrixXd
      working_pressure;  ///< [samples x cylinders] P_i of the model [Pa]; read where active
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> active;  ///< [samples x cylinders]
  Eigen::VectorXd pressure;  ///< [samples] measured at the pump [Pa]
  /// [cylinders] for warnings; empty: the columns' numbers, from 1.
  std::vector<std::string> names = {};
};

struct LearnPumpOptions {
  double data_sheet_standby = 0.0;  ///< [Pa] kept when standby is never seen; 0 = not known
  double max_pressure =
      0.0;  ///< [Pa] samples within 2 % of it are left out (the pump is cut off); 0 = none
  double tie_gap_stds = 2.0;  ///< near tie: closer than this many robust standard deviations
  int min_leading = 20;  ///< samples a cylinder must lead for its margin to count as identified
  double outlier_threshold =
      6.0;  ///< robust standard deviations beyond which a sample is left out at the end
};

struct LearnedMargin {
  double margin = 0.0;      ///< [Pa] c_i >= 0
  bool identified = false;  ///< false: see `upper_bound`
  int active = 0;           ///< samples
  int leading = 0;          ///< samples in which P_i + c_i sets the pressure
  double standard_error =
      std::numeric_limits<double>::infinity();  ///< [Pa] from the spread of its samples
  /// [Pa] A larger margin would have been seen: the cylinder would lead where the pump follows another.
  /// Infinity when it is never active together with something else.
  double upper_bound = std::numeric_limits<double>::infinity();
};

struct LearnedPump {
  double standby = 0.0;  ///< [Pa]; of a constant-pressure supply its pressure
  bool standby_identified = false;
  int standby_leading = 0;             ///< samples
  std::vector<LearnedMargin> margins;  ///< by cylinder
  double rmse = 0.0;  ///< [Pa] over all samples but `invalid` and `saturated`, outliers included
  double robust_std = 0.0;  ///< [Pa]
  int given = 0, invalid = 0, saturated = 0, outliers = 0;
  int sweeps = 0;
  bool converged = false;
  std::vector<std::string> warnings;
};

/// The law for one sample. `leader` (may be null) becomes the cylinder that leads, -1 = standby.
double pump_law(const Eigen::Ref<const Eigen::RowVectorXd>& working_pressure,
                const Eigen::Ref<const Eigen::Array<bool, 1, Eigen::Dynamic>>& active,
                const std::vector<LearnedMargin>& margins, double standby, int* leader = nullptr);

/// A margin that is not identified is set to the median of the identified ones (0 if there is none), at most its
/// upper bound. Samples with a NaN in what is needed are left out. Deterministic.
/// @throws InputError when fewer than ten samples can be used
LearnedPump learn_pump(const PumpSamples& samples, const LearnPumpOptions& options = {});

/// A constant-pressure supply: one robust constant, no margins.
/// @throws InputError when fewer than ten samples can be used
LearnedPump learn_constant_pump(const Eigen::Ref<const Eigen::VectorXd>& pressure);

}  // namespace sparflow
