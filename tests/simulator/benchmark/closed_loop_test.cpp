// Controllers on the dynamic plant: goals are reached, failures are rows with a sentence.
#include "simulator/benchmark/closed_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "models/machine/kinematics.h"
#include "problems/bundled.h"
#include "simulator/benchmark/scenario_file.h"
#include "simulator/controllers/goal_posture.h"
#include "simulator/controllers/registry.h"
#include "simulator/controllers/section_valves.h"
#include "simulator/plant/parameters/plant_effects.h"

namespace sparflow::benchmark {
namespace {

using ::testing::HasSubstr;

Scenario lift() {
  return parse_scenario(R"(
id: lift
machine: loader_crane
start: {q: {boom: 0.2, jib: -1.2, extension: 0.6}}
payload_kg: 200
goals: [{q: {boom: 0.6, jib: -0.9, extension: 1.0}, duration_s: 12}]
tolerance_m: 0.1
)",
                        "lift.yaml", ".", bundled_file);
}

/// What the machine file tells, for controllers that need no model.
struct Known {
  explicit Known(const Scenario& s) : valves(control::sections_of(s.machine)) {
    know.machine = &s.machine;
    know.valves = &valves;
  }
  control::SectionValves valves;
  control::Knowledge know;
};

Row run(const Scenario& s, const std::string& name, std::uint64_t seed = 1) {
  const Known known(s);
  return run_closed_loop(
      s, name,
      [&] { return control::make_controller(*control::find_controller(name), known.know); }, seed);
}

class Levers : public control::Controller {
 public:
  explicit Levers(std::vector<double> u) : u_(std::move(u)) {}
  void begin(const control::Task&, const control::Measurement&) override {}
  std::vector<double> step(const control::Measurement&) override { return u_; }

