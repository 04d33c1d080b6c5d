#pragma once
/// Learns the working pressure of a cylinder in one direction from (flow, static force, pressure) samples:
/// a Gaussian process with an ARD squared-exponential kernel and a mean linear in the force, all
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
  int exact_limit = 200;  ///< samples; the cost of an evaluation grows with them
  int max_centres = 60;   ///< of kInducing; of kSubset the number of samples
  /// kInducing stops adding centres when the mean conditional variance of the samples given the centres is below this
  /// fraction of the noise variance.
  double sparse_tolerance = 0.01;
  int hyper_samples =
      1000;  ///< most samples for learning the hyperparameters, every k-th of the log

  /// Bounds of the length-scales as fractions of the data's range in that input. Below a seventh of the range the process
  /// would fit steps (Coulomb friction, dead bands) that are effects of their own and must remain in the residual; above
  /// three the kernel is a parabola over the data and a longer one changes only the numerical condition.
  double shortest_length = 0.15, longest_length = 3.0;
  double smallest_noise = 1e3;  ///< [Pa] standard deviation; sensors on cranes are not better

  /// Largest standard deviation of the process, in standard deviations of the pressures.
  double largest_signal = 3.0;
  /// Prior standard deviation of the mean's slope around that of a straight line through the data, in standard deviations
  /// of the pressures over the range of the force.
  double slope_std = 1.0;

  double outlier_threshold =
      6.0;  ///< robust standard deviations from a preliminary fit; 0 = no screening
  double max_outlier_fraction =
      0.15;  ///< with a larger fraction beyond the threshold all samples are kept, with a warning
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
  std::string failure;                ///< learn_gps only: why nothing was learned, "" = learned
  std::vector<std::string> warnings;  ///< whole sentences
};

struct LearnedGp {
  GpParameters parameters;
  GpReport report;
};

/// Rows with a NaN or infinity are left out. An input that does not vary gets the longest length-scale of a nominal range
/// and, if it is the force, a slope of zero; the report says so. Deterministic.
/// @param flow [m^3/s]  @param force static force [N]  @param pressure measured [Pa], all [samples]
/// @throws InputError when fewer than `min_samples` rows remain
LearnedGp learn_gp(const Eigen::Ref<const Eigen::ArrayXd>& flow,
                   const Eigen::Ref<const Eigen::ArrayXd>& force,
                   const Eigen::Ref<const Eigen::ArrayXd>& pressure,
                   const LearnGpOptions& options = {});

/// Samples of one pressure model: a cylinder in one direction.
struct GpDataset {
  std::string name;  ///< "boom extend", for messages and progress
  Eigen::ArrayXd flow, force, pressure;
};

/// Learns several pressure models in parallel. A data set that cannot be learned gets `report.failure` and empty
/// parameters; the others are not affected. The result does not depend on `threads`.
/// @param progress called after each with (done, total, name), from one thread at a time; may be empty
/// @param threads 0 = one for each processor
std::vector<LearnedGp> learn_gps(
    const std::vector<GpDataset>& datasets, const LearnGpOptions& options = {},
    const std::function<void(int done, int total, const std::string& name)>& progress = {},
    int threads = 0);

}  // namespace sparflow
