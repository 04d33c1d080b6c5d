// The file of best known energies, and how a later run may change it.
#include "studies/best_known.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "models/files/model_file.h"
#include "models/math/sha256.h"
#include "problems/bundled.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

/// A run that found this energy [J] in this time [s], with this bound [J].
bench::ReachFigures figures_of(double energy, double duration, double bound, double shortest) {
  bench::ReachFigures f;
  f.bound = bound;
  f.comparison.shortest = shortest;
  StrategyRow row;
  row.name = "equal";
  StrategyOutcome best;
  best.kind = kOptimal;
  best.duration = duration;
  best.energy.total = energy;
  best.motion.t = Eigen::Vector2d(0.0, duration);
  row.outcomes.push_back(best);
  f.comparison.rows.push_back(row);
  return f;
}

/// A file of one reach, to which several runs write.
class BestKnown : public ::testing::Test {
 protected:
  BestKnown() {
    tasks_[0].problem.file = "somewhere/lift.yaml";
    tasks_[0].mark = {"crane.json", "abc"};
  }
  ~BestKnown() override { std::remove(path_.c_str()); }
  nlohmann::json after(const bench::ReachFigures& f) {
    bench::write_best_known(path_, tasks_, {f});
    std::ifstream in(path_);
    std::stringstream text;
    text << in.rdbuf();
    return test_support::parsed_json(text.str());
  }
  nlohmann::json lift_after(const bench::ReachFigures& f) { return after(f).at("lift.yaml"); }

  std::string path_ = testing::TempDir() + "best_known_" + std::to_string(getpid()) + ".json";
  std::vector<bench::ReachTask> tasks_ = std::vector<bench::ReachTask>(1);
};

TEST_F(BestKnown, KeepsTheLeastEnergyTheLargestBoundAndTheShortestTime) {
  lift_after(figures_of(80e3, 16.0, 70e3, 7.4));
  nlohmann::json entry = lift_after(figures_of(82e3, 16.0, 78e3, 7.3));
  EXPECT_EQ(entry.at("energy_J"), 80e3) << "the new energy is higher";
  EXPECT_EQ(entry.at("lower_bound_J"), 78e3) << "the larger bound";
  EXPECT_EQ(entry.at("shortest_s"), 7.3);
  entry = lift_after(figures_of(90e3, 12.0, 85e3, 7.5));
  EXPECT_EQ(entry.at("lower_bound_J"), 78e3) << "the bound of another time says nothing";
  EXPECT_EQ(entry.at("shortest_s"), 7.3);
  entry = lift_after(figures_of(79e3, 16.0, 77e3, 7.3));
  EXPECT_EQ(entry.at("energy_J"), 79e3);
  EXPECT_EQ(entry.at("lower_bound_J"), 78e3) << "still the larger one";
}

TEST_F(BestKnown, IsNotChangedByARunThatFindsNothingOrLeavesAReachOut) {
  bench::ReachFigures nothing;
  nothing.named = "too little time";
  const nlohmann::json named = lift_after(nothing);
  EXPECT_EQ(named.at("status"), "infeasible");
  EXPECT_EQ(named.at("why"), "too little time");
  const nlohmann::json known = lift_after(figures_of(80e3, 16.0, 70e3, 7.4));
  EXPECT_EQ(known.at("status"), "optimal") << "found later after all";
  EXPECT_EQ(lift_after(nothing), known);
  nothing.left_out = true;
  tasks_[0].problem.file = "somewhere/lower.yaml";
  EXPECT_FALSE(after(nothing).contains("lower.yaml"));
}

TEST_F(BestKnown, EntriesNameTheirModelAndAreDroppedForAnotherModel) {
  const nlohmann::json first = lift_after(figures_of(80e3, 16.0, 70e3, 7.4));
  EXPECT_EQ(first.at("model"), (nlohmann::json{{"file", "crane.json"}, {"sha256", "abc"}}));
  EXPECT_EQ(first.at("program"), std::string("sparflow ") + program_version());
  tasks_[0].mark.sha256 = "def";
  const nlohmann::json again = lift_after(figures_of(90e3, 16.0, 60e3, 7.5));
  EXPECT_EQ(again.at("energy_J"), 90e3) << "higher, but of the present model";
  EXPECT_EQ(again.at("lower_bound_J"), 60e3);
  EXPECT_EQ(again.at("shortest_s"), 7.5);
  EXPECT_EQ(again.at("model").at("sha256"), "def");
  tasks_[0].mark.sha256 = "ghi";
  const nlohmann::json nothing = lift_after({});
  EXPECT_EQ(nothing.at("status"), "infeasible") << "the old energy says nothing";
  EXPECT_EQ(nothing.at("model").at("sha256"), "ghi");
}

/// The bytes of a bundled file.
std::string bytes_of(const std::string& name) {
  std::ifstream in(bundled_file(name), std::ios::binary);
  std::stringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

TEST(BundledBestKnown, BelongsToTheBundledModelsAndIsAboveItsBounds) {
  const nlohmann::json known = test_support::parsed_json(bytes_of("best_known.json"));
  EXPECT_EQ(known.size(), 43u);
  int optimal = 0;
  for (const auto& [reach, entry] : known.items()) {
    EXPECT_FALSE(bytes_of("reaches/" + reach).empty()) << reach;
    const nlohmann::json& model = entry.at("model");
    EXPECT_EQ(model.at("sha256"),
              sha256_hex(bytes_of("models/" + model.at("file").get<std::string>())))
        << reach << ": found with another model; run bench/problem_set --write";
    EXPECT_TRUE(entry.at("program").get<std::string>().starts_with("sparflow ")) << reach;
    if (entry.at("status") == "infeasible") {
      EXPECT_FALSE(entry.at("why").get<std::string>().empty()) << reach;
      continue;
    }
    ++optimal;
    const double energy = entry.at("energy_J").get<double>();
    EXPECT_GE(energy, entry.at("lower_bound_J").get<double>()) << reach;
    EXPECT_LE(entry.at("shortest_s"), entry.at("duration_s")) << reach;
    for (const auto& [way, other] : entry.at("baselines_J").items())
      EXPECT_LE(energy, other.get<double>()) << reach << ": " << way;
  }
  EXPECT_EQ(optimal, 36);
}

TEST_F(BestKnown, ContainsBaselinesAndTheUnlimitedTimeBesideTheOptimum) {
  bench::ReachFigures f = figures_of(80e3, 16.0, 70e3, 7.4);
  f.unlimited = 79e3;
  std::vector<StrategyOutcome>& outcomes = f.comparison.rows[0].outcomes;
  for (const char* kind : {kJointLine, kMinimumTime}) {
    outcomes.push_back(outcomes[0]);
    outcomes.back().kind = kind;
    outcomes.back().energy.total = 95e3;
  }
  const nlohmann::json entry = lift_after(f);
  EXPECT_EQ(entry.at("unlimited_time_J"), 79e3);
  EXPECT_EQ(entry.at("baselines_J"), (nlohmann::json{{kJointLine, 95e3}}))
      << "the optimum is none, nor is what takes another time";
}

}  // namespace
}  // namespace sparflow
