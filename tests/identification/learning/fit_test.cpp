#include "identification/learning/fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "models/files/model_file.h"
#include "models/math/error.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using namespace testing_support;
using testing::Contains;
using testing::HasSubstr;

// ---------------------------------------------------------------- simulated lift

TEST(Fit, RecoversTheLawOfTheLog) {
  const FitResult r = fit(arm_machine(), {arm_log(0.3, 1)}, {arm_log(0.3, 2)});
  EXPECT_TRUE(r.model.complete());
  // 1700 samples of 0.3 bar noise: the margin's standard error is 0.01 bar, five of them
  EXPECT_NEAR(r.model.cylinders[0].margin, kMargin, 0.05 * units::kBar);
  EXPECT_NEAR(r.model.pumps[0].standby, kStandby, 0.05 * units::kBar);
  // The filter reduces the peaks of speed by some 0.1 %.
  EXPECT_NEAR(r.model.cylinders[0].valve_gain_extend / kGainExtend, 1.0, 3e-3);
  EXPECT_NEAR(r.model.cylinders[0].valve_gain_retract / kGainRetract, 1.0, 3e-3);
  const Machine machine = arm_machine();
  for (const double force : {8e3, 1.0e4, 1.2e4}) {
    // a tenth of the noise
    EXPECT_NEAR(r.model.cylinders[0].extend.mean(5e-4, force), extend_pressure(machine, force),
                0.1 * units::kBar);
  }
  ASSERT_TRUE(r.test.has_value());
  EXPECT_FALSE(r.held_out.has_value());
  // The noise, known to a few per cent from hundreds of samples, and the model's tenth of it.
  EXPECT_NEAR(r.test->find("pressure", "arm", "extend")->rmse, 0.3 * units::kBar,
              0.05 * units::kBar);
  // Binomial: 0.8 % for 700 samples; three of them.
  EXPECT_NEAR(r.test->find("pressure", "arm", "extend")->within_95_percent, 95.0, 2.5);
}

TEST(Fit, TheModelCarriesDataAndQuality) {
  const FitResult r = fit(arm_machine(), {arm_log(0.3, 1)}, {arm_log(0.3, 2)});
  ASSERT_EQ(r.model.data.size(), 2u);
  EXPECT_EQ(r.model.data[0].use, "train");
  EXPECT_EQ(r.model.data[1].use, "test");
  EXPECT_EQ(r.model.data[0].rows, 3000);
  EXPECT_EQ(r.model.data[0].sha256, std::string(64, '0'));
  bool found = false;
  for (const StageQuality& q : r.model.quality) {
    if (q.stage != "pressure" || q.at != "arm extend" || q.data != "test") continue;
    found = true;
    EXPECT_EQ(q.unit, "bar");
    // As in RecoversTheLawOfTheLog.
    EXPECT_NEAR(q.rmse, 0.3, 0.05);
  }
  EXPECT_TRUE(found);
  const std::string text = model_to_json(r.model);
  const CraneModel read = model_from_json(text, "m.json");
  EXPECT_EQ(model_to_json(read), text);
  EXPECT_EQ(compare(read, {arm_log(0.3, 3)}).find("pump", "main")->rmse,
            compare(r.model, {arm_log(0.3, 3)}).find("pump", "main")->rmse)
      << "a loaded model is the fitted one to the last bit";
}

TEST(Fit, IsTheSameEveryTimeAndForAnyNumberOfThreads) {
  FitOptions one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_EQ(model_to_json(fit(arm_machine(), {arm_log(0.3)}, {}, one).model),
            model_to_json(fit(arm_machine(), {arm_log(0.3)}, {}, two).model));
}

TEST(Fit, WithoutTestLogsWholeMotionsAreHeldOut) {
  const FitResult r = fit(arm_machine(), {arm_log(0.3)});
  ASSERT_TRUE(r.held_out.has_value());
  EXPECT_GT(r.held_out->samples, 200);
  EXPECT_LT(r.held_out->samples, 1500);
  // The law is simple, so the error is the noise, and slightly more at the edges of the data.
  EXPECT_NEAR(r.held_out->find("pressure", "arm", "extend")->rmse, 0.3 * units::kBar,
              0.1 * units::kBar);
  EXPECT_THAT(r.brief(), HasSubstr("held-out motions"));
}

