// The smooth law with effects: for each effect of the catalogue, on every bundled machine, exact derivatives of the
// whole energy, agreement with the exact chain, and nothing at all at no strength. New effects are covered by
// standing in the registry.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/effects/effective_machine.h"
#include "models/math/error.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/nlp/derivative_check.h"
#include "optimizer/transcription/transcription.h"
#include "tests/optimizer/applied_effects.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using test_support::applied;
using test_support::Matrix;
using test_support::problem_for;
using test_support::random_state;
using test_support::Vector;

ModeTable changing_modes(int intervals, int cylinders) {
  ModeTable modes = ModeTable::Constant(intervals, cylinders, CylinderMode::kExtend);
  modes.bottomRows(1).setConstant(CylinderMode::kRetract);
  if (cylinders > 1) modes.col(0).topRows(1).setConstant(CylinderMode::kRest);
  return modes;
}

class EffectsOnMachine : public ::testing::TestWithParam<std::string> {
 protected:
  EffectsOnMachine()
      : bare_(test_support::synthetic_model(load_machine(bundled_file("machines/" + GetParam())))) {
  }

  /// One of each effect, at the last place it can sit; loops that need all of them go over this.
  std::vector<EffectAt> one_of_each() const {
    std::vector<EffectAt> all;
    for (const EffectAt& e : candidates(bare_.machine)) {
      if (!all.empty() && all.back().effect == e.effect) all.pop_back();
      all.push_back(e);
    }
    return all;
  }
  std::string key(const EffectAt& e) const {
    return effect_key(e.effect->info(), bare_.machine, e.at);
  }

  CraneModel bare_;
};

/// The energy integral and all limits as the solver sees them.
void check_whole_energy(const CraneModel& model, bool held, const std::string& what) {
  const MotionProblem problem = problem_for(model.machine, 13);
  const int n = model.machine.joint_count(), m = model.machine.cylinder_count(), intervals = 2;
  CraneKnotOptions options;
  options.smoothing = {5e-3, 4e5};
  options.limit_pressure = true;
  if (held) options.modes = changing_modes(intervals, m);
  TranscriptionSpec spec;
  spec.t = Eigen::Vector3d(0.0, 0.2, 0.5);
  spec.knot = std::make_shared<CraneKnotModel>(model, problem, options);
  const Vector wide = Vector::Constant(n, 100.0);
  spec.bounds =
      TranscriptionBounds::uniform(intervals, {-wide, wide}, {-wide, wide}, {-wide, wide});
  Transcription transcription(spec);
  std::mt19937 random(41);
  Vector x(transcription.size().variables);
  for (int k = 0; k <= intervals; ++k) {
    const Vector z = random_state(model.machine, random);
    for (int j = 0; j < n; ++j) {
      x[transcription.q_index(k, j)] = z[j];
      x[transcription.qd_index(k, j)] = z[n + j];
      if (k < intervals) x[transcription.qdd_index(k, j)] = 0.5 * z[n + j];
    }
  }
  // step: truncation h^4 over the 5 mm/s blend stays under 1e-6 (tests/optimizer/crane/crane_knot_model_test.cpp)
  const DerivativeCheck check = check_derivatives(transcription, x, 2e-5);
  const std::string where = what + (held ? ", modes held: " : ", free: ");
  EXPECT_LT(check.gradient_error, 1e-6) << where << check.worst_gradient;
  EXPECT_LT(check.jacobian_error, 1e-6) << where << check.worst_jacobian;
  EXPECT_LT(check.hessian_error, 2e-6) << where << check.worst_hessian;
}

TEST_P(EffectsOnMachine, WholeEnergyWithEachEffectMatchesFiniteDifferences) {
  for (const EffectAt& e : one_of_each()) {
    CraneModel model = bare_;
    model.effects = {applied(e)};
    for (const bool held : {false, true}) check_whole_energy(model, held, key(e));
  }
}

TEST_P(EffectsOnMachine, WholeEnergyWithAllEffectsMatchesFiniteDifferences) {
  CraneModel model = bare_;
  for (const EffectAt& e : candidates(bare_.machine)) model.effects.push_back(applied(e, 0.3));
  for (const bool held : {false, true}) check_whole_energy(model, held, "all");
}

/// States whose every cylinder moves clearly: the smooth law's blend is then over to 1e-9.
Vector clear_state(const CraneModel& model, std::mt19937& random) {
  Chain chain(model);
  const int n = model.machine.joint_count();
  for (;;) {
    const Vector z = random_state(model.machine, random);
    bool clear = true;
    for (const CylinderState& c : chain.evaluate({z.data(), z.data() + n}, 0.0).cylinders) {
      clear = clear && std::abs(c.speed) > 5e-4;
    }
    if (clear) return z;
  }
}

