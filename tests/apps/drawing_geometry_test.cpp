#include "apps/report/charts/drawing_geometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "tests/models/test_machines.h"

namespace sparflow {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Positions are sums of a few rotations of points some ten metres away; 1e-12 m is a thousand rounding errors.
constexpr double kGeometryRounding = 1e-12;

std::vector<MachinePart> of_kind(const std::vector<MachinePart>& parts, PartKind kind) {
  std::vector<MachinePart> found;
  for (const MachinePart& part : parts) {
    if (part.kind == kind) found.push_back(part);
  }
  return found;
}

double length(const MachinePart& part) { return (part.points[1] - part.points[0]).norm(); }

TEST(DrawingGeometry, KindsAndTheirOrderDoNotDependOnTheConfiguration) {
  test_support::Random random(5);
  for (const Machine& machine : test_support::all_test_machines()) {
    const auto first = machine_parts(machine, test_support::random_configuration(machine, random));
    for (int i = 0; i < 5; ++i) {
      // Over twice the range, where some four-bars do not close.
      const VectorXd q = 2.0 * test_support::random_configuration(machine, random);
      const auto parts = machine_parts(machine, q);
      ASSERT_EQ(parts.size(), first.size()) << machine.name;
      for (std::size_t k = 0; k < parts.size(); ++k) EXPECT_EQ(parts[k].kind, first[k].kind);
    }
  }
}

TEST(DrawingGeometry, RodsAreAsLongAsTheCylinderAndBarsKeepTheirLength) {
  test_support::Random random(6);
  for (const Machine& machine : test_support::all_test_machines()) {
    for (int i = 0; i < 5; ++i) {
      const VectorXd q = test_support::random_configuration(machine, random);
      const auto parts = machine_parts(machine, q);
      const auto rods = of_kind(parts, PartKind::kRod), barrels = of_kind(parts, PartKind::kBarrel);
      const auto rockers = of_kind(parts, PartKind::kRocker);
      const auto couplers = of_kind(parts, PartKind::kCoupler);
      std::size_t drawn = 0, bars = 0;
      for (int c = 0; c < machine.cylinder_count(); ++c) {
        const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(c)];
        const auto* four_bar = std::get_if<FourBarLinkage>(&cylinder.linkage);
        if (four_bar == nullptr && !std::holds_alternative<PinsLinkage>(cylinder.linkage)) continue;
        EXPECT_NEAR(length(rods[drawn]), cylinder_length(machine, c, q[cylinder.joint]),
                    kGeometryRounding);
        EXPECT_LE(length(barrels[drawn]), length(rods[drawn]) + kGeometryRounding);
        EXPECT_NEAR((rods[drawn].points[0] - barrels[drawn].points[0]).norm(), 0.0,
                    kGeometryRounding);
        ++drawn;
        if (four_bar == nullptr) continue;
        EXPECT_NEAR(length(rockers[bars]), four_bar->rocker_length, kGeometryRounding);
        // The coupler of a random machine may lie a little outside the plane of the four-bar.
        if (machine.name.rfind("random", 0) != 0) {
          EXPECT_NEAR(length(couplers[bars]), four_bar->coupler_length, kGeometryRounding);
        }
        ++bars;
      }
      EXPECT_EQ(rods.size(), drawn);
      EXPECT_EQ(rockers.size(), bars);
    }
  }
}

TEST(DrawingGeometry, PlanarCraneIsDrawnInBaseCoordinates) {
  const Machine machine = test_support::loader_crane();
  const Vector3d q(0.4, -0.9, 2.0);
  const DrawingPlane plane = drawing_plane(machine, q);
  EXPECT_FALSE(plane.turns);
  EXPECT_EQ(plane.horizontal_name, "x");
  EXPECT_EQ(plane.vertical_name, "z");
  const Vector3d tip = tip_position<double>(machine, q);
  const DrawingFrame frame = drawing_frame(machine, q, 1.5);
  EXPECT_EQ(frame.time, 1.5);
  EXPECT_NEAR((frame.tip - Vector2d(tip.x(), tip.z())).norm(), 0.0, kGeometryRounding);
  // Closed form of two booms and the telescope.
  const Vector2d expected = Vector2d(0, 2) + 3.4 * Vector2d(std::cos(0.4), std::sin(0.4)) +
                            5.0 * Vector2d(std::cos(-0.5), std::sin(-0.5));
  EXPECT_NEAR((frame.tip - expected).norm(), 0.0, kGeometryRounding);
}