TEST(Fit, WithoutHeldOutSeriesAllScoresAreTheSame) {
  FitOptions options;
  const FitResult whole = fit(arm_machine(), {arm_log(0.3, 1)}, {}, options);
  options.keep_held_out_series = false;
  std::vector<Log> logs = {arm_log(0.3, 1)};
  const FitResult lean = fit(arm_machine(), std::move(logs), std::vector<Log>(), options);
  EXPECT_EQ(compare_json(*lean.held_out), compare_json(*whole.held_out));
  EXPECT_EQ(compare_json(lean.train), compare_json(whole.train));
  EXPECT_EQ(model_to_json(lean.model), model_to_json(whole.model));
  EXPECT_TRUE(lean.held_out->logs.at(0).series.empty());
  EXPECT_FALSE(whole.held_out->logs.at(0).series.empty());
}

TEST(Fit, SlimSignalsGiveTheSameModelAndTheSameComparison) {
  FitOptions slim;
  slim.signals.slim = true;
  const FitResult with = fit(arm_machine(), {arm_log()}),
                  without = fit(arm_machine(), {arm_log()}, {}, slim);
  EXPECT_EQ(model_to_json(without.model), model_to_json(with.model));
  EXPECT_EQ(compare_json(without.train), compare_json(with.train));
  EXPECT_EQ(compare_json(*without.held_out), compare_json(*with.held_out));
  EXPECT_EQ(compare_table(without.train), compare_table(with.train));
  EXPECT_EQ(without.train.logs.front().signals.tip.size(), 0);
  CompareOptions options;
  options.signals.slim = true;
  EXPECT_EQ(compare_json(compare(with.model, {arm_log()}, options)),
            compare_json(compare(with.model, {arm_log()})));
}

TEST(Fit, BlocksCoverEveryMotionOnce) {
  const MachineSignals s = make_signals(arm_machine(), arm_log());
  Mask covered = Mask::Constant(s.samples(), false);
  for (const SampleRange& block : motion_blocks(s, 1.0)) {
    EXPECT_GT(block.size(), 10) << "a block is a stretch of motion, not a few rows";
    for (Eigen::Index k = block.begin; k < block.end; ++k) {
      EXPECT_FALSE(covered[k]);
      covered[k] = true;
    }
  }
  for (const Segment& segment : s.segments) {
    EXPECT_EQ(covered[segment.samples.begin], segment.moving);
    EXPECT_EQ(covered[segment.samples.end - 1], segment.moving);
  }
}

TEST(Fit, AMissingMotionIsNotedWithWhatToRecord) {
  Log log = arm_log(0.3);
  for (double& u : channel(log, "u_arm").values) u = std::max(u, 0.0);  // lowered by hand
  const FitResult r = fit(arm_machine(), {log});
  EXPECT_FALSE(r.model.cylinders[0].extend.empty());
  EXPECT_TRUE(r.model.cylinders[0].retract.empty());
  EXPECT_EQ(r.model.missing(), std::vector<std::string>{"arm retract"});
  EXPECT_THAT(r.notes, Contains(HasSubstr("pressure of arm retracting: not learned")));
  EXPECT_THAT(r.notes, Contains(HasSubstr("record arm retracting at several speeds and loads")));
  EXPECT_THAT(r.full(), HasSubstr("not learned"));
  EXPECT_EQ(r.model.cylinders[0].valve_gain_retract, 0.0);
}

TEST(Fit, APressureThatIsNotLoggedIsNoted) {
  Log log = arm_log(0.3);
  remove_channel(log, "pB_arm");
  const FitResult r = fit(arm_machine(), {log});
  EXPECT_FALSE(r.model.cylinders[0].extend.empty());
  EXPECT_THAT(r.notes, Contains(HasSubstr("with pB_arm_bar")));
}

