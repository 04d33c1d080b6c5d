#include "diagnosis/selection/search_candidates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/selection/effect_estimate.h"
#include "identification/signals/series.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using namespace testing_support;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::ElementsAre;

/// A force in proportion to time, of which each log is said to tell further values.
class TimeForce final : public Effect {
 public:
  explicit TimeForce(int values) : values_(values) {}
  const EffectInfo& info() const override {
    static const EffectInfo info = [] {
      EffectInfo i;
      i.id = "force_of_time";
      i.place = EffectPlace::kMachine;
      i.parameters = {{"slope", "N/s", 1.0, 0.0, 10.0, 1.0, "", true, {}}};
      return i;
    }();
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool columns_filtered() const override { return true; }  // no filter in a hand-made log
  int values_from_measurement(const MachineSeries&) const override { return values_; }
  bool columns(const MachineSeries& log, const MeasuredQuantity&, int, std::span<const double>,
               MatrixXd& columns) const override {
    columns = log.time;
    return true;
  }

 private:
  int values_;
};

/// Two suspect logs and a reference, with a channel of the first.
Evidence two_suspects() {
  const std::vector<NoiseBlock> blocks = blocks_of({100, 100});
  const Index n = rows_of(blocks);
  Evidence e;
  e.suspects = 2;
  e.series.resize(3);
  for (MachineSeries& s : e.series) {
    s.time = VectorXd::LinSpaced(n, 0.0, 4.0);
    s.step = s.time[1];
    s.runs = {{0, n}};
  }
  EvidenceChannel c = plain_channel(blocks, VectorXd::Zero(n));
  for (Index i = 0; i < n; ++i) c.sample.push_back(i);
  e.channels.push_back(c);
  return e;
}

TEST(SearchCandidates, ValuesThatALogTellsCountAsParametersOfEachSuspectLog) {
  const Evidence e = two_suspects();
  const TimeForce plain(0), told(4);
  const std::vector<SearchCandidate> all = search_candidates(e, {{&plain, -1}, {&told, -1}});
  ASSERT_EQ(all.size(), 2U);
  const double each = 0.5 * std::log(static_cast<double>(e.channels[0].rows()));
  EXPECT_DOUBLE_EQ(all[0].penalty, each);
  EXPECT_DOUBLE_EQ(all[1].penalty, each * (1 + 2 * 4));
}

/// A pump's lag has three optional parameters in each variant, and one more in that of the flow balance.
TEST(SearchCandidates, OptionalNonlinearParametersArePresentTogetherAndCountWhereTheyAre) {
  const Machine machine = drawn_machine("loader_crane");
  const HiddenCase logs = hidden_case(machine, {}, {5, 60.0});
  const Evidence e =
      collect_evidence(CraneModel::untrained(machine), {make_signals(machine, logs.train)});
  const SearchCandidate lag = search_candidates(e, {parse_effect("pump_lag:main", machine)}).at(0);
  const Effect& effect = *lag.effect.effect;
  std::size_t with = 0, without = 0, balance = 0;
  for (const EffectDesign& d : lag.designs) {
    const int present = optional_shapes(d);
    ASSERT_EQ(present == 4, d.shape[1] == 5.0);
    ASSERT_TRUE(present == 0 || present == 3 || present == 4);
    (present == 0 ? without : present == 3 ? with : balance) += 1;
    EXPECT_DOUBLE_EQ(lag.penalty_of(d), lag.penalty + present * lag.optional_shape_penalty);
    // what is absent has no value to search for
    EXPECT_THAT(shape_choices(effect, d.shape),
                ElementsAre(false, true, present == 0, present == 0, present == 0, present != 4));
  }
  EXPECT_EQ(with, without);
  EXPECT_EQ(with, 50U);
  EXPECT_EQ(balance, 20U) << "ten times, two capacities";
  double rows = 0.0;
  for (const EvidenceChannel& c : e.channels) rows = std::max(rows, static_cast<double>(c.rows()));
  EXPECT_DOUBLE_EQ(lag.optional_shape_penalty, 0.5 * std::log(rows));
}

/// Of a valve's lag half of the flow is late at least; an estimate there says that another law is the cause.
TEST(EffectEstimate, ValuesOnABoundAreNoFinding) {
  const EffectAt lag{find_effect("valve_lag"), 0};
  EffectDesign design;
  design.effect = lag;
  design.linear = 1;
  design.lower = {0.5};
  design.upper = {2.0};
  design.columns = {Eigen::MatrixXd::Ones(3, 1)};
  EffectEstimate all;
  all.effects = {{lag.effect, 0, {0.5, 0.1, 0.0}, {}, {}}};
  all.significant = {true};
  EXPECT_THAT(why_no_finding(all, design, 0), testing::HasSubstr("bound"));
  all.effects[0].values[0] = 0.7;
  EXPECT_EQ(why_no_finding(all, design, 0), "");
  all.significant = {false};
  EXPECT_THAT(why_no_finding(all, design, 0), testing::HasSubstr("contains zero"));
}

/// The estimate stays beside the grid's values when it may not leave them; a start between them is one more.
TEST(EffectEstimate, TriesTheStartsBesideTheGrid) {
  const Machine machine = drawn_machine("loader_crane");
  const HiddenCase logs = hidden_case(machine, {{"sensor_delay", "", 1.0, 0}}, {5, 60.0});
  const double truth = logs.truth("sensor_delay", "delay");
  const CraneModel model = CraneModel::untrained(machine);
  const EffectAt delay = parse_effect("sensor_delay", machine);
  EstimateOptions beside_grid;
  beside_grid.largest_step = 1.001;
  EstimateOptions started = beside_grid;
  started.starts = {{truth, 1.0}};
  const auto estimate = [&](const EstimateOptions& how) {
    return estimate_effects(model, {delay}, {{make_signals(machine, logs.train)}}, {}, how);
  };
  const EffectEstimate grid = estimate(beside_grid), start = estimate(started);
  // values: share, delay, late
  ASSERT_GT(std::abs(grid.effects[0].values[1] - truth), 0.003 * truth)
      << "this seed's delay lies on the grid, so that the test shows nothing";
  EXPECT_NEAR(start.effects[0].values[1], truth, 0.0011 * truth);
  EXPECT_GT(start.log_likelihood, grid.log_likelihood);
}

}  // namespace
}  // namespace sparflow
