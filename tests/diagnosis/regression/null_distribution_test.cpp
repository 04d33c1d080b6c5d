#include "diagnosis/regression/null_distribution.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "models/effects/registry.h"
#include "tests/diagnosis/evidence_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing_support::blocks_of;
using testing_support::draw;
using testing_support::plain_channel;
using testing_support::plain_design;
using testing_support::rows_of;
using testing_support::slow_column;

constexpr int kSimulations = 99;

/// Motions in two channels with nothing missing, and a catalogue of five effects, two of which are searched over a grid
/// of correlated columns.
struct Null {
  Evidence evidence;
  std::vector<std::vector<EffectDesign>> catalogue;
  double penalty = 0.0;

  explicit Null(unsigned seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    NoiseModel noise;  // from nearly white to as slow as with unmodelled friction
    noise.phi1 = 0.4 + 0.5 * uniform(random);
    noise.phi2 = -0.2 * uniform(random);
    noise.offset_variance = 2.0 * uniform(random);
    for (const Index length : {24, 30}) {
      const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(20, length));
      evidence.channels.push_back(
          plain_channel(blocks, draw(noise, blocks, random), MatrixXd::Ones(rows_of(blocks), 1)));
    }
    for (int k = 0; k < 5; ++k) {
      std::vector<EffectDesign> grid;
      const std::size_t c = k < 3 ? 0 : 1;
      const std::vector<NoiseBlock>& blocks = evidence.channels[c].blocks;
      const VectorXd common = slow_column(blocks, random);
      for (int g = 0; g < (k % 2 == 1 ? 3 : 1); ++g) {
        std::vector<MatrixXd> columns(2);
        columns[c] = common + 0.3 * g * slow_column(blocks, random);
        grid.push_back(plain_design(std::move(columns)));
      }
      catalogue.push_back(std::move(grid));
    }
    penalty = 0.5 * std::log(600.0);
  }

  std::vector<NullCandidate> candidates() const {
    std::vector<NullCandidate> all;
    for (const auto& designs : catalogue) all.push_back({&designs, penalty});
    return all;
  }

  /// The smallest p-value by the gains of the search, in which noise is estimated again with each effect.
  double p_value(const NullDistribution& distribution, const EffectFit& fit) const {
    double smallest = 1.0;
    for (std::size_t k = 0; k < catalogue.size(); ++k) {
      double best = -1e300;
      for (const EffectDesign& d : catalogue[k]) {
        FitControl control;
        control.noise_passes = 2;
        best = std::max(best, fit_effects(evidence, {&d}, &fit, control).total() - fit.total());
      }
      smallest = std::min(smallest, distribution.p_value(best - penalty, k));
    }
    return smallest;
  }
};

TEST(NullDistribution, FalseAlarmsAreAsRareAsAsked) {
  const int cases = 200;
  int alarms = 0, above_half = 0;
  for (unsigned seed = 1; seed <= cases; ++seed) {
    const Null null(seed);
    const EffectFit fit = fit_effects(null.evidence, {});
    std::mt19937_64 random(seed);
    const NullDistribution distribution =
        simulate_null_distribution({null.evidence, fit}, null.candidates(), kSimulations, random);
    const double p = null.p_value(distribution, fit);
    alarms += p < 0.05 ? 1 : 0;
    above_half += p > 0.5 ? 1 : 0;
  }
  // 5 % of 200 are 10; 18 are 2.6 deviations more. Taking the larger of two p-values makes it fewer.
  EXPECT_LE(alarms, 18);
  // the p-values are spread out, and not all near one
  EXPECT_GT(above_half, cases / 3);
  EXPECT_LT(above_half, cases * 4 / 5);
}

