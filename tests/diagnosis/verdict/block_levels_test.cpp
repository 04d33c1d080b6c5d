/// Levels of residuals at equal work: what grows with the load is no change where the load is larger.
#include "diagnosis/verdict/block_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnosis/verdict/diagnosed_effect.h"
#include "diagnosis/verdict/residual_levels.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing_support::hidden_case;
using testing_support::HiddenCase;

constexpr double kLevelNoise = 500.0;  // [N]

double mean_load(const Diagnosis& d, const EvidenceChannel& c, std::size_t b) {
  const VectorXd& force =
      d.evidence.series[static_cast<std::size_t>(c.log[b])].cylinders[1].static_force;
  const Index first = c.sample[static_cast<std::size_t>(c.blocks[b].first)],
              last = c.sample[static_cast<std::size_t>(c.blocks[b].last - 1)];
  return force.segment(first, last - first + 1).squaredNorm() /
         static_cast<double>(last - first + 1);
}

struct LoadCase {
  Diagnosis d;
  std::size_t jib = 0;
};

/// Noise of the jib's force in proportion to its load.
/// @param heavier, louder in the suspect log: factors of load and noise beside that
LoadCase with_load(double heavier, double louder) {
  const Machine machine = testing_support::drawn_machine("loader_crane");
  static const HiddenCase logs = hidden_case(machine, {}, {5, 300.0});
  LoadCase out;
  Diagnosis& d = out.d;
  d.evidence = collect_evidence(CraneModel::untrained(machine), {make_signals(machine, logs.train)},
                                {make_signals(machine, logs.reference)});
  d.evidence.series[0].cylinders[1].static_force *= heavier;
  std::mt19937_64 random(4);
  NoiseModel noise;
  noise.variance = kLevelNoise * kLevelNoise;
  for (EvidenceChannel& c : d.evidence.channels)
    c.y = testing_support::draw(noise, c.blocks, random);
  out.jib = static_cast<std::size_t>(d.evidence.find(EvidenceKind::kForce, 1) -
                                     d.evidence.channels.data());
  EvidenceChannel& c = d.evidence.channels[out.jib];
  for (std::size_t b = 0; b < c.blocks.size(); ++b)
    c.y.segment(c.blocks[b].first, c.blocks[b].last - c.blocks[b].first) *=
        std::sqrt(mean_load(d, c, b)) / 1e4 * (c.log[b] == 0 ? louder : 1.0);
  FitControl control;
  control.keep_residuals = true;
  d.search.final = d.search.null = fit_effects(d.evidence, {}, nullptr, control);
  return out;
}

TEST(BlockLevels, AResidualThatGrowsWithTheLoadIsNoChangeUnderALargerLoad) {
  const auto exceeds = [](double heavier, double louder) {
    const LoadCase c = with_load(heavier, louder);
    return exceeds_references(c.d, c.jib);
  };
  EXPECT_FALSE(exceeds(1.0, 1.0));
  EXPECT_FALSE(exceeds(4.0, 1.0));
  EXPECT_TRUE(exceeds(1.0, 4.0));
  EXPECT_TRUE(exceeds(4.0, 4.0));
  const LoadCase c = with_load(4.0, 1.0);
  EXPECT_GT(suspect_rms(c.d.evidence, c.jib, c.d.search.final.residual[c.jib]),
            2.0 * reference_rms(c.d, c.jib));
}

