/// The whole plant against closed forms and its own energy balance.
#include "simulator/plant/run/plant_run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/files/machine_file.h"
#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "models/math/units.h"
#include "simulator/random/random.h"

namespace sparflow::plant {
namespace {

Machine machine_named(const std::string& name) {
  return load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/" + name + ".yaml");
}

/// Nominal but rigid and with the payload at the tip, so that closed forms are those of joints alone.
PlantParameters plain_parameters(const Machine& machine) {
  PlantParameters p = default_parameters(machine);
  p.flex_angle = 0.0;
  p.pendulum.rope_length = 0.0;
  for (PumpParameters& pump : p.pumps) pump.flow_sharing = 0.0;
  return p;
}

std::vector<double> middle(const Machine& machine) {
  std::vector<double> q;
  for (const Joint& j : machine.joints) q.push_back(0.5 * (j.position.lo + j.position.hi));
  return q;
}

/// Static force by the other code path, models/machine. [N]
Eigen::VectorXd holding_force(const Machine& machine, const std::vector<double>& q,
                              double payload) {
  StaticForce force(machine);
  force.update(q.data(), payload, 0);
  return force.force();
}

void hold(PlantRun& run, std::vector<double> command, double seconds) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds / 0.02)); ++i) run.advance(command);
}

TEST(PlantRun, AfterAMoveTheChambersCarryTheStaticForces) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  for (CylinderParameters& c : p.cylinders) {
    c.friction.coulomb = 0.0;  // what friction carries is not in the chambers
    c.friction.viscous *= 100.0;
    c.leakage = 0.0;
  }
  PlantRun run(machine, p, middle(machine), 700.0);
  hold(run, {0.5, -0.4, 0.6}, 2.0);
  hold(run, {0.0, 0.0, 0.0}, 15.0);
  const Record& r = run.record();
  const Eigen::VectorXd force = holding_force(machine, r.q, 700.0);
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<std::size_t>(c);
    const Cylinder& drive = machine.cylinders[k];
    const double chambers =
        r.pressure_a[k] * drive.area_piston() - r.pressure_b[k] * drive.area_rod();
    // what is left of the oscillation after fifteen seconds
    EXPECT_NEAR(chambers, force[c], 2e-3 * std::abs(force[c]) + 20.0) << drive.name;
  }
}

TEST(PlantRun, APayloadPressesClosedChambersTogetherByTheirModulus) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  p.oil.air_fraction = 0.0;
  for (CylinderParameters& c : p.cylinders) {
    c.friction.coulomb = 0.0;
    c.friction.viscous *= 100.0;
    c.leakage = 0.0;
  }
  PlantRun run(machine, p, middle(machine), 500.0);
  hold(run, {0.3, 0.3, -0.3}, 1.0);  // presses both chambers of each cylinder
  hold(run, {0.0, 0.0, 0.0}, 15.0);
  for (const int c : {0, 1, 2})
    ASSERT_GT(std::min(run.record().pressure_a[static_cast<std::size_t>(c)],
                       run.record().pressure_b[static_cast<std::size_t>(c)]),
              10e5);
  const Record before = run.record();
  run.set_payload(600.0);
  hold(run, {0.0, 0.0, 0.0}, 15.0);
  const Record& after = run.record();
  const Eigen::VectorXd added =
      holding_force(machine, after.q, 600.0) - holding_force(machine, before.q, 500.0);
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<std::size_t>(c);
    const Cylinder& drive = machine.cylinders[k];
    const Joint& joint = machine.joints[static_cast<std::size_t>(drive.joint)];
    const double a = cylinder_length(machine, c, joint.position.lo);
    const double b = cylinder_length(machine, c, joint.position.hi);
    const double x = cylinder_length(machine, c, before.q[k]);
    const double va = p.cylinders[k].dead_volume + drive.area_piston() * (x - std::min(a, b));
    const double vb = p.cylinders[k].dead_volume + drive.area_rod() * (std::max(a, b) - x);
    const double stiffness =
        1.5e9 * (std::pow(drive.area_piston(), 2) / va + std::pow(drive.area_rod(), 2) / vb);
    const double moved = cylinder_length(machine, c, after.q[k]) - x;
    // the stiffness changes along the way by the share that the volumes do, some per mille
    EXPECT_NEAR(moved, -added[c] / stiffness, 0.01 * std::abs(moved) + 1e-6) << drive.name;
  }
}

