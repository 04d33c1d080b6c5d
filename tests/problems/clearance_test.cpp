#include "problems/clearance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "models/math/error.h"
#include "tests/problems/arms.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double in(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(engine_);
  }
  Vector3d point(double size) { return {in(-size, size), in(-size, size), in(-size, size)}; }
  VectorXd configuration(const Machine& m) {
    VectorXd q(m.joint_count());
    for (int i = 0; i < q.size(); ++i) {
      const Range& r = m.joints[static_cast<std::size_t>(i)].position;
      q[i] = in(r.lo, r.hi);
    }
    return q;
  }
  /// A random box (often thin, rotated), sphere or half-space in the working area.
  Obstacle obstacle(double spread) {
    const int kind = static_cast<int>(in(0, 3));
    const Vector3d c = Vector3d(4, 0, 2) + point(spread);
    if (kind == 0) return arms::sphere("ball", c, in(0.05, 1.5));
    if (kind == 1) return arms::half_space("side", c + Vector3d(0, 0, -3), point(1));
    Box b;
    b.center = c;
    b.size = Vector3d(in(0.01, 2), in(0.01, 2), in(0.01, 2));
    b.rotation = Eigen::AngleAxisd(in(0, 3), point(1).normalized()).toRotationMatrix();
    return {"block", b};
  }

 private:
  std::mt19937 engine_;
};

MotionProblem with_obstacles(const Machine& m, std::vector<Obstacle> obstacles, double clearance) {
  MotionProblem p = arms::problem(m, VectorXd::Zero(m.joint_count()), TipGoal{});
  p.obstacles = std::move(obstacles);
  p.clearance = clearance;
  return p;
}

TEST(ObstacleDistance, SegmentsAgreeWithDenseSampling) {
  Dice dice(1);
  int inside = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Obstacle o = dice.obstacle(2.0);
    const Vector3d a = Vector3d(4, 0, 2) + dice.point(3), b = Vector3d(4, 0, 2) + dice.point(3);
    double sampled = 1e9;
    for (int i = 0; i <= 400; ++i) {
      sampled = std::min(sampled, signed_distance(o, a + (b - a) * i / 400.0));
    }
    const double exact = segment_distance(o, a, b);
    // Samples can only overestimate; a distance changes by at most half the sample spacing between two.
    EXPECT_LE(exact, sampled + 1e-9);
    EXPECT_GE(exact, sampled - (b - a).norm() / 800.0 - 1e-9);
    inside += exact < 0.0;
  }
  EXPECT_GT(inside, 200);  // both branches were reached
}

