/// Parts of the dynamic plant by closed forms, and that no passive part creates energy.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulator/plant/components/end_stop.h"
#include "simulator/plant/components/friction.h"
#include "simulator/plant/components/oil.h"
#include "simulator/plant/components/smooth.h"

namespace sparflow::plant {
namespace {

TEST(PlantOil, VolumeModulusAndFlowWorkAreDerivativesOfEachOther) {
  const Oil oil(OilParameters{});
  for (const double p : {-0.9e5, -0.5e5, 0.0, 1e5, 5e5, 50e5, 300e5}) {
    const double h = 1e-5 * (p + 1.1e5);
    const Oil::Properties at = oil.at(p), up = oil.at(p + h), down = oil.at(p - h);
    // central differences: errors of order h^2 = 1e-10 of a value and of rounding / h
    EXPECT_NEAR(-at.volume / at.modulus, (up.volume - down.volume) / (2 * h),
                1e-5 * at.volume / at.modulus);
    EXPECT_NEAR(at.volume, (up.flow_work - down.flow_work) / (2 * h), 1e-4);
  }
  EXPECT_DOUBLE_EQ(oil.at(0.0).volume, 1.0);
  EXPECT_NEAR(oil.at(0.0).flow_work, 0.0, 1e-9);
}

TEST(PlantOil, AirSoftensLowPressuresAndHardlyHighOnes) {
  const Oil oil(OilParameters{});
  EXPECT_LT(oil.at(1e5).modulus, 0.15 * 1.5e9);
  EXPECT_GT(oil.at(200e5).modulus, 0.98 * 1.5e9);
  OilParameters pure;
  pure.air_fraction = 0.0;
  EXPECT_NEAR(Oil(pure).at(200e5).modulus, 1.5e9, 1.0);
}

TEST(PlantOil, ViscosityHasTheTwoGivenValuesAndFallsBetween) {
  const Oil oil(OilParameters{});
  EXPECT_NEAR(oil.relative_viscosity(40.0), 1.0, 1e-9);
  EXPECT_NEAR(oil.relative_viscosity(100.0), 6.8 / 46.0, 1e-9);
  EXPECT_GT(oil.relative_viscosity(0.0), 8.0);  // an ISO VG 46 oil has about 600 mm^2/s at 0 degC
}

TEST(PlantChamber, ForcingOilInRaisesThePressureByItsModulus) {
  OilParameters pure;
  pure.air_fraction = 0.0;
  const Oil oil(pure);
  const Chamber stiff{1e-3, 0.0, 1e9};
  double p = 0.0;
  const int steps = 1000;
  const double forced = 1e-5;  // one per cent of the volume
  for (int i = 0; i < steps; ++i) {
    const double mid = p + 0.5 * stiff.pressure_rate(oil.at(p), p, forced, 0.0) / steps;
    p += stiff.pressure_rate(oil.at(mid), mid, forced, 0.0) / steps;
  }
  // mass: V / v(p) = V + forced, v = exp(-p / K)
  EXPECT_NEAR(p, 1.5e9 * std::log(1.01), 1.0);
}

TEST(PlantChamber, StoredEnergyIsTheWorkOfItsFlowAndItsWall) {
  const Oil oil(OilParameters{});
  double p = 20e5, rigid = 2e-3, stored_by_power = 0.0;
  Chamber c{rigid, 1e-3, 8e8};
  const double before = c.energy(oil.at(p), p), dt = 2e-6;
  for (int i = 0; i < 500000;
       ++i) {  // compress while small, let out while large: a cycle of one second
    const double t = (i + 0.5) * dt;
    const double q = 2e-4 * std::sin(2 * std::numbers::pi * t);
    const double growth = 3e-4 * std::cos(2 * std::numbers::pi * t);
    const auto at = oil.at(p);
    const double rate = c.pressure_rate(at, p, q, growth);
    const double mid = p + 0.5 * dt * rate;
    const auto o = oil.at(mid);
    stored_by_power += dt * (o.flow_work * q - mid * growth);
    Chamber half = c;
    half.rigid += 0.5 * dt * growth;
    p += dt * half.pressure_rate(o, mid, q, growth);
    c.rigid += dt * growth;
  }
  const double after = c.energy(oil.at(p), p);
  // energies of some hundred joules, midpoint rule with 5e5 steps
  EXPECT_NEAR(after - before, stored_by_power, 1e-3);
}

TEST(PlantFriction, SlidesAtTheStribeckCurveAndSticksBelowIt) {
  FrictionParameters p;
  p.coulomb = 4000.0;
  p.viscous = 2000.0;
  for (const double v : {0.002, 0.01, 0.1, -0.05}) {
    const double r = v / p.stribeck_speed;
    const double level = 4000.0 * (1.0 + 0.4 * std::exp(-r * r));
    const double z = std::copysign(level * p.presliding / p.coulomb, v);
    const Friction f = friction(v, z, 1.0, p);
    EXPECT_NEAR(f.bristle_rate, 0.0, 1e-12);
    EXPECT_NEAR(f.force, std::copysign(level, v) + 2000.0 * v, 1e-6);
  }
  // at rest it is a spring
  EXPECT_DOUBLE_EQ(friction(0.0, 0.5e-4, 1.0, p).force, 2000.0);
  EXPECT_DOUBLE_EQ(friction(0.1, 0.0, 3.0, {0.0, 1.4, 0.01, 100.0}).force, 30.0);
}

TEST(PlantFriction, GivesBackNoMoreThanItStored) {
  FrictionParameters p;
  p.coulomb = 4000.0;
  p.viscous = 500.0;
  double z = 0.0, work = 0.0, least = 0.0;
  const double dt = 1e-6;
  for (int i = 0; i < 2000000; ++i) {
    const double t = i * dt;
    // small and large reversals, slow and fast
    const double v = 0.004 * std::sin(19.0 * t) + 0.02 * std::sin(3.1 * t * t);
    const Friction f = friction(v, z, 1.0, p);
    work += dt * f.force * v;
    z += dt * f.bristle_rate;
    least = std::min(least, work - bristle_energy(z, p));
  }
  EXPECT_GT(work, 10.0);
  EXPECT_GT(least, -1e-6 * work);  // Euler's rule
}

TEST(PlantEndStop, PushesAwayNeverPullsAndLosesEnergy) {
  const EndStopParameters p;
  const double k = 5e8;
  // off the cushion: nothing
  EXPECT_EQ(end_stop({0.04, 0.1, 0.02, 0.1, k}, p).force, 0.0);
  // leaving it: nothing
  EXPECT_EQ(end_stop({0.01, -0.1, 0.02, 0.1, k}, p).force, 0.0);
  // at its very end with the reference speed: the peak pressure on the area
  EXPECT_NEAR(end_stop({0.0, 0.1, 0.02, 0.1, k}, p).force, 0.02 * 1000e5, 1e-6);
  for (const double speed : {-1.0, -0.1, 0.0, 0.1}) {
    const EndStop e = end_stop({-0.001, speed, 0.02, 0.1, k}, p);
    EXPECT_GE(e.force, 0.0);
    EXPECT_GE(e.loss, 0.0);
  }
  EXPECT_NEAR(end_stop({-0.001, 0.0, 0.02, 0.1, k}, p).force, 5e5, 1e-6);
}

TEST(PlantSmooth, CornersAreExactOutsideTheirWidthAndContinuous) {
  EXPECT_EQ(positive_part(2.0, 0.5), 2.0);
  EXPECT_EQ(positive_part(-2.0, 0.5), 0.0);
  EXPECT_NEAR(positive_part(0.5 - 1e-12, 0.5), 0.5, 1e-11);
  EXPECT_EQ(smaller(3.0, 9.0, 1.0), 3.0);
  EXPECT_EQ(smaller(9.0, 3.0, 1.0), 3.0);
  // the relative error of the laminar part is (d / 2 dp)^2 = 6e-6
  EXPECT_NEAR(orifice_root(100e5, 0.5e5), std::sqrt(100e5), 1e-5 * std::sqrt(100e5));
  EXPECT_EQ(orifice_root(-4e5, 0.5e5), -orifice_root(4e5, 0.5e5));
  EXPECT_EQ(ramp(0.5), 0.5);
}

}  // namespace
}  // namespace sparflow::plant
