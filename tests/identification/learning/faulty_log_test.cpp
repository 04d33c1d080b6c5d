/// Faulty stretches of a log neither train a model nor judge it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "identification/data_checks/set_aside.h"
#include "identification/learning/fit.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using namespace testing_support;
using testing::HasSubstr;

constexpr double kSensorNoise = 0.3;  // [bar]

/// The arm's log with a chamber pressure that rests at one value for thirty of its sixty seconds.
Log stuck_log() {
  Log log = arm_log(kSensorNoise, 1);
  Eigen::VectorXd& x = channel(log, "pA_arm").values;
  x.segment(1000, 1500).setConstant(x[1000]);
  return log;
}

double error_of(const CraneModel& model, const char* regime) {
  return compare(model, {arm_log(kSensorNoise, 2)}).find("pressure", "arm", regime)->rmse /
         units::kBar;
}

TEST(FaultyLog, IsLearnedFromWithoutItsFault) {
  FitOptions unchecked;
  unchecked.check_data = false;
  const FitResult sound = fit(arm_machine(), {stuck_log()}),
                  raw = fit(arm_machine(), {stuck_log()}, {}, unchecked);
  // on another log: the noise, and a tenth of it for the law, as without a fault
  EXPECT_NEAR(error_of(sound.model, "extend"), kSensorNoise, 0.05);
  EXPECT_GT(error_of(raw.model, "extend"), 1.5 * kSensorNoise) << "the fault does matter";
  ASSERT_EQ(sound.train.bad_data.size(), 1U);
  EXPECT_EQ(sound.train.bad_data[0].bad.channel, "pA_arm");
  EXPECT_THAT(sound.full(), HasSubstr("set aside: " + arm_log().file + ": pA_arm is stuck"));
  EXPECT_TRUE(raw.train.bad_data.empty());
}

TEST(FaultyLog, IsComparedWithoutItsFault) {
  const CompareResult r = compare(arm_model(), {stuck_log()});
  EXPECT_NEAR(r.find("pressure", "arm", "extend")->rmse / units::kBar, kSensorNoise, 0.05);
  ASSERT_EQ(r.bad_data.size(), 1U);
  // what the fault does not concern is compared all along
  const CompareResult healthy = compare(arm_model(), {arm_log(kSensorNoise, 1)});
  EXPECT_EQ(r.find("pump", "main")->n, healthy.find("pump", "main")->n);
  EXPECT_EQ(r.find("flow", "arm")->n, healthy.find("flow", "arm")->n);
  EXPECT_LT(r.find("force", "arm")->n, healthy.find("force", "arm")->n);
  EXPECT_FALSE(r.bad_data[0].in_errors);
  EXPECT_THAT(compare_table(r), HasSubstr("set aside: " + arm_log().file + ": pA_arm is stuck"));
}

/// The arm's log with a chamber pressure that jumps three times.
Log jumping_log() {
  Log log = arm_log(kSensorNoise, 1);
  for (const Eigen::Index at : {600, 1300, 2200})
    channel(log, "pA_arm").values.segment(at, 40).array() += 40.0 * units::kBar;
  return log;
}

TEST(FaultyLog, JumpsStayWhereAModelIsJudgedOnly) {
  const Log log = jumping_log();
  const BadDataOptions options;
  const CheckedSignals stay = checked_signals(arm_machine(), log, {}, options, Staying::kJumps),
                       aside = checked_signals(arm_machine(), log, {}, options, Staying::kNothing);
  ASSERT_EQ(stay.bad.size(), 1U);
  EXPECT_EQ(stay.bad[0].kind, BadDataKind::kJumping);
  ASSERT_EQ(aside.bad.size(), 1U);
  const auto known = [](const CheckedSignals& s) {
    return s.signals.cylinders[0].force.array().isFinite().count();
  };
  EXPECT_EQ(known(stay), known({make_signals(arm_machine(), log), {}}));
  EXPECT_LE(known(aside), known(stay) - 60);  // of the 120 samples that jump
  EXPECT_GT(compare(arm_model(), {log}).find("force", "arm")->rmse,
            2.0 * compare(arm_model(), {arm_log(kSensorNoise, 1)}).find("force", "arm")->rmse);
}

TEST(FaultyLog, SaysWhetherAFaultIsInTheErrors) {
  const Log log = jumping_log();
  const CompareResult judged = compare(arm_model(), {log});
  ASSERT_EQ(judged.bad_data.size(), 1U);
  EXPECT_TRUE(judged.bad_data[0].in_errors);
  EXPECT_THAT(compare_table(judged), HasSubstr("in the errors: " + log.file + ": pA_arm jumps"));
  const FitResult fitted = fit(arm_machine(), {log}, {log});
  ASSERT_EQ(fitted.train.bad_data.size(), 1U);
  EXPECT_FALSE(fitted.train.bad_data[0].in_errors) << "nothing is learned from jumps";
  ASSERT_TRUE(fitted.test.has_value());
  ASSERT_EQ(fitted.test->bad_data.size(), 1U);
  EXPECT_TRUE(fitted.test->bad_data[0].in_errors);
}

TEST(FaultyLog, WithoutChecksAllStays) {
  const CheckedSignals all = checked_signals(arm_machine(), stuck_log(), {}, {}, Staying::kAll);
  EXPECT_TRUE(all.bad.empty());
  const MachineSignals raw = make_signals(arm_machine(), stuck_log());
  EXPECT_TRUE(all.signals.cylinders[0].force.isApprox(raw.cylinders[0].force));
  EXPECT_TRUE(stays({}, Staying::kAll));
}

}  // namespace
}  // namespace sparflow
