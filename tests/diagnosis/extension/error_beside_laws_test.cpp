/// Errors of pressures beside laws that are fitted to the same motions: an effect that is there lowers them on motions that took
/// no part in its estimate, one that is not there does not, and what the laws learned before plays no part.
#include "diagnosis/extension/error_beside_laws.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/evidence/left_out_rows.h"
#include "diagnosis/extension/extend.h"
#include "diagnosis/extension/refit_context.h"
#include "identification/learning/fit.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using testing_support::drawn_machine;
using testing_support::hidden_case;
using testing_support::HiddenCase;

class ErrorBesideLaws : public ::testing::Test {
 protected:
  ErrorBesideLaws() { logs.suspects = {hidden.train}; }
  /// Error of the pressures where an effect acts, with it over without it, on motions left out.
  double change(const char* key, const CraneModel& by) const {
    const RefitContext context(by, logs, options);
    const EffectAt effect = parse_effect(key, machine);
    return context
        .pressure_change(effect, by, context.cross_validated(by, {}, {}),
                         context.cross_validated(by, {effect}, {}))
        .ratio;
  }

  const Machine machine = drawn_machine("loader_crane");
  const HiddenCase hidden = hidden_case(machine, {{"pump_lag", "main", 1.0, 0}}, {7, 100.0});
  const CraneModel model = fit(machine, {hidden.train}).model;
  ExtendLogs logs;
  ExtendOptions options;
};

TEST_F(ErrorBesideLaws, FallsByAnEffectThatIsThere) {
  EXPECT_LT(change("pump_lag:main", model), 0.9);
  EXPECT_GT(change("line_loss:boom", model), 0.98);
}

/// Effects that `improve` ends with where the diagnosis, which asks for more than all evidence, names nothing.
std::vector<std::string> improved(const Machine& machine, const Log& log) {
  ExtendOptions options;
  options.diagnose.search.least_gain = 1e9;
  options.diagnose.candidates = {parse_effect("pump_lag:main", machine),
                                 parse_effect("line_loss:boom", machine),
                                 parse_effect("coulomb_friction:boom", machine)};
  std::vector<std::string> keys;
  const ExtendResult r = improve(fit(machine, {log}).model, {{log}, {}, {}}, options);
  for (const AppliedEffect& e : r.model.effects) keys.push_back(e.key(machine));
  return keys;
}

TEST_F(ErrorBesideLaws, LetsAnEffectInThatNoDiagnosisNamed) {
  EXPECT_THAT(improved(machine, hidden.train), ::testing::ElementsAre("pump_lag:main"));
  const HiddenCase nothing = hidden_case(machine, {}, {7, 100.0});
  EXPECT_THAT(improved(machine, nothing.train), ::testing::IsEmpty());
}

TEST_F(ErrorBesideLaws, DoesNotDependOnTheLearnedPressures) {
  CraneModel without = CraneModel::untrained(machine);
  for (std::size_t i = 0; i < without.cylinders.size(); ++i)
    without.cylinders[i].margin = model.cylinders[i].margin;
  for (std::size_t p = 0; p < without.pumps.size(); ++p)
    without.pumps[p].standby = model.pumps[p].standby;
  EXPECT_DOUBLE_EQ(change("pump_lag:main", without), change("pump_lag:main", model));
}

TEST_F(ErrorBesideLaws, IsTheRatioOfTheSquaresLeft) {
  // twice the residual in one channel of which all rows are the same, with a baseline of ones
  Evidence before, after;
  for (Evidence* e : {&before, &after}) {
    e->suspects = 1;
    e->series.resize(1);
    e->series[0].time = Eigen::VectorXd::LinSpaced(10, 0.0, 9.0);
  }
  EvidenceChannel c;
  c.kind = EvidenceKind::kReturnLine;
  c.y = Eigen::Vector4d(1.0, -1.0, 2.0, -2.0);
  c.baseline = Eigen::VectorXd::Ones(4);
  c.blocks = {{0, 4}};
  c.log = {0};
  c.sample = {0, 1, 2, 3};
  before.channels = {c};
  c.y = 2.0 * c.y.array() + 7.0;  // the law takes the constant over
  after.channels = {c};
  EXPECT_NEAR(errors_beside_laws(before, after, 8.0).change(0.0).ratio, 2.0, 1e-12);
  EXPECT_NEAR(errors_beside_laws(after, before, 8.0).change(0.0).ratio, 0.5, 1e-12);
  EXPECT_EQ(errors_beside_laws(before, before, 8.0).change(0.02).ratio, 1.0);
  // the third row is in one of both only: of 1, -1, -2 there remain the squares 25/9, 1/9 and 16/9
  after.channels[0].sample = {0, 1, 9, 3};
  const PressureErrors common = errors_beside_laws(before, after, 8.0);
  ASSERT_EQ(common.channels.size(), 1u);
  EXPECT_EQ(common.channels[0].all().rows, 3.0);
  EXPECT_NEAR(common.channels[0].all().before, 42.0 / 9.0, 1e-12);
}

TEST_F(ErrorBesideLaws, RowsLeftOutTakeEverythingOfThemAway) {
  const MachineSignals signals = make_signals(machine, hidden.train);
  const Evidence all = collect_evidence(model, {signals});
  Mask first_half = Mask::Constant(signals.samples(), false);
  first_half.head(signals.samples() / 2).setConstant(true);
  Index slopes = 0;
  for (const EvidenceChannel& channel : all.channels) {
    const EvidenceChannel rest = without_rows(channel, {first_half});
    std::size_t row = 0;
    for (std::size_t r = 0; r < channel.sample.size(); ++r) {
      if (channel.sample[r] < signals.samples() / 2) continue;
      ASSERT_EQ(rest.sample[row], channel.sample[r]);
      EXPECT_EQ(rest.y[static_cast<Index>(row)], channel.y[static_cast<Index>(r)]);
      if (channel.force_slope.size() > 0) {
        ASSERT_EQ(rest.force_slope.size(), rest.rows());
        EXPECT_EQ(rest.force_slope[static_cast<Index>(row)],
                  channel.force_slope[static_cast<Index>(r)]);
        ++slopes;
      }
      ++row;
    }
    EXPECT_EQ(static_cast<Index>(row), rest.rows());
  }
  EXPECT_GT(slopes, 0);
}

}  // namespace
}  // namespace sparflow