TEST_P(EffectsOnMachine, SmoothLawTendsToTheExactOne) {
  const MotionProblem problem = problem_for(bare_.machine, 9);
  const int n = bare_.machine.joint_count(), m = bare_.machine.cylinder_count();
  std::vector<EffectAt> cases = one_of_each();
  cases.push_back({});  // all of them at once
  for (const EffectAt& e : cases) {
    CraneModel model = bare_;
    if (e.effect != nullptr) {
      model.effects = {applied(e)};
    } else {
      for (const EffectAt& each : candidates(bare_.machine)) {
        model.effects.push_back(applied(each, 0.3));
      }
    }
    const std::string name = e.effect != nullptr ? key(e) : "all";
    Chain chain(model);
    std::mt19937 random(37);
    for (int trial = 0; trial < 6; ++trial) {
      Vector z(3 * n);
      z.head(2 * n) = clear_state(model, random);
      for (int j = 0; j < n; ++j) z[2 * n + j] = 0.3 * std::sin(trial + 2.0 * j);
      const MachineState& exact =
          chain.evaluate({z.data(), z.data() + n, z.data() + 2 * n}, problem.payload);
      for (const bool held : {false, true}) {
        CraneKnotOptions options;
        options.smoothing = {2e-5, 1e3};  // 0.02 mm/s, 0.01 bar
        options.modes = ModeTable();
        if (held) {
          options.modes = ModeTable::Constant(1, m, CylinderMode::kRest);
          for (int c = 0; c < m; ++c) {
            options.modes(0, c) = exact.cylinders[static_cast<std::size_t>(c)].speed > 0.0
                                      ? CylinderMode::kExtend
                                      : CylinderMode::kRetract;
          }
        }
        CraneKnotModel knot(model, problem, options);
        knot.begin_node(0, 0);
        double flow = 0.0;
        for (const CylinderState& c : exact.cylinders) flow += c.flow;
        // The tolerance is the error of the smoothed maximum, doubled for effects that multiply pressures, and rounding.
        const double tolerance =
            2e3 * std::log(m + 1.0) * flow / 1e3 + 1e-9 * std::abs(exact.power) / 1e3 + 1e-12;
        EXPECT_NEAR(knot.cost(z.data()), exact.power / 1e3, tolerance)
            << name << (held ? ", modes held" : ", free");
      }
    }
  }
}

TEST_P(EffectsOnMachine, AnEffectOfZeroStrengthChangesNothing) {
  const MotionProblem problem = problem_for(bare_.machine, 9);
  const int n = bare_.machine.joint_count();
  CraneKnotOptions options;
  options.smoothing = {5e-3, 4e5};
  options.limit_pressure = true;
  CraneKnotModel without(bare_, problem, options);
  Chain exact_without(bare_);
  for (const EffectAt& e : one_of_each()) {
    CraneModel model = bare_;
    model.effects = {applied(e, 0.0)};
    CraneKnotModel with(model, problem, options);
    Chain exact(model);
    std::mt19937 random(7);
    for (int trial = 0; trial < 5; ++trial) {
      Vector z = Vector::Zero(3 * n);
      z.head(2 * n) = random_state(bare_.machine, random);
      const double power = without.cost(z.data());
      EXPECT_NEAR(with.cost(z.data()), power, 1e-12 * std::max(1.0, std::abs(power))) << key(e);
      const int size = with.size();
      Vector g(2 * n), gw(size);
      Matrix h(2 * n, 2 * n), hw(size, size);
      without.cost_derivatives(z.data(), g.data(), h.data());
      with.cost_derivatives(z.data(), gw.data(), hw.data());
      // second derivatives of two paths: differences of products that cancel
      EXPECT_LT((gw.head(2 * n) - g).cwiseAbs().maxCoeff(), 1e-11 * (1.0 + g.cwiseAbs().maxCoeff()))
          << key(e);
      EXPECT_LT((hw.topLeftCorner(2 * n, 2 * n) - h).cwiseAbs().maxCoeff(),
                1e-10 * (1.0 + h.cwiseAbs().maxCoeff()))
          << key(e);
      const double p = exact_without.evaluate({z.data(), z.data() + n}, 300.0).power;
      EXPECT_NEAR(exact.evaluate({z.data(), z.data() + n}, 300.0).power, p,
                  1e-12 * std::max(1.0, std::abs(p)))
          << key(e);
    }
  }
}

