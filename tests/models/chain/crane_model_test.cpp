/// The exact chain of the crane model: flows, working pressures, pump law and energy balance.
#include "models/chain/crane_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/math/units.h"
#include "tests/models/small_process.h"
#include "tests/models/test_machines.h"

namespace sparflow {
namespace {

using test_support::Random;
using test_support::random_configuration;
using test_support::small_process;
using units::kBar;

/// The formula in the head of models/hydraulics/gaussian_process.h, term by term.
double by_hand(const GpParameters& p, double flow, double force) {
  double pressure = p.mean_constant + p.mean_slope * force;
  for (Eigen::Index j = 0; j < p.weight.size(); ++j) {
    const double a = (flow - p.flow[j]) / p.length_flow, b = (force - p.force[j]) / p.length_force;
    pressure += p.weight[j] * p.signal_std * p.signal_std * std::exp(-0.5 * (a * a + b * b));
  }
  return pressure;
}

/// Processes differ by cylinder and direction, so that a confusion shows.
CraneModel trained(const Machine& machine) {
  CraneModel model = CraneModel::untrained(machine);
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    const double n = static_cast<double>(i);
    model.cylinders[i].extend = GaussianProcess(small_process((40 + 7 * n) * kBar, 40.0 + n));
    model.cylinders[i].retract = GaussianProcess(small_process((55 + 9 * n) * kBar, -20.0 - n));
    model.cylinders[i].margin = (11 + n) * kBar;
  }
  return model;
}

// The vectorised kernel differs from std::exp by less than 1e-14 relative; pressures are some 1e7 Pa.
constexpr double kPressureTolerance = 1e-5;  // [Pa]

TEST(CraneModel, UntrainedNamesWhatIsMissing) {
  const Machine machine = test_support::loader_crane();
  CraneModel model = CraneModel::untrained(machine);
  EXPECT_FALSE(model.complete());
  EXPECT_EQ(model.missing().size(), 6u);
  EXPECT_EQ(model.missing().front(), "boom extend");
  EXPECT_EQ(model.pumps.at(0).standby, 22 * kBar);
  model = trained(machine);
  EXPECT_TRUE(model.complete());
  model.cylinders[1].retract = GaussianProcess();
  EXPECT_EQ(model.missing(), std::vector<std::string>{"jib retract"});
  // a drive without hydraulics and a cylinder that no pump feeds have no pressure to learn
  model.machine.cylinders[1].bore = 0.0;
  EXPECT_TRUE(model.complete());
}

TEST(CraneModel, FlowsAndPressuresByHand) {
  const Machine machine = test_support::loader_crane();
  const CraneModel model = trained(machine);
  Chain chain(model);
  const double q[] = {0.4, -1.1, 2.0};
  const double qd[] = {0.05, -0.08, 0.1};
  const double payload = 700;
  const MachineState& s = chain.evaluate({q, qd}, payload);
  const Eigen::VectorXd force =
      static_force<double>(machine, Eigen::Vector3d(q[0], q[1], q[2]), payload);
  double demand = 22 * kBar, total_flow = 0.0;
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Cylinder& c = machine.cylinders[at];
    const double rate = linkage_rates(machine, i, q[i]).d1;
    const double speed = rate * qd[i];
    const double piston = std::numbers::pi / 4 * c.bore * c.bore;
    const double annulus = std::numbers::pi / 4 * (c.bore * c.bore - c.rod * c.rod);
    const double flow = speed > 0 ? speed * piston : -speed * annulus;
    const GaussianProcess& process =
        speed > 0 ? model.cylinders[at].extend : model.cylinders[at].retract;
    const double pressure = by_hand(process.parameters(), flow, force[i]);
    // a few roundings in geometry and statics
    EXPECT_NEAR(s.cylinders[at].rate, rate, 1e-13);
    EXPECT_NEAR(s.cylinders[at].speed, speed, 1e-13);
    EXPECT_NEAR(s.cylinders[at].force, force[i], 1e-10 * std::abs(force[i]));
    EXPECT_NEAR(s.cylinders[at].flow, flow, 1e-15);
    EXPECT_NEAR(s.cylinders[at].pressure, pressure, kPressureTolerance);
    EXPECT_TRUE(s.cylinders[at].moving);
    demand = std::max(demand, pressure + model.cylinders[at].margin);
    total_flow += flow;
  }
  EXPECT_NEAR(s.pumps[0].flow, total_flow, 1e-15);
  EXPECT_NEAR(s.pumps[0].pressure, demand, kPressureTolerance);
  EXPECT_NEAR(s.power, demand * total_flow, 1e-9 * s.power);
}

