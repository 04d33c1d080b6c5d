// A line loss can make another cylinder the load-sensing leader: evidence, search and extension use the leader that
// follows from the found effects.
#include "identification/signals/load_sensing_leader.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "diagnosis/evidence/evidence.h"
#include "diagnosis/selection/effect_estimate.h"
#include "diagnosis/selection/effect_search.h"
#include "diagnosis/verdict/diagnose.h"
#include "identification/signals/series.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/hidden_case.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using namespace testing_support;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double kMargin = 15e5, kStandby = 20e5;
constexpr double kLoss = 0.05 * 1e5 / (1e-3 / 60.0 * 1e-3 / 60.0);  // 0.05 bar/(l/min)^2

/// A log whose pump pressure is computed without pumps_led_by: from working pressures, margins and a line loss.
struct LossyCrane {
  Machine machine = drawn_machine("loader_crane");
  CraneModel model = CraneModel::untrained(machine);
  AppliedEffect loss;
  MachineSignals signals;
  Index moved = 0;  ///< samples in which the loss changes the leader

  explicit LossyCrane(std::uint64_t seed = 3) {
    for (CylinderModel& c : model.cylinders) c.margin = kMargin;
    model.pumps[0].standby = kStandby;
    const EffectAt place = parse_effect("line_loss:extension", machine);
    loss = {place.effect, place.at, {kLoss, 0.0, 0.0}, {}, {}};
    Log log = hidden_case(machine, {}, {seed, 60.0}).train;
    signals = make_signals(machine, log);
    VectorXd& pump = channel(log, "p_" + machine.pumps[0].name).values;
    const MachineSeries series = make_series(model, signals);
    for (Index k = 0; k < signals.samples(); ++k) {
      double with = kStandby, without = kStandby;
      int leader = -1, before = -1;
      for (const int i : machine.pumps[0].feeds) {
        const CylinderSignals& c = signals.cylinders[static_cast<std::size_t>(i)];
        if (c.direction[k] == 0) continue;
        const double asked = c.working_pressure[k] + kMargin;
        const double flow = c.flow[k], more = i == loss.at ? kLoss * flow * flow : 0.0;
        if (asked > without) without = asked, before = i;
        if (asked + more > with) with = asked + more, leader = i;
      }
      pump[k] = with;
      if (std::isfinite(series.pumps[0].demand[k]) && leader != before) ++moved;
    }
    signals = make_signals(machine, log);
  }
};

const LossyCrane& lossy() {
  static const LossyCrane crane;
  return crane;
}

double largest_left(const Evidence& e, const AppliedEffect& loss) {
  const EvidenceChannel* pump = e.find(EvidenceKind::kPump, 0);
  const Eigen::MatrixXd columns = e.columns({loss.effect, loss.at}, {&loss.values[2], 1}, *pump);
  return (pump->y - columns.leftCols(1) * loss.values[0]).cwiseAbs().maxCoeff();
}

TEST(PumpLeaders, ALossIsExactWithTheLeaderThatFollowsFromIt) {
  const LossyCrane& crane = lossy();
  ASSERT_GT(crane.moved, 50) << "the case must contain changes of the leader";
  const Evidence plain = collect_evidence(crane.model, {crane.signals});
  EXPECT_GT(largest_left(plain, crane.loss), 2e5) << "with the leaders without it";
  const std::optional<Evidence> updated = plain.with_leaders_of({&crane.loss, 1});
  ASSERT_TRUE(updated.has_value());
  EXPECT_LT(largest_left(*updated, crane.loss), 1.0) << "[Pa] of hundreds of bar, by rounding";
  EXPECT_FALSE(updated->with_leaders_of({&crane.loss, 1}).has_value())
      << "the leaders do not change any more";
  const EvidenceChannel *before = plain.find(EvidenceKind::kPump, 0),
                        *after = updated->find(EvidenceKind::kPump, 0);
  const VectorXd moved = after->raw[0] + updated->series[0].pumps[0].demand - before->raw[0] -
                         plain.series[0].pumps[0].demand;
  EXPECT_LT(moved.array().isFinite().select(moved, 0.0).cwiseAbs().maxCoeff(), 1.0)
      << "the measured pressure stays";
  const std::optional<Evidence> back = updated->with_leaders_of({});
  ASSERT_TRUE(back.has_value());
  const EvidenceChannel* again = back->find(EvidenceKind::kPump, 0);
  // Rounding of pressures of hundreds of bar is far below 1 Pa, here and in the tests below.
  EXPECT_LT((before->y - again->y).cwiseAbs().maxCoeff(), 1.0);
  EXPECT_EQ(before->baseline, again->baseline);
}

TEST(PumpLeaders, ReferencesKeepTheirLeadersAndThoseOfTheModelIncludeItsOwnLoss) {
  const LossyCrane& crane = lossy();
  const LossyCrane other(5);
  const Evidence e = collect_evidence(crane.model, {crane.signals}, {other.signals});
  const std::optional<Evidence> updated = e.with_leaders_of({&crane.loss, 1});
  ASSERT_TRUE(updated.has_value());
  EXPECT_EQ(updated->series[1].pumps[0].leader, e.series[1].pumps[0].leader);
  EXPECT_NE(updated->series[0].pumps[0].leader, e.series[0].pumps[0].leader);
  CraneModel knows = crane.model;
  knows.effects = {crane.loss};
  const Evidence known = collect_evidence(knows, {crane.signals});
  EXPECT_LT(known.find(EvidenceKind::kPump, 0)->y.cwiseAbs().maxCoeff(), 1.0);
  // references in which the loss acts already
  const Evidence both = collect_evidence(knows, {crane.signals}, {other.signals});
  EXPECT_LT(both.find(EvidenceKind::kPump, 0)->y.cwiseAbs().maxCoeff(), 1.0);
  const std::vector<AppliedEffect> none;
  const Evidence without = collect_evidence(knows, {crane.signals}, {other.signals}, &none);
  EXPECT_EQ(without.series[1].pumps[0].leader, e.series[1].pumps[0].leader);
}