TEST(PlantRun, APayloadIsTakenGraduallyAndThePressuresHardlyRing) {
  const Machine machine = machine_named("loader_crane");
  double overshoot[2];
  for (const bool gradual : {false, true}) {
    RunOptions options;
    options.payload_time = gradual ? 0.8 : 0.0;
    PlantRun run(machine, default_parameters(machine), middle(machine), 0.0, options);
    hold(run, {0.0, 0.0, 0.0}, 1.0);
    const double before = run.record().pressure_a[1];
    run.set_payload(800.0);
    double peak = 0.0, halfway = 0.0;
    for (int i = 0; i < 1500; ++i) {
      run.advance({0.0, 0.0, 0.0});
      peak = std::max(peak, run.record().pressure_a[1]);
      if (i == 19) halfway = run.record().payload;
    }
    EXPECT_NEAR(halfway, gradual ? 400.0 : 800.0, 1e-6);
    EXPECT_EQ(run.record().payload, 800.0);
    const double after = run.record().pressure_a[1];
    ASSERT_GT(after, before + 20e5);
    overshoot[gradual ? 1 : 0] = (peak - after) / (after - before);
    // what the load brought, less what became heat, is stored: a load taken at rest needs no work of the pump
    EXPECT_LT(std::abs(run.ledger().imbalance()), 1e-3 * std::abs(run.ledger().payload_exchange));
  }
  // a load that appears at once swings as far beyond its place as it had to go, but for the damping
  EXPECT_GT(overshoot[0], 0.4);
  EXPECT_LT(overshoot[1], 0.5 * overshoot[0]);
}

TEST(PlantRun, WhatACounterbalanceValveThrottlesIsToldApartFromTheLine) {
  const Machine machine = machine_named("loader_crane");
  for (const double sides : {0.0, 1.0}) {
    PlantParameters p = default_parameters(machine);
    for (CylinderParameters& c : p.cylinders) c.counterbalance.sides = sides;
    PlantRun run(machine, p, middle(machine), 500.0);
    hold(run, {-0.5, 0.0, 0.0}, 4.0);
    const auto& loss = run.ledger().cylinder_loss[0];
    const double valve = loss[static_cast<std::size_t>(Loss::kCounterbalance)];
    const double line = loss[static_cast<std::size_t>(Loss::kLine)];
    EXPECT_GT(line, 0.0);
    if (sides < 0.5) {
      EXPECT_EQ(valve, 0.0);
    } else {
      EXPECT_GT(valve, 10.0 * line);  // the valve holds the load back, the hose does not
    }
  }
}

TEST(PlantRun, ALeakingPistonSinksAtTheRateOfItsLeak) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  for (CylinderParameters& c : p.cylinders) c.leakage = 0.0;
  CylinderParameters& boom = p.cylinders[0];
  boom.leakage = 0.5 * units::kLitrePerMinute / 100e5;
  boom.friction.coulomb = 0.0;
  boom.counterbalance.sides = 2;  // the rod side is open to tank, so that the piston can sink
  p.tank.temperature = 40.0;
  p.tank.cooling = 0.0;
  PlantRun run(machine, p, middle(machine), 500.0);
  hold(run, {0.0, 0.0, 0.0}, 10.0);
  const Record a = run.record();
  hold(run, {0.0, 0.0, 0.0}, 10.0);
  const Record& b = run.record();
  const double speed =
      (cylinder_length(machine, 0, b.q[0]) - cylinder_length(machine, 0, a.q[0])) / 10.0;
  const double across =
      0.5 * (a.pressure_a[0] - a.pressure_b[0] + b.pressure_a[0] - b.pressure_b[0]);
  // the leak is a mass flow: its volume in the chamber is smaller by the compression, 0.5 % here
  EXPECT_NEAR(speed, -boom.leakage * across / machine.cylinders[0].area_piston(),
              0.01 * std::abs(speed));
  EXPECT_LT(speed, -1e-4);
}

