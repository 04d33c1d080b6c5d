/// Cylinder lengths of every linkage against closed forms, their derivatives, their inverse.
#include "models/machine/linkage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/models/test_machines.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::make_cylinder;
using test_support::make_joint;
using test_support::numeric_derivative;
using test_support::Random;

// Closed forms and the code differ by a handful of roundings of numbers of a few metres.
constexpr double kTightRounding = 1e-13;

Machine one_joint(JointType type, const Eigen::Vector3d& axis, const Linkage& linkage) {
  Machine m;
  m.joints = {make_joint("joint", type, {0, 0, 0}, axis, {-1.0, 1.0})};
  m.cylinders = {make_cylinder("cylinder", 0, 0.1, 0.05, linkage)};
  return m;
}

TEST(Linkage, PinsFollowTheLawOfCosines) {
  // Fixed pin at radius a, moving pin at radius b, angle 90 deg + q between them (axis +z):
  // x^2 = a^2 + b^2 - 2 a b cos(90 deg + q) = a^2 + b^2 + 2 a b sin q.
  const double a = 1.4, b = 0.6;
  const Machine m = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(),
                              PinsLinkage{{a, 0, 0}, {0, b, 0}, true});
  for (const double q : {-0.9, -0.2, 0.0, 0.5, 0.9}) {
    const Taylor3 x = linkage_rates(m, 0, q);
    const double expected = std::sqrt(a * a + b * b + 2 * a * b * std::sin(q));
    EXPECT_NEAR(x.value, expected, kTightRounding);
    // x x' = a b cos q
    EXPECT_NEAR(x.d1, a * b * std::cos(q) / expected, kTightRounding);
    // x'^2 + x x'' = -a b sin q
    EXPECT_NEAR(x.d1 * x.d1 + x.value * x.d2, -a * b * std::sin(q), kTightRounding);
    // 3 x' x'' + x x''' = -a b cos q
    EXPECT_NEAR(3 * x.d1 * x.d2 + x.value * x.d3, -a * b * std::cos(q), kTightRounding);
  }
}

TEST(Linkage, ClosedFormIsTheTemplateWithThreeDerivatives) {
  // any axis, any frame, pins off the plane, both branches
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.translate(Eigen::Vector3d(0.3, -0.2, 0.5));
  frame.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()));
  FourBarLinkage bar;
  bar.barrel = {-1.1, -0.4, 0.45};
  bar.rocker = {0.05, -0.1, 0.55};
  bar.coupler = {0.40, 0.15, 0.1};
  bar.rocker_length = 0.55;
  bar.coupler_length = 0.50;
  FourBarLinkage other = bar;
  bar.branch = 1;
  other.branch = -1;
  const Linkage linkages[] = {PinsLinkage{{1.4, 0.1, -0.1}, {0.1, 0.6, 0.2}, true}, bar, other};
  int compared = 0;
  for (const Linkage& linkage : linkages) {
    Machine m =
        one_joint(JointType::kRevolute, Eigen::Vector3d(0.1, -0.3, 1.0).normalized(), linkage);
    m.joints[0].origin = frame;
    for (double q = -1.4; q < 1.45; q += 0.2) {
      Taylor3 expected;
      try {
        expected = cylinder_length(m, 0, TaylorSeries<3>::variable(q));
      } catch (const std::domain_error&) {
        EXPECT_THROW(linkage_rates(m, 0, q), std::domain_error);
        continue;
      }
      // near where the four-bar opens, derivatives grow and carry their rounding with them
      const double size =
          1.0 + std::abs(expected.d1) + std::abs(expected.d2) + std::abs(expected.d3);
      if (size > 1e3) continue;
      ++compared;
      const Taylor3 x = linkage_rates(m, 0, q);
      EXPECT_NEAR(x.value, expected.value, kTightRounding * size);
      EXPECT_NEAR(x.d1, expected.d1, kTightRounding * size * size);
      EXPECT_NEAR(x.d2, expected.d2, kTightRounding * size * size);
      EXPECT_NEAR(x.d3, expected.d3, kTightRounding * size * size);
    }
  }
  EXPECT_GT(compared, 30);
}