TEST_P(EffectsOnMachine, EffectsWithoutInfluenceOnAMotionHaveNoLaw) {
  std::mt19937 random(3);
  Instant<double> s = make_instant(bare_.machine);
  const auto m = static_cast<std::size_t>(bare_.machine.cylinder_count());
  for (const EffectAt& e : candidates(bare_.machine)) {
    if (acts_in_motion(*e.effect)) continue;
    const AppliedEffect a = applied(e);
    std::vector<double> force(m, 0.0), pressure(m, 0.0), demand(m, 0.0),
        pump(bare_.pumps.size(), 0.0);
    for (int state = 0; state < 8; ++state) {
      std::uniform_real_distribution<double> unit(-1.0, 1.0);
      for (std::size_t i = 0; i < m; ++i) {
        s.side[i] = state % 3 - 1;
        s.speed[i] = 0.1 * s.side[i];
        s.flow[i] = s.return_flow[i] = 1e-3 * std::abs(s.side[i]);
        s.static_force[i] = s.force[i] = 1e5 * unit(random);
        s.rate[i] = 0.5;
        s.pressure[i] = 1e7;
      }
      for (std::size_t p = 0; p < pump.size(); ++p) {
        s.pump_flow[p] = 1e-3;
        s.pump_pressure[p] = 2e7;
        s.leader[p] = m > 0 ? 0 : -1;
      }
      a.effect->add_force(s, a.at, a.values, force);
      a.effect->add_pressure(s, a.at, a.values, pressure);
      a.effect->add_return(s, a.at, a.values, pressure);
      a.effect->add_demand(s, a.at, a.values, demand);
      a.effect->add_pump(s, a.at, a.values, pump);
    }
    EXPECT_THAT(force, ::testing::Each(0.0)) << key(e);
    EXPECT_THAT(pressure, ::testing::Each(0.0)) << key(e);
    EXPECT_THAT(demand, ::testing::Each(0.0)) << key(e);
    EXPECT_THAT(pump, ::testing::Each(0.0)) << key(e);
  }
}

INSTANTIATE_TEST_SUITE_P(Bundled, EffectsOnMachine,
                         ::testing::ValuesIn(test_support::machine_files()),
                         test_support::machine_test_name);

CraneModel loader() {
  return test_support::synthetic_model(load_machine(bundled_file("machines/loader_crane.yaml")));
}

TEST(EffectsInKnots, OnlyInertiaNeedsAccelerations) {
  CraneModel model = loader();
  const MotionProblem problem = problem_for(model.machine, 1);
  model.effects = {applied("coulomb_friction:boom", model.machine)};
  EXPECT_EQ(CraneKnotModel(model, problem, {}).size(), 6);
  model.effects.push_back(applied("inertia", model.machine));
  const CraneKnotModel knot(model, problem, {});
  EXPECT_TRUE(knot.uses_acceleration());
  EXPECT_EQ(knot.size(), 9);
}

TEST(EffectsInKnots, EffectsOnMassesAloneKeepTheFastLaw) {
  CraneModel model = loader();
  model.effects = {applied("unmodelled_mass:boom", model.machine),
                   applied("pump_lag:main", model.machine)};
  EXPECT_FALSE(SmoothEffects::needed(model));
  // The law equals that of a machine with this mass in its file.
  CraneModel heavier = model;
  heavier.effects.clear();
  heavier.machine = *effective_machine(model.machine, model.effects);
  const MotionProblem problem = problem_for(model.machine, 1);
  CraneKnotModel a(model, problem, {}), b(heavier, problem, {});
  const CraneModel bare = loader();
  CraneKnotModel without(bare, problem, {});
  std::mt19937 random(5);
  double largest = 0.0;
  for (int trial = 0; trial < 20;
       ++trial) {  // the boom is not the load-sensing leader in every state
    const Vector z = random_state(model.machine, random);
    EXPECT_EQ(a.cost(z.data()), b.cost(z.data()));
    largest = std::max(largest, std::abs(a.cost(z.data()) - without.cost(z.data())));
  }
  EXPECT_GT(largest, 1e-3);  // [kW] effect of 60 kg
}

TEST(EffectsInKnots, SaturationLowersThePumpsFlowLimit) {
  CraneModel model = loader();
  MotionProblem problem = problem_for(model.machine, 1);
  AppliedEffect saturation = applied("flow_saturation:main", model.machine);
  const double own = problem.limits.pump_max_flow[0];
  for (const double limit : {0.6 * own, 1.5 * own}) {
    saturation.values[2] = limit;
    model.effects = {saturation};
    const double expected = std::min(own, limit);
    EXPECT_DOUBLE_EQ(effect_flow_limit(model.machine, model.effects, 0, own), expected);
    const CraneKnotModel knot(model, problem, {});
    Vector lower(knot.path_count()), upper(knot.path_count());
    knot.path_bounds(lower.data(), upper.data());
    ASSERT_EQ(knot.path_name(0), "flow of pump main");
    EXPECT_DOUBLE_EQ(upper[0], expected / 1e-3);
  }
  EXPECT_DOUBLE_EQ(effect_flow_limit(model.machine, model.effects, 0, 0.0), 1.5 * own);
  EXPECT_EQ(effect_flow_limit(model.machine, {}, 0, 0.0), 0.0);
}

TEST(EffectsInKnots, TooManyJointsAreRefused) {
  Machine machine = loader().machine;
  const Joint joint = machine.joints.back();
  for (int extra = 0; extra < 5; ++extra) {
    machine.joints.push_back(joint);
    machine.joints.back().name += std::to_string(extra);
  }
  CraneModel model = test_support::synthetic_model(machine);
  model.effects = {applied("coulomb_friction:boom", machine)};
  EXPECT_NO_THROW(SmoothEffects{model});  // 8 joints, 16 variables
  model.effects.push_back(applied("inertia", machine));
  EXPECT_THROW(SmoothEffects{model}, InputError);  // 24
}

}  // namespace
}  // namespace sparflow