TEST(CraneModel, TheHighestDemandSetsTheLoadSensingLeader) {
  const CraneModel model = trained(test_support::loader_crane());
  Chain chain(model);
  Random random(1);
  bool led[3] = {false, false, false};
  for (int sample = 0; sample < 200; ++sample) {
    double speed[3], force[3];
    for (int i = 0; i < 3; ++i) {
      speed[i] = random.integer(0, 3) == 0 ? 0.0 : random.uniform(-0.1, 0.1);
      force[i] = random.uniform(-5e4, 1.5e5);
    }
    const MachineState& s = chain.evaluate_pressures(speed, force);
    int leader = -1;
    double demand = model.pumps[0].standby;
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (speed[i] == 0.0) continue;
      const double asks = s.cylinders[at].pressure + model.cylinders[at].margin;
      if (asks > demand) {
        demand = asks;
        leader = i;
      }
    }
    EXPECT_EQ(s.pumps[0].leader, leader);
    EXPECT_EQ(s.pumps[0].pressure, demand);
    if (leader >= 0) led[leader] = true;
  }
  EXPECT_TRUE(led[0] && led[1] && led[2]);  // every cylinder was the leader in some sample
}

TEST(CraneModel, AtRestFlowIsZeroAndThePumpIsAtStandby) {
  const CraneModel model = trained(test_support::loader_crane());
  Chain chain(model);
  const double q[] = {0.4, -1.1, 2.0}, moving[] = {0.1, 0.1, 0.1}, rest[] = {0, 0, 0};
  chain.evaluate({q, moving}, 500, true);  // Its values must not survive in the next call.
  const MachineState& s = chain.evaluate({q, rest}, 500, true);
  for (const CylinderState& c : s.cylinders) {
    EXPECT_FALSE(c.moving);
    EXPECT_EQ(c.flow, 0.0);
    EXPECT_EQ(c.pressure, 0.0);
    EXPECT_EQ(c.pressure_std, 0.0);
    EXPECT_NE(c.force, 0.0);  // the load is held all the same
  }
  EXPECT_EQ(s.pumps[0].pressure, 22 * kBar);
  EXPECT_EQ(s.pumps[0].leader, -1);
  EXPECT_EQ(s.power, 0.0);
}

TEST(CraneModel, LowDemandsLeaveThePumpAtStandby) {
  CraneModel model = trained(test_support::loader_crane());
  model.pumps[0].standby = 400 * kBar;
  Chain chain(model);
  const double speed[] = {0.05, 0.05, 0.05}, force[] = {1e4, 1e4, 1e4};
  const MachineState& s = chain.evaluate_pressures(speed, force);
  EXPECT_EQ(s.pumps[0].pressure, 400 * kBar);
  EXPECT_EQ(s.pumps[0].leader, -1);
}

TEST(CraneModel, ConstantPressureSupplyIgnoresDemands) {
  CraneModel model = trained(test_support::knuckle_crane());
  model.pumps[0].standby = 142 * kBar;
  Chain chain(model);
  // Both working pressures are above the supply pressure.
  const double speed[] = {0.05, -0.03}, force[] = {4e5, -4e5};
  const MachineState& s = chain.evaluate_pressures(speed, force);
  EXPECT_GT(s.cylinders[0].pressure, 142 * kBar);
  EXPECT_EQ(s.pumps[0].pressure, 142 * kBar);
  EXPECT_EQ(s.pumps[0].leader, -1);
  EXPECT_NEAR(s.power, 142 * kBar * (s.cylinders[0].flow + s.cylinders[1].flow), 1e-9 * s.power);
}

TEST(CraneModel, PumpPowerIsUsefulPowerPlusThrottling) {
  for (const Machine& machine :
       {test_support::loader_crane(), test_support::knuckle_crane(), test_support::swing_crane()}) {
    SCOPED_TRACE(machine.name);
    const CraneModel model = trained(machine);
    Chain chain(model);
    Random random(2);
    for (int sample = 0; sample < 50; ++sample) {
      const Eigen::VectorXd q = random_configuration(machine, random);
      Eigen::VectorXd qd(q.size());
      for (Eigen::Index j = 0; j < q.size(); ++j) qd[j] = random.uniform(-0.15, 0.15);
      const MachineState& s = chain.evaluate({q.data(), qd.data()}, 600);
      double useful = 0.0, lost = 0.0;
      for (int i = 0; i < machine.cylinder_count(); ++i) {
        const CylinderState& c = s.cylinders[static_cast<std::size_t>(i)];
        const double throttled = s.throttling(machine, i);
        useful += c.pressure * c.flow;
        lost += throttled;
        EXPECT_GE(c.flow, 0.0);
        const Pump& pump = machine.pumps[static_cast<std::size_t>(machine.pump_of_cylinder(i))];
        if (pump.type == PumpType::kLoadSensing) {
          // A load-sensing pump is at least the margin above every moving cylinder, so that no valve creates power.
          const double margin = model.cylinders[static_cast<std::size_t>(i)].margin;
          EXPECT_GE(throttled, margin * c.flow * (1 - 1e-12));
        }
      }
      // sums of three or four products
      EXPECT_NEAR(s.power, useful + lost, 1e-12 * (std::abs(useful) + std::abs(lost)));
    }
  }
}

