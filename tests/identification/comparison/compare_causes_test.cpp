// Tests of the stage at fault, errors by regime with intervals, worst motions and bad data.
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "identification/comparison/compare.h"
#include "tests/identification/arm_log.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using testing::HasSubstr;
using testing_support::arm_log;
using testing_support::arm_model;
using testing_support::channel;
constexpr double kNoise = 0.5;  // [bar]

/// @return a log whose load exceeds the model's by `extra` newtons at the cylinder
Log heavier(double extra) {
  Log log = arm_log(kNoise);
  const CraneModel model = arm_model();
  Eigen::VectorXd& a = channel(log, "pA_arm").values;
  Eigen::VectorXd& b = channel(log, "pB_arm").values;
  Eigen::VectorXd& pump = channel(log, "p_main").values;
  const Eigen::VectorXd& u = channel(log, "u_arm").values;
  const double area_a = model.machine.cylinders[0].area_piston();
  const double area_b = model.machine.cylinders[0].area_rod();
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    if (u[k] > 0.0) {  // the plant's laws at the larger force
      a[k] += extra / area_a;
      pump[k] += extra / area_a;
    } else if (u[k] < 0.0) {
      b[k] -= 50.0 * extra;
      a[k] += (extra - 50.0 * extra * area_b) / area_a;
      pump[k] -= 50.0 * extra;
    } else {
      a[k] += extra / area_a;
    }
  }
  return log;
}

const StageSplit& stage(const CompareResult& r, const std::string& name,
                        const std::string& regime) {
  for (const StageSplit& s : r.fault.stages) {
    if (s.stage == name && s.regime == regime) return s;
  }
  throw std::logic_error("no stage " + name);
}

TEST(StageAtFault, AWrongForceIsNamedAndThePressuresInheritItsError) {
  const CompareResult r = compare(arm_model(), {heavier(20e3)});
  ASSERT_GE(r.fault.fault, 0);
  EXPECT_EQ(r.fault.stages[static_cast<std::size_t>(r.fault.fault)].stage, "force");
  EXPECT_THAT(r.fault.sentence, HasSubstr("arises in the force of arm"));
  EXPECT_THAT(r.fault.sentence, HasSubstr("inherits"));
  const StageSplit& force = stage(r, "force", "");
  // The noise of 0.5 bar, 0.6 kN a sample, adds by its square, 0.05 %; 2 % also cover the filter beside starts and stops.
  EXPECT_NEAR(force.own, 20e3, 400.0);
  EXPECT_EQ(force.inherited, 0.0);
  const StageSplit& up = stage(r, "pressure", "extend");
  // 20 kN over the piston area are 17.7 bar; own error: the sensor noise of 0.5 bar and its part in the smoothed force
  EXPECT_NEAR(up.inherited, 17.7, 0.3);
  EXPECT_LT(up.own, 0.8);
  const StageSplit& pump = stage(r, "pump", "");
  EXPECT_GT(pump.inherited, 8.0 * pump.own);
}

// A first fit learns the pressures with the wrong force; their errors are small, although the law over the force is wrong.
TEST(StageAtFault, ALawLearnedWithAWrongForceIsNotAtFault) {
  CraneModel model = arm_model();
  const double area = model.machine.cylinders[0].area_piston();
  model.cylinders[0].extend =
      testing_support::linear_process(4.0 * units::kBar + 20e3 / area, 1.0 / area);
  const CompareResult r = compare(model, {heavier(20e3)});
  const StageSplit& up = stage(r, "pressure", "extend");
  EXPECT_LT(up.error, 0.8);  // sensor noise, 0.5 bar
  EXPECT_NEAR(up.own, 17.7, 0.3);
  EXPECT_NEAR(up.inherited, 17.7, 0.3);
  EXPECT_TRUE(up.compensates);
  ASSERT_GE(r.fault.fault, 0);
  EXPECT_EQ(r.fault.stages[static_cast<std::size_t>(r.fault.fault)].stage, "force");
  EXPECT_THAT(r.fault.sentence, HasSubstr("working pressure of arm extending was learned with it"));
}

TEST(StageAtFault, AWrongPressureModelIsNamed) {
  CraneModel model = arm_model();
  model.cylinders[0].extend = testing_support::linear_process(
      14.0 * units::kBar, 1.0 / model.machine.cylinders[0].area_piston());  // 10 bar too much
  const CompareResult r = compare(model, {arm_log(kNoise)});
  ASSERT_GE(r.fault.fault, 0);
  const StageSplit& f = r.fault.stages[static_cast<std::size_t>(r.fault.fault)];
  EXPECT_EQ(f.stage + " " + f.regime, "pressure extend");
  // Noise of 0.5 bar adds to 10 bar by its square, 0.01 bar; 3 % also cover the filter beside starts and stops.
  EXPECT_NEAR(f.own, 10.0, 0.3);
  EXPECT_LT(f.inherited, 0.5);
}

TEST(StageAtFault, AWrongMarginIsAttributedToThePump) {
  CraneModel model = arm_model();
  model.cylinders[0].margin += 12.0 * units::kBar;
  const CompareResult r = compare(model, {arm_log(kNoise)});
  ASSERT_GE(r.fault.fault, 0);
  EXPECT_EQ(r.fault.stages[static_cast<std::size_t>(r.fault.fault)].stage, "pump");
}

