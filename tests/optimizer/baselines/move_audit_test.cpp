// The audit of a move: an optimum saves nothing, an uneven pace and a detour cost what their parts say.
#include "optimizer/baselines/move_audit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/files/model_file.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

VectorXd posture(double boom, double jib, double extension) {
  VectorXd q(3);
  q << boom, jib, extension;
  return q;
}

struct Audited {
  MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  CraneModel model = load_model(bundled_file("models/loader_crane.json"));
  MoveAuditOptions options;

  Audited() {
    options.optimize.intervals = 60;
    options.optimize.processes = 1;
    options.seeds = [](const MotionProblem& p) {
      std::vector<SeedMotion> seeds;
      if (const auto* goal = std::get_if<JointGoal>(&p.goal)) {
        Eigen::MatrixXd line(2, p.start.size());
        line << p.start.transpose(), goal->q.transpose();
        const TimedMotion timed = time_parametrise(p, line, 0.0);
        seeds.push_back({"line", timed.motion, timed.shortest, true});
      }
      return seeds;
    };
  }
  /// The path through these postures in a given time.
  Trajectory path(const std::vector<VectorXd>& through, double seconds) const {
    Eigen::MatrixXd rows(static_cast<Index>(through.size()), 3);
    for (std::size_t i = 0; i < through.size(); ++i)
      rows.row(static_cast<Index>(i)) = through[i].transpose();
    return time_parametrise(problem, rows, seconds).motion;
  }
  MoveAudit audit(const Trajectory& recorded) const {
    return audit_move(model, recorded, 500.0, options);
  }
};

const VectorXd kFrom = posture(0.2, -1.6, 0.8), kTo = posture(0.5, -1.0, 1.2);

TEST(MoveAudit, PartsAddUpToTheSavingOfADetour) {
  const Audited a;
  const MoveAudit line = a.audit(a.path({kFrom, kTo}, 14.0)),
                  detour = a.audit(a.path({kFrom, posture(0.7, -1.4, 0.8), kTo}, 14.0));
  ASSERT_TRUE(line.judged()) << line.not_judged;
  ASSERT_TRUE(detour.judged()) << detour.not_judged;
  // both have the same optimum, whose solve ends within half a percent of another start's
  EXPECT_NEAR(line.optimum.total, detour.optimum.total, 5e-3 * line.optimum.total);
  EXPECT_GE(line.saving(), 0.0);
  EXPECT_GT(detour.saving(), line.saving() + 5e3) << "the boom is lifted 0.2 rad and lowered again";
  EXPECT_NEAR(detour.by_pace + detour.by_way, detour.saving(), 1e-6 * detour.saving());
  EXPECT_LT(detour.by_pace, 0.2 * detour.saving()) << "it was driven at an even pace";
  EXPECT_GT(detour.saving_std(), 0.0);
}

TEST(MoveAudit, AnOptimumSavesNothing) {
  const Audited a;
  const MoveAudit first = a.audit(a.path({kFrom, kTo}, 14.0));
  ASSERT_TRUE(first.judged()) << first.not_judged;
  const MoveAudit again = a.audit(first.best);
  ASSERT_TRUE(again.judged()) << again.not_judged;
  EXPECT_NEAR(again.recorded.total, first.optimum.total, 1e-3 * first.optimum.total);
  EXPECT_NEAR(again.saving(), 0.0, 5e-3 * first.optimum.total);
}

TEST(MoveAudit, AHurryInTheMiddleIsPace) {
  const Audited a;
  // the same line, 4 s of which are driven in the quickest way and the rest of the time hardly at all
  Trajectory even = a.path({kFrom, kTo}, 14.0), quick = a.path({kFrom, kTo}, 6.0);
  Trajectory waiting = quick;
  waiting.t.conservativeResize(quick.size() + 1);
  waiting.t[quick.size()] = 14.0;
  for (auto* rows : {&waiting.q, &waiting.qd, &waiting.qdd}) {
    rows->conservativeResize(quick.size() + 1, Eigen::NoChange);
    rows->row(quick.size()) = rows->row(quick.size() - 1);
  }
  waiting.qdd.bottomRows(2).setZero();
  const MoveAudit hurried = a.audit(waiting);
  ASSERT_TRUE(hurried.judged()) << hurried.not_judged;
  EXPECT_GT(hurried.by_pace, 0.0);
  const double slower = exact_total_energy(a.model, even, 500.0);
  EXPECT_NEAR(hurried.by_pace, hurried.recorded.total - slower, 0.02 * slower);
}

/// A search that may neither try sequences nor the grid, and whose only seed is a bad one: a detour.
MoveAuditOptions hardly_searching(const Audited& a) {
  MoveAuditOptions poor = a.options;
  poor.optimize.sequential_starts = poor.optimize.grid_starts = poor.optimize.sequence_rounds = 0;
  poor.optimize.smooth_starts = 0;
  poor.optimize.phase_iterations = 1;
  poor.seeds = [&a](const MotionProblem&) {
    const Trajectory detour = a.path({kFrom, posture(0.7, -1.4, 0.8), kTo}, 14.0);
    return std::vector<SeedMotion>{{"detour", detour, detour.duration(), false}};
  };
  return poor;
}

TEST(MoveAudit, TheOptimumIsNeverDearerThanARecordedMotionWithinTheLimits) {
  const Audited a;
  const MoveAuditOptions poor = hardly_searching(a);
  // what a good search finds is recorded, and the poor search finds nothing as cheap by itself
  const MoveAudit good = a.audit(a.path({kFrom, kTo}, 14.0));
  ASSERT_TRUE(good.judged()) << good.not_judged;
  const OptimizeResult alone =
      optimize(a.model, good.problem, poor.seeds(good.problem), poor.optimize);
  ASSERT_GT(alone.energy.total, 1.02 * good.optimum.total) << "the search is no poor one";
  const MoveAudit m = audit_move(a.model, good.best, 500.0, poor);
  ASSERT_TRUE(m.judged()) << m.not_judged;
  EXPECT_LE(m.optimum.total, m.recorded.total);
  EXPECT_NEAR(m.by_pace + m.by_way, m.saving(), 1e-9 * m.recorded.total);
}

TEST(MoveAudit, ACheaperRecordingThatBreaksALimitIsNotJudged) {
  Audited a;
  const MoveAudit good = a.audit(a.path({kFrom, kTo}, 14.0));
  ASSERT_TRUE(good.judged()) << good.not_judged;
  // in this machine file the pump gives half of what the recording took, and the search finds a slower detour at most
  a.model.machine.pumps[0].max_flow = 0.5 * pumps_along(a.model, good.best, 500.0).flow.maxCoeff();
  const MoveAudit m = audit_move(a.model, good.best, 500.0, hardly_searching(a));
  EXPECT_FALSE(m.judged());
  EXPECT_FALSE(m.not_judged.empty());
}

TEST(MoveAudit, WhatTheModelHasNotLearnedIsNotJudged) {
  Audited a;
  a.options.most_outside = -1.0;
  const MoveAudit m = a.audit(a.path({kFrom, kTo}, 14.0));
  EXPECT_FALSE(m.judged());
  EXPECT_THAT(m.not_judged, HasSubstr("outside the flows and forces"));
}

TEST(MoveAudit, AMoveQuickerThanTheLimitsIsNotJudged) {
  const Audited a;
  Trajectory quick = a.path({kFrom, kTo}, 14.0);
  quick = with_duration(quick, 1.0);
  const MoveAudit m = a.audit(quick);
  EXPECT_FALSE(m.judged());
  EXPECT_FALSE(m.not_judged.empty());
}

}  // namespace
}  // namespace sparflow
