/// A refined motion is the same motion.
#include "models/machine/trajectory.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/models/numeric.h"

namespace sparflow {
namespace {

/// Two joints, uneven instants, random piecewise-constant accelerations, integrated exactly.
Trajectory random_motion(unsigned seed) {
  test_support::Random random(seed);
  const Eigen::Index rows = 9;
  Trajectory motion;
  motion.t.setZero(rows);
  motion.q.setZero(rows, 2);
  motion.qd.setZero(rows, 2);
  motion.qdd.setZero(rows, 2);
  motion.t[0] = 1.5;
  for (Eigen::Index k = 0; k + 1 < rows; ++k) {
    const double h = random.uniform(0.05, 0.6);
    for (Eigen::Index j = 0; j < 2; ++j) motion.qdd(k, j) = random.uniform(-1.0, 1.0);
    motion.t[k + 1] = motion.t[k] + h;
    motion.qd.row(k + 1) = motion.qd.row(k) + h * motion.qdd.row(k);
    motion.q.row(k + 1) = motion.q.row(k) + h * motion.qd.row(k) + 0.5 * h * h * motion.qdd.row(k);
  }
  motion.qdd.row(rows - 1) = motion.qdd.row(rows - 2);
  return motion;
}

// A dozen additions of numbers of order one.
constexpr double kLastDigits = 1e-14;

TEST(Trajectory, RefiningKeepsEveryOriginalInstant) {
  const Trajectory coarse = random_motion(1);
  for (const int factor : {1, 2, 7, 16}) {
    const Trajectory fine = coarse.refined(factor);
    ASSERT_EQ(fine.size(), (coarse.size() - 1) * factor + 1);
    for (Eigen::Index k = 0; k < coarse.size(); ++k) {
      EXPECT_EQ(fine.t[k * factor], coarse.t[k]);
      EXPECT_EQ(fine.q.row(k * factor), coarse.q.row(k));
      EXPECT_EQ(fine.qd.row(k * factor), coarse.qd.row(k));
      EXPECT_EQ(fine.qdd.row(k * factor), coarse.qdd.row(k));
    }
    EXPECT_DOUBLE_EQ(fine.duration(), coarse.duration());
  }
}

TEST(Trajectory, RefinedMotionObeysTheSameLawBetweenInstants) {
  const Trajectory fine = random_motion(2).refined(5);
  for (Eigen::Index k = 0; k + 1 < fine.size(); ++k) {
    const double h = fine.t[k + 1] - fine.t[k];
    EXPECT_GT(h, 0.0);
    const Eigen::RowVectorXd qd = fine.qd.row(k) + h * fine.qdd.row(k);
    const Eigen::RowVectorXd q = fine.q.row(k) + h * fine.qd.row(k) + 0.5 * h * h * fine.qdd.row(k);
    EXPECT_LT((fine.qd.row(k + 1) - qd).norm(), kLastDigits);
    EXPECT_LT((fine.q.row(k + 1) - q).norm(), kLastDigits);
  }
}

TEST(Trajectory, RefiningTwiceIsRefiningOnce) {
  const Trajectory motion = random_motion(3);
  const Trajectory twice = motion.refined(2).refined(3), once = motion.refined(6);
  EXPECT_LT((twice.t - once.t).norm(), kLastDigits);
  EXPECT_LT((twice.q - once.q).norm(), 4 * kLastDigits);
  EXPECT_LT((twice.qd - once.qd).norm(), 4 * kLastDigits);
  EXPECT_EQ(twice.qdd, once.qdd);
}

TEST(Trajectory, ParabolaByHand) {
  Trajectory motion;
  motion.t = Eigen::Vector2d(0, 2);
  motion.q = Eigen::Vector2d(1, 7);   // 1 + t + t^2
  motion.qd = Eigen::Vector2d(1, 5);  // 1 + 2 t
  motion.qdd = Eigen::Vector2d(2, 2);
  const Trajectory fine = motion.refined(4);
  EXPECT_EQ(fine.t[1], 0.5);
  EXPECT_EQ(fine.q(1, 0), 1.75);
  EXPECT_EQ(fine.qd(1, 0), 2.0);
}

TEST(Trajectory, SmallAndWrongCases) {
  EXPECT_EQ(Trajectory().duration(), 0.0);
  EXPECT_EQ(Trajectory().refined(3).size(), 0);
  EXPECT_THROW(random_motion(4).refined(0), std::logic_error);
}

}  // namespace
}  // namespace sparflow
