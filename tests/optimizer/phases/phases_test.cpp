#include "optimizer/phases/phases.h"

#include <gtest/gtest.h>

#include "models/files/machine_file.h"
#include "problems/bundled.h"

namespace sparflow {
namespace {

constexpr CylinderMode kO = CylinderMode::kRest, kE = CylinderMode::kExtend,
                       kR = CylinderMode::kRetract;

PhasePlan plan(std::initializer_list<std::initializer_list<CylinderMode>> rows,
               std::initializer_list<double> durations) {
  PhasePlan p;
  p.modes.resize(static_cast<Eigen::Index>(rows.size()),
                 static_cast<Eigen::Index>(rows.begin()->size()));
  Eigen::Index r = 0;
  for (const auto& row : rows) {
    Eigen::Index c = 0;
    for (const CylinderMode m : row) p.modes(r, c++) = m;
    ++r;
  }
  p.durations = Eigen::Map<const Eigen::VectorXd>(durations.begin(),
                                                  static_cast<Eigen::Index>(durations.size()));
  return p;
}

bool has(const std::vector<PhasePlan>& plans, const PhasePlan& wanted) {
  for (const PhasePlan& p : plans) {
    if (p.count() == wanted.count() && (p.modes.array() == wanted.modes.array()).all()) return true;
  }
  return false;
}

TEST(Phases, IntervalsOfEqualModesAreOnePhase) {
  const PhasePlan table = plan({{kE, kO}, {kE, kO}, {kE, kR}, {kO, kR}}, {0.1, 0.2, 0.3, 0.4});
  Eigen::VectorXd times(5);
  times << 0.0, 0.1, 0.3, 0.6, 1.0;
  const PhasePlan p = plan_of(table.modes, times);
  ASSERT_EQ(p.count(), 3);
  EXPECT_NEAR(p.durations[0], 0.3, 1e-15);
  EXPECT_NEAR(p.durations[2], 0.4, 1e-15);
}

TEST(Phases, OverlapsAreInsertedUnlessACylinderMovesBothWays) {
  const PhasePlan p = with_overlaps(plan({{kE, kO}, {kO, kR}, {kR, kO}}, {2.0, 1.0, 4.0}), 0.4);
  ASSERT_EQ(p.count(), 5);
  EXPECT_EQ(p.modes(1, 0), kE);
  EXPECT_EQ(p.modes(1, 1), kR);
  EXPECT_NEAR(p.durations[1], 0.4, 1e-15) << "a share of the shorter neighbour";
  EXPECT_NEAR(p.durations[0], 1.8, 1e-15);
  EXPECT_NEAR(p.total(), 7.0, 1e-14);
  EXPECT_EQ(with_overlaps(plan({{kE, kO}, {kR, kO}}, {1.0, 1.0}), 0.4).count(), 2);
  EXPECT_EQ(with_overlaps(plan({{kE, kO}, {kE, kE}}, {1.0, 1.0}), 0.4).count(), 2)
      << "the second phase contains the moves of the first";
}

TEST(Phases, ShortPhasesGiveTheirDurationToTheOthers) {
  const PhasePlan p = without_short(plan({{kE, kO}, {kE, kR}, {kE, kO}}, {1.0, 0.01, 2.0}), 0.02);
  ASSERT_EQ(p.count(), 1) << "equal neighbours are joined";
  EXPECT_NEAR(p.total(), 3.01, 1e-14);
}

TEST(Phases, NeighboursExchangeMergeAndShiftButLoseNoMove) {
  const PhasePlan from = plan({{kE, kO}, {kO, kR}}, {1.0, 3.0});
  const std::vector<PhasePlan> all = neighbours(from);
  EXPECT_TRUE(has(all, plan({{kO, kR}, {kE, kO}}, {1.0, 1.0})));
  EXPECT_TRUE(has(all, plan({{kE, kR}}, {1.0})));
  EXPECT_TRUE(has(all, plan({{kE, kR}, {kO, kR}}, {1.0, 1.0})));
  EXPECT_TRUE(has(all, plan({{kE, kO}, {kE, kR}}, {1.0, 1.0})));
  for (const PhasePlan& p : all) {
    EXPECT_TRUE((p.modes.col(0).array() == kE).any());
    EXPECT_TRUE((p.modes.col(1).array() == kR).any());
    EXPECT_NEAR(p.total(), 4.0, 1e-12);
  }
  EXPECT_FALSE(has(all, from));
}

TEST(Phases, APhaseOfAllCylindersHasNeighboursInWhichOneStartsLaterOrStopsEarlier) {
  const std::vector<PhasePlan> all = neighbours(plan({{kE, kR}}, {4.0}));
  EXPECT_EQ(all.size(), 4u);
  EXPECT_TRUE(has(all, plan({{kO, kR}, {kE, kR}}, {2.0, 2.0})));
  EXPECT_TRUE(has(all, plan({{kE, kR}, {kO, kR}}, {2.0, 2.0})));
  EXPECT_TRUE(has(all, plan({{kE, kO}, {kE, kR}}, {2.0, 2.0})));
  EXPECT_TRUE(has(all, plan({{kE, kR}, {kE, kO}}, {2.0, 2.0})));
  for (const PhasePlan& p : all) {
    EXPECT_NEAR(p.total(), 4.0, 1e-12);
    EXPECT_NEAR(p.durations[0], 2.0, 1e-12);
  }
  for (const PhasePlan& p : neighbours(plan({{kE, kO}, {kE, kR}}, {1.0, 4.0}))) {
    if (p.count() != 3) continue;
    EXPECT_NEAR(p.durations[0], 1.0, 1e-12) << "the phase that is not halved keeps its duration";
    EXPECT_NEAR(p.durations[2], 2.0, 1e-12);
  }
  // Only the longest such phase is halved.
  EXPECT_FALSE(has(neighbours(plan({{kE, kR}, {kE, kO}, {kE, kR}}, {1.0, 1.0, 4.0})),
                   plan({{kO, kR}, {kE, kR}, {kE, kO}, {kE, kR}}, {0.5, 0.5, 1.0, 4.0})));
}

TEST(Phases, PlansWithWaypointsHaveNoNeighbours) {
  PhasePlan through = plan({{kE, kO}, {kO, kR}}, {1.0, 3.0});
  ASSERT_FALSE(neighbours(through).empty());
  through.waypoint_after = {0};
  EXPECT_TRUE(neighbours(through).empty()) << "the waypoint's phase would be undefined";
}

TEST(Phases, AMeshHasAKnotAtEveryChangeAndKeepsTheShares) {
  const PhasePlan p = plan({{kE, kO}, {kO, kR}, {kE, kO}}, {1.0, 0.01, 3.0});
  const PhaseMesh mesh = mesh_of(p, 40, 5);
  EXPECT_EQ(mesh.modes.rows(), 10 + 5 + 30);
  EXPECT_NEAR(mesh.times[10], 1.0, 1e-15);
  EXPECT_NEAR(mesh.times[15], 1.01, 1e-15);
  EXPECT_EQ(mesh.of_interval[12], 1);
  EXPECT_TRUE(durations_of(mesh, mesh.times).isApprox(p.durations, 1e-12));
}

TEST(Phases, SectionsOfAMotionTakeTheirNewDurations) {
  Trajectory m;
  m.t = Eigen::VectorXd::LinSpaced(5, 0.0, 4.0);
  m.q = Eigen::VectorXd::LinSpaced(5, 0.0, 1.0);
  m.qd = Eigen::VectorXd::Constant(5, 0.25);
  m.qdd = Eigen::VectorXd::Zero(5);
  const Eigen::Vector2d from(1.0, 3.0), to(2.0, 1.5);
  const Trajectory d = with_durations(m, from, to);
  EXPECT_NEAR(d.t[1], 2.0, 1e-15);
  EXPECT_NEAR(d.t[4], 3.5, 1e-15);
  EXPECT_NEAR(d.qd(3, 0), 0.5, 1e-15);
}

TEST(Phases, TextNamesTheMovingCylinders) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  const PhasePlan p = plan({{kE, kO, kO}, {kO, kR, kE}, {kO, kO, kO}}, {1.0, 1.0, 1.0});
  EXPECT_EQ(plan_text(machine, p), "boom + | jib -, extension + | rest");
}

}  // namespace
}  // namespace sparflow
