// Limits violated between knots: each is tightened by its own share, or intervals are split where a link touches.
#include "optimizer/phases/tightening.h"

#include <gtest/gtest.h>

#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "problems/bundled.h"
#include "problems/clearance.h"
#include "problems/problem_file.h"

namespace sparflow {
namespace {

constexpr double kExcess = 0.1;
constexpr double kTightened = 0.87;  // an excess of 0.1 is subtracted 1.3 times

/// All values of a Tightening in a fixed order.
Eigen::VectorXd values_of(const Tightening& t) {
  Eigen::VectorXd v(9);
  v << t.flow, t.valve, t.pressure, t.line, t.trust, t.clearance, t.position[0], t.position[1],
      t.position[2];
  return v;
}

class BoundTightening : public ::testing::Test {
 protected:
  BoundTightening() { tightening_.position.assign(problem_.machine.joints.size(), 0.0); }
  bool tighten_bounds(const std::string& what, double excess) {
    LimitCheck c;
    c.what = what;
    c.excess = excess;
    return tightening_.tighten_bounds(problem_, {c}, 1e-5);
  }
  /// Expects that only one value is tightened.
  void expect_only(const std::string& what, int index, double wanted) {
    tightening_ = Tightening{};
    tightening_.position.assign(problem_.machine.joints.size(), 0.0);
    tightening_.limit_pressure = true;
    Eigen::VectorXd expected = values_of(tightening_);
    expected[index] = wanted;
    EXPECT_TRUE(tighten_bounds(what, kExcess)) << what;
    EXPECT_TRUE(values_of(tightening_).isApprox(expected, 1e-12))
        << what << ": " << values_of(tightening_).transpose();
  }
  MotionProblem problem_ = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  Tightening tightening_;
};

TEST_F(BoundTightening, EachLimitHasItsOwnShare) {
  expect_only("flow of pump main", 0, kTightened);
  expect_only("flow through valve jib", 1, kTightened);
  expect_only("pressure of pump main", 2, kTightened);
  expect_only("distance of the tip from its line", 3, kTightened);
  expect_only("standard deviation of the pressure of boom", 4, kTightened);
  expect_only("clearance beyond the required distance", 5, 0.13);
  const Range& jib = problem_.limits.position[1];
  expect_only("position of joint jib", 7, 0.13 * (jib.hi - jib.lo));
}

TEST_F(BoundTightening, RowsOfThePumpsPressureAreAddedFirst) {
  EXPECT_TRUE(tighten_bounds("pressure of pump main", kExcess));
  EXPECT_TRUE(tightening_.limit_pressure);
  EXPECT_EQ(tightening_.pressure, 1.0) << "a limit without rows is not tightened";
  EXPECT_TRUE(tighten_bounds("pressure of pump main", kExcess));
  EXPECT_NEAR(tightening_.pressure, kTightened, 1e-12);
}

TEST_F(BoundTightening, RepeatedTighteningAddsUpAndKeptLimitsAreUnchanged) {
  EXPECT_FALSE(tighten_bounds("flow of pump main", 1e-6)) << "within the tolerance";
  EXPECT_EQ(tightening_.flow, 1.0);
  EXPECT_TRUE(tighten_bounds("flow of pump main", kExcess));
  EXPECT_TRUE(tighten_bounds("flow of pump main", kExcess));
  EXPECT_NEAR(tightening_.flow, kTightened * kTightened, 1e-12);
}

/// The boom turns for three seconds with a knot in each; half-way between the second and the third knot the tip meets a ball.
class TouchBetweenKnots : public ::testing::Test {
 protected:
  static constexpr double kSpeed =
      0.3;  // [rad/s] some two metres of the tip's travel in an interval
  static constexpr double kBall = 0.05;  // [m]

  TouchBetweenKnots() {
    const Eigen::Index joints = problem_.start.size();
    problem_.clearance = 0.0;
    motion_.t = Eigen::VectorXd::LinSpaced(4, 0.0, 3.0);
    motion_.q = problem_.start.transpose().replicate(4, 1);
    motion_.q.col(0) += kSpeed * motion_.t;
    motion_.qd = motion_.qdd = Eigen::MatrixXd::Zero(4, joints);
    motion_.qd.col(0).setConstant(kSpeed);
    mesh_.times = motion_.t;
    mesh_.of_interval = {0, 0, 1};
    mesh_.modes = ModeTable::Constant(3, joints, CylinderMode::kRest);
    mesh_.modes(1, 0) = CylinderMode::kExtend;
    mesh_.modes(2, 1) = CylinderMode::kRetract;
    mesh_.waypoint_knots = {1, 2};
  }

  /// Puts a ball slightly further from the boom's pin than the tip, which enters it at 1.5 s by a depth [m].
  void place_ball(double deep) {
    Eigen::VectorXd q = motion_.q.row(1);
    q[0] += 0.5 * kSpeed;
    const Eigen::Vector3d tip = tip_position<double>(problem_.machine, q);
    const Eigen::Vector3d out =
        (tip - problem_.machine.joints[0].origin.translation()).normalized();
    const double radius = ClearanceModel(problem_).radius();
    problem_.obstacles = {{"ball", Sphere{tip + (radius + kBall - deep) * out, kBall}}};
    ASSERT_NEAR(ClearanceModel(problem_).nearest(q.data()).distance, -deep, 1e-4);
  }

  MotionProblem problem_ = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  Trajectory motion_;
  PhaseMesh mesh_;
};

TEST_F(TouchBetweenKnots, SplitsThatIntervalInFour) {
  place_ball(0.05);
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Eigen::VectorXd q = motion_.q.row(k);
    ASSERT_TRUE(ClearanceModel(problem_).clear(q.data())) << "violated at knot " << k;
  }
  ASSERT_TRUE(split_where_it_touches(problem_, motion_, 16, 100, mesh_));
  const Eigen::VectorXd times = (Eigen::VectorXd(7) << 0, 1, 1.25, 1.5, 1.75, 2, 3).finished();
  ASSERT_EQ(mesh_.times.size(), times.size());
  EXPECT_TRUE(mesh_.times.isApprox(times, 1e-12)) << mesh_.times.transpose();
  EXPECT_EQ(mesh_.of_interval, (std::vector<int>{0, 0, 0, 0, 0, 1}));
  EXPECT_EQ(mesh_.waypoint_knots, (std::vector<int>{1, 5})) << "at the same instants as before";
  ASSERT_EQ(mesh_.modes.rows(), 6);
  EXPECT_EQ(mesh_.modes(0, 0), CylinderMode::kRest);
  for (Eigen::Index k = 1; k < 5; ++k) EXPECT_EQ(mesh_.modes(k, 0), CylinderMode::kExtend) << k;
  EXPECT_EQ(mesh_.modes(5, 1), CylinderMode::kRetract);
}

TEST_F(TouchBetweenKnots, LeavesTheMeshWhereTighteningIsEnoughOrItIsFull) {
  place_ball(0.003);
  EXPECT_FALSE(split_where_it_touches(problem_, motion_, 16, 100, mesh_))
      << "a depth of three millimetres is left to tightening";
  place_ball(0.05);
  EXPECT_FALSE(split_where_it_touches(problem_, motion_, 16, 3, mesh_)) << "the mesh is full";
  problem_.obstacles.clear();
  EXPECT_FALSE(split_where_it_touches(problem_, motion_, 16, 100, mesh_)) << "there is no obstacle";
  EXPECT_EQ(mesh_.times.size(), 4);
}

}  // namespace
}  // namespace sparflow