TEST(ObstacleDistance, KnownDistances) {
  const Obstacle b = arms::box("b", {0, 0, 0}, {2, 2, 2});
  EXPECT_DOUBLE_EQ(signed_distance(b, {4, 5, 0}), 5.0);  // 3-4-5 off an edge
  EXPECT_DOUBLE_EQ(signed_distance(b, {0.25, 0, 0}), -0.75);
  // a diagonal that passes the edge (1, 1) at x + y = 4: distance (4 - 2) / sqrt 2
  EXPECT_NEAR(segment_distance(b, {5, -1, 0}, {-1, 5, 0}), std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(segment_distance(b, {-5, 0.5, 0}, {5, 0.5, 0}), -0.5, 1e-8);
}

TEST(ObstacleDistance, SmoothValueNeverExceedsTheDistanceAndKeepsItsBias) {
  Dice dice(2);
  double worst_bias = 0.0;
  for (int trial = 0; trial < 100; ++trial) {
    const Obstacle o = dice.obstacle(2.0);
    const double level = dice.in(0.05, 0.4);
    const SmoothObstacle smooth(o, level);
    for (int i = 0; i < 200; ++i) {
      const Vector3d p = Vector3d(4, 0, 2) + dice.point(4);
      const double d = signed_distance(o, p);
      if (smooth.value(p) >= 0.0) {
        EXPECT_GE(d, level - 1e-12);
      } else {
        worst_bias = std::max(worst_bias, d / level - 1.0);
      }
    }
  }
  EXPECT_LT(worst_bias, 0.18);  // documented: 17 % of the level at a box's corner
}

void compare_with_differences(ClearanceModel& model, const Machine& m, Dice& dice) {
  const int n = m.joint_count();
  const int rows = model.rows();
  ASSERT_GT(rows, 3);
  const auto in_rows = static_cast<std::size_t>(rows);
  std::vector<double> g(in_rows), up(in_rows), down(in_rows), weight(in_rows);
  const std::size_t size = in_rows * static_cast<std::size_t>(n);
  std::vector<double> jac(size), jac_up(size), jac_down(size);
  for (int trial = 0; trial < 20; ++trial) {
    VectorXd q = dice.configuration(m);
    for (double& w : weight) w = dice.in(-1, 1);
    model.jacobian(q.data(), g.data(), jac.data());
    model.values(q.data(), up.data());
    for (std::size_t r = 0; r < in_rows; ++r) EXPECT_DOUBLE_EQ(g[r], up[r]);
    MatrixXd hessian = MatrixXd::Zero(n, n), numeric(n, n);
    model.add_hessian(q.data(), weight.data(), hessian.data());
    EXPECT_TRUE(hessian.isApprox(hessian.transpose(), 1e-12));
    const double step = 1e-5;
    for (int k = 0; k < n; ++k) {
      const double q_k = q[k];
      q[k] = q_k + step;
      model.jacobian(q.data(), up.data(), jac_up.data());
      q[k] = q_k - step;
      model.jacobian(q.data(), down.data(), jac_down.data());
      q[k] = q_k;
      for (int i = 0; i < n; ++i) numeric(i, k) = 0.0;
      for (std::size_t r = 0; r < in_rows; ++r) {
        const std::size_t row = r * static_cast<std::size_t>(n);
        // values up to 50 m: 1e-14 relative rounding over the step, and step^2 times third derivatives
        EXPECT_NEAR(jac[row + static_cast<std::size_t>(k)], (up[r] - down[r]) / (2 * step), 2e-6);
        for (int i = 0; i < n; ++i) {
          const std::size_t e = row + static_cast<std::size_t>(i);
          numeric(i, k) += weight[r] * (jac_up[e] - jac_down[e]) / (2 * step);
        }
      }
    }
    // fourth derivatives of exp(.../tau) at tau = 7 cm and arms of 12 m
    EXPECT_LT((hessian - numeric).cwiseAbs().maxCoeff(),
              1e-4 * (1.0 + hessian.cwiseAbs().maxCoeff()));
  }
}

TEST(Clearance, RowsDerivativesMatchFiniteDifferences) {
  Dice dice(3);
  for (const Machine& m : {arms::loader_crane(), arms::slewing_crane(), arms::two_link()}) {
    std::vector<Obstacle> obstacles;
    for (int i = 0; i < 6; ++i) obstacles.push_back(dice.obstacle(2.0));
    ClearanceModel model(with_obstacles(m, obstacles, 0.2));
    compare_with_differences(model, m, dice);
    MatrixXd postures(2, m.joint_count());
    for (int k = 0; k < 2; ++k) postures.row(k) = dice.configuration(m).transpose();
    model.use_planes(postures, 100.0);
    model.at_posture(1);
    compare_with_differences(model, m, dice);
  }
}

TEST(ObstacleDistance, PlanesTouchTheObstacleAndLieBetweenItAndTheSegment) {
  Dice dice(11);
  int outside = 0, inside = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Obstacle o = dice.obstacle(2.0);
    const Vector3d a = Vector3d(4, 0, 2) + dice.point(3), b = Vector3d(4, 0, 2) + dice.point(3);
    const HalfSpace plane = separating_plane(o, a, b);
    EXPECT_NEAR(plane.normal.norm(), 1.0, 1e-12);
    EXPECT_NEAR(signed_distance(o, plane.point), 0.0, 1e-9) << "it touches the obstacle";
    // No point of the obstacle lies in front of it.
    for (int i = 0; i < 20; ++i) {
      const Vector3d x = plane.point + dice.point(2);
      if (signed_distance(o, x) <= 0.0) {
        EXPECT_LE(plane.normal.dot(x - plane.point), 1e-9);
      }
    }
    const double exact = segment_distance(o, a, b);
    const double ends =
        std::min(plane.normal.dot(a - plane.point), plane.normal.dot(b - plane.point));
    if (exact > 1e-6) {
      ++outside;
      EXPECT_NEAR(ends, exact, 1e-7) << "its distance from the segment is the obstacle's";
    } else {
      ++inside;
      EXPECT_LE(ends, 1e-6);
    }
  }
  EXPECT_GT(outside, 500);
  EXPECT_GT(inside, 200);
}

TEST(Clearance, PlanesAreExactInTheirPostureAndImplyClearanceInOthers) {
  Dice dice(12);
  int exact_ones = 0, covered = 0;
  for (int scene = 0; scene < 400; ++scene) {
    const Machine m = scene % 2 ? arms::loader_crane() : arms::slewing_crane();
    const MotionProblem problem =
        with_obstacles(m, {dice.obstacle(3.0), dice.obstacle(3.0)}, dice.in(0.05, 0.4));
    ClearanceModel model(problem);
    MatrixXd postures(3, m.joint_count());
    for (int k = 0; k < 3; ++k) postures.row(k) = dice.configuration(m).transpose();
    model.use_planes(postures, 100.0);
    std::vector<double> g(static_cast<std::size_t>(model.rows()) + 1, 1e9);
    for (int k = 0; k < 3; ++k) {
      model.at_posture(k);
      const VectorXd own = postures.row(k);
      const double exact = model.nearest(own.data()).distance;
      model.values(own.data(), g.data());
      if (exact > -model.radius() + 1e-6) {  // outside the obstacles
        ++exact_ones;
        // An end that no joint moves has no row and may be the nearest one.
        EXPECT_GE(*std::min_element(g.begin(), g.end()), exact - 1e-7);
      }
      for (int i = 0; i < 10; ++i) {
        const VectorXd q = own + 0.05 * (dice.configuration(m) - own);
        model.values(q.data(), g.data());
        if (exact < 0.0 || *std::min_element(g.begin(), g.end()) < 0.0) continue;
        ++covered;
        EXPECT_GE(model.nearest(q.data()).distance, -1e-7);
      }
    }
  }
  EXPECT_GT(exact_ones, 300);
  EXPECT_GT(covered, 1000);
}

