#include "diagnosis/verdict/reference_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/effects/registry.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// A log and its references, of which one may have a sensor that is off.
struct LogAndReference {
  Machine machine = testing_support::drawn_machine("loader_crane");
  Log log, reference;

  LogAndReference() {
    const auto logs = testing_support::hidden_case(machine, {}, {7, 60.0});
    log = logs.train;
    reference = logs.reference;
  }
  /// @param by [Pa] added to the pressure of the boom's chamber A
  void shift(Log& of, double by) const {
    for (Channel& c : of.channels) {
      if (c.role == Role::kPressureA && c.index == machine.cylinder_index("boom"))
        c.values.array() += by;
    }
  }
  std::vector<ReferenceFault> faults() const {
    return reference_faults(CraneModel::untrained(machine),
                            diagnosis_signals(machine, {log}, {reference}), {});
  }
};

TEST(ReferenceFaults, SoundReferencesHaveNone) {
  EXPECT_THAT(LogAndReference().faults(), IsEmpty());
}

TEST(ReferenceFaults, AFaultOfTheLogIsNone) {
  LogAndReference c;
  c.shift(c.log, 25e5);
  EXPECT_THAT(c.faults(), IsEmpty());
}

TEST(ReferenceFaults, APressureSensorThatIsOffInTheReferencesIsSaid) {
  LogAndReference c;
  c.shift(c.reference, 25e5);
  const std::vector<ReferenceFault> faults = c.faults();
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].text, "force of boom");
  const double area =
      c.machine.cylinders[static_cast<std::size_t>(c.machine.cylinder_index("boom"))].area_piston();
  EXPECT_NEAR(faults[0].in_references, 25e5 * area, 0.3 * 25e5 * area);
  EXPECT_LT(faults[0].in_log, 0.5 * faults[0].in_references);
  EXPECT_THAT(faults[0].sentence(),
              StartsWith("in the force of boom they differ from the model by "));
  EXPECT_THAT(faults[0].sentence(), HasSubstr(" N (RMS)"));
  EXPECT_THAT(faults[0].sentence(), Not(HasSubstr("e+0")));
}

TEST(ReferenceFaults, WithoutReferencesThereIsNoneAndADiagnosisTakesThemOver) {
  LogAndReference c;
  c.shift(c.reference, 25e5);
  const CraneModel model = CraneModel::untrained(c.machine);
  EXPECT_THAT(reference_faults(model, diagnosis_signals(c.machine, {c.log}), {}), IsEmpty());
  DiagnoseOptions few;
  few.candidates = {parse_effect("pressure_offset:boom", c.machine)};
  const Diagnosis d = diagnose(model, {c.log}, {c.reference}, few);
  ASSERT_FALSE(d.reference_faults.empty());
  EXPECT_THAT(d.table(), HasSubstr("Check the references: in the force of boom"));
  EXPECT_THAT(d.json(), HasSubstr("\"rmse_references\""));
}

}  // namespace
}  // namespace sparflow
