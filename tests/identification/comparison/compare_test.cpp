#include "identification/comparison/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "tests/identification/arm_log.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using namespace testing_support;
using testing::Contains;
using testing::HasSubstr;

// ---------------------------------------------------------------- signals

TEST(Signals, DirectionFollowsTheCommandWhereTheyDisagree) {
  Log log = arm_log();
  // A command to lower while the arm still rises, as a lagging valve shows it.
  Eigen::VectorXd& u = channel(log, "u_arm").values;
  Eigen::Index rising = 0;
  while (u[rising] < 0.3) ++rising;
  for (Eigen::Index k = rising; k < rising + 10; ++k) u[k] = -0.2;
  const MachineSignals s = make_signals(arm_machine(), log);
  const CylinderSignals& c = s.cylinders[0];
  const Eigen::Index k = rising + 5;
  EXPECT_GT(c.speed[k], 2e-3);
  EXPECT_EQ(c.direction[k], -1);
  EXPECT_TRUE(c.moving[k]);
  EXPECT_FALSE(c.driven[k])
      << "nothing may be learned from a sample that moves against its command";
  EXPECT_EQ(c.flow[k], 0.0) << "no flow goes into a chamber that shrinks";
  EXPECT_EQ(c.working_pressure[k], c.pressure_b[k]);
}

TEST(Signals, SpeedAloneDecidesWithoutCommands) {
  Log log = arm_log();
  remove_channel(log, "u_arm");
  const MachineSignals s = make_signals(arm_machine(), log);
  const CylinderSignals& c = s.cylinders[0];
  for (Eigen::Index k = 0; k < s.samples(); ++k) {
    EXPECT_EQ(c.direction[k], std::abs(c.speed[k]) <= 2e-3 ? 0 : (c.speed[k] > 0 ? 1 : -1));
    EXPECT_EQ(c.moving[k], c.direction[k] != 0);
  }
}

TEST(Signals, MeasuredForceFollowsFromTheChamberPressures) {
  const MachineSignals s = make_signals(arm_machine(), arm_log());
  const CylinderSignals& c = s.cylinders[0];
  // The simulated forces are in balance; the remaining error is that of the smoothed pose.
  for (Eigen::Index k = 0; k < s.samples(); ++k) {
    EXPECT_NEAR(c.force[k], c.static_force[k], 30.0) << "0.1 % of the load, sample " << k;
  }
}

TEST(Signals, StrokesAreConvertedToJointAngles) {
  const Machine machine = arm_machine();
  Log log = arm_log();
  const Eigen::VectorXd q = channel(log, "q_arm").values;
  Eigen::VectorXd x(q.size());
  for (Eigen::Index k = 0; k < q.size(); ++k) x[k] = stroke_at(machine, 0, q[k]);
  EXPECT_LT((joints_at_strokes(machine, 0, x) - q).cwiseAbs().maxCoeff(), 1e-10) << "as documented";

  const MachineSignals direct = make_signals(machine, log);
  remove_channel(log, "q_arm");
  add_channel(log, Role::kStroke, 0, "x_arm", x);
  SignalOptions same;
  same.smoothing.window_s = direct.window;
  const MachineSignals converted = make_signals(machine, log, same);
  EXPECT_LT((converted.q - direct.q).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(Signals, StrokesOutOfReachAreLeftOutOrRefused) {
  const Machine machine = arm_machine();
  Log log = arm_log();
  Eigen::VectorXd x(log.samples());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    x[k] = stroke_at(machine, 0, channel(log, "q_arm").values[k]);
  }
  remove_channel(log, "q_arm");
  x[100] = 9.0;
  add_channel(log, Role::kStroke, 0, "x_arm", x);
  const MachineSignals s = make_signals(machine, log);
  EXPECT_FALSE(s.usable[100]);
  EXPECT_THAT(s.notes, Contains(HasSubstr("1 sample(s) left out")));

  channel(log, "x_arm").values *= 1000.0;  // millimetres taken for metres
  try {
    make_signals(machine, log);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("x_arm"));
    EXPECT_THAT(error.what(), HasSubstr("joint arm"));
    EXPECT_THAT(error.what(), HasSubstr("Check unit"));
  }
}