TEST(Clearance, NonNegativeRowsImplyExactClearance) {
  // The bound of problems/clearance.h, on random obstacles and configurations: 1e4 of them.
  Dice dice(4);
  int covered = 0, tight = 0, judged = 0;
  double widest_gap = 0.0;
  for (int scene = 0; scene < 1000; ++scene) {
    const Machine m = scene % 2 ? arms::loader_crane() : arms::slewing_crane();
    const MotionProblem problem = with_obstacles(m, {dice.obstacle(3.0)}, dice.in(0.05, 0.4));
    ClearanceModel model(problem);
    if (!model.cover_complete()) continue;
    std::vector<double> g(static_cast<std::size_t>(model.rows()) + 1, 1.0);
    for (int i = 0; i < 25; ++i) {
      const VectorXd q = dice.configuration(m);
      model.values(q.data(), g.data());
      const double exact = model.nearest(q.data()).distance;
      const bool rows_ok = *std::min_element(g.begin(), g.end()) >= 0.0;
      ++judged;
      if (rows_ok) {
        ++covered;
        EXPECT_GE(exact, -1e-9);
      } else if (exact > 0.0) {
        ++tight;
        widest_gap = std::max(widest_gap, exact);
      }
    }
  }
  EXPECT_GT(judged, 10000);
  EXPECT_GT(covered, judged / 4);
  EXPECT_LT(tight, judged / 10);  // the rows rarely exclude a clear posture
  // inflation 0.05 m plus the box's 17 % of a level of at most 0.45 m
  EXPECT_LT(widest_gap, 0.05 + 0.17 * 0.45 + 1e-3);
}

TEST(Clearance, WallBetweenTwoFreePostures) {
  const Machine m = arms::two_link();
  MotionProblem p = with_obstacles(m, {arms::box("wall", {2.5, 0, 0}, {3, 2, 0.1})}, 0.05);
  ClearanceModel model(p);
  const VectorXd low = (VectorXd(2) << -1.0, 0.0).finished();
  const VectorXd high = (VectorXd(2) << 1.0, 0.0).finished();
  EXPECT_TRUE(model.clear(low.data()));
  EXPECT_TRUE(model.clear(high.data()));
  const double share = model.clear_share(low.data(), high.data());
  EXPECT_GT(share, 0.3);
  EXPECT_LT(share, 0.5);
  EXPECT_FALSE(model.motion_clear(high.data(), low.data()));
  const VectorXd hit = VectorXd::Zero(2);
  const Nearest nearest = model.nearest(hit.data());
  EXPECT_LT(nearest.distance, 0.0);
  EXPECT_EQ(model.obstacle_name(nearest.obstacle), "wall");
  EXPECT_THAT(model.describe(nearest), testing::HasSubstr("inside wall"));
}

TEST(Clearance, ImmovableColumnAndUnreachableObstaclesHaveNoRows) {
  const Machine m = arms::slewing_crane();
  // The column stands in a platform and the far ball is out of reach (15.1 m), so neither restricts a motion.
  MotionProblem p = with_obstacles(m, {arms::sphere("far", {40, 0, 0}, 1.0)}, 0.1);
  ClearanceModel far(p);
  EXPECT_EQ(far.rows(), 0);
  p.obstacles = {arms::half_space("ground", {0, 0, 0}, {0, 0, 1})};
  ClearanceModel ground(p);
  EXPECT_TRUE(ground.cover_complete());
  EXPECT_GE(ground.rows(), 3);
  EXPECT_LE(ground.rows(), 5);
  const VectorXd up = (VectorXd(4) << 0.0, 0.5, -0.5, 1.0).finished();
  EXPECT_TRUE(ground.clear(up.data()));
}

TEST(Clearance, AColumnOnTheGroundIsNoCollision) {
  // The slewing column stands on the ground, which is also an obstacle: only moving parts are checked.
  Machine machine = arms::loader_crane();
  machine.joints[0].origin.translation() =
      Eigen::Vector3d(0.0, 0.0, 0.0);  // boom pivot at ground level
  MotionProblem problem;
  problem.machine = machine;
  problem.limits = limits_of(machine);
  problem.start = Eigen::Vector3d(0.6, -0.3, 0.5);
  problem.goal = JointGoal{problem.start};
  problem.clearance = 0.15;
  problem.obstacles.push_back({"ground", HalfSpace{{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}}});
  ClearanceModel clearance(problem);
  EXPECT_TRUE(clearance.clear(problem.start.data()));
  EXPECT_TRUE(clearance.cover_complete());
  const Eigen::Vector3d low(0.6, -2.2, 3.0);  // the jib is below the ground, which must be found
  EXPECT_FALSE(clearance.clear(low.data()));
}

}  // namespace
}  // namespace sparflow
