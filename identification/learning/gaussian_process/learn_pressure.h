#pragma once
/// Learns the working pressure of a cylinder in one direction from (flow, static force, pressure) samples:
/// a plane, and a Gaussian process with an ARD squared-exponential kernel about it where it predicts better, all
/// hyperparameters by marginal likelihood. docs/gaussian_process.md describes the method.
/// Source: Rasmussen & Williams (2006), ch. 2.7, 5.4; Titsias (2009) for long logs.
#include <Eigen/Dense>
#include <functional>
#include <string>
#include <vector>

#include "models/hydraulics/gaussian_process.h"

namespace sparflow {

enum class GpMethod {
  kAutomatic,  ///< exact up to `exact_limit` samples, inducing points beyond
  kExact,      ///< every sample is a centre, O(n^3)
  kInducing,   ///< few inducing points summarise all samples (variational bound)
  kSubset      ///< an exact process of a selected subset; the other samples are not used
};
const char* gp_method_name(GpMethod method);

struct LearnGpOptions {
  GpMethod method = GpMethod::kAutomatic;
  /// Largest number of samples of an exact process with `kAutomatic`.
  /// @threshold [samples] 10..2000; chosen: the cost of an evaluation grows with them
  int exact_limit = 200;
  /// Largest number of centres of kInducing; of kSubset the number of samples.
  /// @threshold [centres] 5..1000; chosen: several times what the models of loader_crane/plain
  /// need, see the table in docs/gaussian_process.md
  int max_centres = 60;
  /// kInducing stops adding centres when the mean conditional variance of the samples given the
  /// centres is below this fraction of the noise variance.
  /// @threshold [1] 1e-4..0.5; tuned: on loader_crane/plain, table in docs/gaussian_process.md
  double sparse_tolerance = 0.01;
  /// Ratio of that variance to its tolerance from which on the report warns of too few centres.
  /// @threshold [1] 1..100; chosen: a tenth of the noise variance, which shows in the errors
  double warned_ratio = 10.0;
  /// Largest number of samples for learning the hyperparameters, every k-th of the log.
  /// @threshold [samples] 100..100000; tuned: on loader_crane/plain, table in
  /// docs/gaussian_process.md
  int hyper_samples = 1000;
  /// Largest number of samples from which the weights of the inducing points are learned, every k-th of the log; all samples
  /// are screened for outliers and judge the result.
  /// @threshold [samples] 1000..1e8; chosen: a thousand for each of some hundred centres, so that what more would average
  /// out is a thirtieth of the noise; time and memory of a log of millions of rows do not grow further
  long most_samples = 100000;
  /// Largest change of the logarithm of a length-scale at which centres and hyperparameters, which
  /// depend on each other, are settled.
  /// @threshold [1] 1e-3..0.5; numerical: ends the alternate updates, at a tenth of a length-scale
  double settled = 0.1;

  /// Least length-scale as a fraction of the data's range in that input.
  /// @threshold [1] 0.02..0.5; tuned: on loader_crane/plain, table in docs/gaussian_process.md;
  /// below it the process would fit steps (Coulomb friction, dead bands) that are effects of their
  /// own and must remain in the residual
  double shortest_length = 0.15;
  /// Largest length-scale as a fraction of the data's range in that input.
  /// @threshold [1] 1..10; derived: above three ranges the kernel is a parabola over the data and a
  /// longer one changes only the numerical condition
  double longest_length = 3.0;
  /// Least standard deviation of the noise.
  /// @threshold [Pa] 10..1e5; chosen: sensors on cranes are not better
  double smallest_noise = 1e3;
  /// Largest standard deviation of the noise, in standard deviations of the pressures.
  /// @threshold [1] 1..10; chosen: above one, at which the noise explains everything
  double largest_noise = 2.0;
  /// Least standard deviation of the process, in standard deviations of the pressures.
  /// @threshold [1] 1e-6..0.1; chosen: a smaller deviation from the linear mean has no effect
  double smallest_signal = 1e-3;
  /// Largest standard deviation of the process, in standard deviations of the pressures.
  /// @threshold [1] 1..10; chosen: a larger one is not determined by data of this spread
  double largest_signal = 3.0;
  /// Prior standard deviation of the mean's slope around that of a straight line through the data,
  /// in standard deviations of the pressures over the range of the force.
  /// @threshold [1] 0.1..10; chosen: one spread of the pressures over the range of the force;
  /// without it a long length-scale and the line are exchangeable
  double slope_std = 1.0;
  /// Whether a plane without a process is taken where it predicts groups that were left out not worse.
  bool simplest_law = true;
  /// Largest number of parts into which the groups are divided, each of which is left out in turn.
  /// @threshold [parts] 2..20; cited: five or ten (Hastie, Tibshirani & Friedman 2009, ch. 7.10.1)
  int most_folds = 5;
  /// Standard errors by which the plane's squared error may exceed that of the process and still
  /// count as not worse.
  /// @threshold [1] 0..3; cited: one (Breiman et al. 1984, ch. 3.4.3)
  double not_worse = 1.0;