TEST(Signals, DurationsAddUpToTheRuns) {
  Eigen::VectorXd time(6);
  time << 0.0, 0.1, 0.3, 5.0, 5.1, 5.2;
  EXPECT_NEAR(sample_durations(time, {{0, 3}, {3, 6}}).sum(), 0.5, 1e-15)
      << "the gap does not count";
}

// ---------------------------------------------------------------- compare

TEST(Compare, TheRightModelHasNoError) {
  const CompareResult r = compare(arm_model(), {arm_log()});
  ASSERT_NE(r.find("force", "arm"), nullptr);
  // The filter reduces the peaks of speed by 0.1 %, which remains as error of load and flow.
  EXPECT_LT(r.find("force", "arm")->rmse, 30.0);
  EXPECT_LT(r.find("pressure", "arm", "extend")->rmse, 0.05 * units::kBar);
  EXPECT_LT(r.find("pressure", "arm", "retract")->rmse, 0.05 * units::kBar);
  EXPECT_LT(r.find("flow", "arm")->rmse, 0.1 * units::kLitrePerMinute);
  EXPECT_LT(r.find("pump", "main")->rmse, 0.05 * units::kBar);
  ASSERT_EQ(r.energy.size(), 1u);
  EXPECT_LT(std::abs(r.energy[0].relative_error), 1e-3);
  ASSERT_TRUE(r.energy[0].from_commands.has_value());
  // The filter's 0.1 % of the speed, in the flow and in the load.
  EXPECT_NEAR(*r.energy[0].from_commands / r.energy[0].measured, 1.0, 2e-3);
  EXPECT_EQ(r.samples, 3000);
}

TEST(Compare, EnergyIsThePumpsPressureTimesFlow) {
  const Log log = arm_log();
  const CompareResult r = compare(arm_model(), {log});
  // The reference is computed from the command's exact flow without a filter.
  double energy = 0.0;
  const Eigen::VectorXd u = log.find("u_arm")->values, p = log.find("p_main")->values;
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    energy += p[k] * std::abs(u[k]) * (u[k] > 0 ? kGainExtend : kGainRetract) * 0.02;
  }
  EXPECT_NEAR(r.energy[0].measured / energy, 1.0, 2e-3) << "filter and trapezoidal rule";
}

TEST(Compare, ScoresFollowTheirDefinitions) {
  CraneModel model = arm_model();
  // The model predicts 2 bar too much while extending.
  model.cylinders[0].extend =
      linear_process(6.0 * units::kBar, 1.0 / model.machine.cylinders[0].area_piston());
  const CompareResult r = compare(model, {arm_log()});
  const StageScore& s = *r.find("pressure", "arm", "extend");
  // The offset is the only error, beside the 0.05 bar of TheRightModelHasNoError, which add by their squares.
  EXPECT_NEAR(s.rmse, 2.0 * units::kBar, 0.01 * units::kBar);
  EXPECT_NEAR(s.bias, 2.0 * units::kBar, 0.01 * units::kBar) << "predicted - measured";
  double sum = 0.0, squares = 0.0;
  for (const ComparedSeries& series : r.logs[0].series) {
    if (series.stage != "pressure") continue;
    for (Eigen::Index k = 0; k < series.measured.size(); ++k) {
      if (std::isfinite(series.measured[k]) && series.regime[k] == 0) sum += series.measured[k];
    }
    for (Eigen::Index k = 0; k < series.measured.size(); ++k) {
      if (std::isfinite(series.measured[k]) && series.regime[k] == 0) {
        squares += std::pow(series.measured[k] - sum / static_cast<double>(s.n), 2);
      }
    }
  }
  // The same sums in another order: rounding.
  EXPECT_NEAR(s.fit_percent,
              100.0 * (1.0 - s.rmse * std::sqrt(static_cast<double>(s.n)) / std::sqrt(squares)),
              1e-6);
}

