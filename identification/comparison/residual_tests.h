#pragma once
/// Is what a model leaves over noise, or does it repeat? Tests that hold although neighbouring residuals are alike.
///
/// Under the null hypothesis each block of motion could as well have left its residual with the other sign. Of every
/// quantity the mean, and its product with every signal (and the signal's square), is summed in each block:
///   T = |sum_b c_b| / sqrt(sum_b c_b^2),
/// and compared with the largest T of all tests when the blocks' signs are flipped at random, the same flips for all:
/// P. H. Westfall & S. S. Young, "Resampling-Based Multiple Testing" (1993), single step. The chance of even one
/// false alarm in everything tested is then the p-value named; autocorrelation within a block does not matter, nor do
/// quantities and signals that go together. Student's t or a likelihood ratio of independent samples alarms on such
/// residuals nearly always.
#include <Eigen/Dense>
#include <string>
#include <vector>

#include "identification/comparison/compare_parts.h"

namespace sparflow {

struct ResidualTest {
  std::string stage, at, regime;
  std::string depends_on;  ///< key of the signal; "" = the test of the mean
  double p_value = 1.0;    ///< controlled over everything tested
  double statistic = 0.0;  ///< T
  double size = 0.0;       ///< in `unit`: the bias, or the RMS of what the signal explains
  Range ci95;              ///< of a bias, in `unit`, by bootstrap of blocks; NaN else
  std::string unit;
  double share_explained = 0.0;  ///< of the squared error, 0..1
  long samples = 0;
  /// How many independent samples would tell as much about the mean: n / (1 + 2 sum rho_k), Sokal 1997.
  double effective_samples = 0.0;
  int blocks = 0;  ///< that hold samples of it
  std::string sentence;
};

struct ResidualTests {
  std::vector<ResidualTest> tests;  ///< smallest p-value first, then largest share
  int blocks = 0;
  int tested = 0;  ///< hypotheses
  double smallest_p() const { return tests.empty() ? 1.0 : tests.front().p_value; }
};

struct ResidualTestOptions {
  int flips = 999;
  unsigned seed = 1;
  int least_blocks =
      6;  ///< of a quantity: fewer cannot reach 5 % (2^-5 is the smallest p there is)
};

ResidualTests test_residuals(const std::vector<ComparedPart>& parts, int blocks,
                             const ResidualTestOptions& options = {});

/// The statistics' heart. @param sums [blocks x tests], 0 where a block holds nothing
/// @return [tests x 2] T and its controlled p-value
Eigen::MatrixXd max_t_sign_flip(const Eigen::MatrixXd& sums, int flips, unsigned seed);

/// n / (1 + 2 sum of autocorrelations up to the first below 0.05); pairs are taken inside blocks only.
double effective_samples(const Eigen::VectorXd& values, const std::vector<int>& block);

}  // namespace sparflow
