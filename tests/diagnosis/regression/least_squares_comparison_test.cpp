#include "diagnosis/regression/least_squares_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/diagnosis/evidence_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using testing_support::blocks_of;
using testing_support::plain_channel;
using testing_support::plain_design;
using testing_support::white;

/// Strokes up and down in turn as blocks of motion, with a speed that rises and falls within each.
struct Strokes {
  std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(20, 60));
  VectorXd side = VectorXd(1200), speed = VectorXd(1200);
  Strokes() {
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const double sign = b % 2 == 0 ? 1.0 : -1.0;
      for (Index k = 0; k < 60; ++k) {
        side[blocks[b].first + k] = sign;
        speed[blocks[b].first + k] = sign * std::sin(3.14159 * (static_cast<double>(k) + 0.5) / 60);
      }
    }
  }
};

double advantage(const Evidence& e, const EffectDesign& other, const EffectDesign& one) {
  const std::vector<bool> all(e.channels.size(), true);
  return least_squares_advantage(e, least_squares_residual(e, {}, other, all),
                                 least_squares_residual(e, {}, one, all));
}

/// Dry friction and a second, unmodelled force that has the shape of the speed within a stroke and changes its sign
/// from pair to pair of strokes, so that it averages out.
TEST(LeastSquaresComparison, PrefersTheLargeEffectToOneWithTheShapeOfTheError) {
  const Strokes s;
  std::mt19937_64 random(3);
  VectorXd y = 4.0 * s.side + 0.3 * white(1200, random);
  for (std::size_t b = 0; b < s.blocks.size(); ++b) {
    y.segment(s.blocks[b].first, 60) +=
        (b % 4 < 2 ? 1.5 : -1.5) * s.speed.segment(s.blocks[b].first, 60).cwiseAbs();
  }
  Evidence e;
  e.channels.push_back(plain_channel(s.blocks, y));
  const EffectDesign coulomb = plain_design({s.side}), viscous = plain_design({s.speed});
  // RegressionOptions::least_advantage of 1200 rows, below which no advantage counts.
  EXPECT_GT(advantage(e, coulomb, viscous), 0.05 * 1200);
  EXPECT_EQ(advantage(e, viscous, coulomb), 0.0);
}

TEST(LeastSquaresComparison, AFurtherParameterThatFitsNoiseIsNoAdvantage) {
  const Strokes s;
  int advantages = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937_64 random(seed);
    Evidence e;
    e.channels.push_back(plain_channel(s.blocks, 4.0 * s.side + white(1200, random)));
    Eigen::MatrixXd more(1200, 3);
    more << s.side, s.speed, white(1200, random);
    if (advantage(e, plain_design({more}), plain_design({s.side})) > 0.0) ++advantages;
  }
  // two further parameters explain the variance of about 2 of 1200 rows; a twentieth is 60
  EXPECT_EQ(advantages, 0);
}

TEST(LeastSquaresComparison, ComparesOnlyChannelsInWhichBothAct) {
  const Strokes s;
  std::mt19937_64 random(5);
  Evidence e;
  e.channels.push_back(plain_channel(s.blocks, s.side + white(1200, random)));
  e.channels.push_back(plain_channel(s.blocks, 9.0 * s.side + white(1200, random)));
  const EffectDesign first = plain_design({s.speed, Eigen::MatrixXd()});
  const EffectDesign second = plain_design({Eigen::MatrixXd(), s.side});
  EXPECT_EQ(advantage(e, second, first), 0.0);
  EXPECT_EQ(advantage(e, first, second), 0.0);
}

}  // namespace
}  // namespace sparflow