TEST(Compare, PredictedIntervalsCoverTheNoise) {
  CraneModel model = arm_model();
  GpParameters p = model.cylinders[0].extend.parameters();
  p.noise_std = 0.8 * units::kBar;
  p.signal_std = 1.0;  // the mean is certain
  model.cylinders[0].extend = GaussianProcess(p);
  const CompareResult r = compare(model, {arm_log(0.8)});
  // 800 independent samples: the share's own deviation is 0.8 %
  EXPECT_NEAR(r.find("pressure", "arm", "extend")->within_95_percent, 95.0, 3.0);
}

TEST(Compare, UnmeasuredQuantitiesAreNotedAndNotCompared) {
  struct Case {
    const char* removed;
    const char* stage;
    const char* at;
    const char* regime;
    const char* note;
  };
  const Case cases[] = {
      {"pA_arm", "force", "arm", "", "force of arm: not compared, needs pA_arm_bar and pB_arm_bar"},
      {"pA_arm", "pressure", "arm", "extend",
       "pressure of arm extending: not compared, needs pA_arm_bar"},
      {"pB_arm", "pressure", "arm", "retract",
       "pressure of arm retracting: not compared, needs pB_arm_bar"},
      {"u_arm", "flow", "arm", "", "flow of arm from its command: not compared, needs u_arm"},
      {"p_main", "pump", "main", "",
       "pressure and energy of pump main: not compared, needs p_main_bar"},
      {"payload", "nothing", "", "", "no payload_kg in the log: 0 kg is assumed"},
  };
  for (const Case& c : cases) {
    Log log = arm_log();
    remove_channel(log, c.removed);
    const CompareResult r = compare(arm_model(), {log});
    EXPECT_EQ(r.find(c.stage, c.at, c.regime), nullptr) << c.removed;
    EXPECT_THAT(r.notes, Contains(HasSubstr(c.note))) << c.removed;
    EXPECT_THAT(compare_table(r), HasSubstr(c.note));
  }
  Log log = arm_log();
  remove_channel(log, "p_main");
  EXPECT_TRUE(compare(arm_model(), {log}).energy.empty());
}

TEST(Compare, AMissingPressureModelIsNotCompared) {
  CraneModel model = arm_model();
  model.cylinders[0].retract = {};
  model.cylinders[0].valve_gain_extend = model.cylinders[0].valve_gain_retract = 0.0;
  const CompareResult r = compare(model, {arm_log()});
  EXPECT_NE(r.find("pressure", "arm", "extend"), nullptr);
  EXPECT_EQ(r.find("pressure", "arm", "retract"), nullptr);
  EXPECT_EQ(r.find("flow", "arm"), nullptr);
  EXPECT_NE(r.find("pump", "main"), nullptr) << "while extending";
  EXPECT_THAT(r.notes, Contains(HasSubstr("the model has no valve gain")));
}

TEST(Compare, ExtrapolationOfAPressureModelIsNoted) {
  CraneModel model = arm_model();
  GpParameters p = model.cylinders[0].extend.parameters();
  const Log log = arm_log();
  const MachineSignals s = make_signals(model.machine, log);
  const double lo = s.cylinders[0].static_force.minCoeff(),
               hi = s.cylinders[0].static_force.maxCoeff();
  p.flow_max = 1.0;
  p.force_min = lo;
  p.force_max = 0.5 * (lo + hi);
  // A wrong slope makes the error grow towards the loads beyond the data, as in an extrapolation.
  p.mean_slope *= 1.3;
  p.mean_constant = extend_pressure(model.machine, lo) - p.mean_slope * lo;
  model.cylinders[0].extend = GaussianProcess(p);
  const CompareResult r = compare(model, {log});
  const StageScore& score = *r.find("pressure", "arm", "extend");
  // Half of the range of loads lies beyond the data, so that more than a tenth of the samples must.
  EXPECT_GT(score.extrapolated_percent, 10.0);
  EXPECT_GT(score.extrapolated_error_percent, score.extrapolated_percent);
  EXPECT_THAT(r.notes, Contains(HasSubstr("lie outside what it was learned from")));
}