TEST(PlantRun, ThePumpHoldsStandbyMarginAndCutOff) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  p.pumps[0].power = 1e9;
  PlantRun run(machine, p, middle(machine), 300.0);
  hold(run, {0.0, 0.0, 0.0}, 3.0);
  EXPECT_NEAR(run.record().pump_pressure[0], 22e5, 0.05e5);
  hold(run, {0.0, 0.0, 0.5}, 6.0);
  const StateLayout& l = run.system().layout();
  const double asked = run.state()[static_cast<std::size_t>(l.cylinder(2, StateLayout::kHoseA))];
  // the arm still swings a little, and the pump follows with its lag
  EXPECT_NEAR(run.record().pump_pressure[0] - asked, 20e5, 1e5);
  EXPECT_NEAR(run.record().pump_flow[0] * 6e4, 75.0 * (0.49 - 0.054) / (1.0 - 0.054), 0.5);
  hold(run, {0.0, 0.0, 1.0}, 25.0);  // the extension stands at its stop
  EXPECT_NEAR(run.record().q[2], 6.0, 0.01);
  EXPECT_NEAR(run.record().pump_pressure[0], 310e5, 0.5e5);
}

TEST(PlantRun, PortReliefValvesEndThePressureOfAStoppedSlewingDrive) {
  const Machine machine = machine_named("excavator");
  const auto highest = [&](double relief, double lever) {
    PlantParameters p = default_parameters(machine);
    for (CylinderParameters& c : p.cylinders) c.port_relief = relief;
    PlantRun run(machine, p, middle(machine), 800.0);
    std::vector<double> levers(machine.cylinders.size(), 0.0);
    double most = 0.0;
    for (int k = 0; k < 250; ++k) {  // 3 s of full swing, then the lever is let go
      levers[0] = k < 150 ? lever : 0.0;
      run.advance(levers);
      most = std::max({most, run.record().pressure_a[0], run.record().pressure_b[0]});
    }
    return most;
  };
  const double set = default_parameters(machine).cylinders[0].port_relief;
  for (const double lever : {1.0, -1.0}) {  // each way another chamber is pressed together
    EXPECT_GT(highest(1e9, lever), 1.5 * set) << lever;
    // at the port's full flow the valve is 20 bar above its setting
    EXPECT_LT(highest(set, lever), set + 20e5) << lever;
  }
}

TEST(PlantRun, AConstantPressureSupplyHoldsItsPressure) {
  const Machine machine = machine_named("hmf_2020_k4");
  PlantRun run(machine, plain_parameters(machine), middle(machine), 0.0);
  hold(run, {0.0, 0.0}, 2.0);
  EXPECT_NEAR(run.record().pump_pressure[0], 250e5, 0.1e5);
  hold(run, {0.5, 0.0}, 3.0);
  EXPECT_NEAR(run.record().pump_pressure[0], 250e5, 1e5);
}

TEST(PlantRun, TheTorqueLimitHoldsPressureTimesFlow) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  p.pumps[0].power = 4e3;
  PlantRun run(machine, p, {0.2, -0.6, 4.0}, 1500.0);
  hold(run, {1.0, 0.0, 0.0}, 3.0);
  const double pressure = run.record().pump_pressure[0];
  const double displaced = run.state()[static_cast<std::size_t>(
      run.system().layout().pump(0, StateLayout::kDisplacement))];
  EXPECT_NEAR(pressure * displaced * p.pumps[0].max_flow, 4e3, 40.0);
  // 4 kW are less than what the command asks for
  EXPECT_LT(run.record().flow[0], 0.5 * p.cylinders[0].max_flow_extend);
}

TEST(PlantRun, AnExhaustedPumpStarvesTheHighestLoadUnlessTheSectionsShare) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  p.pumps[0].max_flow = 60.0 * units::kLitrePerMinute;
  double share[2][2];
  for (const int sharing : {0, 1}) {
    p.pumps[0].flow_sharing = sharing;
    PlantRun run(machine, p, {0.0, -0.9, 1.0}, 1500.0);
    hold(run, {0.8, 0.0, 0.8}, 4.0);
    const Record& r = run.record();
    ASSERT_GT(r.pressure_a[0], r.pressure_a[2] + 20e5);  // the boom has the higher load
    share[sharing][0] = r.flow[0] / p.cylinders[0].max_flow_extend;
    share[sharing][1] = r.flow[2] / p.cylinders[2].max_flow_extend;
  }
  EXPECT_LT(share[0][0], 0.5 * share[0][1]);                  // the boom gets what is left
  EXPECT_NEAR(share[1][0], share[1][1], 0.02 * share[1][1]);  // both get the same share
}

