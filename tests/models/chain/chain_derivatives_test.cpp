/// Derivatives of the exact law against central differences of the exact chain, for each effect of the catalogue. New effects are
/// covered by standing in the registry.
#include "models/chain/chain_derivatives.h"

#include <gtest/gtest.h>

#include <cmath>

#include "models/effects/effective_machine.h"
#include "models/effects/registry.h"
#include "models/math/error.h"
#include "models/math/units.h"
#include "tests/models/small_process.h"
#include "tests/models/test_machines.h"

namespace sparflow {
namespace {

using test_support::numeric_partial;
using test_support::Random;
using test_support::small_process;
using units::kBar;

CraneModel model_of(const Machine& machine) {
  CraneModel model = CraneModel::untrained(machine);
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    const double n = static_cast<double>(i);
    model.cylinders[i].extend = GaussianProcess(small_process((60 + 7 * n) * kBar, 40.0 + n));
    model.cylinders[i].retract = GaussianProcess(small_process((75 + 9 * n) * kBar, -20.0 - n));
    model.cylinders[i].margin = (11 + n) * kBar;
  }
  return model;
}

AppliedEffect typical(const EffectAt& e) {
  AppliedEffect applied{e.effect, e.at, {}, {}, {}};
  for (const EffectParameter& p : e.effect->info().parameters) applied.values.push_back(p.typical);
  return applied;
}

/// Positions, speeds that are well above those at which friction turns, and accelerations.
Eigen::VectorXd moving_state(const Machine& machine, Random& random) {
  const Eigen::Index n = machine.joint_count();
  Eigen::VectorXd x(3 * n);
  x.head(n) = test_support::random_configuration(machine, random);
  for (Eigen::Index j = 0; j < n; ++j) {
    x[n + j] = random.uniform(0.08, 0.2) * (random.integer(0, 1) == 0 ? -1.0 : 1.0);
    x[2 * n + j] = random.uniform(-0.3, 0.3);
  }
  return x;
}

constexpr double kCarriedMass = 600.0;  // [kg]

/// Total forces, working pressures, pressures of the pumps and power, one after another.
struct ExactLaw {
  explicit ExactLaw(const CraneModel& model) : chain(model), n(model.machine.joint_count()) {}
  Eigen::VectorXd operator()(const Eigen::VectorXd& x) {
    const MachineState& s =
        chain.evaluate({x.data(), x.data() + n, x.data() + 2 * n}, kCarriedMass);
    const auto m = static_cast<Eigen::Index>(s.cylinders.size());
    const auto p = static_cast<Eigen::Index>(s.pumps.size());
    Eigen::VectorXd all(2 * m + p + 1);
    leaders.clear();
    for (Eigen::Index i = 0; i < m; ++i) {
      all[i] = s.cylinders[static_cast<std::size_t>(i)].total_force;
      all[m + i] = s.cylinders[static_cast<std::size_t>(i)].pressure;
    }
    for (Eigen::Index i = 0; i < p; ++i) {
      all[2 * m + i] = s.pumps[static_cast<std::size_t>(i)].pressure;
      leaders.push_back(s.pumps[static_cast<std::size_t>(i)].leader);
    }
    all[2 * m + p] = s.power;
    return all;
  }
  Chain chain;
  int n;
  std::vector<int> leaders;
};

std::vector<const Jet*> same_of(const ChainDerivatives& law) {
  std::vector<const Jet*> all;
  for (const Jet& j : law.instant().force) all.push_back(&j);
  for (const Jet& j : law.instant().pressure) all.push_back(&j);
  for (std::size_t p = 0; p < law.instant().pump_flow.size(); ++p)
    all.push_back(&law.pump_pressure(static_cast<int>(p)));
  all.push_back(&law.power());
  return all;
}

double derivative(const Jet& jet, Eigen::Index k) { return jet.gradient(static_cast<int>(k)); }

/// Compares at some states. @return number of pumps that a cylinder led and that standby led, over all states
std::pair<int, int> check_derivatives(const CraneModel& model, const std::string& what) {
  Random random(17);
  ExactLaw exact(model);
  ChainDerivatives law(model);
  std::pair<int, int> led{0, 0};
  for (int sample = 0; sample < 4; ++sample) {
    const Eigen::VectorXd x = moving_state(model.machine, random);
    const Eigen::VectorXd values = exact(x);
    const std::vector<int> leaders = exact.leaders;
    for (const int leader : leaders) ++(leader < 0 ? led.second : led.first);
    const Eigen::Index n = exact.n;
    law.evaluate({x.data(), x.data() + n, x.data() + 2 * n}, kCarriedMass);
    const std::vector<const Jet*> jets = same_of(law);
    for (Eigen::Index k = 0; k < (law.uses_acceleration() ? 3 : 2) * n; ++k) {
      bool same_leaders = true;
      // the kernel is exact to 1e-14, which a step of 1e-4 makes 1e-10 of the value; truncation h^6 is below it
      const Eigen::VectorXd by_differences = numeric_partial(
          [&](const Eigen::VectorXd& moved) {
            Eigen::VectorXd all = exact(moved);
            same_leaders = same_leaders && exact.leaders == leaders;
            return all;
          },
          x, k, 1e-4);
      if (!same_leaders) continue;  // there is no derivative within the step
      for (Eigen::Index i = 0; i < values.size(); ++i) {
        const Jet& jet = *jets[static_cast<std::size_t>(i)];
        // a factor of 100 above rounding
        const double tolerance = 1e-8 * (std::abs(values[i]) + std::abs(by_differences[i])) + 1e-6;
        EXPECT_NEAR(derivative(jet, k), by_differences[i], tolerance)
            << what << ", quantity " << i << ", variable " << k << ", sample " << sample;
      }
    }
    for (Eigen::Index i = 0; i < values.size(); ++i)
      EXPECT_NEAR(jets[static_cast<std::size_t>(i)]->value, values[i],
                  1e-11 * std::abs(values[i]) + 1e-5)
          << what << ", quantity " << i;
  }
  return led;
}

class ChainDerivativesOf : public ::testing::TestWithParam<Machine (*)()> {};

TEST_P(ChainDerivativesOf, EachEffectMatchesCentralDifferences) {
  CraneModel model = model_of(GetParam()());
  std::vector<EffectAt> cases{{}};
  for (const EffectAt& e : candidates(model.machine))
    if (e.effect->changes_machine() || acts_in_motion(*e.effect)) cases.push_back(e);
  ASSERT_GT(cases.size(), 10u);
  const bool load_sensing = model.machine.pumps[0].type == PumpType::kLoadSensing;
  for (const EffectAt& e : cases) {
    model.effects.clear();
    if (e.effect != nullptr) model.effects.push_back(typical(e));
    const std::string what =
        e.effect == nullptr ? "none" : effect_key(e.effect->info(), model.machine, e.at);
    for (PumpModel& p : model.pumps) p.standby = load_sensing ? 20 * kBar : 250 * kBar;
    const auto led = check_derivatives(model, what);
    if (load_sensing) {
      EXPECT_GT(led.first, 0) << what;
      for (PumpModel& p : model.pumps) p.standby = 600 * kBar;
      EXPECT_GT(check_derivatives(model, what + ", standby").second, 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, ChainDerivativesOf,
                         ::testing::Values(&test_support::loader_crane,
                                           &test_support::knuckle_crane,  // constant pressure
                                           &test_support::swing_crane));  // two pumps

TEST(ChainDerivatives, OfEqualDemandsTheFirstLeadsAsInTheChain) {
  CraneModel model = CraneModel::untrained(test_support::loader_crane());
  GpParameters flat = small_process(80 * kBar, 0.0);
  flat.weight.setZero();
  for (CylinderModel& c : model.cylinders) c.extend = c.retract = GaussianProcess(flat);
  ChainDerivatives law(model);
  Chain chain(model);
  const double q[] = {0.4, -1.1, 2.0}, qd[] = {0.0, -0.08, 0.1};
  const MachineState& s = chain.evaluate({q, qd}, kCarriedMass);
  ASSERT_EQ(s.cylinders[1].pressure, s.cylinders[2].pressure);
  law.evaluate({q, qd}, kCarriedMass);
  EXPECT_EQ(s.pumps[0].leader, 1);
  EXPECT_EQ(law.instant().leader[0], 1);
  EXPECT_EQ(law.pump_pressure(0).value, s.pumps[0].pressure);
}

TEST(ChainDerivatives, AMachineOfTooManyJointsIsRefusedInWordsOfDerivatives) {
  const CraneModel model = CraneModel::untrained(test_support::random_machine(11, 1));
  try {
    const ChainDerivatives law(model);
    FAIL() << "expected an InputError";
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find("remove"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("derivatives"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace sparflow