TEST(DrawingGeometry, TelescopeStagesFollowOneAnotherToTheTip) {
  const Machine machine = test_support::loader_crane();
  const auto stages =
      of_kind(machine_parts(machine, Vector3d(0.4, -0.9, 2.0)), PartKind::kTelescope);
  ASSERT_EQ(stages.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(length(stages[i]), 0.5, kGeometryRounding);  // a quarter of 2 m
    if (i == 0) continue;
    EXPECT_NEAR((stages[i].points[0] - stages[i - 1].points[1]).norm(), 0.0, kGeometryRounding);
  }
  EXPECT_NEAR(
      (stages[3].points[1] - tip_position<double>(machine, VectorXd(Vector3d(0.4, -0.9, 2.0))))
          .norm(),
      0.0, kGeometryRounding);
}

/// The plane turns with the swinging arm, so that the drawing stays the same on level ground.
TEST(DrawingGeometry, SwingCraneIsDrawnByRadiusAndHeight) {
  Machine machine = test_support::swing_crane();
  machine.joints[0].origin.linear().setIdentity();
  VectorXd q(4);
  q << 0.0, 0.6, -0.8, 1.2;
  EXPECT_TRUE(drawing_plane(machine, q).turns);
  EXPECT_EQ(drawing_plane(machine, q).horizontal_name, "radius");
  const DrawingFrame ahead = drawing_frame(machine, q);
  EXPECT_GT(ahead.tip.x(), 0.0);
  for (const double swing : {-1.9, -0.7, 1.6}) {
    q[0] = swing;
    const DrawingFrame turned = drawing_frame(machine, q);
    for (std::size_t k = 0; k < ahead.parts.size(); ++k) {
      for (std::size_t i = 0; i < ahead.parts[k].points.size(); ++i) {
        EXPECT_NEAR((turned.parts[k].points[i] - ahead.parts[k].points[i]).norm(), 0.0,
                    kGeometryRounding);
      }
    }
  }
}

TEST(DrawingGeometry, PlaneIsUprightAndOrthonormalForAnyMachine) {
  test_support::Random random(8);
  for (const Machine& machine : test_support::all_test_machines()) {
    const DrawingPlane plane =
        drawing_plane(machine, test_support::random_configuration(machine, random));
    EXPECT_NEAR(plane.horizontal.norm(), 1.0, kGeometryRounding) << machine.name;
    EXPECT_NEAR(plane.horizontal.dot(plane.up), 0.0, kGeometryRounding) << machine.name;
    EXPECT_NEAR(plane.up.dot(machine.gravity), -machine.gravity.norm(), 1e-9) << machine.name;
  }
}

TEST(DrawingGeometry, DrawsTheOtherPartsWhereAFourBarDoesNotClose) {
  const Machine machine = test_support::knuckle_crane();
  // At 1.76 rad the jib's coupler pin is 0.11 m from the rocker pin; the bars of 0.49 m and 0.22 m need 0.27 m.
  const auto parts = machine_parts(machine, Eigen::Vector2d(0.2, 1.76));
  for (const PartKind kind :
       {PartKind::kRocker, PartKind::kCoupler, PartKind::kRod, PartKind::kBarrel}) {
    const auto both = of_kind(parts, kind);
    ASSERT_EQ(both.size(), 2u);
    EXPECT_EQ(both[0].points.size(), 2u);
    EXPECT_TRUE(both[1].points.empty());
  }
  for (const MachinePart& link : of_kind(parts, PartKind::kLink)) EXPECT_EQ(link.points.size(), 2u);
}

TEST(DrawingGeometry, FramesAreEvenInTimeAndEndAtTheMotionsEnds) {
  const Machine machine = test_support::loader_crane();
  Trajectory motion;
  motion.t = Vector3d(1.0, 1.5, 4.0);
  motion.q.resize(3, 3);
  motion.q << 0.1, -1.0, 0.5, 0.3, -0.9, 0.7, 0.9, -0.5, 2.0;
  const auto frames = drawing_frames(machine, motion, 7);
  ASSERT_EQ(frames.size(), 7u);
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_NEAR(frames[i].time, 1.0 + 0.5 * static_cast<double>(i), kGeometryRounding);
  }
  const VectorXd middle = motion.q.row(1), last = motion.q.row(2);
  EXPECT_NEAR((frames[1].tip - drawing_frame(machine, middle).tip).norm(), 0.0, kGeometryRounding);
  EXPECT_NEAR((frames[6].tip - drawing_frame(machine, last).tip).norm(), 0.0, kGeometryRounding);
  EXPECT_TRUE(drawing_frames(machine, Trajectory{}, 7).empty());
}

}  // namespace
}  // namespace sparflow