TEST(CraneModel, TwoPumpsAreIndependent) {
  const Machine machine =
      test_support::swing_crane();  // front feeds swing and jib, rear boom and extension
  const CraneModel model = trained(machine);
  Chain chain(model);
  const double force[] = {2e4, 9e4, -3e4, 5e3};
  const double all[] = {0.05, 0.04, -0.06, 0.08}, front[] = {0.05, 0, -0.06, 0},
               rear[] = {0, 0.04, 0, 0.08};
  const MachineState both = chain.evaluate_pressures(all, force);
  const MachineState only_front = chain.evaluate_pressures(front, force);
  const MachineState only_rear = chain.evaluate_pressures(rear, force);
  EXPECT_EQ(both.pumps[0].pressure, only_front.pumps[0].pressure);
  EXPECT_EQ(both.pumps[0].flow, only_front.pumps[0].flow);
  EXPECT_EQ(both.pumps[1].pressure, only_rear.pumps[1].pressure);
  EXPECT_EQ(both.pumps[1].flow, only_rear.pumps[1].flow);
  EXPECT_EQ(only_front.pumps[1].pressure, 24 * kBar);
  EXPECT_EQ(only_front.pumps[1].flow, 0.0);
  EXPECT_EQ(only_rear.pumps[0].pressure, 18 * kBar);
  EXPECT_NEAR(both.power, only_front.power + only_rear.power, 1e-12 * both.power);
  EXPECT_TRUE(both.pumps[0].leader == 0 || both.pumps[0].leader == 2);
  EXPECT_TRUE(both.pumps[1].leader == 1 || both.pumps[1].leader == 3);
}

TEST(CraneModel, ParallelCylindersNeedTwiceTheFlow) {
  const Machine machine = test_support::swing_crane();
  ASSERT_EQ(machine.cylinders[1].parallel, 2);
  const CraneModel model = trained(machine);
  Chain chain(model);
  const double force[] = {0, 0, 0, 0}, up[] = {0, 0.04, 0, 0}, down[] = {0, -0.04, 0, 0};
  const double bore2 = 0.110 * 0.110, rod2 = 0.070 * 0.070, quarter = std::numbers::pi / 4;
  EXPECT_NEAR(chain.evaluate_pressures(up, force).cylinders[1].flow, 2 * quarter * bore2 * 0.04,
              1e-15);
  EXPECT_NEAR(chain.evaluate_pressures(down, force).cylinders[1].flow,
              2 * quarter * (bore2 - rod2) * 0.04, 1e-15);
}

TEST(CraneModel, RestSpeedSetsWhatCountsAsMoving) {
  const CraneModel model = trained(test_support::loader_crane());
  Chain chain(model);
  const double speed[] = {0.0015, -0.0025, 0.0}, force[] = {5e4, 5e4, 5e4};
  const MachineState& s = chain.evaluate_pressures(speed, force, false, 2e-3);
  EXPECT_FALSE(s.cylinders[0].moving);
  EXPECT_TRUE(s.cylinders[1].moving);
  EXPECT_EQ(s.cylinders[0].flow, 0.0);
  EXPECT_GT(s.cylinders[1].flow, 0.0);
}

TEST(CraneModel, StandardDeviationIsThatOfTheProcess) {
  const CraneModel model = trained(test_support::loader_crane());
  Chain chain(model);
  const double speed[] = {0.03, 0.02, 0.04}, force[] = {5e4, 5e4, 5e4};
  const MachineState& s = chain.evaluate_pressures(speed, force, true);
  for (std::size_t i = 0; i < 3; ++i) {
    const double variance = model.cylinders[i].extend.variance(s.cylinders[i].flow, force[i]);
    EXPECT_GT(variance, 0.0);
    EXPECT_EQ(s.cylinders[i].pressure_std, std::sqrt(variance));
  }
}

TEST(CraneModel, WithoutHydraulicsThereIsForceButNoFlow) {
  Machine machine;
  machine.joints = {
      test_support::make_joint("axis", JointType::kPrismatic, {0, 0, 0}, {1, 0, 0}, {-1, 1})};
  machine.links = {test_support::make_link("carriage", 0, 95, {0, 0, 0})};
  machine.gravity = {-1.0, 0, 0};
  machine.cylinders = {test_support::make_cylinder("axis", 0, 0, 0, DirectLinkage{})};
  const CraneModel model = CraneModel::untrained(machine);
  EXPECT_TRUE(model.complete());
  Chain chain(model);
  const double q = 0.1, qd = 0.2;
  const MachineState& s = chain.evaluate({&q, &qd}, 0);
  EXPECT_NEAR(s.cylinders[0].force, 95.0, 1e-12);
  EXPECT_EQ(s.cylinders[0].speed, 0.2);
  EXPECT_EQ(s.cylinders[0].flow, 0.0);
  EXPECT_EQ(s.power, 0.0);
  EXPECT_EQ(s.throttling(machine, 0), 0.0);
}

}  // namespace
}  // namespace sparflow
