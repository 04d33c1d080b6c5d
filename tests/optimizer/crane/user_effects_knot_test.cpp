// User effects from a file in the optimiser: exact derivatives of the whole energy and of all limits, with one law of each
// stage that influences a motion.
#include <gtest/gtest.h>

#include "models/effects/formula/user_effect.h"
#include "models/effects/registry.h"
#include "models/effects/user_effect_scope.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/nlp/derivative_check.h"
#include "optimizer/transcription/transcription.h"
#include "tests/optimizer/applied_effects.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using test_support::applied;
using test_support::Vector;

constexpr const char* kEffects = R"yaml(effects:
  - id: knot_tight_spot
    stage: force
    law: Fb * tanh(v / v0) * exp(-square((x - x0) / w))
    parameters:
      Fb: {unit: kN, bounds: [0, 50], typical: 20}
      v0: {unit: mm/s, bounds: [1, 50], typical: 10}
      x0: {unit: m, bounds: [0.5, 3], typical: 1.5}
      w: {unit: m, bounds: [0.1, 2], typical: 0.5}
  - id: knot_rod_mass                  # the rod's acceleration needs the linkage's fourth derivative
    stage: force
    law: m * a
    parameters:
      m: {unit: kg, bounds: [0, 5000], typical: 500}
  - id: knot_hose
    stage: pressure
    at: machine
    law: k * Q * exp(-beta * (oil - 20[degC]))
    parameters:
      k: {unit: bar/(l/min), bounds: [0, 1], typical: 0.2}
      beta: {unit: 1/degC, bounds: [0, 0.1], typical: 0.03}
  - id: knot_filter
    stage: pump
    law: k * Q_pump^2
    parameters:
      k: {unit: bar/(l/min)^2, bounds: [0, 0.1], typical: 1e-3}
)yaml";

/// Energy and limits of a motion of two intervals against central differences.
void check_whole_energy(const CraneModel& model, const std::string& what) {
  const MotionProblem problem = test_support::problem_for(model.machine, 13);
  const int n = model.machine.joint_count(), intervals = 2;
  CraneKnotOptions options;
  options.smoothing = {5e-3, 4e5};
  options.limit_pressure = true;
  TranscriptionSpec spec;
  spec.t = Eigen::Vector3d(0.0, 0.2, 0.5);
  spec.knot = std::make_shared<CraneKnotModel>(model, problem, options);
  const Vector wide = Vector::Constant(n, 100.0);
  spec.bounds =
      TranscriptionBounds::uniform(intervals, {-wide, wide}, {-wide, wide}, {-wide, wide});
  Transcription transcription(spec);
  std::mt19937 random(43);
  Vector x(transcription.size().variables);
  for (int k = 0; k <= intervals; ++k) {
    const Vector z = test_support::random_state(model.machine, random);
    for (int j = 0; j < n; ++j) {
      x[transcription.q_index(k, j)] = z[j];
      x[transcription.qd_index(k, j)] = z[n + j];
      if (k < intervals) x[transcription.qdd_index(k, j)] = 0.5 * z[n + j];
    }
  }
  // step and tolerances as for the catalogue (tests/optimizer/crane/effects_knot_model_test.cpp): the laws' own scales,
  // 10 mm/s and 0.1 m, are not finer than the smoothing's 5 mm/s
  const DerivativeCheck check = check_derivatives(transcription, x, 2e-5);
  EXPECT_LT(check.gradient_error, 1e-6) << what << check.worst_gradient;
  EXPECT_LT(check.jacobian_error, 1e-6) << what << check.worst_jacobian;
  EXPECT_LT(check.hessian_error, 2e-6) << what << check.worst_hessian;
}

class UserEffectsOnMachine : public ::testing::TestWithParam<std::string> {};

TEST_P(UserEffectsOnMachine, WholeEnergyMatchesFiniteDifferences) {
  const UserEffectScope scope;
  CraneModel bare =
      test_support::synthetic_model(load_machine(bundled_file("machines/" + GetParam())));
  CraneModel all = bare;
  for (const Effect* effect : register_user_effects(kEffects, "mine.yaml", bare.machine)) {
    ASSERT_NE(effect->info().in_motion.substr(0, 7), "nothing") << effect->info().id;
    for (const int at : effect->places(bare.machine)) {
      all.effects.push_back(applied({effect, at}, 0.5));
    }
    CraneModel model = bare;
    model.effects = {applied({effect, effect->places(bare.machine).front()})};
    check_whole_energy(model, effect->info().id + ": ");
  }
  check_whole_energy(all, "all: ");
}

TEST_P(UserEffectsOnMachine, EnergyChangesWithThem) {
  const UserEffectScope scope;
  const CraneModel bare =
      test_support::synthetic_model(load_machine(bundled_file("machines/" + GetParam())));
  const MotionProblem problem = test_support::problem_for(bare.machine, 13);
  CraneKnotOptions options;
  options.smoothing = {5e-3, 4e5};
  std::mt19937 random(5);
  const Vector z = test_support::random_state(bare.machine, random);
  Vector whole = Vector::Zero(3 * bare.machine.joint_count());
  whole.head(z.size()) = z;
  CraneKnotModel without(bare, problem, options);
  without.begin_node(0, 0);
  const double before = without.cost(whole.data());
  const auto effects = register_user_effects(kEffects, "mine.yaml", bare.machine);
  CraneModel model = bare;
  model.effects = {
      applied({effects[3], 0})};  // k Q_pump^2 beyond the pump's pressure: power can only rise
  CraneKnotModel with(model, problem, options);
  with.begin_node(0, 0);
  EXPECT_GT(with.cost(whole.data()), before);
}

INSTANTIATE_TEST_SUITE_P(Bundled, UserEffectsOnMachine,
                         ::testing::Values("loader_crane.yaml", "swing_crane_two_pumps.yaml"),
                         [](const auto& i) { return i.param.substr(0, i.param.find('.')); });

}  // namespace
}  // namespace sparflow
