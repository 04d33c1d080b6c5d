#include "diagnosis/selection/search_scores.h"

#include <gtest/gtest.h>

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

/// Two channels and four candidates, two in each; the first and the third are missing.
struct Scored {
  Evidence evidence;
  std::vector<SearchCandidate> candidates;
  SearchOptions options;

  Scored() {
    std::mt19937_64 random(3);
    NoiseModel noise;
    noise.phi1 = 0.5;
    const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(20, 25));
    for (int c = 0; c < 2; ++c)
      evidence.channels.push_back(
          plain_channel(blocks, draw(noise, blocks, random), MatrixXd::Ones(rows_of(blocks), 1)));
    for (std::uint64_t k = 0; k < 4; ++k) {
      std::vector<MatrixXd> columns(2);
      columns[k / 2] = slow_column(blocks, random);
      if (k % 2 == 0) evidence.channels[k / 2].y += columns[k / 2];
      SearchCandidate candidate;
      candidate.designs = {plain_design(std::move(columns))};
      candidate.designs[0].number = k + 1;
      candidates.push_back(std::move(candidate));
    }
  }
  EffectFit fit(const std::vector<const EffectDesign*>& designs) const {
    FitControl control;
    control.noise_passes = 12;  // as the search, to convergence
    return fit_effects(evidence, designs, nullptr, control);
  }
};

/// Gains by candidate.
std::vector<double> gains(const std::vector<CandidateScore>& scores) {
  std::vector<double> all(4);
  for (const CandidateScore& s : scores) all[s.candidate] = s.gain;
  return all;
}

TEST(SearchScores, GainsKeptFromBeforeAreThoseComputedAnew) {
  const Scored s;
  const std::vector<bool> none(4, false);
  const SearchScores used(s.evidence, s.candidates, s.options);
  std::vector<const EffectDesign*> base;
  const EffectFit nothing = s.fit(base);
  const std::vector<double> first = gains(used.beside(base, nothing, none));
  base = {&s.candidates[0].designs[0]};
  const EffectFit with = s.fit(base);
  const std::vector<double> kept = gains(used.beside(base, with, none)),
                            anew = gains(SearchScores(s.evidence, s.candidates, s.options)
                                             .beside(base, with, none));
  // both start from the same fits, which end within 1e-3 nats of each other
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(kept[k], anew[k], 2e-3) << k;
  EXPECT_EQ(kept[2], first[2]) << "nothing has changed in the second channel";
  EXPECT_EQ(kept[3], first[3]);
  // of the first, nothing is left: at most chi-square / 2 of one parameter, which exceeds 8 in one of 16,000
  EXPECT_GT(first[0], 50.0);
  EXPECT_LT(kept[0], 8.0);
}

TEST(SearchScores, AContextIsWhatSharesAChannel) {
  const Scored s;
  const SearchScores scores(s.evidence, s.candidates, s.options);
  const std::vector<const EffectDesign*> base = {&s.candidates[0].designs[0]};
  const EffectFit nothing = s.fit({}), with = s.fit(base);
  const auto same = [&](std::size_t k) {
    return same_contexts(scores.contexts({}, nothing, k), scores.contexts(base, with, k));
  };
  EXPECT_FALSE(same(0));
  EXPECT_FALSE(same(1));
  EXPECT_TRUE(same(2));
  EXPECT_TRUE(same(3));
  // another fit of the same designs is another context
  EffectFit other = with;
  other.log_likelihood[0] += 1.0;
  EXPECT_FALSE(same_contexts(scores.contexts(base, with, 1), scores.contexts(base, other, 1)));
  // as is a fit of the same likelihood with another design
  EffectDesign replaced = *base[0];
  replaced.number = 5;
  EXPECT_FALSE(
      same_contexts(scores.contexts(base, with, 1), scores.contexts({&replaced}, with, 1)));
  // and a design without a number makes no context known
  EffectDesign unnumbered = *base[0];
  unnumbered.number = 0;
  EXPECT_FALSE(same_contexts(scores.contexts({&unnumbered}, with, 1),
                             scores.contexts({&unnumbered}, with, 1)));
}

}  // namespace
}  // namespace sparflow
