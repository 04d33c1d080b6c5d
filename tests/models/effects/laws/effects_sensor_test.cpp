/// Errors and delays of sensors: what they show in forces, chambers, speeds and the pump, and that delays are estimated; no
/// signature of the flow contains the speed that it is to explain.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/models/effects/effects_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test_support::effect;
using test_support::instant_at;
using test_support::log_of;
using test_support::swinging;
using test_support::swinging_log;

TEST(PressureOffset, ShowsInForceChambersAndPump) {
  const Machine machine = test_support::loader_crane();
  MachineSeries log = swinging_log(machine);
  const Index n = log.samples();
  log.pumps[0].leader.setZero(n);
  const Effect& e = effect("pressure_offset");
  const std::vector<double> a{1.0}, b{-1.0};
  MatrixXd column;
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kForce, 0}, 0, a, column));
  EXPECT_DOUBLE_EQ(column(3, 0), machine.cylinders[0].area_piston());
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kForce, 0}, 0, b, column));
  EXPECT_DOUBLE_EQ(column(3, 0), -machine.cylinders[0].area_rod());
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kSupplyExtend, 0}, 0, a, column));
  EXPECT_EQ(column(3, 0), 1.0);
  // The chamber whose sensor is right shows it only by way of the force (Evidence::columns).
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kReturnExtend, 0}, 0, a, column));
  EXPECT_EQ(column(3, 0), 0.0);
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kReturnExtend, 0}, 0, b, column));
  EXPECT_EQ(column(3, 0), 1.0);
  ASSERT_TRUE(e.columns(log, {EvidenceKind::kPump, 0}, 0, a, column));
  for (Index k = 0; k < n; k += 5) {  // the demand follows the wrong measurement while extending
    EXPECT_EQ(column(k, 0), log.cylinders[0].direction[k] > 0 ? -1.0 : 0.0);
  }
  EXPECT_FALSE(e.columns(log, {EvidenceKind::kForce, 1}, 0, a, column));
}

/// With positions late by d, the difference between the true force and that of the logged pose determines d.
TEST(SensorDelay, IsEstimatedWithinFivePerCentFrom20To200Milliseconds) {
  const Machine machine = test_support::loader_crane();
  for (const double delay : {0.02, 0.1, 0.2}) {
    const auto late = [&](double t) { return swinging(machine, t - delay); };
    const MachineSeries log = log_of(machine, late, 30.0, 0.02, 300.0);
    for (int i = 0; i < 2; ++i) {
      MatrixXd column;
      const std::vector<double> positions{delay, 1.0};
      ASSERT_TRUE(
          effect("sensor_delay").columns(log, {EvidenceKind::kForce, i}, -1, positions, column));
      double xy = 0.0, xx = 0.0;
      for (Index k = 0; k < log.samples(); ++k) {
        if (!std::isfinite(column(k, 0))) continue;
        const double truth = instant_at(machine, swinging(machine, log.time[k]), 300.0)
                                 .static_force[static_cast<std::size_t>(i)];
        const double left = truth - log.cylinders[static_cast<std::size_t>(i)].static_force[k];
        xy += column(k, 0) * left;
        xx += column(k, 0) * column(k, 0);
      }
      EXPECT_NEAR(xy / xx, 1.0, 0.05);  // the share of the shift that shows
    }
  }
}