TEST(Linkage, PinsWithAnAxialOffsetAddItInQuadrature) {
  const Machine flat = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(),
                                 PinsLinkage{{1.4, 0, 0}, {0, 0.6, 0}, true});
  const Machine offset = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(),
                                   PinsLinkage{{1.4, 0, -0.1}, {0, 0.6, 0.2}, true});
  const double x = cylinder_length(flat, 0, 0.3);
  EXPECT_NEAR(cylinder_length(offset, 0, 0.3), std::hypot(x, 0.3), kTightRounding);
}

TEST(Linkage, PinsOfAPrismaticJoint) {
  // Rod pin 0.3 beside the guide: x = hypot(q + 2, 0.3).
  const Machine m = one_joint(JointType::kPrismatic, Eigen::Vector3d::UnitX(),
                              PinsLinkage{{-2, 0, 0}, {0, 0.3, 0}, true});
  for (const double q : {-0.8, 0.0, 0.7}) {
    const Taylor3 x = linkage_rates(m, 0, q);
    EXPECT_NEAR(x.value, std::hypot(q + 2.0, 0.3), kTightRounding);
    EXPECT_NEAR(x.d1, (q + 2.0) / x.value, kTightRounding);
  }
}

TEST(Linkage, LoaderCraneBoomByHand) {
  // At q = 0 the rod pin stands at (0.65, 2.0 - 0.20), the barrel pin at (0.40, 0.50).
  EXPECT_NEAR(stroke_at(test_support::loader_crane(), 0, 0.0), std::hypot(0.25, 1.3),
              kTightRounding);
}

TEST(Linkage, WhichEndHoldsTheBarrelDoesNotChangeTheLength) {
  for (const double q : {-0.7, 0.4}) {
    const PinsLinkage linkage{{1.4, 0.1, 0}, {0.2, 0.6, 0.1}, true};
    PinsLinkage swapped = linkage;
    swapped.barrel_on_parent = false;
    const Machine a = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), linkage);
    const Machine b = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), swapped);
    EXPECT_DOUBLE_EQ(cylinder_length(a, 0, q), cylinder_length(b, 0, q));
    EXPECT_EQ(linkage_pins(a, 0, q).barrel, linkage_pins(b, 0, q).rod);
  }
}

TEST(Linkage, FourBarClosesOnBothBars) {
  // The rod pin lies on both circles in every pose, which defines the linkage.
  const Machine m = test_support::loader_crane();
  const auto& f = std::get<FourBarLinkage>(m.cylinders[1].linkage);
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const LinkagePins<double> pins = linkage_pins(m, 1, random.uniform(-2.3, 0.05));
    EXPECT_NEAR((pins.rod - pins.rocker).norm(), f.rocker_length, kTightRounding);
    EXPECT_NEAR((pins.rod - pins.coupler).norm(), f.coupler_length, kTightRounding);
  }
}

TEST(Linkage, FourBarFollowsTheLawOfCosines) {
  // Rocker pin in the joint, rocker 0.5, coupler pin at radius 0.3, coupler 0.4: a rigid 3-4-5 triangle
  // that turns with the joint; rod pin at the right angle seen from the coupler pin. With the axis +z
  // and branch +1 it lies at +acos(0.3/0.5) from the coupler pin's direction.
  FourBarLinkage f;
  f.barrel = {-1.2, 0.0, 0};
  f.rocker = {0, 0, 0};
  f.coupler = {0.3, 0, 0};
  f.rocker_length = 0.5;
  f.coupler_length = 0.4;
  for (const int branch : {1, -1}) {
    f.branch = branch;
    const Machine m = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), f);
    for (const double q : {-0.8, 0.1, 0.9}) {
      const double angle = q + branch * std::acos(0.6);  // of the rod pin, from +x
      const double expected = std::sqrt(1.44 + 0.25 + 2 * 1.2 * 0.5 * std::cos(angle));
      const Taylor3 x = linkage_rates(m, 0, q);
      EXPECT_NEAR(x.value, expected, kTightRounding);
      EXPECT_NEAR(x.d1, -0.6 * std::sin(angle) / expected, kTightRounding);
    }
  }
}

