// The tip line of best redundancy: its geometry, its sum against the exact law, a known optimum, refusals.
#include "optimizer/baselines/path_redundancy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/machine/kinematics.h"
#include "optimizer/baselines/baselines.h"
#include "optimizer/baselines/self_motion.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;

struct LineCase {
  explicit LineCase(const std::string& name = "loader_crane_lift.yaml")
      : problem(load_problem(bundled_file("reaches/" + name))),
        model(test_support::synthetic_model(problem.machine)) {}
  Eigen::Vector3d goal() const { return std::get<TipGoal>(problem.goal).tip; }
  Trajectory pseudo_inverse(double duration) const {
    double share = 0.0;
    const Eigen::MatrixXd path = pseudo_inverse_line(model.machine, problem, goal(), &share);
    EXPECT_EQ(share, 1.0);
    const TimedMotion timed = time_parametrise(problem, path, duration);
    EXPECT_EQ(timed.status, TimingStatus::kOk) << timed.message;
    return timed.motion;
  }
  MotionProblem problem;
  CraneModel model;
};

double largest_distance_from_line(const LineCase& c, const Trajectory& motion) {
  const Eigen::Vector3d from = tip_position<double>(c.problem.machine, c.problem.start);
  const Eigen::Vector3d along = (c.goal() - from).normalized();
  const Trajectory fine = motion.refined(8);
  double largest = 0.0;
  for (Eigen::Index k = 0; k < fine.size(); ++k) {
    const VectorXd q = fine.q.row(k).transpose();
    Eigen::Vector3d off = tip_position<double>(c.problem.machine, q) - from;
    off -= along * along.dot(off);
    largest = std::max(largest, off.norm());
  }
  return largest;
}

TEST(PathRedundancy, TipStaysOnItsLineAndLimitsHold) {
  const LineCase c;
  const PathRedundancy r = best_redundancy_line(c.model, c.problem, 16.0, {});
  ASSERT_TRUE(r.found()) << r.why;
  EXPECT_NEAR(r.motion.duration(), 16.0, 1e-12);
  EXPECT_LE(worst_excess(check_limits(c.model, c.problem, r.motion, 16)), 1e-5);
  // Control points are on the line; between two of them the tip deviates from the chord by at most angle^2 r / 8 and
  // angle * extension / 4, with the largest steps of an interval of 0.16 s. Twice that allows for the rounded corners.
  const double h = 0.16;
  const double angle = h * (r.motion.qd.col(0) + r.motion.qd.col(1)).cwiseAbs().maxCoeff(),
               jib = h * r.motion.qd.col(1).cwiseAbs().maxCoeff(),
               extension = h * r.motion.qd.col(2).cwiseAbs().maxCoeff(), radius = 12.5;
  const double bulge =
      std::max(angle, jib) * std::max(angle, jib) * radius / 8 + angle * extension / 4;
  EXPECT_LT(largest_distance_from_line(c, r.motion), 2.0 * bulge);
  EXPECT_LT(bulge, 2e-3);
}

TEST(PathRedundancy, NeverCostsMoreThanThePseudoInverse) {
  for (const auto& [name, duration] : {std::pair{"loader_crane_lift.yaml", 16.0},
                                       {"loader_crane_unfold.yaml", 20.0},
                                       {"loader_crane_lower.yaml", 18.0},
                                       {"swing_crane_far.yaml", 24.0}}) {
    const LineCase c(name);
    const Trajectory line = c.pseudo_inverse(duration);
    ASSERT_LE(worst_excess(check_limits(c.model, c.problem, line)), 1e-5) << name;
    const double least_motion = exact_total_energy(c.model, line, c.problem.payload);
    const PathRedundancy r = best_redundancy_line(c.model, c.problem, duration, line);
    ASSERT_TRUE(r.found()) << name << ": " << r.why;
    EXPECT_LE(r.energy.total, least_motion) << name;
    EXPECT_GT(r.grids, 0) << name << ": the grid itself found nothing better";
    // The integral is summed from powers at 100 knots and at 1600 midpoints. The sums differ where a cylinder starts or
    // stops within an interval: ten such among 100 intervals, half counted, each at most a fifth of the power.
    EXPECT_NEAR(r.summed_J, r.energy.total, 0.01 * r.energy.total) << name;
  }
}

TEST(PathRedundancy, FinerGridsChangeLittle) {
  const LineCase c;
  PathRedundancyOptions fine;
  fine.intervals = 200;
  fine.energy_change = 0.0;
  fine.most_grids = 7;
  const Trajectory line = c.pseudo_inverse(16.0);
  const PathRedundancy coarse = best_redundancy_line(c.model, c.problem, 16.0, line),
                       best = best_redundancy_line(c.model, c.problem, 16.0, line, fine);
  ASSERT_TRUE(coarse.found() && best.found());
  // Refinement ends at changes of 0.5 %; all finer grids together are allowed twice that.
  EXPECT_NEAR(coarse.energy.total, best.energy.total, 0.01 * best.energy.total);
}