TEST(NullDistribution, AnEffectPasses) {
  int found = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Null null(seed);
    // as large as the standard deviation of the innovation where the column is one
    null.evidence.channels[1].y += 1.0 * null.catalogue[3][0].columns[1].col(0);
    const EffectFit fit = fit_effects(null.evidence, {});
    std::mt19937_64 random(seed);
    const NullDistribution distribution =
        simulate_null_distribution({null.evidence, fit}, null.candidates(), kSimulations, random);
    found += null.p_value(distribution, fit) < 0.05 ? 1 : 0;
  }
  // One in ten may be hidden by the noise that is drawn.
  EXPECT_GE(found, 36) << "of 40";
}

TEST(NullDistribution, AnUnmodelledErrorInOneChannelHidesNothingInAnother) {
  // Whole motions of the first channel have errors beyond its noise, with the shape of no candidate.
  int found = 0, alarms = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Null null(seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    EvidenceChannel& disturbed = null.evidence.channels[0];
    for (const NoiseBlock& b : disturbed.blocks) {
      disturbed.y.segment(b.first, b.last - b.first) *= std::exp(2.0 * normal(random));
    }
    const EffectFit plain = fit_effects(null.evidence, {});
    const NullDistribution before =
        simulate_null_distribution({null.evidence, plain}, null.candidates(), kSimulations, random);
    alarms += null.p_value(before, plain) < 0.05 ? 1 : 0;
    null.evidence.channels[1].y += 1.0 * null.catalogue[3][0].columns[1].col(0);
    const EffectFit fit = fit_effects(null.evidence, {});
    const NullDistribution distribution =
        simulate_null_distribution({null.evidence, fit}, null.candidates(), kSimulations, random);
    found += null.p_value(distribution, fit) < 0.05 ? 1 : 0;
  }
  EXPECT_GE(found, 36) << "of 40";
  EXPECT_LE(alarms, 6) << "of 40: 5 % are 2, and 6 are 2.9 deviations more";
}

TEST(NullDistribution, AnAcceptedEffectCannotBeFoundAgain) {
  // candidates are orthogonal to accepted effects: with the only candidate accepted, all simulated gains are zero
  Null null(3);
  null.catalogue.resize(1);
  const EffectDesign& known = null.catalogue[0][0];
  const EffectFit fit = fit_effects(null.evidence, {&known});
  std::mt19937_64 random(1);
  const NullDistribution distribution = simulate_null_distribution(
      {null.evidence, fit, {&known}}, {{&null.catalogue[0], 0.0}}, kSimulations, random);
  // Zero but for rounding, which the ridge of the simulation keeps from growing.
  EXPECT_LT(distribution.normal.back(), 1e-3);
  EXPECT_LT(distribution.flipped.back(), 1e-3);
}

TEST(NullDistribution, MoreCandidatesRaiseTheThreshold) {
  const Null null(7);
  const EffectFit fit = fit_effects(null.evidence, {});
  std::vector<NullCandidate> one = {{&null.catalogue[0], null.penalty}};
  std::mt19937_64 a(1), b(1);
  const NullDistribution narrow =
                             simulate_null_distribution({null.evidence, fit}, one, kSimulations, a),
                         wide = simulate_null_distribution({null.evidence, fit}, null.candidates(),
                                                           kSimulations, b);
  EXPECT_GT(wide.threshold(0.05), narrow.threshold(0.05));
  ASSERT_EQ(narrow.scale.front(), 1.0) << "gains are scaled, so that penalties do not add up";
  // a penalty lowers a candidate's gains by as much
  one[0].penalty += 3.0;
  std::mt19937_64 c(1);
  const NullDistribution penalised =
      simulate_null_distribution({null.evidence, fit}, one, kSimulations, c);
  // The same seed gives the same draws; rounding alone differs, here and below.
  EXPECT_NEAR(penalised.threshold(0.05), narrow.threshold(0.05) - 3.0, 1e-9);
  // and so does the penalty of optional parameters for designs that have them
  std::vector<EffectDesign> wider = null.catalogue[0];
  for (EffectDesign& design : wider) design.optional = true;
  std::mt19937_64 d(1);
  const NullDistribution optional = simulate_null_distribution(
      {null.evidence, fit}, {{&wider, null.penalty, 3.0}}, kSimulations, d);
  EXPECT_NEAR(optional.threshold(0.05), narrow.threshold(0.05) - 3.0, 1e-9);
  // a nonlinear one counts by itself: a pump's lag at a point that has three
  std::vector<EffectDesign> shaped = null.catalogue[0];
  const EffectAt lag{find_effect("pump_lag"), 0};
  for (EffectDesign& design : shaped) {
    design.effect = lag;
    design.shape = {0.1, 0.0, 0.4, 0.1, 0.05, 0.0};
  }
  std::mt19937_64 e(1);
  const NullDistribution present = simulate_null_distribution(
      {null.evidence, fit}, {{&shaped, null.penalty, 0.0, 1.0}}, kSimulations, e);
  EXPECT_NEAR(present.threshold(0.05), narrow.threshold(0.05) - 3.0, 1e-9);
}