EffectFit without_effects(const Evidence& e) {
  FitControl control;
  control.keep_residuals = true;
  control.noise_passes = 12;  // as the search does it
  return fit_effects(e, {}, nullptr, control);
}

std::vector<EffectAt> pump_effects(const Machine& machine) {
  std::vector<EffectAt> candidates;
  for (const char* key : {"line_loss:extension", "line_loss:boom", "flow_dependent_margin:main",
                          "torque_limit:main", "return_back_pressure"}) {
    candidates.push_back(parse_effect(key, machine));
  }
  return candidates;
}

TEST(PumpLeaders, ASearchUpdatesThem) {
  const LossyCrane& crane = lossy();
  const Evidence e = collect_evidence(crane.model, {crane.signals});
  const SearchResult r = search_effects(e, pump_effects(crane.machine));
  ASSERT_EQ(r.found.size(), 1u);
  EXPECT_EQ(r.found[0].design.effect.at, crane.loss.at);
  ASSERT_TRUE(r.updated_evidence.has_value());
  EXPECT_FALSE(r.updated_evidence->with_leaders_of({&crane.loss, 1}).has_value());
  // The pump pressure has no noise; only samples whose leader differs with the estimated loss leave an error.
  EXPECT_NEAR(r.found[0].values[0], kLoss, 0.01 * kLoss);
  // null fit and ranking belong to the leaders without the effect
  EXPECT_NEAR(r.null.total(), without_effects(e).total(), 1.0);
  EXPECT_GT(std::abs(without_effects(*r.updated_evidence).total() - r.null.total()), 5.0);
}

TEST(SearchEffects, IndistinguishableRivalsAreListedHoweverMuchWorse) {
  const LossyCrane& crane = lossy();
  const Evidence e = collect_evidence(crane.model, {crane.signals});
  SearchOptions options;
  options.largest_alternative_loss = 0.0;
  const SearchResult few = search_effects(e, pump_effects(crane.machine), options);
  ASSERT_EQ(few.found.size(), 1u);
  for (const auto& [rival, worse] : few.found[0].alternatives)
    EXPECT_LT(worse, same_within(few.found[0], options));
  options.same_nats = 1e9;  // all effects are indistinguishable
  const SearchResult all = search_effects(e, pump_effects(crane.machine), options);
  ASSERT_EQ(all.found.size(), 1u);
  EXPECT_GT(all.found[0].alternatives.size(), few.found[0].alternatives.size());
  EXPECT_GT(all.found[0].alternatives.back().second, SearchOptions{}.largest_alternative_loss)
      << "so that the usual limit would leave it out";
}

TEST(PumpLeaders, AnEffectThatIsNotNamedDoesNotChangeThem) {
  const LossyCrane& crane = lossy();
  const Evidence e = collect_evidence(crane.model, {crane.signals});
  SearchOptions options;
  options.smallest_effect = 1e300;  // every effect is too small to be named
  const SearchResult r = search_effects(e, pump_effects(crane.machine), options);
  EXPECT_TRUE(r.found.empty());
  EXPECT_FALSE(r.updated_evidence.has_value());
  EXPECT_NEAR(r.final.total(), without_effects(e).total(), 1.0);
}

TEST(PumpLeaders, ADiagnosisReportsTheErrorWithTheLeadersWithoutTheEffect) {
  const LossyCrane& crane = lossy();
  DiagnoseOptions options;
  options.candidates = pump_effects(crane.machine);
  const Diagnosis d = diagnose_signals(crane.model, {{crane.signals}}, options);
  ASSERT_EQ(d.effects.size(), 1u);
  const Evidence plain = collect_evidence(crane.model, {crane.signals});
  const EffectFit without = without_effects(plain);
  const ChannelGain& pump = d.effects[0].channels.front();
  ASSERT_EQ(plain.channels[pump.channel].kind, EvidenceKind::kPump);
  const VectorXd& residual = without.residual[pump.channel];
  const double rms = std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size()));
  // some leaders differ with the estimated loss, which is within 1 % of the true one
  EXPECT_NEAR(pump.rmse_before, rms, 0.02 * rms);
  EXPECT_LT(pump.rmse_after, 0.05 * rms);
}

TEST(PumpLeaders, AnExtensionUpdatesThemToo) {
  const LossyCrane& crane = lossy();
  const EffectEstimate estimate =
      estimate_effects(crane.model, {{crane.loss.effect, crane.loss.at}}, {{crane.signals}});
  ASSERT_EQ(estimate.effects.size(), 1u);
  // As for the search above: the log has no noise in the pump pressure.
  EXPECT_NEAR(estimate.effects[0].values[0], kLoss, 0.01 * kLoss);
}

}  // namespace
}  // namespace sparflow
