#include "identification/log/segments.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

#include "identification/signals/smoothing.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

constexpr double kStep = 0.02;

Eigen::VectorXd clock_of(Eigen::Index n) {
  return Eigen::VectorXd::LinSpaced(n, 0.0, kStep * static_cast<double>(n - 1));
}

/// 400 samples, two cylinders: the first extends over 100..200, the second retracts over 150..300.
Eigen::MatrixXd two_motions() {
  Eigen::MatrixXd v = Eigen::MatrixXd::Constant(400, 2, 1e-3);  // noise below the threshold
  v.col(0).segment(100, 100).setConstant(0.05);
  v.col(1).segment(150, 150).setConstant(-0.02);
  return v;
}

TEST(Segments, MotionAndRestAlternate) {
  const auto segments = find_segments(clock_of(400), two_motions(), {}, {{0, 400}});
  ASSERT_EQ(segments.size(), 3u);
  EXPECT_FALSE(segments[0].moving);
  EXPECT_TRUE(segments[1].moving);
  EXPECT_FALSE(segments[2].moving);
  EXPECT_EQ(segments[1].samples.begin, 100);
  EXPECT_EQ(segments[1].samples.end, 300);
  EXPECT_DOUBLE_EQ(segments[1].cylinders[0].extends, 0.5);
  EXPECT_DOUBLE_EQ(segments[1].cylinders[0].retracts, 0.0);
  EXPECT_DOUBLE_EQ(segments[1].cylinders[1].retracts, 0.75);
  EXPECT_FALSE(segments[0].cylinders[0].moves());
}

TEST(Segments, ThresholdIsTwoMillimetresASecond) {
  Eigen::MatrixXd v(4, 1);
  v << 0.0019, 0.0021, -0.0021, NAN;
  EXPECT_EQ(motion_directions(v, {}), (Eigen::MatrixXi(4, 1) << 0, 1, -1, 0).finished());
}

TEST(Segments, WithZeroOrMissingCommandACylinderRests) {
  const Eigen::MatrixXd v = Eigen::MatrixXd::Constant(4, 2, 0.1);
  Eigen::MatrixXd u(4, 2);
  u.col(0) << 0.3, 0.0, NAN, -0.2;  // the direction is the motion's, not the command's
  u.col(1).setConstant(NAN);        // not logged
  EXPECT_EQ(motion_directions(v, u), (Eigen::MatrixXi(4, 2) << 1, 1, 0, 1, 0, 1, 1, 1).finished());
}

TEST(Segments, APauseEndsAMotionAndAReversalDoesNot) {
  Eigen::MatrixXd v = Eigen::MatrixXd::Constant(300, 1, 0.05);
  v.col(0).segment(100, 9).setZero();   // 0.18 s
  v.col(0).segment(200, 10).setZero();  // 0.2 s
  v.col(0).tail(90).setConstant(-0.05);
  const auto segments = find_segments(clock_of(300), v, {}, {{0, 300}});
  ASSERT_EQ(segments.size(), 3u);
  EXPECT_EQ(segments[0].samples.end, 200);
  EXPECT_EQ(segments[2].samples.begin, 210);
  EXPECT_DOUBLE_EQ(segments[2].cylinders[0].retracts, 1.0);
}

TEST(Segments, AVeryShortMotionIsRest) {
  Eigen::MatrixXd v = Eigen::MatrixXd::Zero(100, 1);
  v.col(0).segment(50, 4).setConstant(0.003);
  const auto segments = find_segments(clock_of(100), v, {}, {{0, 100}});
  ASSERT_EQ(segments.size(), 1u);
  EXPECT_FALSE(segments[0].moving);
}

TEST(Segments, NeverCrossAGapAndCoverEverySample) {
  Eigen::MatrixXd v = Eigen::MatrixXd::Constant(200, 1, 0.05);
  const std::vector<SampleRange> runs = {{0, 70}, {70, 75}, {75, 200}};
  Eigen::VectorXd time = clock_of(200);
  time.tail(130).array() += 1.0;
  time.tail(125).array() += 1.0;
  const auto segments = find_segments(time, v, {}, runs);
  ASSERT_EQ(segments.size(), 3u);
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    EXPECT_EQ(segments[i].samples.begin, next);
    EXPECT_EQ(segments[i].run, static_cast<int>(i));
    next = segments[i].samples.end;
  }
  EXPECT_EQ(next, 200);
}

TEST(Segments, WithoutSamplesOrCylindersNothingMoves) {
  EXPECT_TRUE(find_segments({}, Eigen::MatrixXd(0, 2), {}, {}).empty());
  const auto segments = find_segments(clock_of(10), Eigen::MatrixXd(10, 0), {}, {{0, 10}});
  ASSERT_EQ(segments.size(), 1u);
  EXPECT_FALSE(segments[0].moving);
}

TEST(Segments, OfARealLogContainTheTestedCylinder) {
  const std::string path = test::shared_file("hmf_2020_k4/MainSTDTest1_270325.csv");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "real logs are not here";
  const Log log = load_log(path, test::real_crane());
  const SavitzkyGolay filter = make_filter(log);
  Eigen::MatrixXd velocity = log.matrix(Role::kStroke, 2);
  for (int c = 0; c < 2; ++c) velocity.col(c) = filter.apply(Eigen::VectorXd(velocity.col(c)), 1);
  const auto segments = find_segments(log.time, velocity, log.matrix(Role::kCommand, 2), log.runs);
  double main_moves = 0.0, jib_moves = 0.0;
  for (const Segment& s : segments) {
    const auto n = static_cast<double>(s.samples.size());
    main_moves += n * (s.cylinders[0].extends + s.cylinders[0].retracts);
    jib_moves += n * (s.cylinders[1].extends + s.cylinders[1].retracts);
  }
  EXPECT_GT(main_moves, 500.0);  // the main cylinder is the one under test
  EXPECT_EQ(jib_moves, 0.0);
}

}  // namespace
}  // namespace sparflow
