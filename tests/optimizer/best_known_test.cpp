// The file of best known energies: what a later run may change in it.
#include "bench/best_known.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <sstream>

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

TEST(BestKnown, KeepsTheLeastEnergyTheLargestBoundAndTheShortestTime) {
  const std::string path = testing::TempDir() + "best_known_" + std::to_string(getpid()) + ".json";
  std::vector<bench::ReachTask> tasks(1);
  tasks[0].problem.file = "somewhere/lift.yaml";
  const auto after = [&](const bench::ReachFigures& f) {
    bench::write_best_known(path, tasks, {f});
    std::ifstream in(path);
    std::stringstream text;
    text << in.rdbuf();
    return test_support::parsed_json(text.str()).at("lift.yaml");
  };
  after(figures_of(80e3, 16.0, 70e3, 7.4));
  nlohmann::json entry = after(figures_of(82e3, 16.0, 78e3, 7.3));
  EXPECT_EQ(entry.at("energy_J"), 80e3) << "dearer";
  EXPECT_EQ(entry.at("lower_bound_J"), 78e3) << "the larger bound";
  EXPECT_EQ(entry.at("shortest_s"), 7.3);
  entry = after(figures_of(90e3, 12.0, 85e3, 7.5));
  EXPECT_EQ(entry.at("lower_bound_J"), 78e3) << "the bound of another time says nothing";
  EXPECT_EQ(entry.at("shortest_s"), 7.3);
  entry = after(figures_of(79e3, 16.0, 77e3, 7.3));
  EXPECT_EQ(entry.at("energy_J"), 79e3);
  EXPECT_EQ(entry.at("lower_bound_J"), 78e3) << "still the larger one";
  std::remove(path.c_str());
}

}  // namespace
}  // namespace sparflow