TEST(Fit, WithoutPumpPressureTheMachineFilesStandbyStays) {
  Log log = arm_log(0.3);
  remove_channel(log, "p_main");
  const FitResult r = fit(arm_machine(), {log});
  EXPECT_EQ(r.model.pumps[0].standby, arm_machine().pumps[0].standby);
  EXPECT_THAT(r.notes, Contains(HasSubstr("pump main: not learned")));
  EXPECT_TRUE(r.train.energy.empty());
}

TEST(Fit, AConstantSupplyIsOneNumber) {
  Machine machine = arm_machine();
  machine.pumps[0].type = PumpType::kConstantPressure;
  Log log = arm_log(0.3);
  channel(log, "p_main").values.setConstant(140.0 * units::kBar);
  const FitResult r = fit(machine, {log});
  // The pressure has no noise: rounding.
  EXPECT_NEAR(r.model.pumps[0].standby, 140.0 * units::kBar, 1.0);
  EXPECT_EQ(r.model.cylinders[0].margin, 0.0);
  EXPECT_NEAR(r.train.energy[0].relative_error, 0.0, 1e-9);
}

TEST(Fit, ADriveWithoutHydraulicsHasItsForceCompared) {
  Machine machine = arm_machine();
  machine.cylinders[0].bore = machine.cylinders[0].rod = 0.0;
  machine.pumps.clear();
  machine.valves.clear();
  machine.source_text.clear();
  Log log = arm_log();
  const MachineSignals s = make_signals(arm_machine(), log);
  add_channel(log, Role::kForce, 0, "force_arm", s.cylinders[0].static_force * 1.1);
  for (const char* name : {"pA_arm", "pB_arm", "p_main"}) remove_channel(log, name);
  const FitResult r = fit(machine, {log});
  EXPECT_TRUE(r.processes.empty());
  ASSERT_NE(r.train.find("force", "arm"), nullptr);
  EXPECT_LT(r.train.find("force", "arm")->bias, 0.0) << "the measured force is a tenth larger";
  EXPECT_THAT(r.full(), HasSubstr("no hydraulic cylinder"));
  EXPECT_THAT(r.train.notes, Contains(HasSubstr("the machine has no pump")));
}

TEST(Fit, MotionsAgainstTheCommandAreNotUsed) {
  // For a quarter of a second the command is ahead of the motion and the chamber pressure is invalid.
  Log good = arm_log(0.3), bad = good;
  Eigen::VectorXd& u = channel(bad, "u_arm").values;
  for (Eigen::Index k = 1; k + 12 < u.size(); ++k) {
    if (u[k] < 0.0 && u[k - 1] == 0.0) {
      for (Eigen::Index j = k + 20; j < k + 32; ++j) {
        u[j] = 0.3;
        channel(bad, "pA_arm").values[j] = 200.0 * units::kBar;
      }
    }
  }
  const FitResult r = fit(arm_machine(), {bad}, {good});
  // As in RecoversTheLawOfTheLog: the bad samples must leave no trace.
  EXPECT_NEAR(r.test->find("pressure", "arm", "extend")->rmse, 0.3 * units::kBar,
              0.05 * units::kBar);
}

TEST(Fit, ProgressRunsToOne) {
  double last = -1.0;
  fit(arm_machine(), {arm_log(0.3)}, {}, {}, [&](double share, const std::string& what) {
    EXPECT_GE(share, 0.0);
    EXPECT_LE(share, 1.0);
    EXPECT_FALSE(what.empty());
    last = share;
  });
  EXPECT_EQ(last, 1.0);
}

TEST(Fit, NoLogIsAnError) { EXPECT_THROW(fit(arm_machine(), {}), InputError); }

// ---------------------------------------------------------------- correlated samples

TEST(IntegratedAutocorrelation, IsThatOfAFirstOrderProcess) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (const double a : {0.0, 0.5, 0.9}) {
    Eigen::VectorXd x(20000);
    std::vector<Eigen::Index> position;
    double value = 0.0;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      value = a * value + normal(generator);
      x[k] = value;
      position.push_back(k);
    }
    const double expected = (1.0 + a) / (1.0 - a);
    // The sum ends at a correlation of 0.05, which leaves out at most 0.1 / (1 - a); the rest is statistical error.
    EXPECT_NEAR(integrated_autocorrelation(x, position), expected,
                0.1 / (1.0 - a) + 0.05 * expected)
        << a;
  }
}