TEST(StageAtFault, NoneWhereTheModelIsRight) {
  const CompareResult r = compare(arm_model(), {arm_log(kNoise)});
  EXPECT_EQ(r.fault.fault, -1);
  EXPECT_THAT(r.fault.sentence, HasSubstr("No stage stands out"));
  // The level at which a dependence is reported.
  EXPECT_GT(r.tests.smallest_p(), 0.05);
  EXPECT_TRUE(r.bad_data.empty());
}

TEST(WorstRegions, AStageThatIsBiasedEverywhereComesFirst) {
  const CompareResult r = compare(arm_model(), {heavier(20e3)});
  ASSERT_FALSE(r.worst.empty());
  EXPECT_TRUE(r.worst[0].where.empty());
  EXPECT_EQ(r.worst[0].stage, "force");
  EXPECT_THAT(r.worst[0].sentence, HasSubstr("everywhere"));
  EXPECT_THAT(r.worst[0].sentence, HasSubstr("20 kN too low"));
  for (const WorstRegion& w : compare(arm_model(), {arm_log(kNoise)}).worst)
    EXPECT_THAT(w.sentence, Not(HasSubstr("everywhere")));
}

TEST(WorstSegments, TheMotionWithTheErrorIsNamedWithItsTime) {
  Log log = arm_log(kNoise);
  channel(log, "pA_arm").values.segment(1260, 60).array() += 30.0 * units::kBar;  // 25.2 to 26.4 s
  const CompareResult r = compare(arm_model(), {log});
  ASSERT_FALSE(r.segments.empty());
  const WorstSegment& w = r.segments[0];
  EXPECT_LT(w.from_s, 25.3);
  // It must contain the faulty stretch but for 0.1 s at its start and 0.2 s at its end.
  EXPECT_GT(w.to_s, 26.2);
  EXPECT_EQ(w.moved, "arm extending");
  // 60 samples of 30 bar have 54,000 bar^2, the noise of all samples has less than a twentieth of that.
  EXPECT_GT(w.share_of_error, 0.9);
}

TEST(Regimes, IntervalsContainTheErrorAndTheWrongPayloadIsFound) {
  Log log = arm_log(kNoise);
  const Eigen::VectorXd payload = channel(log, "payload").values;
  Eigen::VectorXd& a = channel(log, "pA_arm").values;
  for (Eigen::Index k = 0; k < a.size(); ++k) {
    if (payload[k] == 200.0) a[k] += 4.0 * units::kBar;
  }
  const CompareResult r = compare(arm_model(), {log});
  double light = 0.0, heavy = 0.0;
  std::size_t intervals = 0;
  for (const RegimeError& e : r.regimes) {
    if (std::isfinite(e.rmse_ci95.lo)) {
      ++intervals;
      EXPECT_LE(e.rmse_ci95.lo, e.rmse * (1.0 + 1e-9));
      EXPECT_GE(e.rmse_ci95.hi, e.rmse * (1.0 - 1e-9));
    }
    if (e.stage != "pressure" || e.regime != "extend" || e.factor != "payload_kg") continue;
    (e.level == "200" ? heavy : light) = e.rmse;
  }
  // where a regime has too few motions there is none
  EXPECT_GE(2 * intervals, r.regimes.size());
  EXPECT_NEAR(light, kNoise, 0.1);
  EXPECT_NEAR(heavy, 4.0, 0.2);
}

TEST(CompareJson, HasTheCauses) {
  Log log = heavier(20e3);
  Eigen::VectorXd& pump = channel(log, "p_main").values;
  pump.segment(1000, 250).setConstant(pump[1000]);
  const CompareResult r = compare(arm_model(), {log});
  const auto json = test_support::parsed_json(compare_json(r));
  EXPECT_EQ(json["stage_at_fault"]["stage"], "force");
  EXPECT_LE(json["residual_tests"]["p_value"], 0.05);
  EXPECT_FALSE(json["regimes"].empty());
  EXPECT_FALSE(json["worst_segments"].empty());
  ASSERT_EQ(json["bad_data"].size(), 1u);
  EXPECT_EQ(json["bad_data"][0]["channel"], "p_main");
  EXPECT_EQ(json["bad_data"][0]["kind"], "stuck");
  EXPECT_EQ(json["bad_data"][0]["in_errors"], false);
  const std::string table = compare_table(r);
  EXPECT_THAT(table, HasSubstr("stage at fault"));
  EXPECT_THAT(table, HasSubstr("p_main is stuck"));
  EXPECT_THAT(table, HasSubstr("systematic errors"));
}

/// A load of 20 kN too much, judged so strictly that no test can be significant.
TEST(CompareTable, DoesNotDenyAnErrorThatTheMotionsAreTooFewToDecide) {
  Log log = heavier(20e3);
  ResidualTestOptions strict;
  strict.alarm = 5e-4;  // 999 flips allow no p-value below 0.001, so no number of blocks suffices
  CompareOptions options;
  options.tests = strict;
  const std::string table = compare_table(compare(arm_model(), {log}, options));
  EXPECT_THAT(table, HasSubstr("too few to decide whether"));
  EXPECT_THAT(table, testing::Not(HasSubstr("none: no significant")));
}

}  // namespace
}  // namespace sparflow