TEST(NullDistribution, PValueIsTheLargerOfBothDistributions) {
  NullDistribution distribution;
  distribution.scale = {1.0, 4.0};
  distribution.penalty = {0.0, 2.0};
  for (int i = 0; i < 99; ++i) {
    distribution.normal.push_back(i);
    distribution.flipped.push_back(2.0 * i);
  }
  EXPECT_DOUBLE_EQ(distribution.p_value(1e9, 0), 0.01) << "never zero: 1/(n+1)";
  EXPECT_DOUBLE_EQ(distribution.p_value(-1.0, 0), 1.0);
  EXPECT_DOUBLE_EQ(distribution.p_value(97.5, 0), 0.51) << "50 of the flipped ones are as large";
  EXPECT_DOUBLE_EQ(distribution.p_value(4.0 * (97.5 + 2.0) - 2.0, 1), 0.51)
      << "scaled, but not its penalty";
  EXPECT_DOUBLE_EQ(distribution.threshold(0.05), 186.0) << "95 % of the flipped ones";
  // a gain above the threshold of a level has a p-value of at most about that level
  EXPECT_LE(distribution.p_value(distribution.threshold(0.05) + 1e-9, 0), 0.06);
}

TEST(NullDistribution, SameSeedGivesTheSameDistribution) {
  const Null null(5);
  const EffectFit fit = fit_effects(null.evidence, {});
  std::mt19937_64 a(7), b(7);
  EXPECT_EQ(simulate_null_distribution({null.evidence, fit}, null.candidates(), 20, a).normal,
            simulate_null_distribution({null.evidence, fit}, null.candidates(), 20, b).normal);
}

TEST(NullDistribution, CandidatesThatAreUnchangedKeepTheirSimulation) {
  const Null null(5);
  const EffectDesign& known =
      null.catalogue[0][0];  // in the first channel, as the first three candidates
  const EffectFit before = fit_effects(null.evidence, {}),
                  after = fit_effects(null.evidence, {&known});
  std::mt19937_64 a(1), b(1);
  NullSimulator used(null.evidence, kSimulations, a), anew(null.evidence, kSimulations, b);
  const NullDistribution first = used.distribution({null.evidence, before}, null.candidates());
  const NullModel next{null.evidence, after, {&known}};
  const NullDistribution kept =
      used.distribution(next, null.candidates(), {}, {false, false, false, true, true});
  const NullDistribution whole = anew.distribution(next, null.candidates());
  ASSERT_EQ(kept.normal.size(), whole.normal.size());
  for (std::size_t k = 0; k < kept.normal.size(); ++k) {
    // the second channel's fit is the same but for rounding
    EXPECT_NEAR(kept.normal[k], whole.normal[k], 1e-6);
    EXPECT_NEAR(kept.flipped[k], whole.flipped[k], 1e-6);
  }
  EXPECT_NE(first.normal, kept.normal);
}

}  // namespace
}  // namespace sparflow
