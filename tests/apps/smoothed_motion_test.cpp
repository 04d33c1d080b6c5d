// The moving average of a motion: what it keeps of the motion, and that its instants belong together.
#include "apps/tasks/benchmark/smoothed_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

constexpr double kWidth = 1.6;  // [s]

/// Two joints, one after the other, each with a speed that rises and falls at once; begins at a time that is not 0.
Trajectory one_after_another() {
  Trajectory m;
  m.t.resize(7);
  m.t << 3.0, 3.5, 6.0, 6.5, 7.5, 8.5, 9.1;
  m.qdd = Eigen::MatrixXd::Zero(7, 2);
  m.qdd.col(0) << 0.4, 0.0, -0.4, 0.0, 0.0, 0.0, 0.0;
  m.qdd.col(1) << 0.0, 0.0, 0.0, -0.3, 0.3, 0.0, 0.0;
  m.q = m.qd = Eigen::MatrixXd::Zero(7, 2);
  m.q.row(0) << 0.7, -1.1;
  for (Eigen::Index k = 0; k + 1 < m.size(); ++k) {
    const double dt = m.t[k + 1] - m.t[k];
    m.qd.row(k + 1) = m.qd.row(k) + dt * m.qdd.row(k);
    m.q.row(k + 1) = m.q.row(k) + dt * m.qd.row(k) + 0.5 * dt * dt * m.qdd.row(k);
  }
  return m;
}

/// The second way: the mean of the position over the width before an instant, by many samples.
Eigen::RowVectorXd mean_before(const Trajectory& m, double t, double width) {
  const int samples = 20000;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(m.q.cols());
  for (int i = 0; i < samples; ++i) {
    const double at = std::clamp(t - width * (i + 0.5) / samples, m.t[0], m.t[m.size() - 1]);
    Eigen::Index k = 0;
    while (k + 2 < m.size() && m.t[k + 1] <= at) ++k;
    const double s = at - m.t[k];
    sum += m.q.row(k) + s * m.qd.row(k) + 0.5 * s * s * m.qdd.row(k);
  }
  return sum / samples;
}

TEST(SmoothedMotion, IsTheMeanOverTheWidthBeforeEachInstant) {
  const Trajectory m = one_after_another(), s = smoothed(m, kWidth);
  for (Eigen::Index k = 0; k < s.size(); k += 7)
    EXPECT_LT((s.q.row(k) - mean_before(m, s.t[k], kWidth)).cwiseAbs().maxCoeff(), 1e-7) << s.t[k];
}

TEST(SmoothedMotion, KeepsItsEndPointsAndRestsThere) {
  const Trajectory m = one_after_another(), s = smoothed(m, kWidth);
  const Eigen::Index last = s.size() - 1;
  EXPECT_DOUBLE_EQ(s.t[0], m.t[0]);
  EXPECT_NEAR(s.duration(), m.duration() + kWidth, 1e-12);
  EXPECT_LT((s.q.row(0) - m.q.row(0)).norm(), 1e-12);
  EXPECT_LT((s.q.row(last) - m.q.row(m.size() - 1)).norm(), 1e-12);
  EXPECT_EQ(s.qd.row(0).norm(), 0.0);
  EXPECT_LT(s.qd.row(last).norm(), 1e-12);
}

TEST(SmoothedMotion, PositionsAndSpeedsAreTheIntegralsOfTheAccelerations) {
  const Trajectory m = one_after_another(), s = smoothed(m, kWidth);
  Eigen::RowVectorXd q = s.q.row(0), qd = s.qd.row(0);
  double moved = 0.0;
  for (Eigen::Index k = 0; k + 1 < s.size(); ++k) {
    const double dt = s.t[k + 1] - s.t[k];
    EXPECT_LE(dt, 0.2);
    q += dt * qd + 0.5 * dt * dt * s.qdd.row(k);
    qd += dt * s.qdd.row(k);
    EXPECT_LT((q - s.q.row(k + 1)).cwiseAbs().maxCoeff(), 1e-4) << s.t[k + 1];
    EXPECT_LT((qd - s.qd.row(k + 1)).cwiseAbs().maxCoeff(), 1e-9) << s.t[k + 1];
    moved = std::max(moved, qd.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(moved, 0.1);
}

TEST(SmoothedMotion, KeepsTheRangesOfTheMotion) {
  const Trajectory m = one_after_another(), s = smoothed(m, kWidth);
  for (Eigen::Index j = 0; j < m.q.cols(); ++j) {
    EXPECT_LE(s.q.col(j).maxCoeff(), m.q.col(j).maxCoeff() + 1e-12);
    EXPECT_GE(s.q.col(j).minCoeff(), m.q.col(j).minCoeff() - 1e-12);
    EXPECT_LE(s.qd.col(j).maxCoeff(), m.qd.col(j).maxCoeff() + 1e-12);
    EXPECT_GE(s.qd.col(j).minCoeff(), m.qd.col(j).minCoeff() - 1e-12);
    EXPECT_LE(s.qdd.col(j).maxCoeff(), m.qdd.col(j).maxCoeff() + 1e-9);
    EXPECT_GE(s.qdd.col(j).minCoeff(), m.qdd.col(j).minCoeff() - 1e-9);
    // and changes of speed are spread over the width
    EXPECT_LT(s.qdd.col(j).cwiseAbs().maxCoeff(), 0.7 * m.qdd.col(j).cwiseAbs().maxCoeff());
  }
}

TEST(SmoothedMotion, OfNoWidthIsTheMotionItself) {
  const Trajectory m = one_after_another(), s = smoothed(m, 0.0);
  EXPECT_EQ(s.t, m.t);
  EXPECT_EQ(s.q, m.q);
  EXPECT_EQ(s.qd, m.qd);
  EXPECT_EQ(s.qdd, m.qdd);
  EXPECT_EQ(smoothed(Trajectory{}, kWidth).size(), 0);
}

}  // namespace
}  // namespace sparflow