/// Levers of an operator: each cylinder gets a new command now and then, and away from its stops.
CommandSource random_levers(const Machine& machine, simulator::Random& random) {
  auto command = std::make_shared<std::vector<double>>(machine.cylinders.size(), 0.0);
  return [command, &machine, &random](const Record& r) {
    for (std::size_t c = 0; c < command->size(); ++c) {
      double& u = (*command)[c];
      const int j = machine.cylinders[c].joint;
      const Range range = machine.joints[static_cast<std::size_t>(j)].position;
      const double at = (r.q[static_cast<std::size_t>(j)] - range.lo) / (range.hi - range.lo);
      const double slope =
          linkage_rates(machine, static_cast<int>(c), r.q[static_cast<std::size_t>(j)]).d1;
      if (random.chance(0.01)) u = random.chance(0.4) ? 0.0 : random.uniform(-1.0, 1.0);
      if (at < 0.1 && u * slope < 0.0) u = 0.0;
      if (at > 0.9 && u * slope > 0.0) u = 0.0;
    }
    return *command;
  };
}

TEST(PlantRun, EnergyBalancesOverTwentyRandomCycles) {
  const std::vector<std::string> names = {"loader_crane", "hmf_2020_k4", "excavator",
                                          "swing_crane"};
  for (unsigned cycle = 0; cycle < 20; ++cycle) {
    const Machine machine = machine_named(names[cycle % names.size()]);
    simulator::Random random(100 + cycle, "levers");
    PlantParameters p = default_parameters(machine);
    if (cycle % 2 == 0) p.flex_angle = 0.0;
    if (machine.name == "excavator")
      p.pendulum.rope_length = 0.0;  // full levers would swing it over
    PlantRun run(machine, p, middle(machine), 200.0);
    const CommandSource levers = random_levers(machine, random);
    run_plant(run, levers, 6.0);
    run.set_payload(500.0);
    run_plant(run, levers, 6.0);
    run.set_payload(0.0);
    const RunResult r = run_plant(run, levers, 3.0);
    ASSERT_EQ(r.status, RunStatus::kRunning) << r.message;
    const EnergyLedger& l = r.ledger;
    double pumps = 0.0;
    for (const double w : l.pump_work) pumps += w;
    EXPECT_GT(pumps, 1e3);
    EXPECT_LT(std::abs(l.imbalance()), 1e-3 * pumps) << machine.name << " cycle " << cycle;
  }
}

TEST(PlantRun, ARopeThatIsSwungUpSidewaysEndsTheRunAndSaysSo) {
  const Machine machine = machine_named("excavator");
  PlantParameters p = default_parameters(machine);
  p.flex_angle = 0.0;
  PlantRun run(machine, p, middle(machine), 300.0);
  const double period = 2.0 * 3.14159 * std::sqrt(1.5 / 9.81);
  const RunResult r = run_plant(
      run,
      [&](const Record& now) {  // slews in time with the swing
        std::vector<double> u(machine.cylinders.size(), 0.0);
        u[0] = std::fmod(now.t, period) < 0.5 * period ? 1.0 : -1.0;
        return u;
      },
      60.0);
  EXPECT_EQ(r.status, RunStatus::kKinematicsEnd);
  EXPECT_NE(r.message.find("rope"), std::string::npos);
  EXPECT_LT(r.records.back().t, 59.0);
  EXPECT_TRUE(std::isfinite(r.ledger.imbalance()));
}