TEST(Linkage, MirroredFourBarHasTheMirroredLength) {
  // Mirroring the plane in y changes the signs of q and of the branch.
  FourBarLinkage f;
  f.barrel = {-1.1, -0.4, 0.05};
  f.rocker = {-0.25, 0.1, 0};
  f.coupler = {0.40, 0.15, 0};
  f.rocker_length = 0.55;
  f.coupler_length = 0.50;
  f.branch = 1;
  FourBarLinkage mirrored = f;
  for (Eigen::Vector3d* p : {&mirrored.barrel, &mirrored.rocker, &mirrored.coupler}) {
    p->y() = -p->y();
  }
  mirrored.branch = -1;
  const Machine a = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), f);
  const Machine b = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), mirrored);
  for (const double q : {-0.8, 0.0, 0.6}) {
    const Taylor3 x = linkage_rates(a, 0, q), y = linkage_rates(b, 0, -q);
    EXPECT_NEAR(x.value, y.value, kTightRounding);
    EXPECT_NEAR(x.d1, -y.d1, kTightRounding);
    EXPECT_NEAR(x.d2, y.d2, kTightRounding);
  }
  mirrored.branch = 1;  // the other branch is another linkage
  const Machine other = one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), mirrored);
  EXPECT_GT(std::abs(cylinder_length(other, 0, 0.0) - cylinder_length(a, 0, 0.0)), 0.1);
}

TEST(Linkage, OpenFourBarThrows) {
  Machine m = test_support::loader_crane();
  auto& f = std::get<FourBarLinkage>(m.cylinders[1].linkage);
  // pins 0.5 apart at q = 0: too short to meet, and too unequal to meet
  f.rocker_length = f.coupler_length = 0.2;
  EXPECT_THROW(cylinder_length(m, 1, 0.0), std::domain_error);
  EXPECT_THROW(linkage_rates(m, 1, 0.0), std::domain_error);
  f.rocker_length = 1.2;
  EXPECT_THROW(cylinder_length(m, 1, 0.0), std::domain_error);
}

TEST(Linkage, RackAndDirect) {
  const Machine rack =
      one_joint(JointType::kRevolute, Eigen::Vector3d::UnitZ(), RackLinkage{-0.16});
  const Machine direct =
      one_joint(JointType::kPrismatic, Eigen::Vector3d::UnitX(), DirectLinkage{});
  const Taylor3 x = linkage_rates(rack, 0, 0.5), y = linkage_rates(direct, 0, 0.5);
  EXPECT_DOUBLE_EQ(x.value, -0.08);
  EXPECT_DOUBLE_EQ(x.d1, -0.16);
  EXPECT_DOUBLE_EQ(y.value, 0.5);
  EXPECT_DOUBLE_EQ(y.d1, 1.0);
  EXPECT_EQ(x.d2, 0.0);
  EXPECT_EQ(y.d3, 0.0);
  EXPECT_DOUBLE_EQ(joint_at_stroke(rack, 0, -0.08), 0.5);
  EXPECT_DOUBLE_EQ(joint_at_stroke(direct, 0, 0.5), 0.5);
}

TEST(Linkage, ThreeDerivativesMatchNumericOnesOnEveryMachine) {
  for (const Machine& m : test_support::all_test_machines()) {
    Random random(7);
    for (int c = 0; c < m.cylinder_count(); ++c) {
      SCOPED_TRACE(m.name + " " + m.cylinders[static_cast<std::size_t>(c)].name);
      for (int i = 0; i < 5; ++i) {
        const int joint = m.cylinders[static_cast<std::size_t>(c)].joint;
        const double q = test_support::random_configuration(m, random)[joint];
        const Taylor3 x = linkage_rates(m, c, q);
        const auto length = [&](double v) { return cylinder_length(m, c, v); };
        const auto rate = [&](double v) { return linkage_rates(m, c, v).d1; };
        const auto second = [&](double v) { return linkage_rates(m, c, v).d2; };
        // a knuckle near its stretched pose varies over centimetres, hence the smaller step; rounding
        // then is near 1e-12 of the value differenced
        const double h = 2e-3;
        EXPECT_NEAR(x.value, length(q), kTightRounding);
        EXPECT_NEAR(x.d1, numeric_derivative(length, q, h), kDerivativeTolerance);
        EXPECT_NEAR(x.d2, numeric_derivative(rate, q, h),
                    kDerivativeTolerance * (1 + std::abs(x.d2)));
        EXPECT_NEAR(x.d3, numeric_derivative(second, q, h),
                    kDerivativeTolerance * (1 + std::abs(x.d3)));
      }
    }
  }
}