TEST(Compare, MeasuredFlowIsComparedWithTheSpeed) {
  Log log = arm_log();
  const Eigen::VectorXd u = channel(log, "u_arm").values;
  Eigen::VectorXd flow(u.size());
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    flow[k] = 1.1 * std::abs(u[k]) * (u[k] > 0 ? kGainExtend : kGainRetract);  // reads 10 % high
  }
  add_channel(log, Role::kFlow, 0, "Q_arm", flow);
  const CompareResult r = compare(arm_model(), {log});
  const StageScore* s = r.find("flow_sensor", "arm");
  ASSERT_NE(s, nullptr);
  // The sensor reads a tenth more, which is more than half a litre per minute.
  EXPECT_LT(s->bias, -0.5 * units::kLitrePerMinute);
}

TEST(Compare, MasksLimitWhatCounts) {
  const Machine machine = arm_machine();
  MachineSignals signals = make_signals(machine, arm_log());
  Mask first = Mask::Constant(signals.samples(), false);
  first.head(1500).setConstant(true);
  const CompareResult r = compare_signals(arm_model(), {signals}, {first});
  EXPECT_EQ(r.samples, 1500);
  // One sample, of which the trapezoidal rule counts half at either end.
  EXPECT_NEAR(r.energy[0].duration, 30.0, 0.02);
  EXPECT_TRUE(r.logs[0].series[0].measured.tail(1500).array().isNaN().all());
}

// ---------------------------------------------------------------- worst regions

TEST(WorstRegions, NoiseAloneGivesNoRegion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const CompareResult r = compare(arm_model(), {arm_log(0.8, seed)});
    EXPECT_TRUE(r.worst.empty()) << "seed " << seed << ": " << r.worst[0].sentence;
  }
}

TEST(WorstRegions, FindTheAngleAndDirectionOfAnInjectedError) {
  Log log = arm_log(0.8);
  const Eigen::VectorXd q = channel(log, "q_arm").values, u = channel(log, "u_arm").values;
  Eigen::VectorXd& b = channel(log, "pB_arm").values;
  const double lo = 0.10, hi = 0.25;
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    if (u[k] < 0.0 && q[k] > lo && q[k] < hi) b[k] += 6.0 * units::kBar;
  }
  const CompareResult r = compare(arm_model(), {log});
  const WorstRegion* found = nullptr;
  for (const WorstRegion& w : r.worst) {
    if (w.stage == "pressure" && found == nullptr) found = &w;
  }
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->at, "arm");
  EXPECT_EQ(found->regime, "retract");
  ASSERT_FALSE(found->where.empty());
  EXPECT_EQ(found->where[0].key, "q_arm_deg");
  // The ends are quantiles: each may be off by a tenth of the samples, here some 4 degrees.
  EXPECT_NEAR(found->where[0].lo, lo / units::kDegree, 4.0);
  EXPECT_NEAR(found->where[0].hi, hi / units::kDegree, 4.0);
  EXPECT_GT(found->share_of_error, 0.5);
  EXPECT_LT(found->share_of_samples, 0.4);
  EXPECT_THAT(found->sentence, HasSubstr("arm retracting with arm angle"));
  EXPECT_THAT(found->sentence, HasSubstr("% of the pressure error in"));
  EXPECT_THAT(found->sentence, HasSubstr("bar)"));
}