TEST(IntegratedAutocorrelation, UsesNoPairsAcrossGaps) {
  Eigen::VectorXd x(4000);
  std::vector<Eigen::Index> position;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    x[k] = (k % 7 < 3) ? 1.0 : -1.0;
    position.push_back(2 * k);  // no two samples are neighbours
  }
  EXPECT_EQ(integrated_autocorrelation(x, position), 1.0);
}

TEST(Fit, CorrelatedSamplesAreThinned) {
  Log log = arm_log();
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  double wander = 0.0;
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    wander = 0.9 * wander + std::sqrt(1.0 - 0.81) * normal(generator) * units::kBar;
    channel(log, "pA_arm").values[k] += wander;
  }
  FitOptions options;
  options.check_data = false;  // beside a log without noise the wander looks like a sensor's
  const FitResult r = fit(arm_machine(), {log}, {}, options);
  ASSERT_EQ(r.processes.size(), 2u);
  // (1 + 0.9) / (1 - 0.9) is 19; short motions cut the sum off early.
  EXPECT_GT(r.processes[0].autocorrelation, 5.0);
  EXPECT_GE(r.processes[0].step, 3) << "at most so that 400 samples remain";
  EXPECT_EQ(r.processes[0].report.given, r.model.cylinders[0].extend.parameters().data_count);
  EXPECT_LT(r.processes[0].report.given, r.processes[0].offered);
}

// ---------------------------------------------------------------- simulated loader crane

TEST(Fit, LoaderCraneWithNothingMissing) {
  const std::string shared = SPARFLOW_SOURCE_DIR "/../shared/";
  const std::string folder = shared + "data/loader_crane/plain/";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "no simulated loader crane beside the source tree";
  const Machine machine = load_machine(shared + "machines/loader_crane.yaml");
  const FitResult r = fit(machine, {load_log(folder + "train.csv", machine)},
                          {load_log(folder + "test.csv", machine)});
  EXPECT_TRUE(r.model.complete());
  ASSERT_TRUE(r.test.has_value());
  for (const Cylinder& c : machine.cylinders) {
    for (const char* side : {"extend", "retract"}) {
      const StageScore* s = r.test->find("pressure", c.name, side);
      ASSERT_NE(s, nullptr) << c.name << side;
      // The requirement is 1.5 bar; with a sensor noise of 0.8 bar, 1.0 bar leaves 0.6 bar for the model.
      EXPECT_LT(s->rmse, 1.0 * units::kBar) << c.name << " " << side;
      EXPECT_LT(std::abs(s->bias), 0.2 * units::kBar) << c.name << " " << side;
      EXPECT_NEAR(s->within_95_percent, 95.0, 3.0) << c.name << " " << side;
    }
  }
  EXPECT_LT(r.test->find("pump", "main")->rmse, 1.0 * units::kBar) << "requirement: 2 bar";
  ASSERT_EQ(r.test->energy.size(), 1u);
  EXPECT_LT(std::abs(r.test->energy[0].relative_error), 5e-3) << "requirement: 2 %";
  // Below the noise of one sample, 0.8 bar.
  EXPECT_NEAR(r.model.pumps[0].standby, 22.0 * units::kBar, 0.5 * units::kBar);
  for (const CylinderModel& c : r.model.cylinders) {
    EXPECT_GT(c.margin, 5.0 * units::kBar);
    EXPECT_LT(c.margin, 40.0 * units::kBar);
  }
  const Valve* valve = machine.valve_of_cylinder(0);
  ASSERT_NE(valve, nullptr);
  EXPECT_NEAR(r.model.cylinders[0].valve_gain_extend / valve->max_flow_extend, 1.0, 0.02);
}

}  // namespace
}  // namespace sparflow