TEST(PlantRun, NoPassivePartCreatesEnergy) {
  const Machine machine = machine_named("swing_crane");
  simulator::Random random(7, "levers");
  PlantRun run(machine, default_parameters(machine), middle(machine), 300.0);
  const CommandSource levers = random_levers(machine, random);
  EnergyLedger last = run.ledger();
  for (int i = 0; i < 500; ++i) {
    run.advance(levers(run.record()));
    const EnergyLedger& now = run.ledger();
    for (std::size_t c = 0; c < now.cylinder_loss.size(); ++c) {
      for (int k = 0; k < kLosses; ++k) {
        const auto place = static_cast<std::size_t>(k);
        // the bristles of friction give back what they stored, at most Fc * presliding
        const double slack = place == static_cast<std::size_t>(Loss::kFriction) ? 0.5 : 0.01;
        EXPECT_GE(now.cylinder_loss[c][place], last.cylinder_loss[c][place] - slack)
            << kLossNames[place];
      }
    }
    EXPECT_GE(now.tank_loss, last.tank_loss - 0.01);
    EXPECT_GE(now.swing_loss, last.swing_loss - 0.01);
    EXPECT_GE(now.pump_loss[0], last.pump_loss[0]);
    last = now;
  }
}

TEST(PlantRun, HalvingTheToleranceChangesTheEnergyByLessThanAThousandth) {
  const Machine machine = machine_named("loader_crane");
  double work[2];
  for (const int half : {0, 1}) {
    RunOptions options;
    if (half == 1) options.relative_tolerance *= 0.5;
    PlantRun run(machine, default_parameters(machine), middle(machine), 400.0, options);
    run_plant(
        run,
        [](const Record& r) {
          // told by time alone, so that both runs get the same commands
          return std::vector<double>{0.6 * std::sin(0.7 * r.t), 0.5 * std::sin(1.1 * r.t),
                                     0.7 * std::sin(0.5 * r.t)};
        },
        15.0);
    work[half] = run.ledger().pump_work[0];
  }
  EXPECT_NEAR(work[1], work[0], 1e-3 * work[0]);
}

TEST(PlantRun, AStopCatchesTheCylinderAndTheCushionSlowsItBefore) {
  const Machine machine = machine_named("loader_crane");
  double fastest[2];  // in the last five millimetres
  for (const int cushioned : {0, 1}) {
    PlantParameters p = plain_parameters(machine);
    if (cushioned == 0)
      for (CylinderParameters& c : p.cylinders) c.end.cushion_length = 0.0;
    PlantRun run(machine, p, {0.5, -1.0, 5.7}, 0.0);
    fastest[cushioned] = 0.0;
    for (int i = 0; i < 2000; ++i) {
      run.advance({0.0, 0.0, 1.0}, 0.002);
      EXPECT_LT(run.record().q[2], 6.003);  // the stop yields by two millimetres
      if (run.record().q[2] > 5.995)
        fastest[cushioned] = std::max(fastest[cushioned], run.record().qd[2]);
    }
    EXPECT_GT(run.record().q[2], 5.999);
  }
  EXPECT_LT(fastest[1], 0.7 * fastest[0]);
}

TEST(PlantRun, AMachineThatStartsBeyondItsRangeIsNotPushedBackByItsStop) {
  const Machine machine = machine_named("loader_crane");
  PlantRun run(machine, plain_parameters(machine), {0.5, -1.0, 6.05}, 300.0);
  hold(run, {0.0, 0.0, 0.0}, 2.0);
  EXPECT_NEAR(run.record().q[2], 6.05, 0.005);
}

TEST(PlantRun, AMachineWithoutHydraulicsFollowsItsDrive) {
  const Machine machine = machine_named("emps");
  PlantParameters p = default_parameters(machine);
  p.pendulum.rope_length = 0.0;
  PlantRun run(machine, p, middle(machine), 0.0);
  hold(run, {0.2}, 1.0);
  EXPECT_NEAR(run.record().qd[0], 0.2 * 0.5, 1e-3);
  EXPECT_GT(run.ledger().drive_work, 0.0);
}

TEST(PlantRun, BendingBoomsSinkByTheirAngleUnderTheirLargestTorque) {
  const Machine machine = machine_named("loader_crane");
  PlantParameters p = plain_parameters(machine);
  p.flex_angle = 0.01;
  PlantRun run(machine, p, {0.575, -1.125, 6.0}, 1000.0);
  const FlexibleBooms& booms = run.system().booms();
  ASSERT_EQ(booms.hinges.size(), 2U);
  for (std::size_t h = 0; h < 2; ++h) {
    const double bent = std::abs(run.state()[static_cast<std::size_t>(booms.hinges[h])]);
    EXPECT_GT(bent, 0.001);
    EXPECT_LT(bent, 0.0101);
  }
}

}  // namespace
}  // namespace sparflow::plant
