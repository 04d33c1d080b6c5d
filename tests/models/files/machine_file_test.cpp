#include "models/files/machine_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

constexpr double kPi = std::numbers::pi;
// Numbers that pass through a few sums and rotations of order one.
constexpr double kFileRounding = 1e-12;

const std::string kMachines = SPARFLOW_SOURCE_DIR "/problems/machines/";

Machine parsed(const std::string& text, std::vector<std::string>* warnings = nullptr) {
  return parse_machine(text, "test.yaml", kMachines, warnings);
}

/// Tip by the machine's own forward kinematics.
Eigen::Vector3d tip(const Machine& machine, std::initializer_list<double> q) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(q.size()));
  std::copy(q.begin(), q.end(), v.data());
  return tip_position<double>(machine, v);
}

const std::string kRates = "velocity: [-1, 1], acceleration: [-2, 2]";

TEST(MachineFile, LoaderCraneIsReadWithUnitsConverted) {
  std::vector<std::string> warnings;
  const Machine m = load_machine(kMachines + "loader_crane.yaml", &warnings);
  EXPECT_THAT(warnings, testing::IsEmpty());
  EXPECT_EQ(m.name, "loader-crane");
  ASSERT_EQ(m.joint_count(), 3);
  EXPECT_EQ(m.joints[2].type, JointType::kPrismatic);
  EXPECT_EQ(m.joints[0].origin.translation(), Eigen::Vector3d(0, 0, 2.0));
  EXPECT_EQ(m.joints[0].axis, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(m.joints[1].position.lo, -2.30);
  EXPECT_EQ(m.joints[1].velocity.hi, 0.18);
  EXPECT_EQ(m.joints[2].acceleration.lo, -0.60);
  ASSERT_EQ(m.links.size(), 6u);
  EXPECT_EQ(m.links[2].joint, 1);
  EXPECT_EQ(m.links[2].slides_with, 2);
  EXPECT_EQ(m.links[2].fraction, 0.25);
  EXPECT_EQ(m.links[0].inertia, 820);
  ASSERT_EQ(m.cylinder_count(), 3);
  EXPECT_EQ(m.cylinders[2].stages, 4);
  EXPECT_EQ(m.cylinders[0].parallel, 1);
  // A = pi/4 0.18^2
  EXPECT_NEAR(m.cylinders[0].area_piston(), 0.025446900494077322, 1e-15);
  const auto& pins = std::get<PinsLinkage>(m.cylinders[0].linkage);
  EXPECT_TRUE(pins.barrel_on_parent);
  EXPECT_EQ(pins.child_pin, Eigen::Vector3d(0.65, 0, -0.20));
  const auto& bar = std::get<FourBarLinkage>(m.cylinders[1].linkage);
  EXPECT_EQ(bar.branch, -1);
  EXPECT_EQ(bar.rocker_length, 0.60);
  EXPECT_EQ(bar.coupler, Eigen::Vector3d(0.30, 0, 0));
  ASSERT_EQ(m.pump_count(), 1);
  EXPECT_EQ(m.pumps[0].type, PumpType::kLoadSensing);
  EXPECT_THAT(m.pumps[0].feeds, testing::ElementsAre(0, 1, 2));
  EXPECT_DOUBLE_EQ(m.pumps[0].max_flow, 0.002);      // 120 l/min
  EXPECT_DOUBLE_EQ(m.pumps[0].max_pressure, 310e5);  // 310 bar
  EXPECT_DOUBLE_EQ(m.pumps[0].standby, 22e5);
  ASSERT_NE(m.valve_of_cylinder(2), nullptr);
  EXPECT_DOUBLE_EQ(m.valve_of_cylinder(2)->max_flow_extend, 75.0 / 6e4);
  EXPECT_DOUBLE_EQ(m.valve_of_cylinder(2)->max_flow_retract, 40.0 / 6e4);
  EXPECT_EQ(m.tip.joint, 2);
  // folded out straight: 3.4 + 3.0 + 1 ahead of the boom pin
  EXPECT_NEAR((tip(m, {0, 0, 1}) - Eigen::Vector3d(7.4, 0, 2)).norm(), 0.0, kFileRounding);
  EXPECT_NE(m.source_text.find("A 21 t.m loader crane"), std::string::npos);
}

TEST(MachineFile, RealCraneHasMovingMassesAndConstantPressure) {
  const Machine m = load_machine(kMachines + "hmf_2020_k4.yaml");
  EXPECT_EQ(m.pumps[0].type, PumpType::kConstantPressure);
  EXPECT_EQ(m.cylinders[0].length_at_zero_stroke, 1.043);
  EXPECT_EQ(m.cylinders[0].stroke, 0.75);
  EXPECT_EQ(m.cylinders[0].barrel_mass, 57.956);
  EXPECT_EQ(m.cylinders[1].rod_cog, 0.4694);
  const auto& bar = std::get<FourBarLinkage>(m.cylinders[1].linkage);
  EXPECT_EQ(bar.coupler_mass, 22.05);
  EXPECT_EQ(bar.coupler_cog, 0.110);
  EXPECT_EQ(bar.rocker_mass, 12.852);
}

TEST(MachineFile, DriveWithoutHydraulics) {
  const Machine m = load_machine(kMachines + "emps.yaml");
  EXPECT_FALSE(m.cylinders[0].hydraulic());
  EXPECT_EQ(m.pump_count(), 0);
  EXPECT_TRUE(m.valves.empty());
}

TEST(MachineFile, EveryBundledMachineLoadsWithoutWarning) {
  for (const char* name : {"loader_crane", "hmf_2020_k4", "emps", "swing_crane_two_pumps",
                           "excavator", "urdf_crane"}) {
    std::vector<std::string> warnings;
    const Machine m = load_machine(kMachines + name + ".yaml", &warnings);
    EXPECT_THAT(warnings, testing::IsEmpty()) << name;
  }
}

TEST(MachineFile, BundledMachinesAreThePublishedOnes) {
  const std::string shared = SPARFLOW_SOURCE_DIR "/../shared/machines/";
  if (!std::ifstream(shared + "loader_crane.yaml")) GTEST_SKIP() << "no shared folder here";
  for (const char* name : {"loader_crane.yaml", "hmf_2020_k4.yaml", "emps.yaml"}) {
    EXPECT_EQ(read_file(shared + name), read_file(kMachines + name)) << name;
  }
}

TEST(MachineFile, SwingCranePullsItsJibOverTheWholeRange) {
  const Machine m = load_machine(kMachines + "swing_crane_two_pumps.yaml");
  const int jib = m.cylinder_index("jib");
  const Range range = m.joints[static_cast<std::size_t>(m.joint_index("jib"))].position;
  for (int k = 0; k <= 50; ++k) {
    const double q = range.lo + (range.hi - range.lo) * k / 50.0;
    EXPECT_LT(linkage_rates(m, jib, q).d1, -0.1) << q;  // [m/rad], far from a dead centre
  }
  EXPECT_EQ(m.pump_of_cylinder(jib), 1);
  EXPECT_EQ(m.cylinders[0].parallel, 2);
  // boom pin 0.25 m out and 2.1 m up, boom 3.2, jib 2.2, telescope 0.3: all straight at q = 0
  EXPECT_NEAR((tip(m, {0, 0, 0, 0}) - Eigen::Vector3d(5.95, 0, 2.1)).norm(), 0.0, kFileRounding);
  // Slewed to the left, the boom lifts the straight arm.
  const Eigen::Vector3d up = tip(m, {kPi / 2, kPi / 6, 0, 0});
  EXPECT_NEAR((up - Eigen::Vector3d(0, 0.25 + 5.7 * std::cos(kPi / 6), 2.1 + 5.7 * 0.5)).norm(),
              0.0, kFileRounding);
}

TEST(MachineFile, AxisIsNormalisedAndRpyTurnsTheFrame) {
  const Machine m = parsed(
      "name: m\njoints:\n"
      "  - {name: a, type: revolute, origin: {xyz: [1, 2, 3], rpy: [0, 0, "
      "1.5707963267948966]}, axis: [0, 0, 5], position: [-1, 1], " +
      kRates + "}\ntip: {joint: a, xyz: [1, 0, 0]}\n");
  EXPECT_EQ(m.joints[0].axis, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(m.gravity, Eigen::Vector3d(0, 0, -9.81));
  EXPECT_NEAR((tip(m, {0}) - Eigen::Vector3d(1, 3, 3)).norm(), 0.0, kFileRounding);
}

// T_01 T_12 of standard Denavit-Hartenberg, written out by hand, against the converted chain.
TEST(MachineFile, DenavitHartenbergChainIsTheTextbookProduct) {
  const Machine m = parsed(
      "name: m\njoints:\n"
      "  - {name: a, type: revolute, dh: {a: 0.4, alpha: 1.2, d: 0.7, theta: "
      "0.3}, position: [-3, 3], " +
      kRates +
      "}\n"
      "  - {name: b, type: prismatic, dh: {a: 0.2, alpha: -0.5, d: 0.1, theta: "
      "0.9}, position: [-3, 3], " +
      kRates +
      "}\n"
      "tip: {joint: b, xyz: [0.11, 0.22, 0.33]}\n");
  const auto dh = [](double theta, double d, double a, double alpha) {
    Eigen::Matrix4d t;
    const double ct = std::cos(theta), st = std::sin(theta), ca = std::cos(alpha),
                 sa = std::sin(alpha);
    t << ct, -st * ca, st * sa, a * ct,  //
        st, ct * ca, -ct * sa, a * st,   //
        0, sa, ca, d,                    //
        0, 0, 0, 1;
    return t;
  };
  const double q1 = 0.8, q2 = -0.35;
  const Eigen::Vector4d expected = dh(q1 + 0.3, 0.7, 0.4, 1.2) * dh(0.9, 0.1 + q2, 0.2, -0.5) *
                                   Eigen::Vector4d(0.11, 0.22, 0.33, 1.0);
  EXPECT_NEAR((tip(m, {q1, q2}) - expected.head<3>()).norm(), 0.0, kFileRounding);
}

// The frame of a DH joint is the far end of its link; an origin joint, a mass and a pin follow in it.
TEST(MachineFile, DenavitHartenbergAndOriginJointsMix) {
  const Machine m = parsed(
      "name: m\njoints:\n"
      "  - {name: a, type: revolute, dh: {a: 2, alpha: 0, d: 0, theta: 0}, "
      "position: [-3, 3], " +
      kRates +
      "}\n"
      "  - {name: b, type: revolute, origin: {xyz: [0.5, 0, 0]}, axis: [0, 0, "
      "1], position: [0.2, 2.5], " +
      kRates +
      "}\n"
      "tip: {joint: b, xyz: [1, 0, 0]}\n"
      "links:\n  - {name: l, joint: a, mass: 3, cog: [-0.5, 0, 0]}\n"
      "cylinders:\n"
      "  - {name: c, joint: b, bore: 0.1, rod: 0.05, linkage: {type: pins, "
      "barrel: {frame: a, xyz: [-1.5, 0.2, 0]}, rod: {frame: b, xyz: [0.4, 0, "
      "0]}}}\n");
  EXPECT_NEAR((tip(m, {0, kPi / 2}) - Eigen::Vector3d(2.5, 1, 0)).norm(), 0.0, kFileRounding);
  // 0.5 m back from the link's far end at 2 m
  EXPECT_EQ(m.links[0].cog, Eigen::Vector3d(1.5, 0, 0));
  EXPECT_EQ(std::get<PinsLinkage>(m.cylinders[0].linkage).parent_pin, Eigen::Vector3d(0.5, 0.2, 0));
  // at b = 90 degrees the pins are 2.0 apart along x and 0.4 - 0.2 along y
  EXPECT_NEAR(cylinder_length(m, 0, kPi / 2), std::hypot(2.0, 0.2), kFileRounding);
}

TEST(MachineFile, PinsMayHaveTheBarrelOnTheMovingLink) {
  const std::string head =
      "name: m\njoints:\n"
      "  - {name: a, type: revolute, axis: [0, 0, 1], position: [0.5, 2.5], " +
      kRates + "}\ntip: {joint: a, xyz: [1, 0, 0]}\ncylinders:\n";
  const Machine on_child = parsed(
      head +
      "  - {name: c, joint: a, linkage: {type: pins, barrel: {frame: a, xyz: [1, 0, 0]}, rod: "
      "{frame: base, xyz: [3, 0, 0]}}}\n");
  const auto& pins = std::get<PinsLinkage>(on_child.cylinders[0].linkage);
  EXPECT_FALSE(pins.barrel_on_parent);
  EXPECT_EQ(pins.parent_pin, Eigen::Vector3d(3, 0, 0));
  EXPECT_EQ(pins.child_pin, Eigen::Vector3d(1, 0, 0));
  // law of cosines at 90 degrees
  EXPECT_NEAR(cylinder_length(on_child, 0, kPi / 2), std::sqrt(10.0), kFileRounding);
}

TEST(MachineFile, RackDirectParallelAndSingleValveFlow) {
  const Machine m = parsed(
      "name: m\njoints:\n"
      "  - {name: a, type: revolute, axis: [0, 0, 1], position: [-3, 3], " +
      kRates +
      "}\n"
      "tip: {joint: a, xyz: [1, 0, 0]}\n"
      "cylinders:\n"
      "  - {name: c, joint: a, bore: 0.1, rod: 0.05, parallel: 3, linkage: "
      "{type: rack, radius: -0.2}}\n"
      "pumps: [{name: p, feeds: [c], max_flow_lpm: 60, max_pressure_bar: 200, "
      "standby_bar: 0}]\n"
      "valves: [{cylinder: c, max_flow_lpm: 30}]\n");
  EXPECT_EQ(std::get<RackLinkage>(m.cylinders[0].linkage).radius, -0.2);
  EXPECT_NEAR(m.cylinders[0].area_piston(), 3 * kPi / 4 * 0.01, 1e-15);
  EXPECT_DOUBLE_EQ(m.valves[0].max_flow_extend, 0.0005);
  EXPECT_DOUBLE_EQ(m.valves[0].max_flow_retract, 0.0005);
}

// A slewing drive: 250 cm3 a turn through a gear of 40 takes 10 l for each turn of the column.
TEST(MachineFile, MotorIsTheDriveWithEqualAreasThatTakesTheSameOil) {
  const Machine m = parsed(
      "name: m\njoints:\n"
      "  - {name: slew, type: revolute, axis: [0, 0, 1], position: [-3, 3], " +
      kRates + "}\n  - {name: winch, type: prismatic, axis: [0, 0, 1], position: [0, 10], " +
      kRates +
      "}\n"
      "tip: {joint: winch, xyz: [1, 0, 0]}\n"
      "cylinders:\n"
      "  - {name: s, joint: slew, motor: {displacement_cm3: 250, gear_ratio: -40}, parallel: 2}\n"
      "  - {name: w, joint: winch, motor: {displacement_cm3: 250, gear_ratio: 40, radius: 0.2}}\n"
      "pumps: [{name: p, feeds: [s, w], max_flow_lpm: 60, max_pressure_bar: 200, standby_bar: "
      "20}]\n"
      "valves: [{cylinder: s, max_flow_lpm: 30}]\n");
  const Cylinder& slew = m.cylinders[0];
  EXPECT_TRUE(slew.hydraulic());
  EXPECT_EQ(slew.area_piston(), slew.area_rod());
  const double turn = cylinder_length(m, 0, 2 * kPi) - cylinder_length(m, 0, 0.0);
  EXPECT_LT(turn, 0.0);  // the ratio is negative: port A turns the joint backwards
  EXPECT_NEAR(slew.area_piston() * -turn, 2 * 10e-3, kFileRounding);
  const Cylinder& winch = m.cylinders[1];
  const double up = cylinder_length(m, 1, 2 * kPi * 0.2) - cylinder_length(m, 1, 0.0);
  EXPECT_NEAR(winch.area_rod() * up, 10e-3, kFileRounding);  // one turn of the drum
}

TEST(MachineFile, RodOfDiameterZeroMakesEqualAreas) {
  const Machine m = parsed(
      "name: m\njoints:\n"
      "  - {name: a, type: revolute, axis: [0, 0, 1], position: [-3, 3], " +
      kRates +
      "}\n"
      "tip: {joint: a, xyz: [1, 0, 0]}\n"
      "cylinders:\n"
      "  - {name: c, joint: a, bore: 0.1, rod: 0, linkage: {type: rack, radius: 0.2}}\n");
  EXPECT_TRUE(m.cylinders[0].hydraulic());
  EXPECT_EQ(m.cylinders[0].area_piston(), m.cylinders[0].area_rod());
  const Machine again = parse_machine(write_machine(m), "m", "");
  EXPECT_EQ(again.cylinders[0].area_rod(), m.cylinders[0].area_rod());
}

TEST(MachineFile, MachineWithoutJointsIsPossible) {
  const Machine m = parsed("name: post\njoints: []\ntip: {joint: base, xyz: [0, 0, 1]}\n");
  EXPECT_EQ(m.joint_count(), 0);
  EXPECT_EQ(m.tip.joint, -1);
}

TEST(UrdfImport, FoldsFixedJointsAndTakesLimits) {
  const Machine m = load_machine(kMachines + "urdf_crane.yaml");
  ASSERT_EQ(m.joint_count(), 3);
  EXPECT_EQ(m.joints[0].name, "boom");
  // fixed column 0.3 up, boom pin 1.2 above it
  EXPECT_NEAR((m.joints[0].origin.translation() - Eigen::Vector3d(0, 0, 1.5)).norm(), 0,
              kFileRounding);
  EXPECT_EQ(m.joints[0].position.hi, 1.25);     // the URDF's
  EXPECT_EQ(m.joints[0].velocity.lo, -0.2);     // the URDF's
  EXPECT_EQ(m.joints[0].acceleration.hi, 0.5);  // the machine file's
  EXPECT_EQ(m.joints[1].position.lo, -2.2);     // continuous there, given here
  ASSERT_EQ(m.links.size(), 5u);
  EXPECT_EQ(m.links[0].joint, -1);  // the column does not move
  const Link& boom = m.links[1];
  EXPECT_EQ(boom.inertia, 110);  // about the joint's axis, -y
  const Link& toolbox = m.links[2];
  EXPECT_EQ(toolbox.joint, 0);
  EXPECT_NEAR((toolbox.cog - Eigen::Vector3d(0.4, 0, 0.2)).norm(), 0, kFileRounding);
  const Link& tube = m.links[4];  // on the telescope: a mass that slides on the jib
  EXPECT_EQ(tube.joint, 1);
  EXPECT_EQ(tube.slides_with, 2);
  EXPECT_EQ(tube.fraction, 1.0);
  EXPECT_NEAR((tube.cog - Eigen::Vector3d(1.3, 0, 0)).norm(), 0, kFileRounding);
  EXPECT_NEAR(tube.inertia, 14, kFileRounding);
  EXPECT_EQ(m.tip.joint, 2);
  EXPECT_NEAR((m.tip.xyz - Eigen::Vector3d(0.1, 0, -0.05)).norm(), 0, kFileRounding);
}

TEST(UrdfImport, SourceTextIsComplete) {
  const Machine m = load_machine(kMachines + "urdf_crane.yaml");
  EXPECT_EQ(m.source_text.find("urdf:"), std::string::npos);
  const Machine again = parse_machine(m.source_text, "again.yaml", "/nowhere");
  EXPECT_NEAR((tip(again, {0.4, -1.1, 0.7}) - tip(m, {0.4, -1.1, 0.7})).norm(), 0.0, kFileRounding);
}

TEST(MachineWriter, EveryBundledMachineSurvivesWritingAndReading) {
  for (const char* name :
       {"loader_crane", "hmf_2020_k4", "emps", "swing_crane_two_pumps", "excavator"}) {
    const Machine a = load_machine(kMachines + name + ".yaml");
    const Machine b = parse_machine(write_machine(a), name, "");
    ASSERT_EQ(a.joint_count(), b.joint_count()) << name;
    for (std::size_t i = 0; i < a.joints.size(); ++i) {
      EXPECT_TRUE(a.joints[i].origin.isApprox(b.joints[i].origin, kFileRounding)) << name;
      EXPECT_EQ(a.joints[i].axis, b.joints[i].axis);
      EXPECT_EQ(a.joints[i].position.hi, b.joints[i].position.hi);
    }
    ASSERT_EQ(a.links.size(), b.links.size());
    for (std::size_t i = 0; i < a.links.size(); ++i) {
      EXPECT_EQ(a.links[i].cog, b.links[i].cog);
      EXPECT_EQ(a.links[i].fraction, b.links[i].fraction);
    }
    for (int i = 0; i < a.cylinder_count(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Range r = a.joints[static_cast<std::size_t>(a.cylinders[k].joint)].position;
      const double q = 0.3 * r.lo + 0.7 * r.hi;
      EXPECT_NEAR(cylinder_length(a, i, q), cylinder_length(b, i, q), kFileRounding) << name;
      EXPECT_EQ(a.cylinders[k].area_rod(), b.cylinders[k].area_rod());
      EXPECT_EQ(a.cylinders[k].barrel_mass, b.cylinders[k].barrel_mass);
      EXPECT_EQ(a.pump_of_cylinder(i), b.pump_of_cylinder(i));
    }
    for (std::size_t i = 0; i < a.pumps.size(); ++i) {
      EXPECT_DOUBLE_EQ(a.pumps[i].max_flow, b.pumps[i].max_flow);
      EXPECT_EQ(a.pumps[i].type, b.pumps[i].type);
    }
  }
}

struct Warned {
  const char* what;
  std::string text;
  std::string expected;
};

TEST(MachineCheck, WarningsNameWhatIsUnusual) {
  const std::string joint =
      "name: m\njoints:\n  - {name: a, type: revolute, axis: [0, 0, 1], position: [0.5, 2.5], " +
      kRates + "}\ntip: {joint: a, xyz: [1, 0, 0]}\n";
  const std::string pins =
      "linkage: {type: pins, barrel: {frame: base, xyz: [3, 0, 0]}, rod: {frame: a, xyz: [1, 0, "
      "0]}}}\n";
  const std::vector<Warned> cases = {
      {"gravity", "gravity: [0, 0, 0]\n" + joint,
       "test.yaml: gravity: is zero, so no load presses on any cylinder; expected about 9.81 "
       "m/s^2"},
      {"no cylinder", joint,
       "test.yaml:3:5: joints[a]: no cylinder drives this joint; moving it will cost no energy"},
      {"no pump", joint + "cylinders:\n  - {name: c, joint: a, bore: 0.1, rod: 0.05, " + pins,
       "test.yaml:6:5: cylinders[c]: no pump feeds it; its motion will cost no energy"},
      {"too short",
       joint + "cylinders:\n  - {name: c, joint: a, length_at_zero_stroke: 2.5, " + pins,
       "test.yaml:6:5: cylinders[c].length_at_zero_stroke: the length falls to 2.1759 m at a = "
       "28.6 "
       "deg (0.5000 rad), shorter than 2.5000 m at zero stroke"},
      {"too long",
       joint + "cylinders:\n  - {name: c, joint: a, length_at_zero_stroke: 2.1, stroke: 1, " + pins,
       "test.yaml:6:5: cylinders[c].stroke: the length grows to 3.8480 m at a = 143.2 deg (2.5000 "
       "rad), longer than 3.1000 m at full stroke"},
  };
  for (const Warned& c : cases) {
    std::vector<std::string> warnings;
    parsed(c.text, &warnings);
    EXPECT_THAT(warnings, testing::Contains(c.expected)) << c.what;
  }
}

}  // namespace
}  // namespace sparflow