/// A loud stretch of one row against the same one of all its rows: the variance of the logarithm of one squared normal value is
/// pi^2 / 2 (the trigamma function of one half).
TEST(BlockLevels, AStretchOfOneRowTellsItsLevelWorseThanALongOne) {
  const LoadCase which = with_load(1.0, 1.0);
  const EvidenceChannel& c = which.d.evidence.channels[which.jib];
  std::size_t loud = 0;
  while (c.log[loud] != 0) ++loud;
  const NoiseBlock block = c.blocks[loud];
  const auto levels = [&](Index rows) {
    Evidence evidence = which.d.evidence;
    evidence.channels[which.jib].blocks[loud].last = block.first + rows;
    VectorXd residual = c.y;
    residual.segment(block.first, rows).setConstant(1e3 * kLevelNoise);
    return compare_levels(evidence, which.jib, residual);
  };
  const LevelComparison of_one = levels(1), of_all = levels(block.last - block.first);
  EXPECT_GT(of_one.largest, 10.0);
  const double added =
      std::pow(of_one.largest_deviation, 2) - std::pow(of_all.largest_deviation, 2);
  EXPECT_NEAR(added, 4.934802,
              0.15 * 4.934802);  // less what those of the references have; the series ends
}

/// The same difference as least squares over both groups with one slope for each of load and speed, and a row for the prior of each.
TEST(BlockLevels, TheDifferenceIsThatOfLeastSquaresWithTheSlopesOfBothGroups) {
  const LoadCase which = with_load(3.0, 1.5);
  const Diagnosis& d = which.d;
  const EvidenceChannel& c = d.evidence.channels[which.jib];
  const VectorXd residual = settled(d, which.jib, d.search.final.residual[which.jib]);
  const LevelComparison levels = compare_levels(d.evidence, which.jib, residual);
  const Index n = std::ssize(c.blocks);
  MatrixXd design = MatrixXd::Zero(n + 2, 4), squares(n, 2);
  VectorXd level = VectorXd::Zero(n + 2);
  for (Index b = 0; b < n; ++b) {
    const auto at = static_cast<std::size_t>(b);
    const Index first = c.blocks[at].first, rows = c.blocks[at].last - first;
    level[b] = std::log(residual.segment(first, rows).array().square().mean());
    design(b, c.log[at] == 0 ? 0 : 1) = 1.0;
    const VectorXd& speed =
        d.evidence.series[static_cast<std::size_t>(c.log[at])].cylinders[1].speed;
    double sum = 0.0, count = 0.0;
    for (Index i = c.sample[static_cast<std::size_t>(first)];
         i <= c.sample[static_cast<std::size_t>(first + rows - 1)]; ++i)
      if (std::isfinite(speed[i])) sum += speed[i] * speed[i], count += 1.0;
    squares.row(b) << mean_load(d, c, at), sum / count;
  }
  for (Index k = 0; k < 2; ++k)
    design.col(2 + k).head(n) = (squares.col(k).array() + 0.01 * squares.col(k).mean()).log();
  VectorXd solution = VectorXd::Zero(4);
  design(n, 2) = design(n + 1, 3) = 1.0;  // a slope of zero, within one
  VectorXd weight = VectorXd::Zero(n + 2);
  weight.tail(2).setOnes();
  for (const int group : {0, 1}) {  // rows over the deviation of their group
    const VectorXd own = design.col(group).head(n);
    const VectorXd left =
        own.cwiseProduct(level.head(n) - VectorXd::Constant(n, own.dot(level.head(n)) / own.sum()));
    weight.head(n) += own * std::sqrt((own.sum() - 1.0) / left.squaredNorm());
  }
  solution = (weight.asDiagonal() * design).colPivHouseholderQr().solve(weight.cwiseProduct(level));
  EXPECT_EQ(levels.suspects + levels.references, n);
  EXPECT_NEAR(levels.difference, solution[0] - solution[1], 1e-9);
  // the noise is 1.5 times as large at equal work
  EXPECT_NEAR(levels.difference, 2.0 * std::log(1.5), 3.0 * std::sqrt(levels.variance));
  double apart = 0.0;  // of the mean levels
  for (Index b = 0; b < n; ++b)
    apart += level[b] * (c.log[static_cast<std::size_t>(b)] == 0 ? 1.0 / levels.suspects
                                                                 : -1.0 / levels.references);
  EXPECT_NEAR(levels.explained, apart - levels.difference, 1e-9);
}

}  // namespace
}  // namespace sparflow
