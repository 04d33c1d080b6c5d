/// Friction behind the bounce of starts and stops, which no law of the catalogue describes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "diagnosis/extension/extend.h"
#include "diagnosis/selection/effect_estimate.h"
#include "diagnosis/verdict/diagnose.h"
#include "identification/learning/fit.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using testing_support::drawn_machine;
using testing_support::hidden_case;
using testing_support::HiddenCase;

CraneModel settling_model(const Machine& machine, const Log& log) {
  FitOptions options;
  options.hold_out_every = 0;
  return fit(machine, {log}, {}, options).model;
}

/// Adds to the piston's pressure 100 bar that ring out after every start and stop of the boom, at 2 to 4 Hz. One-sided, they
/// come after starts of extending alone, on the rod's side and without a change of sign, as of a load that lies on the ground.
void let_boom_bounce(simulator::GeneratedLog& log, bool one_sided = false) {
  const auto column = [&](const std::string& name) -> std::vector<double>& {
    const auto at = std::find(log.names.begin(), log.names.end(), name);
    return log.columns.at(static_cast<std::size_t>(at - log.names.begin()));
  };
  const std::vector<double>&lever = column("u_boom"), &time = column("t_s");
  std::vector<double>& pressure = column(one_sided ? "pB_boom_bar" : "pA_boom_bar");
  double since = -10.0, frequency = 2.0;
  for (std::size_t k = 1; k < log.rows(); ++k) {
    if ((lever[k] == 0.0) != (lever[k - 1] == 0.0)) {
      since = time[k];
      frequency = frequency > 3.5 ? 2.0 : frequency + 0.3;
    }
    const double t = time[k] - since;
    const double swing =
        one_sided ? (lever[k] > 0.0 ? 1.0 : 0.0) : std::cos(2.0 * std::numbers::pi * frequency * t);
    pressure[k] += 100.0 * std::exp(-t / 0.25) * swing;
  }
}

struct Bounce {
  Diagnosis with, without;  ///< with noise that settles, and with even noise
  double truth = 0.0;       ///< [N] Coulomb friction
};

const Bounce& bounce() {
  static const Bounce b = [] {
    const Machine machine = drawn_machine("loader_crane");
    HiddenCase logs = hidden_case(machine, {{"coulomb_friction", "boom", 0.5, 0}}, {7, 100.0});
    let_boom_bounce(logs.logs.train);
    const Log log = log_from_text("train.csv", simulator::csv_text(logs.logs.train), machine);
    const CraneModel model = settling_model(machine, log);
    DiagnoseOptions even;
    even.evidence.force_widths.clear();  // behind a low-pass the bounce hides nothing
    even.evidence.mechanisms.switch_off(Mechanism::kSettling);
    return Bounce{diagnose(model, {log}), diagnose(model, {log}, {}, even),
                  logs.truth("coulomb_friction", "Fc")};
  }();
  return b;
}

TEST(DiagnoseSettling, BounceOfStartsAndStopsHidesNoFriction) {
  const Diagnosis& d = bounce().with;
  ASSERT_EQ(d.verdict, Verdict::kMissing) << d.table();
  EXPECT_EQ(d.effects.front().key(), "coulomb_friction:boom") << d.table();
  EXPECT_NEAR(d.effects.front().applied.values[0], bounce().truth, 0.1 * bounce().truth);
  EXPECT_THAT(d.table(), HasSubstr("; without starts and stops "));
}

/// The bounce is noise of all rows alike there, and the friction less certain.
TEST(DiagnoseSettling, WithEvenNoiseItIsLessCertain) {
  const auto interval = [](const Diagnosis& d) {
    const AppliedEffect& e = d.effects.front().applied;
    return e.upper95[0] - e.lower95[0];
  };
  const Diagnosis& d = bounce().without;
  if (d.verdict == Verdict::kMissing) {
    EXPECT_GT(interval(d), 1.5 * interval(bounce().with)) << d.table();
  }
}

/// What every start of one direction adds looks like friction of the other sign. Rows near starts count less in the values and
/// intervals, too, so that it does not move them.
TEST(DiagnoseSettling, ABounceToOneSideDoesNotMoveTheFriction) {
  const Machine machine = drawn_machine("loader_crane");
  HiddenCase logs = hidden_case(machine, {{"coulomb_friction", "boom", 0.5, 0}}, {7, 100.0});
  let_boom_bounce(logs.logs.train, true);
  const Log log = log_from_text("train.csv", simulator::csv_text(logs.logs.train), machine);
  const CraneModel model = settling_model(machine, log);
  EstimateOptions even;
  even.evidence.force_widths.clear();
  even.evidence.mechanisms.switch_off(Mechanism::kSettling);
  const auto friction = [&](const EstimateOptions& how) {
    return estimate_effects(model, {parse_effect("coulomb_friction:boom", machine)},
                            {{make_signals(machine, log)}}, {}, how)
        .effects[0];
  };
  const double truth = logs.truth("coulomb_friction", "Fc");
  const AppliedEffect settling = friction({}), alike = friction(even);
  EXPECT_LT(settling.lower95[0], truth);
  EXPECT_GT(settling.upper95[0], truth);
  EXPECT_LT(alike.values[0], 0.8 * truth)
      << "the bounce moves nothing, so that this test shows nothing";
  EXPECT_LT(truth - settling.values[0], 0.5 * (truth - alike.values[0]));
}

/// Two strokes: 6 s extending and 2 s retracting, after a start from the ground and before a stop on it.
TEST(DiagnoseRealCrane, DryFrictionOfALaboratoryCrane) {
  const std::string beside = SPARFLOW_SOURCE_DIR "/../shared/";
  if (!std::filesystem::exists(beside + "data/lab_crane"))
    GTEST_SKIP() << "no log of the laboratory crane beside the source tree";
  const Machine machine = load_machine(beside + "machines/lab_crane.yaml");
  const Log log = load_log(beside + "data/lab_crane/friction.csv", machine);
  const Diagnosis d = diagnose(settling_model(machine, log), {log});
  ASSERT_EQ(d.verdict, Verdict::kMissing) << d.table();
  const DiagnosedEffect* friction = nullptr;
  for (const DiagnosedEffect& e : d.effects) {
    if (!d.named(e)) continue;
    EXPECT_NE(e.id, "unmodelled_mass") << d.table();
    if (e.key() == "coulomb_friction:boom") friction = &e;
  }
  ASSERT_NE(friction, nullptr) << d.table();
  // 992 N is the mean over both strokes where they are steady; the friction rises by a third towards the end of the stroke
  EXPECT_GT(friction->applied.values[0], 0.9 * 992.0);
  EXPECT_LT(friction->applied.lower95[0], 1.1 * 992.0);

  // what was named can be added: the error falls where the motion is steady, though starts and stops hold most of it
  const ExtendResult better = improve(settling_model(machine, log), {{log}, {}, {}});
  ASSERT_FALSE(better.steps.empty()) << better.table();
  EXPECT_EQ(better.steps[0].added, "coulomb_friction:boom");
  EXPECT_LT(better.steps[0].change.own_steady, 0.5);
  EXPECT_THAT(better.table(), HasSubstr("without starts and stops the force error"));
}

}  // namespace
}  // namespace sparflow
