// Applying a model's effects to logs gives the numbers of the exact chain sample by sample, and a fit learns the rest of
// the model with their contributions subtracted.
#include "identification/signals/apply_effects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/evidence/evidence.h"
#include "identification/learning/fit.h"
#include "identification/signals/series.h"
#include "models/effects/effective_machine.h"
#include "models/effects/memory.h"
#include "models/effects/registry.h"
#include "models/effects/valve_flow.h"
#include "tests/identification/arm_log.h"
#include "tests/models/effects/effect_series.h"

namespace sparflow {
namespace {

using namespace testing_support;
using Eigen::Index;

AppliedEffect typical(const std::string& key, const Machine& machine) {
  const EffectAt place = parse_effect(key, machine);
  AppliedEffect e{place.effect, place.at, {}, {}, {}};
  for (const EffectParameter& p : place.effect->info().parameters) e.values.push_back(p.typical);
  return e;
}

/// @return the arm's motion with the pressures of the exact chain of `truth`. Poses and speeds are the filtered ones, so
///   that program and plant agree to rounding.
Log log_of(const CraneModel& truth, double noise = 0.0, unsigned seed = 1) {
  Log log = arm_log(noise, seed);
  const Log clean = arm_log();
  const MachineSignals s = make_signals(truth.machine, log);
  const Cylinder& c = truth.machine.cylinders[0];
  const double a = c.area_piston(), b = c.area_rod();
  Eigen::VectorXd& pa = channel(log, "pA_arm").values;
  Eigen::VectorXd& pb = channel(log, "pB_arm").values;
  Eigen::VectorXd& pump = channel(log, "p_main").values;
  pa -= channel(const_cast<Log&>(clean), "pA_arm").values;  // only the noise remains
  pb -= channel(const_cast<Log&>(clean), "pB_arm").values;
  pump -= channel(const_cast<Log&>(clean), "p_main").values;
  Chain chain(truth);
  for (Index k = 0; k < s.samples(); ++k) {
    const double q = s.q(k, 0), qdd = s.qdd(k, 0);
    // Where the command is zero the small speed that the filter leaves is no motion.
    const double qd = s.cylinders[0].direction[k] == 0 ? 0.0 : s.qd(k, 0);
    const MachineState& state = chain.evaluate({&q, &qd, &qdd}, s.payload[k]);
    const CylinderState& x = state.cylinders[0];
    const bool retracts = x.speed < 0.0;
    pa[k] += retracts ? (x.total_force + x.pressure * b) / a : x.pressure;
    pb[k] += retracts ? x.pressure : (x.pressure * a - x.total_force) / b;
    pump[k] += state.pumps[0].pressure;
  }
  return log;
}

double rmse(const CompareResult& r, const std::string& stage, const std::string& at) {
  const auto* score = r.find(stage, at);
  return score == nullptr ? std::nan("") : score->rmse;
}

TEST(WithOpenings, SubtractTheDeadBandOfTheirOwnCylinder) {
  const Machine machine = testing_support::arm_machine();
  MachineSeries series;
  series.cylinders.resize(2);
  series.cylinders[0].command = series.cylinders[1].command =
      (Eigen::VectorXd(6) << -1.0, -0.3, -0.05, 0.05, 0.3, 1.0).finished();
  AppliedEffect band = typical("valve_deadband:arm", machine);
  band.values = {0.1, 0.2, 0.0};  // extending, retracting, and the gain stays
  const MachineSeries banded = with_openings({band}, series);
  EXPECT_EQ(series.cylinders[0].opening.size(), 0) << "the series given stays as it is";
  const Eigen::VectorXd& opening = banded.cylinders[0].opening;
  // Rounding of differences of numbers below one.
  EXPECT_NEAR(opening[0], -0.8, 1e-12);
  EXPECT_NEAR(opening[1], -0.1, 1e-12);
  EXPECT_EQ(opening[2], 0.0);
  EXPECT_EQ(opening[3], 0.0);
  EXPECT_NEAR(opening[4], 0.2, 1e-12);
  EXPECT_NEAR(opening[5], 0.9, 1e-12);
  EXPECT_EQ(banded.cylinders[1].opening, series.cylinders[1].command) << "another cylinder's valve";
  band.values[2] = 1.0;  // full command still gives full flow
  const Eigen::VectorXd full = with_openings({band}, series).cylinders[0].opening;
  EXPECT_NEAR(full[0], -1.0, 1e-12);
  EXPECT_NEAR(full[4], 0.2 / 0.9, 1e-12);
}

/// A log of the first of two cylinders, whose valve has a dead band, is late, and has less pressure over its edge at times.
class ReachedOpening : public ::testing::Test {
 protected:
  static constexpr double kGain = 0.14, kBand = 0.08, kTau = 0.2, kSetting = 12e5;
  Machine machine = test_support::two_direct_cylinders();
  MachineSeries log = test_support::two_cylinder_series(machine);