 private:
  std::vector<double> u_;
};

Row run_levers(const Scenario& s, const std::vector<double>& u) {
  return run_closed_loop(
      s, "levers", [&] { return std::make_unique<Levers>(u); }, 1);
}

TEST(ClosedLoop, EveryControllerWithoutModelReachesTheGoalAndAccountsForItsEnergy) {
  Scenario s = lift();
  s.goals.front().q.reset();  // the point alone, which all of them can reach
  int runs = 0;
  for (const control::ControllerInfo& info : control::controllers()) {
    if (info.needs_model) continue;
    SCOPED_TRACE(std::string(info.name));
    const Row row = run(s, std::string(info.name));
    EXPECT_TRUE(row.done) << row.reason;
    EXPECT_LE(row.tip_error_end, s.tolerance);
    EXPECT_GT(row.time, 3.0);
    EXPECT_GT(row.useful, 0.0);  // the load was lifted
    double lost = row.pump_loss + row.tank_loss + row.swing_loss;
    for (const double loss : row.loss) lost += loss;
    // as the plant's own balance closes (plant_run_test), to 0.1 %
    EXPECT_NEAR(row.pump_work, row.useful + lost, 2e-3 * row.pump_work);
    EXPECT_LT(row.energy, row.pump_work);
    // the second way: pressure times flow, of which the trace keeps a sample now and then
    double delivered = 0.0;
    for (std::size_t i = 1; i < row.trace.t.size(); ++i)
      delivered += 0.5 * (row.trace.power[i] + row.trace.power[i - 1]) *
                   (row.trace.t[i] - row.trace.t[i - 1]);
    EXPECT_NEAR(row.energy, delivered, 0.03 * delivered);
    EXPECT_EQ(row.trace.t.size(), row.trace.q.size());
    ++runs;
  }
  EXPECT_GE(runs, 4);
}

TEST(ClosedLoop, TheSameSeedGivesTheSameRowAndAnotherNoiseAnother) {
  const Scenario s = lift();
  const Row a = run(s, "joint_pi", 1), b = run(s, "joint_pi", 1), c = run(s, "joint_pi", 2);
  EXPECT_EQ(a.energy, b.energy);
  EXPECT_EQ(a.tip_error_path, b.tip_error_path);
  EXPECT_NE(a.energy, c.energy);
}

TEST(ClosedLoop, ASequentialOperatorMovesOneLeverAtATime) {
  const Scenario s = lift();
  const Row one = run(s, "sequential_operator"), all = run(s, "simultaneous_operator");
  ASSERT_TRUE(one.done) << one.reason;
  ASSERT_TRUE(all.done) << all.reason;
  const auto together = [](const Row& row) {  // share of the instants at which two joints move
    int count = 0;
    for (std::size_t i = 1; i < row.trace.q.size(); ++i) {
      int moving = 0;
      for (std::size_t j = 0; j < row.trace.q[i].size(); ++j)
        moving += std::abs(row.trace.q[i][j] - row.trace.q[i - 1][j]) > 4e-3 ? 1 : 0;
      count += moving > 1 ? 1 : 0;
    }
    return count;
  };
  // levers overlap while one falls and the next rises, half a second each
  EXPECT_LE(together(one), 8);
  EXPECT_GT(together(all), 15);
}

TEST(GoalPosture, IsFoundBehindTheColumnToo) {
  const Scenario s =
      load_scenario(bundled_file("scenarios/test/test_swing_crane_02.yaml"), bundled_file);
  control::Task task;
  task.tip = s.goals.front().tip;
  task.tolerance = s.tolerance;
  const Eigen::VectorXd q = control::goal_posture(s.machine, task, s.start);
  EXPECT_LT((tip_position<double>(s.machine, q) - task.tip).norm(), s.tolerance);
  for (int k = 0; k < s.machine.joint_count(); ++k) {
    const Range r = s.machine.joints[static_cast<std::size_t>(k)].position;
    EXPECT_GE(q[k], r.lo);
    EXPECT_LE(q[k], r.hi);
  }
  task.tip = {100.0, 0.0, 0.0};
  EXPECT_THROW(control::goal_posture(s.machine, task, s.start), control::ControllerFailure);
}

TEST(ClosedLoop, FailuresAreRowsWithASentence) {
  const Scenario s = lift();
  Row row = run_levers(s, {0.0, 0.0, 0.0});
  EXPECT_FALSE(row.done);
  EXPECT_THAT(row.reason, HasSubstr("goal 1 was not reached"));
  EXPECT_TRUE(std::isnan(row.time));
  EXPECT_GT(row.pump_work, 0.0);  // the pump idled
  row = run_levers(s, {0.0, 0.0});
  EXPECT_THAT(row.reason, HasSubstr("2 commands for 3 cylinders"));
  row = run_levers(s, {0.0, std::nan(""), 0.0});
  EXPECT_THAT(row.reason, HasSubstr("not a number"));
  row = run(s, "tracked_optimum");
  EXPECT_THAT(row.reason, HasSubstr("needs a learned model"));
  row = run_levers(s, {1.0, 0.0, 0.0});  // against the stop
  EXPECT_FALSE(row.done);
  EXPECT_THAT(row.limits, ::testing::Contains("cut-off of pump main"));
}

TEST(ClosedLoop, AnotherPostureAtTheSameTipIsNotTheOneAskedFor) {
  Scenario s = lift();
  s.time_limit = 30.0;
  s.goals.front().tip = tip_position<double>(s.machine, s.start);
  s.goals.front().duration = 3.0;
  // levers that rest keep the tip where it is; the posture of the goal is another one
  const Row other = run_levers(s, {0.0, 0.0, 0.0});
  EXPECT_FALSE(other.done);
  EXPECT_THAT(other.reason, HasSubstr("a rod"));
  s.goals.front().q.reset();
  EXPECT_TRUE(run_levers(s, {0.0, 0.0, 0.0}).done);
}

TEST(ClosedLoop, AllThatArriveInTimeRunEquallyLong) {
  const Scenario away = lift();
  Scenario here = lift();
  here.goals.front().q.reset();
  here.goals.front().tip = tip_position<double>(here.machine, here.start);
  const Row soon = run_levers(here, {0.0, 0.0, 0.0}), later = run(away, "joint_pi");
  ASSERT_TRUE(soon.done) << soon.reason;
  ASSERT_TRUE(later.done) << later.reason;
  const double duration = away.goals.front().duration;
  EXPECT_LT(soon.time, 0.1 * duration);
  EXPECT_GT(later.time, 0.7 * duration);
  EXPECT_LT(later.time, duration);
  const LoopOptions loop;
  EXPECT_NEAR(soon.ran, duration + loop.hold, 1.5 * loop.sample_time);
  EXPECT_NEAR(later.ran, soon.ran, 1e-9);
}

TEST(ClosedLoop, ARowReadsBackAsItWasPacked) {
  Row row = run(lift(), "joint_pi");
  row.reason = "a \"quoted\", reason";
  row.tip_error_path = kNotKnown;
  const Row back = row_from(packed(row));
  EXPECT_EQ(packed(back), packed(row));
  EXPECT_EQ(back.energy, row.energy);
  EXPECT_TRUE(std::isnan(back.tip_error_path));
  EXPECT_THAT(row_csv(row), HasSubstr("\"a \"\"quoted\"\", reason\""));
}

}  // namespace
}  // namespace sparflow::benchmark