TEST(Linkage, JointAtStrokeInvertsTheStrokeOverTheRange) {
  for (const Machine& m :
       {test_support::loader_crane(), test_support::knuckle_crane(), test_support::swing_crane()}) {
    for (int c = 0; c < m.cylinder_count(); ++c) {
      SCOPED_TRACE(m.name + " " + m.cylinders[static_cast<std::size_t>(c)].name);
      const int joint = m.cylinders[static_cast<std::size_t>(c)].joint;
      const Range& range = m.joints[static_cast<std::size_t>(joint)].position;
      for (int i = 0; i <= 40; ++i) {
        const double q = range.lo + (range.hi - range.lo) * i / 40.0;
        // Newton stops at steps below 1e-13; a rounding of the length, 2e-16, weighs 1/|dx/dq| (up to 30)
        EXPECT_NEAR(joint_at_stroke(m, c, stroke_at(m, c, q)), q, 1e-12);
      }
    }
  }
}

TEST(Linkage, JointAtStrokeAcceptsSlightlyMoreThanTheRange) {
  const Machine m = test_support::loader_crane();
  const double past = m.joints[0].position.hi + 0.02;
  EXPECT_NEAR(joint_at_stroke(m, 0, stroke_at(m, 0, past)), past, 1e-12);
  EXPECT_THROW(joint_at_stroke(m, 0, stroke_at(m, 0, past), 0.01), std::domain_error);
  EXPECT_THROW(joint_at_stroke(m, 0, 10.0), std::domain_error);
  EXPECT_THROW(joint_at_stroke(m, 0, 0.0), std::domain_error);
}

TEST(Linkage, LengthAtZeroStrokeIsSubtracted) {
  const Machine m = test_support::knuckle_crane();
  EXPECT_DOUBLE_EQ(stroke_at(m, 0, 0.3), cylinder_length(m, 0, 0.3) - 1.043);
}

TEST(Linkage, MassesLieOnTheirMembers) {
  const Machine m = test_support::knuckle_crane();
  const auto& f = std::get<FourBarLinkage>(m.cylinders[0].linkage);
  const double q = 0.4;
  std::vector<LinkageMass<double>> masses;
  append_linkage_masses(m, 0, q, masses);
  ASSERT_EQ(masses.size(), 4u);
  const LinkagePins<double> pins = linkage_pins(m, 0, q);
  // On the line between its member's pins, at the stated distance from the stated pin.
  const auto expect_on = [](const LinkageMass<double>& mass, double kg, const Eigen::Vector3d& from,
                            const Eigen::Vector3d& to, double distance) {
    EXPECT_EQ(mass.mass, kg);
    EXPECT_NEAR((mass.position - from).norm(), distance, kTightRounding);
    EXPECT_NEAR((mass.position - to).norm(), (to - from).norm() - distance, kTightRounding);
  };
  expect_on(masses[0], 57.956, pins.barrel, pins.rod, 0.4125);
  expect_on(masses[1], 43.93, pins.rod, pins.barrel, 0.429);
  expect_on(masses[2], f.rocker_mass, pins.rocker, pins.rod, f.rocker_cog);
  expect_on(masses[3], f.coupler_mass, pins.coupler, pins.rod, f.coupler_cog);
}

TEST(Linkage, BarrelOfADirectCylinderStaysItsRodTravels) {
  const Machine m = test_support::swing_crane();
  std::vector<LinkageMass<double>> near, far;
  append_linkage_masses(m, 3, 0.5, near);
  append_linkage_masses(m, 3, 1.7, far);
  ASSERT_EQ(near.size(), 2u);
  EXPECT_EQ(near[0].position, far[0].position);
  const Eigen::Vector3d travel = far[1].position - near[1].position;
  EXPECT_NEAR((travel - 1.2 * Eigen::Vector3d::UnitX()).norm(), 0.0, kTightRounding);
}

}  // namespace
}  // namespace sparflow
