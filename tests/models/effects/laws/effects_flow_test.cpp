// Effects of the flow stage: their columns recover the parameters of a log that another formula made.
#include <gtest/gtest.h>

#include <random>

#include "models/effects/hydraulics.h"
#include "tests/models/effects/effect_series.h"

namespace sparflow::test_support {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class FlowEffects : public ::testing::Test {
 protected:
  Machine machine = two_direct_cylinders();
  MachineSeries log = two_cylinder_series(machine);

  MatrixXd gains_and(const MatrixXd& columns, std::size_t cylinder) const {
    MatrixXd x(log.samples(), 2 + columns.cols());
    const VectorXd& u = log.cylinders[cylinder].command;
    x << u.cwiseMax(0.0), u.cwiseMin(0.0), columns;
    return x;
  }
  MatrixXd columns(const std::string& id, int cylinder, int at,
                   const std::vector<double>& shape = {}) const {
    MatrixXd c;
    EXPECT_TRUE(effect_named(id).columns(log, {EvidenceKind::kFlow, cylinder}, at, shape, c)) << id;
    return c;
  }
  double residual(const MatrixXd& x, const VectorXd& y) const {
    return (y - x * scaled_least_squares(x, y)).norm() / y.norm();
  }
};

// u0 differs by direction; the gain is fitted again, so that both forms of the law agree.
TEST_F(FlowEffects, DeadBandIsRecoveredByDirectionAndForBothGains) {
  const double extend = 0.071, retract = 0.126;
  for (const bool full_flow : {false, true}) {
    CylinderSeries& c = log.cylinders[0];
    VectorXd straight = c.command;
    for (Index k = 0; k < log.samples(); ++k) {
      const double u = c.command[k], u0 = u > 0.0 ? extend : retract;
      const double g = (u > 0.0 ? 0.15 : 0.12) / (full_flow ? 1.0 - u0 : 1.0);
      c.speed[k] = g * std::max(0.0, std::abs(u) - u0) * (u > 0.0 ? 1.0 : -1.0);
      straight[k] = u * (u > 0.0 ? 0.15 : 0.12);
    }
    const MatrixXd lack = columns("valve_deadband", 0, 0, {full_flow ? 1.0 : 0.0});
    // With free gains both agree, within 1 %: the dead band is found to 1e-4, and few samples are inside it.
    const VectorXd free = scaled_least_squares(gains_and(lack, 0), c.speed);
    if (!full_flow) {
      EXPECT_NEAR(free[2], extend, 0.01 * extend);
      EXPECT_NEAR(free[3], retract, 0.01 * retract);
    }
    // With gains fixed by a reference without dead band the form of the law decides.
    const VectorXd pinned = scaled_least_squares(lack, c.speed - straight);
    EXPECT_NEAR(pinned[0], extend, 0.01 * extend) << full_flow;
    EXPECT_NEAR(pinned[1], retract, 0.01 * retract) << full_flow;
  }
}

TEST_F(FlowEffects, WithoutDeadBandNoneIsFound) {
  const VectorXd b = scaled_least_squares(gains_and(columns("valve_deadband", 0, 0, {0.0}), 0),
                                          log.cylinders[0].speed);
  EXPECT_NEAR(b[2], 0.0, 1e-4);  // tolerance of the search for the dead band
  EXPECT_NEAR(b[3], 0.0, 1e-4);
}

// The log's lag is integrated in small explicit steps, the effect's by the exact exponential.
TEST_F(FlowEffects, LagAndDelayAreDistinguishedAndEstimated) {
  CylinderSeries& c = log.cylinders[0];
  const VectorXd flow = c.speed;
  const double tau = 0.21;
  for (const auto& [first, last] : log.runs) {
    double y = flow[first];
    for (Index k = first + 1; k < last; ++k) {
      for (int i = 0; i < 200; ++i) y += (flow[k] - y) / tau * log.step / 200.0;
      c.speed[k] = y;
    }
  }
  const VectorXd right =
      scaled_least_squares(gains_and(columns("valve_lag", 0, 0, {tau, 0.0}), 0), c.speed);
  EXPECT_NEAR(right[2], 1.0, 0.01);  // Euler at a thousandth of tau
  const double exact = residual(gains_and(columns("valve_lag", 0, 0, {tau, 0.0}), 0), c.speed);
  for (const std::vector<double>& wrong :
       {std::vector<double>{0.16, 0.0}, {0.27, 0.0}, {0.16, 1.0}, {0.21, 1.0}}) {
    EXPECT_LT(3.0 * exact, residual(gains_and(columns("valve_lag", 0, 0, wrong), 0), c.speed));
  }
}

// A valve lag acts on the opening that the dead band leaves of the command, not on the command.
TEST_F(FlowEffects, LagActsBehindTheDeadBandOfTheModel) {
  CylinderSeries& c = log.cylinders[0];
  VectorXd opening = c.command;
  const std::vector<double> band{0.1, 0.15, 0.0};
  effect_named("valve_deadband").shape_opening(0, 0, band, opening);
  const double tau = 0.21;
  const Valve& valve = *machine.valve_of_cylinder(0);
  for (const auto& [first, last] : log.runs) {
    double y = 0.0;
    for (Index k = first; k < last; ++k) {
      const double u = opening[k];
      const double flow = u > 0.0 ? u * valve.max_flow_extend / machine.cylinders[0].area_piston()
                                  : u * valve.max_flow_retract / machine.cylinders[0].area_rod();
      if (k == first) y = flow;
      for (int i = 0; i < 200 && k > first; ++i) y += (flow - y) / tau * log.step / 200.0;
      c.speed[k] = y;
    }
  }
  const auto error_and_share = [&](const VectorXd& behind) {
    c.opening = behind;
    MatrixXd x(log.samples(), 3);
    x << opening.cwiseMax(0.0), opening.cwiseMin(0.0), columns("valve_lag", 0, 0, {tau, 0.0});
    return std::pair{residual(x, c.speed), scaled_least_squares(x, c.speed)[2]};
  };
  const auto [exact, share] = error_and_share(opening);
  const auto [of_command, other_share] = error_and_share({});
  EXPECT_NEAR(share, 1.0, 0.01);       // Euler at a thousandth of tau
  EXPECT_LT(3.0 * exact, of_command);  // that lag contains what the dead band removes as well
}

// The pump's pressure is late, so that both valves lose pressure drop; the log's law is an orifice written out by regimes.
TEST_F(FlowEffects, FlowFollowsThePressureDropBelowTheCompensatorsSetting) {
  const double setting = 12e5;
  CylinderSeries& c = log.cylinders[0];
  Index starved = 0, closed = 0;
  for (Index k = 0; k < log.samples(); ++k) {
    double& supply = log.pumps[0].pressure[k];
    supply -= 20e5 * std::pow(std::sin(0.8 * log.time[k]), 2);
    const double drop = supply - (c.command[k] > 0.0 ? c.pressure_a[k] : c.pressure_b[k]);
    if (c.command[k] == 0.0 || drop >= setting) continue;
    ++(drop > 0.0 ? starved : closed);
    c.speed[k] *= drop > 0.0 ? std::sqrt(drop) / std::sqrt(setting) : 0.0;
  }
  ASSERT_GT(starved, 100);
  ASSERT_GT(closed, 100);
  const MatrixXd right = gains_and(columns("valve_pressure_drop", 0, 0, {setting, 1.0}), 0);
  EXPECT_NEAR(scaled_least_squares(right, c.speed)[2], 1.0, 1e-9);  // the same law, no noise
  for (const double wrong : {0.7 * setting, 1.5 * setting}) {
    const MatrixXd other = gains_and(columns("valve_pressure_drop", 0, 0, {wrong, 1.0}), 0);
    EXPECT_LT(0.01, residual(other, c.speed)) << wrong;
  }
  log.pumps[0].pressure.resize(0);
  MatrixXd none;
  EXPECT_FALSE(effect_named("valve_pressure_drop")
                   .columns(log, {EvidenceKind::kFlow, 0}, 0, std::vector{setting, 1.0}, none));
}

/// Without its compensator a valve passes more than at the setting, too; what a single log shows then is another gain.
TEST_F(FlowEffects, FlowRisesBeyondTheSettingOfACompensatorThatHasFailed) {
  const double setting = 12e5;
  const Effect& effect = effect_named("valve_pressure_drop");
  EXPECT_TRUE(effect.needs_reference(std::vector{setting, 0.0}));
  EXPECT_FALSE(effect.needs_reference(std::vector{setting, 1.0}));
  const VectorXd passed = effect.passed_flow(log, 0, 0, std::vector{1.0, setting, 0.0}, {});
  const CylinderSeries& c = log.cylinders[0];
  Index more = 0;
  for (Index k = 0; k < log.samples(); ++k) {
    if (c.command[k] == 0.0) continue;
    const double drop =
        log.pumps[0].pressure[k] - (c.command[k] > 0.0 ? c.pressure_a[k] : c.pressure_b[k]);
    ASSERT_NEAR(passed[k], std::sqrt(std::max(0.0, drop) / setting), 1e-12) << k;
    more += passed[k] > 1.0 ? 1 : 0;
  }
  EXPECT_GT(more, 100);
  log.cylinders[0].speed = c.speed.cwiseProduct(passed);
  const MatrixXd right = gains_and(columns("valve_pressure_drop", 0, 0, {setting, 0.0}), 0);
  EXPECT_LT(residual(right, log.cylinders[0].speed), 1e-9);
}

/// With compensators behind the edges every section has the drop between the pump and the highest load that is commanded.
TEST_F(FlowEffects, SectionsShareTheFlowWhereTheirCompensatorsKnowTheHighestLoad) {
  const double setting = 40e5;  // above most pressure drops
  const Effect& effect = effect_named("valve_pressure_drop");
  Index other = 0, own = 0, alone = 0, differs = 0;
  for (const int at : {0, 1}) {
    const VectorXd passed = effect.passed_flow(log, at, at, std::vector{1.0, setting, 2.0}, {});
    for (Index k = 0; k < log.samples(); ++k) {
      const CylinderSeries &c = log.cylinders[static_cast<std::size_t>(at)],
                           &d = log.cylinders[static_cast<std::size_t>(1 - at)];
      if (c.command[k] == 0.0) continue;
      const double here = c.command[k] > 0.0 ? c.pressure_a[k] : c.pressure_b[k];
      const double there = d.command[k] > 0.0   ? d.pressure_a[k]
                           : d.command[k] < 0.0 ? d.pressure_b[k]
                                                : 0.0;
      const double drop = log.pumps[0].pressure[k] - std::max(here, there);
      differs += passed[k] < 0.99 * std::sqrt(std::clamp(
                                        (log.pumps[0].pressure[k] - here) / setting, 0.0, 1.0))
                     ? 1
                     : 0;
      ASSERT_NEAR(passed[k], std::sqrt(std::clamp(drop / setting, 0.0, 1.0)), 1e-12) << k;
      (d.command[k] == 0.0 ? alone : here < there ? other : own) += 1;
    }
  }
  EXPECT_GT(std::min({other, own, alone, differs}), 10);
  // the only section of a pump shares with none, so that the variant would be the plain law again
  Machine one = machine;
  one.pumps[0].feeds = {0};
  log.machine = std::make_shared<const Machine>(one);
  EXPECT_EQ(effect.passed_flow(log, 0, 0, std::vector{1.0, setting, 2.0}, {}).size(), 0);
}

/// A loss between valve and cylinder takes its part of the drop that is measured over both: with a quadratic loss and an edge below its
/// setting, Q = Q_valve (drop / (setting + k Q_valve^2))^0.5 in closed form.
TEST_F(FlowEffects, LossBehindTheValveLowersTheFlowWhereItFollowsThePressureDrop) {
  const double setting = 40e5;  // above all pressure drops, so that the edge is never compensated
  const std::vector<double> law{1.0, setting, 0.0};
  const Effect& loss = effect_named("line_loss");
  MatrixXd c;
  const std::vector<double> at_cylinder{0.0}, at_valve{1.0};
  EXPECT_FALSE(loss.columns(log, {EvidenceKind::kFlow, 0}, 0, at_cylinder, c));
  CylinderSeries& s = log.cylinders[0];
  s.passing = {&effect_named("valve_pressure_drop"), 0, law};
  EXPECT_FALSE(loss.columns(log, {EvidenceKind::kFlow, 1}, 0, at_cylinder, c));
  EXPECT_FALSE(loss.columns(log, {EvidenceKind::kFlow, 0}, 0, at_valve, c));

  const Cylinder& cylinder = log.machine->cylinders[0];
  const double k = 3e12;  // [Pa s^2/m^6]
  const VectorXd without = s.passing.effect->passed_flow(log, 0, 0, law, {});
  VectorXd with(log.samples());
  const double gain[2] = {0.11, 0.17};  // [m/s] extending, retracting
  const auto speed_at = [&](Index i) { return gain[s.command[i] > 0.0 ? 0 : 1] * s.command[i]; };
  for (Index i = 0; i < log.samples(); ++i) {
    const double q = std::abs(speed_at(i)) * supply_area(cylinder, s.command[i] > 0.0 ? 1 : -1);
    with[i] = without[i] / std::sqrt(1.0 + k * q * q / setting);
    s.speed[i] = speed_at(i) * with[i];
  }
  const std::vector<double> about{k, 0.0};
  ASSERT_TRUE(loss.columns(log, {EvidenceKind::kFlow, 0, about}, 0, at_cylinder, c));
  ASSERT_EQ(c.cols(), 2);
  double largest = 0.0;
  for (Index i = 0; i < log.samples(); ++i)
    largest = std::max(largest, std::abs(speed_at(i) * (with[i] - without[i])));
  ASSERT_GT(largest, 1e-3);
  for (Index i = 0; i < log.samples(); ++i)
    ASSERT_NEAR(k * c(i, 0), speed_at(i) * (with[i] - without[i]), 0.02 * largest) << i;
  // the same loss as a part of the model
  const VectorXd lost = loss.lost_behind_valve(log, 0, 0, std::vector{k, 0.0, 0.0});
  const VectorXd passed = s.passing.effect->passed_flow(log, 0, 0, law, lost);
  for (Index i = 0; i < log.samples(); ++i) {
    if (s.command[i] == 0.0) continue;
    ASSERT_NEAR(passed[i], with[i], 0.01) << i;
  }
  EXPECT_EQ(loss.lost_behind_valve(log, 1, 0, std::vector{k, 0.0, 0.0}).size(), 0);
  EXPECT_EQ(loss.lost_behind_valve(log, 0, 0, std::vector{k, 0.0, 1.0}).size(), 0);
}

// Where the model computes the flow from the measured pump pressure, a pump at its limit lowers that pressure, and beside it no flow.
TEST_F(FlowEffects, SaturationActsInThePumpAloneWhereFlowsFollowThePressureDrop) {
  const double limit = 1.3e-3;
  const std::vector<double> law{1.0, 12e5, 1.0};
  MatrixXd c;
  for (std::size_t i = 0; i < 2; ++i) {
    const int at = static_cast<int>(i);
    ASSERT_TRUE(effect_named("flow_saturation")
                    .columns(log, {EvidenceKind::kFlow, at}, 0, std::vector{limit}, c));
    log.cylinders[i].passed = effect_named("valve_pressure_drop").passed_flow(log, at, at, law, {});
    EXPECT_EQ(effect_named("valve_pressure_drop").passed_flow(log, 1 - at, at, law, {}).size(), 0);
    EXPECT_FALSE(effect_named("flow_saturation")
                     .columns(log, {EvidenceKind::kFlow, at}, 0, std::vector{limit}, c));
  }
  EXPECT_TRUE(effect_named("flow_saturation")
                  .columns(log, {EvidenceKind::kPump, 0}, 0, std::vector{limit}, c));
  for (Index k = 0; k < log.samples(); ++k) {
    const CylinderSeries& s = log.cylinders[0];
    const double drop =
        log.pumps[0].pressure[k] - (s.command[k] > 0.0 ? s.pressure_a[k] : s.pressure_b[k]);
    const double passed =
        s.command[k] == 0.0 || drop > 12e5 ? 1.0 : std::sqrt(std::max(0.0, drop) / 12e5);
    ASSERT_NEAR(s.passed[k], passed, 1e-12) << k;
  }
}

TEST_F(FlowEffects, SaturationSharesThePumpInProportion) {
  const double limit = 1.3e-3;
  std::vector<VectorXd> straight;
  for (std::size_t i = 0; i < 2; ++i) straight.push_back(log.cylinders[i].speed);
  const VectorXd asked = pump_flow(log, 0);
  const VectorXd served = (limit / asked.array()).min(1.0).matrix();
  for (std::size_t i = 0; i < 2; ++i) {
    log.cylinders[i].speed = straight[i].cwiseProduct(served);
    log.cylinders[i].flow = log.cylinders[i].flow.cwiseProduct(served);
  }
  ASSERT_GT((served.array() < 1.0).count(), 100);
  for (int i = 0; i < 2; ++i) {
    const VectorXd b =
        scaled_least_squares(gains_and(columns("flow_saturation", i, 0, {limit}).leftCols(1),
                                       static_cast<std::size_t>(i)),
                             log.cylinders[static_cast<std::size_t>(i)].speed);
    EXPECT_NEAR(b[2], 1.0, 0.02);  // The alternating fit of gains and share converges to about 1 %.
  }
  const std::vector<double> grid = effect_named("flow_saturation").grid(log, 0, 0);
  ASSERT_FALSE(grid.empty());
  EXPECT_LT(grid.front(), limit);
  EXPECT_GT(grid.back(), limit);
  const double values[] = {1.0, 0.0, limit};
  EXPECT_EQ(effect_named("flow_saturation").flow_limit(machine, 0, 0, values), limit);
  // The edges lose pressure with the square of their flow.
  MatrixXd pump;
  ASSERT_TRUE(effect_named("flow_saturation")
                  .columns(log, {EvidenceKind::kPump, 0}, 0, std::vector{limit, 0.0}, pump));
  const VectorXd lost = (served.array().square() - 1.0).matrix();
  // the gains and with them the share of the demand are fitted to about 1 %
  EXPECT_LT((pump.col(1) - lost).norm(), 0.03 * lost.norm());
  EXPECT_TRUE(pump.col(0).isZero(0.0));
}

// Sections that do not share: where both ask for too much, the pump's pressure p takes the value at which their edges, each with
// the root of its share of 15 bar, let the limit through.
TEST_F(FlowEffects, SaturationWithoutSharingStarvesTheHighestLoad) {
  const double limit = 1.3e-3, edge = 15e5;
  log.pumps[0].asked.resize(log.samples(), 2);
  VectorXd pressure = log.pumps[0].demand;
  std::vector<VectorXd> served(2, VectorXd::Ones(log.samples()));
  int saturated = 0, starved = 0;
  for (Index k = 0; k < log.samples(); ++k) {
    double asked[2], load[2];
    for (std::size_t i = 0; i < 2; ++i) {
      const CylinderSeries& c = log.cylinders[i];
      load[i] = c.direction[k] > 0 ? c.pressure_a[k] : c.pressure_b[k];
      asked[i] = c.direction[k] == 0 ? 0.0 : c.flow[k];
      log.pumps[0].asked(k, static_cast<Index>(i)) =
          c.direction[k] == 0 ? std::nan("") : load[i] + edge;
    }
    if (asked[0] + asked[1] <= limit) continue;
    ++saturated;
    const auto share = [&](std::size_t i, double p) {
      return std::sqrt(std::clamp((p - load[i]) / edge, 0.0, 1.0));
    };
    // the second path: a scan in steps of 50 Pa from above
    double p = std::max(load[0], load[1]) + edge;
    while (asked[0] * share(0, p) + asked[1] * share(1, p) > limit) p -= 50.0;
    pressure[k] = p;
    for (std::size_t i = 0; i < 2; ++i) served[i][k] = share(i, p);
    starved += std::min(served[0][k], served[1][k]) < 0.5 ? 1 : 0;
  }
  ASSERT_GT(saturated, 100);
  ASSERT_GT(starved, 5);
  for (std::size_t i = 0; i < 2; ++i)
    log.cylinders[i].speed = log.cylinders[i].speed.cwiseProduct(served[i]);
  for (int i = 0; i < 2; ++i) {
    const VectorXd b =
        scaled_least_squares(gains_and(columns("flow_saturation", i, 0, {limit, 2.0}).leftCols(1),
                                       static_cast<std::size_t>(i)),
                             log.cylinders[static_cast<std::size_t>(i)].speed);
    EXPECT_NEAR(b[2], 1.0,
                0.03);  // The alternating fit of gains and shares converges to about 1 %.
  }
  MatrixXd pump;
  ASSERT_TRUE(effect_named("flow_saturation")
                  .columns(log, {EvidenceKind::kPump, 0}, 0, std::vector{limit, 2.0}, pump));
  const VectorXd lost = pressure - log.pumps[0].demand;
  EXPECT_LT((pump.col(0) - lost).norm(), 0.05 * lost.norm());
}

// 0.5 l/min at 100 bar of load pressure lets a 100 mm piston sink by 0.5e-3/60/A.
TEST_F(FlowEffects, LeakageLowersTheLoad) {
  CylinderSeries& c = log.cylinders[0];
  const double a = machine.cylinders[0].area_piston(), b = machine.cylinders[0].area_rod();
  c.command.setZero();
  c.force.setConstant(100e5 * a);
  c.force.tail(800).setConstant(-100e5 * b);
  const MatrixXd col = columns("leakage", 0, 0, {1.0});
  const double k = effect_named("leakage").info().parameters[0].si * 0.5;
  EXPECT_NEAR(col(0, 0) * k, -0.5e-3 / 60.0 / a, 1e-12);
  EXPECT_NEAR(col(1999, 0) * k, 0.5e-3 / 60.0 / b, 1e-12);
  // Oil leaks past the spool only while that is closed.
  c.direction.setZero();
  c.direction.head(1000).setConstant(1);
  const MatrixXd closed = columns("leakage", 0, 0, {0.0});
  EXPECT_EQ(closed(0, 0), 0.0);
  EXPECT_EQ(closed(1999, 0), col(1999, 0));
  // Past the piston with tight ports the rod rests, and in motion the leak takes from the supply chamber what flows from A to B.
  c.direction.tail(200).setConstant(-1);
  c.pressure_a.setConstant(80e5);
  c.pressure_b.setConstant(30e5);
  const MatrixXd piston = columns("leakage", 0, 0, {2.0});
  EXPECT_NEAR(piston(0, 0), -50e5 / a, 1e-6 * 50e5 / a);
  EXPECT_EQ(piston(1500, 0), 0.0);
  EXPECT_NEAR(piston(1999, 0), -50e5 / b, 1e-6 * 50e5 / b);
  // What passes it from A to B leaves B beside the rod's flow, or does not leave A; whether pressures follow is a variant.
  const Effect& leakage = effect_named("leakage");
  MatrixXd edge;
  EXPECT_FALSE(leakage.return_edge_flow(log, 0, std::vector{2.0}, edge));
  ASSERT_TRUE(leakage.return_edge_flow(log, 0, std::vector{3.0}, edge));
  EXPECT_EQ(edge(0, 0), 50e5);
  EXPECT_EQ(edge(1500, 0), 0.0);
  EXPECT_EQ(edge(1999, 0), -50e5);
  EXPECT_EQ(columns("leakage", 0, 0, {3.0}), piston);
  c.pressure_b.resize(0);
  EXPECT_FALSE(leakage.return_edge_flow(log, 0, std::vector{3.0}, edge));
}

// A chamber of 1.0 m + 5 % of 2 m at 1 GPa: 10 bar/s take 1.1 mm/s.
TEST_F(FlowEffects, CompressedVolumeReducesTheRodSpeed) {
  CylinderSeries& c = log.cylinders[0];
  c.direction.setConstant(1);
  c.length.setConstant(1.0);
  c.pressure_a = 10e5 * log.time;
  const MatrixXd col = columns("compressibility", 0, 0, {0.0});
  EXPECT_NEAR(col(500, 0) * 1e-9, -1.1e-3, 1e-9);
  EXPECT_EQ(col(log.runs.back().first, 0), 0.0) << "there is no rate across a gap";
  c.direction.setConstant(-1);
  c.pressure_b = -10e5 * log.time;
  EXPECT_NEAR(columns("compressibility", 0, 0, {0.0})(500, 0) * 1e-9, -1.1e-3, 1e-9);
}

// 50 bar more in a chamber of 1.1 m at 1 GPa are 5.5 mm with and without lag, also when the supply chamber changes.
TEST_F(FlowEffects, APressureStepDisplacesTheRodEquallyForEveryLag) {
  CylinderSeries& c = log.cylinders[0];
  c.length.setConstant(1.0);
  c.pressure_a = VectorXd::Constant(log.samples(), 20e5);
  c.pressure_b = VectorXd::Constant(log.samples(), 90e5);
  c.pressure_a.segment(300, log.samples() - 300).setConstant(70e5);
  // The unfiltered pressure counts.
  c.measured_a = c.pressure_a;
  c.measured_b = c.pressure_b;
  c.pressure_a.setZero();
  c.direction.setConstant(-1);
  c.direction.tail(log.samples() - 300).setConstant(1);
  for (const double tau : {0.0, 0.2}) {
    const MatrixXd col = columns("compressibility", 0, 0, {tau});
    EXPECT_EQ(col(299, 0), 0.0);
    // A lag sampled every 20 ms changes the sum by less than 1e-3.
    EXPECT_NEAR(col.topRows(900).sum() * log.step * 1e-9, -5.5e-3, 6e-6) << tau;
  }
  EXPECT_LT(columns("compressibility", 0, 0, {0.2}).col(0).cwiseAbs().maxCoeff(),
            0.2 * columns("compressibility", 0, 0, {0.0}).col(0).cwiseAbs().maxCoeff());
}

TEST_F(FlowEffects, ActOnHydraulicCylindersAndNeedACommand) {
  for (const char* id : {"valve_deadband", "valve_lag", "leakage", "compressibility"}) {
    EXPECT_EQ(effect_named(id).places(machine), (std::vector<int>{0, 1})) << id;
    MatrixXd c;
    EXPECT_FALSE(effect_named(id).columns(log, {EvidenceKind::kForce, 0}, 0,
                                          std::vector<double>{0.1, 0.0}, c));
    EXPECT_FALSE(effect_named(id).columns(log, {EvidenceKind::kFlow, 1}, 0,
                                          std::vector<double>{0.1, 0.0}, c));
  }
  Machine dry = machine;
  dry.cylinders[0].bore = 0.0;
  EXPECT_EQ(effect_named("valve_lag").places(dry), (std::vector<int>{1}));
  log.cylinders[0].command.resize(0);
  MatrixXd c;
  for (const char* id : {"valve_deadband", "valve_lag", "flow_saturation"}) {
    EXPECT_FALSE(effect_named(id).columns(log, {EvidenceKind::kFlow, 0}, 0,
                                          std::vector<double>{0.1, 0.0}, c))
        << id;
  }
}

}  // namespace
}  // namespace sparflow::test_support