/// With one joint's position late, every cylinder's force is that of a pose with this joint elsewhere, and only its own
/// cylinder's speed is delayed.
TEST(SensorDelay, OfOnePositionIsDistinguishedFromThatOfAll) {
  const Machine machine = test_support::loader_crane();
  const Index joints = machine.joint_count();
  const Index joint = 1;
  const double delay = 0.1;
  const auto late = [&](double t) {
    VectorXd x = swinging(machine, t);
    const VectorXd before = swinging(machine, t - delay);
    for (const Index k : {joint, joints + joint, 2 * joints + joint}) x[k] = before[k];
    return x;
  };
  MachineSeries log = log_of(machine, late, 30.0, 0.02, 300.0);
  StaticForce statics(machine);
  for (CylinderSeries& c : log.cylinders) {
    c.static_slope.resize(log.samples(), joints);
    c.command = 10.0 * c.speed;
  }
  for (Index k = 0; k < log.samples(); ++k) {
    const VectorXd q = log.q.row(k);
    statics.update(q.data(), 300.0, 1);
    for (std::size_t i = 0; i < log.cylinders.size(); ++i)
      log.cylinders[i].static_slope.row(k) = statics.force_jacobian().row(static_cast<Index>(i));
  }
  const Effect& e = effect("sensor_delay");
  const std::vector<double> all{delay, 1.0}, one{delay, 2.0 + static_cast<double>(joint)};
  for (int i = 0; i < 2; ++i) {
    double left = 0.0, by_one = 0.0, by_all = 0.0;
    MatrixXd alone, together;
    ASSERT_TRUE(e.columns(log, {EvidenceKind::kForce, i}, -1, one, alone));
    ASSERT_TRUE(e.columns(log, {EvidenceKind::kForce, i}, -1, all, together));
    for (Index k = 0; k + 10 < log.samples(); ++k) {  // samples after the end are not known
      const double truth = instant_at(machine, swinging(machine, log.time[k]), 300.0)
                               .static_force[static_cast<std::size_t>(i)];
      const double y = truth - log.cylinders[static_cast<std::size_t>(i)].static_force[k];
      left += y * y;
      by_one += std::pow(y - alone(k, 0), 2);
      by_all += std::pow(y - together(k, 0), 2);
    }
    EXPECT_LT(by_one, 0.01 * left) << i;  // to first order in an angle of some hundredths
    EXPECT_GT(by_all, 0.1 * left) << i;
    MatrixXd speed;
    const bool own = machine.cylinders[static_cast<std::size_t>(i)].joint == joint;
    EXPECT_EQ(e.columns(log, {EvidenceKind::kFlow, i}, -1, one, speed), own);
  }
  const std::vector<double> grid = e.grid(log, -1, 1);
  EXPECT_EQ(grid.size(), 2 + static_cast<std::size_t>(joints));
}

/// While the command is constant a delay shows nothing in the speed; after a step, for as long as it lasts.
TEST(SensorDelay, ShowsOnlyWhereTheCommandHasChanged) {
  const Machine machine = test_support::loader_crane();
  MachineSeries log = log_of(
      machine, [&](double t) { return swinging(machine, t); }, 10.0, 0.02, 300.0);
  CylinderSeries& c = log.cylinders[0];
  c.command.setZero(log.samples());
  c.command.tail(251).setConstant(0.5);  // step at 5 s
  MatrixXd column;
  ASSERT_TRUE(
      effect("sensor_delay")
          .columns(log, {EvidenceKind::kFlow, 0}, -1, std::vector<double>{0.1, 1.0}, column));
  EXPECT_EQ(column.topRows(250).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(column.bottomRows(246).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GT(column.middleRows(250, 5).cwiseAbs().minCoeff(), 0.0);
}

/// A signature that contains the speed which it is to explain smooths it: half of v(t + d) - v(t) cancels an oscillation of period
/// 2 d. Gains and dead bands, fitted to the whole log, may move by what the oscillation happens to have in common with commands.
TEST(SignaturesOfFlow, DoNotContainTheSpeedThatTheyExplain) {
  const Machine machine = test_support::loader_crane();
  MachineSeries log = log_of(
      machine, [&](double t) { return swinging(machine, t); }, 30.0, 0.02, 300.0);
  const VectorXd ripple = (2.0 * M_PI * 2.5 * log.time.array()).sin() * 0.01;
  for (CylinderSeries& c : log.cylinders) {
    c.stroke_measured = true;
    c.command = 10.0 * c.speed;
    c.pressure_a.setConstant(log.samples(), 8e6);
    c.pressure_b.setConstant(log.samples(), 5e6);
    c.measured_a = c.pressure_a, c.measured_b = c.pressure_b;
  }
  MachineSeries shaken = log;
  for (CylinderSeries& c : shaken.cylinders) c.speed += ripple;
  // A pump's limit is left out: whether it is reached at all depends on the gains.
  for (const char* id :
       {"sensor_delay", "valve_lag", "valve_deadband", "compressibility", "leakage"}) {
    const Effect& e = effect(id);
    const std::vector<EffectParameter>& parameters = e.info().parameters;
    std::vector<double> shape;
    for (const EffectParameter& p : parameters)
      if (!p.linear) shape.push_back(p.typical);
    const int at = e.places(machine).front();
    MatrixXd still, moved;
    ASSERT_TRUE(e.columns(log, {EvidenceKind::kFlow, 0}, at, shape, still)) << id;
    ASSERT_TRUE(e.columns(shaken, {EvidenceKind::kFlow, 0}, at, shape, moved)) << id;
    for (Index k = 0; k < still.cols(); ++k) {
      const VectorXd change =
          (moved - still).col(k).unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
      const double typical = std::abs(parameters[static_cast<std::size_t>(k)].typical);
      EXPECT_LT(typical * std::abs(change.dot(ripple)), 0.02 * ripple.squaredNorm())
          << id << ", parameter " << k;
    }
  }
}

}  // namespace
}  // namespace sparflow
