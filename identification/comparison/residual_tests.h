#pragma once
/// Tests residuals for bias and for dependence on signals; the tests are valid for autocorrelated residuals.
///
/// Under the null hypothesis the residual of each block of motion could equally have the opposite sign. For every quantity
/// the residual, and its product with every signal (and the signal's square), is summed in each block:
///   T = |sum_b c_b| / sqrt(sum_b c_b^2),
/// and compared with the largest T of all tests when the blocks' signs are flipped at random, the same flips for all:
/// P. H. Westfall & S. S. Young, "Resampling-Based Multiple Testing" (1993), single step. The p-value is thus the
/// probability of at least one false alarm among all tests, whatever the autocorrelation within a block and the
/// correlation between quantities and signals. Tests that assume independent samples (Student's t, likelihood ratio)
/// would nearly always reject on such residuals.
#include <Eigen/Dense>
#include <string>
#include <vector>

#include "identification/comparison/compare_parts.h"

namespace sparflow {

struct ResidualTest {
  std::string stage, at, regime;
  std::string depends_on;  ///< key of the signal; "" = the test of the mean
  double p_value = 1.0;    ///< family-wise, over all tests
  double statistic = 0.0;  ///< T
  double size = 0.0;       ///< in `unit`: the bias, or the RMS of the part that the signal explains
  Range ci95;              ///< of a bias, in `unit`, by bootstrap of blocks; NaN otherwise
  std::string unit;
  double share_explained = 0.0;  ///< of the squared error, 0..1
  long samples = 0;
  /// Number of independent samples with the same information about the mean: n / (1 + 2 sum rho_k), Sokal 1997.
  double effective_samples = 0.0;
  int blocks = 0;  ///< blocks with samples of the quantity
  /// Smallest p-value that these blocks allow among all tests: that of the same sums with one sign in all blocks.
  double least_p = 0.0;
  std::string sentence;
};

struct AutocorrelationOptions {
  /// Autocorrelation below which the sum over the lags ends, since the rest is noise.
  /// @threshold [1] 0.01..0.3; chosen: close to zero, as the estimates scatter around it
  double gone = 0.05;
  /// Least number of pairs of samples at one lag.
  /// @threshold [pairs] 5..1000; chosen: an estimate from fewer pairs is noise
  int fewest_pairs = 10;
  /// The same where the sum decides how samples of a pressure model are thinned.
  /// @threshold [pairs] 5..1000; chosen: an estimate from fewer pairs is noise
  int fewest_pairs_to_thin = 20;
};

struct ResidualTestOptions {
  /// Number of random flips of the blocks' signs.
  /// @threshold [1] 99..100000; derived: the smallest p-value is 1/(flips + 1), a fiftieth of
  /// `alarm`
  int flips = 999;
  unsigned seed = 1;
  /// Least number of blocks of a quantity.
  /// @threshold [blocks] 6..100; derived: with fewer the smallest possible p-value (2^-5 for 6) is
  /// above 5 %
  int least_blocks = 6;
  /// Level of significance: a residual test with a larger p-value is no alarm.
  /// @threshold [1] 0..0.2; chosen: the usual level; one log in twenty without an error gives an
  /// alarm
  double alarm = 0.05;
  /// Share of the squared error from which a part of it is told although the blocks are too few to
  /// decide.
  /// @threshold [1] 0..1; chosen: half of it; without a smaller part the error would be much the same
  double large_share = 0.5;
  AutocorrelationOptions autocorrelation;
  BlockOptions blocks;
};

struct ResidualTests {
  std::vector<ResidualTest> tests;  ///< smallest p-value first, then largest share
  int blocks = 0;
  int tested = 0;  ///< hypotheses
  /// Level of significance of the options: a test with a larger p-value is no alarm.
  double alarm = ResidualTestOptions().alarm;
  double smallest_p() const { return tests.empty() ? 1.0 : tests.front().p_value; }
  double large_share = ResidualTestOptions().large_share;  ///< that of the options
  /// Sentences without a full stop on errors that could not be alarms, because their quantities move in too few blocks: of
  /// each quantity the largest part, where it is large enough to be told, the largest first.
  std::vector<std::string> undecided() const;
};

ResidualTests test_residuals(const std::vector<ComparedPart>& parts, int blocks,
                             const ResidualTestOptions& options = {});

/// Single-step max-T test by sign flips. @param sums [blocks x tests], 0 where a block holds no sample
/// @return [tests x 3] T, its family-wise p-value, and that of the same sums with one sign in all blocks
Eigen::MatrixXd max_t_sign_flip(const Eigen::MatrixXd& sums, int flips, unsigned seed);

/// @return n / (1 + 2 sum of the autocorrelations up to the first that is gone), with pairs inside blocks only
double effective_samples(const Eigen::VectorXd& values, const std::vector<int>& block,
                         const AutocorrelationOptions& options = {});

}  // namespace sparflow