  void SetUp() override {
    for (Index k = 0; k < log.samples(); ++k)
      log.pumps[0].pressure[k] =
          log.cylinders[0].pressure_a[k] + 9e5 + 8e5 * std::sin(0.31 * log.time[k]);
    log.cylinders[0].command = log.cylinders[0].command.cwiseAbs();  // extends only
    log = with_reached(laws(kBand, 1.0, 1.0), std::move(log));
    log.cylinders[0].speed = kGain * log.cylinders[0].reached;
  }
  /// @param lag, drop shares  @param band of the command
  std::vector<AppliedEffect> laws(double band, double lag, double drop) const {
    const auto law = [&](const char* id, std::vector<double> values) {
      AppliedEffect e = typical(std::string(id) + ":lift", machine);
      e.values = std::move(values);
      return e;
    };
    return {law("valve_deadband", {band, band, 0.0}), law("valve_lag", {lag, kTau, 0.0}),
            law("valve_pressure_drop", {drop, kSetting, 1.0})};
  }
  /// Speed of the rod by other values, less that of the log, for each unit. [samples, m/s]
  Eigen::VectorXd slope(const std::vector<AppliedEffect>& other, double change) const {
    const Eigen::VectorXd there = with_reached(other, log).cylinders[0].reached;
    return kGain * (there - log.cylinders[0].reached) / change;
  }
  Eigen::MatrixXd columns(const char* id, std::vector<double> shape) const {
    Eigen::MatrixXd out;
    EXPECT_TRUE(find_effect(id)->columns(log, {EvidenceKind::kFlow, 0}, 0, std::move(shape), out))
        << id;
    return out;
  }
};

TEST_F(ReachedOpening, IsTheProductOfBandLagAndPressureDrop) {
  const CylinderSeries& c = log.cylinders[0];
  Eigen::VectorXd opening = (c.command.array() - kBand).max(0.0);
  opening = first_order_lag(log, opening, kTau);
  int throttled = 0;
  for (Index k = 0; k < log.samples(); ++k) {
    const double drop = log.pumps[0].pressure[k] - c.pressure_a[k];
    const bool open = c.command[k] > kBand;
    const double passes = open ? std::sqrt(std::clamp(drop / kSetting, 0.0, 1.0)) : 1.0;
    EXPECT_NEAR(c.reached[k], opening[k] * passes, 1e-12) << k;  // rounding
    throttled += open && passes < 0.9 ? 1 : 0;
  }
  EXPECT_GT(throttled, 100);
  EXPECT_EQ(log.cylinders[1].reached.size(), 0) << "another cylinder's valve";
}

TEST_F(ReachedOpening, ColumnsAreItsDerivatives) {
  // Shares act linearly; what is left is rounding and the fit of the gain.
  const Eigen::VectorXd lag = slope(laws(kBand, 1.1, 1.0), 0.1),
                        drop = slope(laws(kBand, 1.0, 1.1), 0.1);
  EXPECT_LT((columns("valve_lag", {kTau, 0.0}).col(0) - lag).norm(), 1e-9 * lag.norm());
  EXPECT_LT((columns("valve_pressure_drop", {kSetting, 1.0}).col(0) - drop).norm(),
            1e-9 * drop.norm());
  // A dead band's column, and the gain fitted for it, leave the lag out: some per cent in the ramps of this log.
  const Eigen::VectorXd band = slope(laws(kBand + 1e-3, 1.0, 1.0), 1e-3);
  const Eigen::MatrixXd found = columns("valve_deadband", {0.0});
  double settled = 0.0, squares = 0.0;
  for (Index k = 0; k < log.samples(); ++k) {
    const Eigen::VectorXd& u = log.cylinders[0].command;
    const Index before = std::max<Index>(0, k - 60);  // six times the lag
    if (u.segment(before, k - before + 1).minCoeff() < 2.0 * kBand) continue;
    settled += std::pow(found(k, 0) - band[k], 2);
    squares += band[k] * band[k];
  }
  EXPECT_GT(squares, 0.0);
  EXPECT_LT(std::sqrt(settled / squares), 0.1);
}

// A pump without flow left slows the rod in one log; the same valve has the same columns in both all the same.
TEST(SectionPool, AValveHasTheSameGainInAllLogs) {
  const Machine machine = test_support::two_direct_cylinders();
  std::vector<MachineSeries> logs(2, test_support::two_cylinder_series(machine));
  logs[1].cylinders[0].speed.tail(1200) *= 0.3;
  const auto columns = [&](std::size_t log, SectionPool* pool) {
    Eigen::MatrixXd out;
    find_effect("valve_deadband")
        ->columns(logs[log], {EvidenceKind::kFlow, 0, {}, pool}, 0, std::vector<double>{0.0}, out);
    return out;
  };
  const double apart =
      columns(1, nullptr).cwiseAbs().maxCoeff() / columns(0, nullptr).cwiseAbs().maxCoeff();
  EXPECT_LT(apart, 0.8) << "fitted to each log by itself they differ";
  SectionPool pool;
  for (std::size_t log = 0; log < 2; ++log) {
    pool.begin(log);
    columns(log, &pool);
  }
  pool.complete();
  EXPECT_FALSE(pool.empty());
  pool.begin(0);
  const Eigen::MatrixXd first = columns(0, &pool);
  pool.begin(1);
  EXPECT_EQ(columns(1, &pool), first) << "both logs have the same commands";
}

TEST(ApplyEffects, ForcesAreTheExactChains) {
  const CraneModel bare = arm_model();
  int checked = 0;
  for (const EffectAt& place : candidates(bare.machine)) {
    const EffectInfo& info = place.effect->info();
    // Presliding friction depends on the last reversal, sway on the accelerations before; the chain has no memory.
    const bool memory = info.id == "presliding" || info.id == "payload_sway";
    if (info.stage != EffectStage::kForce || memory) continue;
    CraneModel model = bare;
    const std::string key = effect_key(info, bare.machine, place.at);
    model.effects = {typical(key, bare.machine)};
    const MachineSignals s = with_effects(model, make_signals(bare.machine, arm_log()));
    Chain chain(model), without(bare);
    double largest = 0.0, difference = 0.0;
    for (Index k = 0; k < s.samples(); ++k) {
      if (!s.usable[k] || s.edge[k] || !s.cylinders[0].driven[k]) continue;
      const double q = s.q(k, 0), qd = s.qd(k, 0), qdd = s.qdd(k, 0);
      const double force = chain.evaluate({&q, &qd, &qdd}, s.payload[k]).cylinders[0].total_force;
      difference = std::max(difference, std::abs(force - s.cylinders[0].model_force[k]));
      largest = std::max(
          largest, std::abs(force - without.evaluate({&q, &qd}, s.payload[k]).cylinders[0].force));
    }
    // Rounding of forces of 10 kN; on logs flex is taken as proportional to its parameters, which is an approximation.
    EXPECT_LT(difference, info.id == "structural_flex" ? 5e-2 * largest : 1e-4) << key;
    if (largest > 1.0) ++checked;
  }
  EXPECT_GE(checked, 6) << "effects that act on this arm";
}

TEST(ApplyEffects, ResidualIsZeroWhenTheModelHasThem) {
  CraneModel truth = arm_model();
  for (const char* key : {"coulomb_friction:arm", "unmodelled_mass:arm", "return_back_pressure",
                          "flow_dependent_margin:main"}) {
    truth.effects.push_back(typical(key, truth.machine));
  }
  const Log log = log_of(truth);
  const CompareResult with = compare(truth, {log}), without = compare(arm_model(), {log});
  // rounding of pressures of 1e7 Pa and forces of 1e4 N
  EXPECT_LT(rmse(with, "force", "arm"), 1e-3);
  for (const char* regime : {"extend", "retract"}) {
    EXPECT_LT(with.find("pressure", "arm", regime)->rmse, 1.0) << regime;
  }
  EXPECT_LT(rmse(with, "pump", "main"), 1.0);
  // Without the effects the errors are those of typical effects, a quarter of 8 kN and 1 bar at least.
  EXPECT_GT(rmse(without, "force", "arm"), 2e3);
  EXPECT_GT(without.find("pressure", "arm", "extend")->rmse, 1e5);
  EXPECT_GT(rmse(without, "pump", "main"), 1e5);
}

TEST(ApplyEffects, FitLearnsTheRestOfTheModelWithThem) {
  CraneModel truth = arm_model();
  for (const char* key :
       {"coulomb_friction:arm", "return_back_pressure", "flow_dependent_margin:main"}) {
    truth.effects.push_back(typical(key, truth.machine));
  }
  FitOptions options;
  options.effects = truth.effects;
  const FitResult r = fit(truth.machine, {log_of(truth, 0.3, 1)}, {log_of(truth, 0.3, 2)}, options);
  ASSERT_EQ(r.model.effects.size(), 3u);
  // as for a log without effects (fit_test.cpp): 0.3 bar noise
  EXPECT_NEAR(r.model.cylinders[0].margin, kMargin, 0.1 * units::kBar);
  for (const double force : {1.6e4, 1.8e4, 2.0e4}) {  // with 8 kN of friction
    EXPECT_NEAR(r.model.cylinders[0].extend.mean(5e-4, force),
                extend_pressure(truth.machine, force), 0.2 * units::kBar);
  }
  ASSERT_TRUE(r.test.has_value());
  // Noise of 0.3 bar and the tolerances of margin and pressure model above.
  EXPECT_NEAR(rmse(*r.test, "pump", "main"), 0.3 * units::kBar, 0.1 * units::kBar);
  const FitResult blind = fit(truth.machine, {log_of(truth, 0.3, 1)}, {log_of(truth, 0.3, 2)});
  EXPECT_GT(rmse(*blind.test, "force", "arm"), 5.0 * rmse(*r.test, "force", "arm"));
}

TEST(ApplyEffects, MarginsOfALaggingPumpAreLearned) {
  const CraneModel truth = arm_model();
  Log log = log_of(truth);
  CraneModel model = truth;
  model.effects = {typical("pump_lag:main", truth.machine)};
  std::fill(model.effects[0].values.begin() + 3, model.effects[0].values.end(), 0.0);  // lag alone
  MachineSignals s = make_signals(truth.machine, log);
  MachineSeries series = make_series(truth, s);
  Eigen::VectorXd& pump = channel(log, "p_main").values;
  pump = first_order_lag(series, pump, model.effects[0].values[1]);
  // With the lag in the model less than a hundredth of the error without it is left.
  EXPECT_GT(rmse(compare(truth, {log}), "pump", "main"), 1e5);
  EXPECT_LT(rmse(compare(model, {log}), "pump", "main"), 1e3);
  FitOptions options;
  options.effects = model.effects;
  const FitResult r = fit(truth.machine, {log}, {log}, options);
  EXPECT_NEAR(r.model.cylinders[0].margin, kMargin, 0.05 * units::kBar);
  EXPECT_NEAR(r.model.pumps[0].standby, kStandby, 0.05 * units::kBar);
}

/// Measured pressures contain noise, so the compression flow computed from them is filtered like the speed.
TEST(ApplyEffects, FlowsOfReadingsAreFilteredLikeTheSpeed) {
  CraneModel model = arm_model();
  const AppliedEffect oil = typical("compressibility:arm", model.machine);
  model.effects = {oil};
  const MachineSignals s = with_effects(model, make_signals(model.machine, log_of(model, 0.8)));
  CraneModel without = model;
  without.effects.clear();
  const Evidence e = collect_evidence(without, {s});
  const EvidenceChannel* speed = e.find(EvidenceKind::kFlow, 0);
  ASSERT_NE(speed, nullptr);
  const Eigen::MatrixXd by_unit =
      e.columns({oil.effect, oil.at}, std::vector<double>{oil.values[1]}, *speed);
  const Eigen::VectorXd& flow = s.cylinders[0].flow_effect;
  ASSERT_EQ(by_unit.rows(), speed->rows());
  for (Index r = 0; r < by_unit.rows(); ++r) {
    EXPECT_NEAR(flow[speed->sample[static_cast<std::size_t>(r)]], oil.values[0] * by_unit(r, 0),
                1e-12);
  }
  const Eigen::VectorXd raw = effect_series(oil, e.series[0], EvidenceKind::kFlow, 0);
  EXPECT_LT(flow.norm(), 0.9 * raw.norm()) << "the filter removes noise";
}

TEST(ApplyEffects, AnotherModelReplacesEarlierEffectsAndChangesNoValue) {
  CraneModel model = arm_model();
  const MachineSignals plain = make_signals(model.machine, arm_log());
  model.effects = {typical("angle_offset:arm", model.machine),
                   typical("coulomb_friction:arm", model.machine)};
  const MachineSignals once = with_effects(model, plain), twice = with_effects(model, once);
  EXPECT_GT((once.cylinders[0].speed - plain.cylinders[0].speed).cwiseAbs().maxCoeff(), 1e-5)
      << "another lever";
  EXPECT_EQ(plain.cylinders[0].model_force, plain.cylinders[0].static_force);
  EXPECT_EQ(twice.cylinders[0].model_force, once.cylinders[0].model_force);
  const MachineSignals s = with_effects(arm_model(), twice);
  EXPECT_EQ(s.cylinders[0].model_force, plain.cylinders[0].static_force);
  EXPECT_EQ(s.cylinders[0].static_force, plain.cylinders[0].static_force);
  EXPECT_EQ(s.cylinders[0].speed, plain.cylinders[0].speed);
  EXPECT_EQ(s.cylinders[0].flow, plain.cylinders[0].flow);
  EXPECT_EQ(s.cylinders[0].pressure_effect.size(), 0);
}

TEST(ApplyEffects, AnotherAngleLeavesTheSpeedOfAMeasuredStroke) {
  CraneModel model = arm_model();
  Log log = arm_log();
  for (Channel& c : log.channels) {
    if (c.role != Role::kJointPosition) continue;
    c.role = Role::kStroke;
    c.index = 0;
    for (double& x : c.values) x = stroke_at(model.machine, 0, x);
  }
  const MachineSignals plain = make_signals(model.machine, log);
  model.effects = {typical("angle_offset:arm", model.machine)};
  const MachineSignals offset = with_effects(model, plain);
  EXPECT_EQ(offset.cylinders[0].speed, plain.cylinders[0].speed);
  EXPECT_EQ(offset.cylinders[0].flow, plain.cylinders[0].flow);
  EXPECT_NE(offset.cylinders[0].model_force, plain.cylinders[0].model_force);
  const MachineSeries series = make_series(arm_model(), plain);
  Eigen::MatrixXd column;
  EXPECT_FALSE(model.effects[0].effect->columns(series, {EvidenceKind::kFlow, 0}, 0, {}, column));
}

}  // namespace
}  // namespace sparflow