TEST(WorstRegions, TwoSignalsAreUsedWhereOneDoesNotSuffice) {
  ErrorGroup g;
  g.stage = "pressure";
  g.at = "boom";
  g.regime = "extend";
  g.words = "boom extending";
  g.pool = "pressure";
  g.pool_words = "the pressure error";
  g.unit = "bar";
  const Eigen::Index side = 60;
  Eigen::VectorXd x(side * side), y(side * side), e = Eigen::VectorXd::Ones(side * side);
  for (Eigen::Index i = 0; i < side; ++i) {
    for (Eigen::Index j = 0; j < side; ++j) {
      x[i * side + j] = static_cast<double>(i) / side;
      y[i * side + j] = static_cast<double>(j) / side;
      if (i >= 30 && i < 42 && j < 12) e[i * side + j] = 100.0;
    }
  }
  g.squared_error = e;
  g.signals = {{"load_boom_kN", "boom load", "kN", 1.0, x},
               {"speed_boom_mm_s", "boom speed", "mm/s", 1.0, y},
               {"constant", "a constant", "", 1.0, Eigen::VectorXd::Ones(side * side)}};
  const std::vector<WorstRegion> worst = worst_regions({g});
  ASSERT_EQ(worst.size(), 1u);
  ASSERT_EQ(worst[0].where.size(), 2u);
  EXPECT_NEAR(worst[0].where[0].lo, 0.5, 1e-12);  // the boundaries lie on the decile edges
  EXPECT_NEAR(worst[0].where[0].hi, 0.7, 1e-12);
  EXPECT_NEAR(worst[0].where[1].hi, 0.2, 1e-12);
  EXPECT_NEAR(worst[0].share_of_samples, 0.04, 1e-12);
  EXPECT_NEAR(worst[0].share_of_error, 14400.0 / (14400.0 + 3456.0), 1e-12);
  EXPECT_NEAR(worst[0].rmse, 10.0, 1e-12);
  EXPECT_EQ(
      worst[0].sentence,
      "boom extending with boom load 0.50..0.70 kN and boom speed 0.00..0.20 mm/s: 81 % of the "
      "pressure error in 4 % of the samples (RMSE 10 bar)");
}

// ---------------------------------------------------------------- reports

TEST(CompareReport, JsonHasTheDocumentedKeys) {
  Log log = arm_log(0.8);
  Eigen::VectorXd& b = channel(log, "pB_arm").values;
  const Eigen::VectorXd q = channel(log, "q_arm").values;
  for (Eigen::Index k = 0; k < b.size(); ++k) {
    if (q[k] > 0.2) b[k] += 9.0 * units::kBar;
  }
  const nlohmann::json j = test_support::parsed_json(compare_json(compare(arm_model(), {log})));
  EXPECT_EQ(j["samples"], 3000);
  for (const auto& s : {j["stages"]["force"]["arm"], j["stages"]["flow"]["arm"],
                        j["stages"]["pressure"]["arm"]["extend"],
                        j["stages"]["pressure"]["arm"]["retract"], j["stages"]["pump"]["main"]}) {
    EXPECT_TRUE(s["rmse"].is_number());
    EXPECT_TRUE(s["unit"].is_string());
    EXPECT_TRUE(s["fit_percent"].is_number());
    EXPECT_GT(s["n"], 0);
  }
  EXPECT_EQ(j["stages"]["pressure"]["arm"]["extend"]["unit"], "bar");
  // The noise of pA; only pB has an offset. Hundreds of samples give it to a few per cent.
  EXPECT_NEAR(j["stages"]["pressure"]["arm"]["extend"]["rmse"], 0.8, 0.1);
  EXPECT_EQ(j["stages"]["flow"]["arm"]["unit"], "l/min");
  for (const char* key : {"measured_J", "predicted_J", "relative_error"}) {
    EXPECT_TRUE(j["stages"]["energy"]["main"][key].is_number()) << key;
  }
  ASSERT_FALSE(j["worst"].empty());
  for (const char* key : {"stage", "at", "where", "rmse", "share_of_error"}) {
    EXPECT_TRUE(j["worst"][0].contains(key)) << key;
  }
  EXPECT_EQ(j["worst"][0]["where"].begin().value().size(), 2u);
}

TEST(CompareReport, TableFitsAScreen) {
  const std::string table = compare_table(compare(arm_model(), {arm_log(0.8)}));
  EXPECT_LT(std::count(table.begin(), table.end(), '\n'), 40);
  std::size_t start = 0;
  while (start < table.size()) {
    const std::size_t end = table.find('\n', start);
    EXPECT_LE(end - start, 120u) << table.substr(start, end - start);
    start = end + 1;
  }
  EXPECT_THAT(table, HasSubstr("bar"));
  EXPECT_THAT(table, HasSubstr("arm extend"));
  EXPECT_THAT(table, HasSubstr("explained % = 100"));
}

}  // namespace
}  // namespace sparflow