  /// Number of boxes along each input, in each of which one sample represents the others in the
  /// preliminary fit.
  /// @threshold [1] 3..50; chosen: some hundred representatives, of which a process is learned at
  /// once
  int representative_cells = 11;
  /// Robust standard deviations from a preliminary fit beyond which a sample is an outlier; 0 = no
  /// screening.
  /// @threshold [1] 3..20; chosen: beyond noise of any usual distribution
  double outlier_threshold = 6.0;
  /// Largest fraction of outliers; with a larger one all samples are kept, with a warning.
  /// @threshold [1] 0..0.5; chosen: more are no outliers but a law that is not smooth
  double max_outlier_fraction = 0.15;
  /// Least number of samples.
  /// @threshold [samples] 3..1000; chosen: more than the four hyperparameters and the two
  /// coefficients of the mean
  int min_samples = 10;
};

/// How the learning went.
struct GpReport {
  GpMethod method = GpMethod::kExact;  ///< actually used
  int given = 0;                       ///< all samples
  int invalid = 0;                     ///< left out because they are not finite
  int outliers = 0;                    ///< left out by the screening
  int used = 0;                        ///< samples that remain
  int centres = 0;
  double rmse = 0.0;       ///< [Pa] of the samples used
  double noise_std = 0.0;  ///< [Pa] learned
  double log_likelihood =
      0.0;  ///< of the scaled problem (a bound if sparse); comparable within one data set only
  int evaluations = 0;  ///< of the likelihood
  bool converged = false;
  double seconds = 0.0;
  PressureLaw law = PressureLaw::kPlaneAndProcess;
  double plane_left_out = 0.0;  ///< [Pa] RMS error of a plane on groups left out; 0 = not compared
  double process_left_out = 0.0;      ///< [Pa] the same of plane and process
  std::string failure;                ///< learn_gps only: why nothing was learned, "" = learned
  std::vector<std::string> warnings;  ///< whole sentences
};

/// Samples of one pressure model: a cylinder in one direction.
struct GpDataset {
  std::string name;  ///< "boom extend", for messages and progress
  Eigen::ArrayXd flow, force, pressure;
  /// [samples] log, or block of motion in a single log, of each sample; empty: one group. Samples of one group have
  /// errors in common, so that only a group left out whole shows how a law predicts other motions.
  std::vector<int> group = {};

  GpDataset select(const std::vector<Eigen::Index>& rows) const;
};

struct LearnedGp {
  GpParameters parameters;
  GpReport report;
};

/// Rows with a NaN or infinity are left out. An input that does not vary gets the longest length-scale of a nominal range
/// and a slope of zero; the report says so. With two groups or more, plane and process are compared on groups left out,
/// and the simplest law that is not worse is taken. Deterministic.
/// @throws InputError when fewer than `min_samples` rows remain
LearnedGp learn_gp(const GpDataset& samples, const LearnGpOptions& options = {});
/// The same for samples of one group.
/// @param flow [m^3/s]  @param force static force [N]  @param pressure measured [Pa], all [samples]
LearnedGp learn_gp(const Eigen::Ref<const Eigen::ArrayXd>& flow,
                   const Eigen::Ref<const Eigen::ArrayXd>& force,
                   const Eigen::Ref<const Eigen::ArrayXd>& pressure,
                   const LearnGpOptions& options = {});

/// Learns several pressure models in parallel. A data set that cannot be learned gets `report.failure` and empty
/// parameters; the others are not affected. The result does not depend on `threads`.
/// @param progress called after each with (done, total, name), from one thread at a time; may be empty
/// @param threads 0 = one for each processor
std::vector<LearnedGp> learn_gps(
    const std::vector<GpDataset>& datasets, const LearnGpOptions& options = {},
    const std::function<void(int done, int total, const std::string& name)>& progress = {},
    int threads = 0);

}  // namespace sparflow