TEST(PathRedundancy, TelescopeAloneWhereEveryOtherCylinderWouldRaiseThePressure) {
  LineCase c;
  c.problem.start << 0.5, -0.9, 0.8;
  VectorXd end = c.problem.start;
  end[2] = 3.0;
  c.problem.goal = TipGoal{tip_position<double>(c.problem.machine, end)};
  // Each of the other two would raise the pump pressure by 150 bar as soon as it moves.
  c.model.cylinders[0].margin = c.model.cylinders[1].margin = 150e5;
  c.problem.limits.pump_max_pressure.assign(1, 600e5);
  const Trajectory line = c.pseudo_inverse(20.0);
  const PathRedundancy r = best_redundancy_line(c.model, c.problem, 20.0, line);
  ASSERT_TRUE(r.found()) << r.why;
  for (Eigen::Index j = 0; j < 2; ++j) {
    // Newton's residual is removed from each step, so a joint at rest stays there; 1e-8 rad covers the sum of 100 steps.
    EXPECT_LT((r.motion.q.col(j).array() - c.problem.start[j]).abs().maxCoeff(), 1e-8);
    EXPECT_LT(r.motion.qd.col(j).cwiseAbs().maxCoeff(), 1e-9);
  }
  // one cylinder moves, but for the instants at both ends in which its flow is below its valve's least one
  EXPECT_NEAR(r.energy.share_moving[0] + r.energy.share_moving[1], 1.0, 1e-9);
  EXPECT_GT(r.energy.share_moving[1], 0.97);
  EXPECT_LT(r.energy.total, 0.8 * exact_total_energy(c.model, line, c.problem.payload));
}

TEST(PathRedundancy, RefusesMachinesWithoutASingleRedundantJoint) {
  const LineCase two_joints("hmf_lift.yaml");
  EXPECT_THAT(path_redundancy_refusal(two_joints.problem),
              HasSubstr("2 joints move the tip in 2 directions"));
  const PathRedundancy r = best_redundancy_line(two_joints.model, two_joints.problem, 25.0, {});
  EXPECT_FALSE(r.found());
  EXPECT_THAT(r.why, HasSubstr("needs exactly one"));
  const BaselineSet set(two_joints.model, two_joints.problem, {});
  EXPECT_THAT(set.at(kBestTipLine, 25.0).why, HasSubstr("needs exactly one"));
  EXPECT_EQ(set.shortest(kBestTipLine), 0.0);
  LineCase posture;
  posture.problem.goal = JointGoal{posture.problem.start};
  EXPECT_THAT(path_redundancy_refusal(posture.problem), HasSubstr("posture"));
  EXPECT_EQ(path_redundancy_refusal(LineCase().problem), "");
}

TEST(PathRedundancy, IsAsFastAsThePseudoInverse) {
  const LineCase c;
  BaselineOptions options;
  options.polished_orders = 0;
  const BaselineSet set(c.model, c.problem, {}, options);
  EXPECT_LE(set.shortest(kBestTipLine), set.shortest(kTipLine));
  const double duration = set.shortest(kTipLine);
  EXPECT_LE(set.at(kBestTipLine, duration).energy.total,
            set.at(kTipLine, duration).energy.total * (1 + 1e-12));
}

TEST(PathRedundancy, SaysHowFarItGetsInTooShortADuration) {
  const LineCase c;
  const PathRedundancy r = best_redundancy_line(c.model, c.problem, 3.0, {});
  EXPECT_FALSE(r.found());
  EXPECT_THAT(r.why, HasSubstr("the tip's line ends after"));
}

TEST(SelfMotion, SamplesKeepTheTipAndOneJointOfEachIsOnTheGrid) {
  for (const char* name : {"loader_crane_lift.yaml", "swing_crane_far.yaml"}) {
    const LineCase c(name);
    SelfMotion postures(c.problem);
    ASSERT_EQ(postures.redundancy(), 1);
    const Eigen::Vector3d tip = tip_position<double>(c.problem.machine, c.problem.start);
    const VectorXd from = postures.scaled(c.problem.start);
    std::vector<VectorXd> samples;
    postures.trace(tip, from, 0.5, 1e3, samples);
    EXPECT_GT(samples.size(), 10U) << name;
    for (const VectorXd& z : samples) {
      ASSERT_TRUE(postures.within_range(z)) << name;
      // Newton's method stops at 1e-11 m
      EXPECT_LT((tip_position<double>(c.problem.machine, postures.joints(z)) - tip).norm(), 1e-9);
      bool on_grid = false;
      for (Eigen::Index j = 0; j < z.size(); ++j) {
        const double cell = std::round((z[j] - from[j]) / 0.5);
        const Range& r = c.problem.limits.position[static_cast<std::size_t>(j)];
        on_grid = on_grid || z[j] == from[j] + 0.5 * cell || z[j] == r.lo / postures.scale()[j] ||
                  z[j] == r.hi / postures.scale()[j];
      }
      EXPECT_TRUE(on_grid) << name;
    }
  }
}

}  // namespace
}  // namespace sparflow
