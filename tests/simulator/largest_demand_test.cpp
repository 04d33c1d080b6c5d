/// The simulator's copy of the pump's law against that of the model, models/chain/pump_law.h: alone, and in the plant.
#include "simulator/hidden_effects/largest_demand.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "models/chain/pump_law.h"
#include "simulator/hidden_effects/plant.h"
#include "tests/simulator/hidden_log_support.h"

namespace sparflow::simulator {
namespace {

TEST(LargestDemand, IsTheLawOfTheModel) {
  std::mt19937 random(11);
  // whole bars, so that demands are often equal to each other and to standby
  std::uniform_int_distribution<int> bars(15, 30);
  for (int trial = 0; trial < 2000; ++trial) {
    const double standby = 1e5 * bars(random);
    LargestDemand copy{standby};
    PumpLaw first(standby);
    for (int i = 0; i < 5; ++i) {
      const double demand = bars(random) == 15 ? NAN : 1e5 * bars(random);
      copy.add(i, demand);
      first.add(i, demand);
      ASSERT_EQ(copy.pressure, first.pressure());
      ASSERT_EQ(copy.leader, first.leader());
    }
  }
}

TEST(LargestDemand, ThePlantsPumpFollowsTheLawOfTheModel) {
  const Machine machine = machine_named("loader_crane");
  const CraneLaws laws = draw_crane_laws(machine, 5);
  std::vector<std::unique_ptr<HiddenLaw>> none;
  std::vector<double> start;
  for (const Joint& joint : machine.joints)
    start.push_back(0.5 * (joint.position.lo + joint.position.hi));
  Plant plant(machine, laws, none, start, 0.02);
  const std::size_t cylinders = machine.cylinders.size();
  int led = 0, idle = 0;
  for (int k = 0; k < 400; ++k) {
    // All cylinders are commanded to and fro, each with a period of its own, and stop together every fourth second.
    std::vector<double> command(cylinders, 0.0);
    const double time = 0.02 * k;
    if (std::fmod(time, 4.0) < 3.0) {
      for (std::size_t i = 0; i < cylinders; ++i)
        command[i] = 0.5 * std::sin(time * (2.0 + 0.7 * static_cast<double>(i)));
    }
    plant.step(500.0, 40.0, command);
    for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
      PumpLaw law(laws.standby[p]);
      for (const int i : machine.pumps[p].feeds) {
        const auto at = static_cast<std::size_t>(i);
        const CylinderState& c = plant.state().cylinders[at];
        if (c.asked == 0) continue;
        law.add(i, (c.asked > 0 ? c.pressure_a : c.pressure_b) + laws.cylinders[at].margin);
      }
      const PumpState& pump = plant.state().pumps[p];
      ASSERT_EQ(pump.demand, law.pressure());
      ASSERT_EQ(pump.leader, law.leader());
      ++(law.leader() >= 0 ? led : idle);
    }
  }
  EXPECT_GT(led, 100);
  EXPECT_GT(idle, 50);
}

}  // namespace
}  // namespace sparflow::simulator
