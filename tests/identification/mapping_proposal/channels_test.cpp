#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "identification/mapping_proposal/assignment.h"
#include "identification/mapping_proposal/channel_file.h"
#include "identification/mapping_proposal/channel_summary.h"
#include "identification/mapping_proposal/channel_words.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

RawTable table_of(std::vector<RawColumn> columns) {
  RawTable table;
  table.file = "log.csv";
  table.columns = std::move(columns);
  return table;
}

TEST(ChannelFile, TheClockIsTheColumnThatRisesWhateverItsName) {
  RawColumn clock, other;
  clock.name = "CH07";
  other.name = "CH01";
  for (int i = 0; i < 100; ++i) {
    clock.values.push_back(5000.0 + 20.0 * i);
    other.values.push_back(std::sin(0.3 * i));
  }
  const TimedChannels file = timed_channels(table_of({other, clock}));
  EXPECT_EQ(file.clock, "CH07");
  EXPECT_DOUBLE_EQ(file.clock_unit, 1e-3);  // steps of 20 s are no log
  ASSERT_EQ(file.recording.channels.size(), 1U);
  EXPECT_NEAR(file.recording.channels[0].time.back(), 1.98, 1e-12);  // from the first row
}

TEST(ChannelFile, ATableWithoutAClockIsRefused) {
  RawColumn a;
  a.name = "x";
  a.values = {1.0, 0.0, 1.0, 0.0};
  EXPECT_THROW(timed_channels(table_of({a})), InputError);
}

TEST(ChannelUnits, AnElementOfAListIsNoShare) {
  EXPECT_EQ(channel_unit("slip [1]", "").word, "1");
  EXPECT_EQ(channel_unit("/pressures.data[1]", "").word, "");
}

TEST(ChannelUnits, ALastLetterIsTheUnitOfATemperatureOnlyWhereTheNameSaysOne) {
  EXPECT_EQ(channel_unit("oil_C", "").word, "degC");
  EXPECT_EQ(channel_unit("TempTank_K", "").word, "K");
  EXPECT_EQ(channel_unit("gain_k", "").word, "");
  EXPECT_EQ(channel_unit("sensor_c", "").word, "");
}

TEST(ChannelSummary, RateGapsMissingResolutionAndNoiseAreThoseOfTheChannel) {
  RecordedChannel channel;
  channel.name = "p";
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 2.0);
  for (int i = 0; i < 4000; ++i) {
    channel.time.push_back(0.01 * i + (i >= 2000 ? 5.0 : 0.0));
    channel.values.push_back(i % 100 == 7 ? kNaN : 0.5 * std::round(noise(random) / 0.5));
  }
  const ChannelSummary s = summarise(channel);
  EXPECT_NEAR(s.rate, 100.0, 1e-6);
  EXPECT_EQ(s.gaps, 1);
  EXPECT_NEAR(s.longest_gap, 5.01, 1e-9);
  EXPECT_NEAR(s.longest_gap_at, 19.99, 1e-9);
  EXPECT_NEAR(s.missing_share, 0.01, 1e-12);
  EXPECT_DOUBLE_EQ(s.resolution, 0.5);
  // 4000 samples: the robust estimate scatters by about 2 %, the grid adds 0.5^2/12 to the variance
  EXPECT_NEAR(s.noise, 2.0, 0.2);
}

TEST(ChannelWords, NamesAreSplitAndUmlautsFolded) {
  EXPECT_THAT(name_words("KolbenDruck_Löffel2 [bar]"),
              testing::ElementsAre("kolben", "druck", "loeffel", "2", "bar"));
}

TEST(ChannelWords, GermanNamesSpeakForTheirMeaning) {
  const Machine machine =
      load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/loader_crane.yaml");
  const auto odds = [&](Role role, int index) {
    return name_evidence("Hubarm Druck Kolbenseite", {role, index}, machine).log_odds;
  };
  EXPECT_GT(odds(Role::kPressureA, 0), 5.0);
  EXPECT_GT(odds(Role::kPressureA, 0), odds(Role::kPressureB, 0) + 3.0);
  EXPECT_GT(odds(Role::kPressureA, 0), odds(Role::kPressureA, 1) + 3.0);
  EXPECT_LT(odds(Role::kCommand, 1), 0.0);
}

/// Every injective choice in turn: the second code path.
double best_by_hand(const Eigen::MatrixXd& score, Eigen::Index row, std::vector<bool>& used) {
  if (row == score.rows()) return 0.0;
  double best = best_by_hand(score, row + 1, used);
  for (Eigen::Index c = 0; c < score.cols(); ++c) {
    if (used[static_cast<std::size_t>(c)]) continue;
    used[static_cast<std::size_t>(c)] = true;
    best = std::max(best, score(row, c) + best_by_hand(score, row + 1, used));
    used[static_cast<std::size_t>(c)] = false;
  }
  return best;
}

TEST(Assignment, IsTheBestOfAllChoices) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 200; ++k) {
    const Eigen::Index rows = 1 + k % 5, columns = 1 + k % 6;
    const Eigen::MatrixXd score =
        Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
    double total = 0.0;
    const std::vector<int> taken = best_assignment(score, &total);
    std::vector<bool> used(static_cast<std::size_t>(columns), false);
    EXPECT_NEAR(total, best_by_hand(score, 0, used), 1e-12);
    double sum = 0.0;
    std::vector<int> count(static_cast<std::size_t>(columns), 0);
    for (Eigen::Index r = 0; r < rows; ++r) {
      const int c = taken[static_cast<std::size_t>(r)];
      if (c < 0) continue;
      sum += score(r, c);
      EXPECT_EQ(++count[static_cast<std::size_t>(c)], 1);
    }
    EXPECT_NEAR(sum, total, 1e-12);
  }
}

TEST(Assignment, PairSetsShareNoColumnAndComeBestFirst) {
  // Both groups like columns 0 and 1 best; one of them must give way.
  const std::vector<PairSet> sets = best_pair_sets(
      {{{0, 1, 5.0}, {2, 3, 1.0}, {-1, -1, 0.0}}, {{1, 0, 4.0}, {3, 2, 2.0}, {-1, -1, 0.0}}}, 3);
  ASSERT_EQ(sets.size(), 3U);
  EXPECT_DOUBLE_EQ(sets[0].total, 7.0);
  EXPECT_EQ(sets[0].pairs[1].first, 3);
  EXPECT_GE(sets[1].total, sets[2].total);
}

TEST(Assignment, APairSearchThatIsEndedGivesTheGreedySetAtLeast) {
  // Twelve groups that like the same ten columns: all orders of them would have to be tried.
  std::vector<std::vector<ColumnPair>> groups(12);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    groups[g].push_back({-1, -1, 0.0});
    for (int c = 0; c < 10; ++c) {
      groups[g].push_back({c, -1, 1.0 + 0.1 * std::sin(static_cast<double>(g) * 7.0 + c)});
    }
  }
  const PairSet greedy = greedy_pairs(groups);
  for (const std::int64_t steps : {1, 1000}) {
    const std::vector<PairSet> sets = best_pair_sets(groups, 2, {steps});
    ASSERT_FALSE(sets.empty());
    EXPECT_GE(sets[0].total, greedy.total);
    double sum = 0.0;
    std::vector<int> count(10, 0);
    for (const ColumnPair& p : sets[0].pairs) {
      sum += p.score;
      if (p.first >= 0) {
        EXPECT_EQ(++count[static_cast<std::size_t>(p.first)], 1);
      }
    }
    EXPECT_NEAR(sum, sets[0].total, 1e-12);
  }
}

}  // namespace
}  // namespace sparflow
