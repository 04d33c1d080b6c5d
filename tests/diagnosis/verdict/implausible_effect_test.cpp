// An effect beyond what masses and areas of the machine make plausible is not named (models/effects/plausible.h).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "diagnosis/verdict/diagnose.h"
#include "models/math/units.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kOffset = 99e3;  // [N]

/// Diagnoses a log with a constant force of 99 kN beyond the statics on a cylinder that can push `bar` times its area.
Diagnosis diagnosed_at(double bar) {
  CraneModel model = testing_support::arm_model();
  model.machine.pumps[0].max_pressure = bar * units::kBar;
  Log log = testing_support::arm_log(0.5);
  testing_support::channel(log, "pA_arm").values.array() +=
      kOffset / model.machine.cylinders[0].area_piston();
  DiagnoseOptions options;
  options.check_data = false;
  options.candidates = {parse_effect("force_offset:arm", model.machine),
                        parse_effect("coulomb_friction:arm", model.machine)};
  return diagnose(model, {log}, {}, options);
}

bool names_offset(const Diagnosis& d) {
  return std::any_of(d.effects.begin(), d.effects.end(), [&](const DiagnosedEffect& e) {
    return d.named(e) && e.id == "force_offset";
  });
}

TEST(ImplausibleEffect, AForceThatTheCylinderCanGiveIsNamed) {
  const Diagnosis d = diagnosed_at(250.0);  // 283 kN
  ASSERT_TRUE(names_offset(d));
  // An offset is the plainest of laws: its estimate is off by the model-form error of 2 % and the noise at most.
  EXPECT_NEAR(d.effects[0].parameters[0].value, kOffset, 0.03 * kOffset);
}

TEST(ImplausibleEffect, AForceBeyondTheCylinderIsNotNamedAndANoteSaysWhy) {
  const Diagnosis d = diagnosed_at(60.0);  // 68 kN
  EXPECT_FALSE(names_offset(d));
  EXPECT_THAT(d.notes, Contains(HasSubstr("force_offset:arm: offset of ")));
  EXPECT_NE(d.verdict, Verdict::kNone) << "the error is there";
}

}  // namespace
}  // namespace sparflow
