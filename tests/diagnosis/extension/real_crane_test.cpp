// Tests on real logs, which are not part of the project; they are skipped where the logs are absent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "diagnosis/extension/extend.h"
#include "identification/comparison/report_numbers.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Contains;
using testing::HasSubstr;

const std::string kRealLogs = SPARFLOW_SOURCE_DIR "/../shared/";

class RealCrane : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kRealLogs + "data/hmf_2020_k4")) {
      GTEST_SKIP() << "no logs of the real crane beside the source tree";
    }
    machine = load_machine(kRealLogs + "machines/hmf_2020_k4.yaml");
    for (const char* name : {"MainSTDTest1_270325", "MainSineTest_230425", "Dual2SineTest_230425",
                             "Dual1SineRun_230425"}) {
      logs.push_back(load_log(kRealLogs + "data/hmf_2020_k4/" + name + ".csv", machine));
    }
  }
  Machine machine;
  std::vector<Log> logs;
};

TEST_F(RealCrane, StaticForceFromCadIsOffByTwentyKilonewton) {
  const CompareResult r = compare(CraneModel::untrained(machine), logs);
  // Published with the logs: 20 347 N on |dx/dt| > 2 mm/s. The choice of filter changes it by about 10 N.
  EXPECT_NEAR(r.find("force", "main")->rmse, 20347.0, 30.0);
  // For the jib, an independent computation with the same speed threshold gives 5458 N.
  EXPECT_NEAR(r.find("force", "jib")->rmse, 5458.0, 0.01 * 5458.0);
  // A further condition on the command changes it by less than a newton.
  for (Log& log : logs)
    std::erase_if(log.channels, [](const Channel& c) { return c.role == Role::kCommand; });
  EXPECT_NEAR(compare(CraneModel::untrained(machine), logs).find("force", "main")->rmse, 20347.0,
              30.0);
}

TEST_F(RealCrane, StrokesBecomeAnglesByTheFourBars) {
  for (const Log& log : logs) {
    const MachineSignals s = make_signals(machine, log);
    EXPECT_TRUE(s.usable.all()) << log.file;
    for (int j = 0; j < 2; ++j) {
      EXPECT_GT(s.q.col(j).minCoeff(), machine.joints[static_cast<std::size_t>(j)].position.lo);
      EXPECT_LT(s.q.col(j).maxCoeff(), machine.joints[static_cast<std::size_t>(j)].position.hi);
    }
  }
}

TEST_F(RealCrane, FitsAndNotesTheDeadBands) {
  const FitResult r = fit(machine, logs);
  EXPECT_TRUE(r.model.complete()) << "four pressure models: two cylinders, both directions";
  ASSERT_TRUE(r.held_out.has_value());
  // Constant-pressure supply of 134 to 151 bar over the days.
  EXPECT_GT(r.model.pumps[0].standby, 134.0 * units::kBar);
  EXPECT_LT(r.model.pumps[0].standby, 151.0 * units::kBar);
  EXPECT_LT(r.train.find("pressure", "main", "extend")->rmse, 1.5 * units::kBar);
  EXPECT_LT(std::abs(r.train.energy[0].relative_error), 0.03);
  EXPECT_GT(r.processes[0].step, 1) << "friction and dynamics correlate neighbouring errors";
  EXPECT_FALSE(r.train.worst.empty());
  // On whole motions that were held out the error was 4.0 bar over main in both directions and jib extending. Another
  // split of the motions into blocks may increase it by a quarter; noise alone is below 1 bar.
  double squares = 0.0, n = 0.0;
  for (const StageScore& s : r.held_out->scores) {
    if (s.stage != "pressure") continue;
    squares += s.rmse * s.rmse * static_cast<double>(s.n);
    n += static_cast<double>(s.n);
  }
  EXPECT_GT(n, 1500.0);
  EXPECT_LT(std::sqrt(squares / n), 5.0 * units::kBar);
  // One block of four is held out (FitOptions::hold_out_every); blocks and their usable samples differ in number.
  EXPECT_GT(r.held_out->samples, 0.1 * static_cast<double>(r.train.samples));
  EXPECT_LT(r.held_out->samples, 0.3 * static_cast<double>(r.train.samples));
  ASSERT_FALSE(r.held_out->energy.empty());
  EXPECT_LT(std::abs(r.held_out->energy[0].relative_error), 0.03);
  EXPECT_GT(r.held_out->find("pressure", "main", "retract")->rmse,
            r.train.find("pressure", "main", "retract")->rmse)
      << "training data is not held out";
  // The crane's valves have dead bands (authors: 0.07 and 0.13 for the main section).
  EXPECT_THAT(r.notes, Contains(HasSubstr("dead band")));
}

const AppliedEffect* effect_of(const CraneModel& model, const std::string& key) {
  for (const AppliedEffect& e : model.effects) {
    if (e.key(model.machine) == key) return &e;
  }
  return nullptr;
}

std::string steps_text(const ExtendResult& r) {
  std::string text;
  for (const ExtendStep& s : r.steps) text += s.added + " ";
  return text;
}

/// Published with these logs: a mass that is missing in the CAD model, Coulomb friction of 4000 N (main) and 3900 N
/// (jib), no viscous friction.
void expect_published(const ExtendResult& r) {
  const std::string steps = steps_text(r);
  // The effects of one diagnosis are estimated together, so that their order says nothing.
  EXPECT_THAT(steps, HasSubstr("unmodelled_mass")) << steps;
  for (const ExtendStep& s : r.steps) EXPECT_THAT(s.added, Not(HasSubstr("viscous"))) << steps;
  const AppliedEffect* main = effect_of(r.model, "coulomb_friction:main");
  ASSERT_NE(main, nullptr) << steps;
  // 10 % of the published value, as is required of a clear effect (diagnose_test.cpp).
  EXPECT_NEAR(main->values[0], 4000.0, 400.0);
  const AppliedEffect* jib = effect_of(r.model, "coulomb_friction:jib");
  ASSERT_NE(jib, nullptr) << steps;
  EXPECT_NEAR(jib->values[0], 3900.0, 390.0);
}

/// The parameter is the log that is left out of everything; the other three are the training logs.
class RealCraneImproved : public RealCrane, public testing::WithParamInterface<int> {};

TEST_P(RealCraneImproved, NamesMassAndDryFrictionAndPredictsTheRunLeftOut) {
  std::vector<Log> test = {logs[static_cast<std::size_t>(GetParam())]};
  logs.erase(logs.begin() + GetParam());
  const CraneModel model = fit(machine, logs).model;
  ExtendOptions options;
  options.max_steps = 6;  // the effects that are checked, and a few more
  // What is published concerns forces; DiagnoseRealCrane searches the whole catalogue.
  for (const EffectAt& c : candidates(machine)) {
    if (c.effect->info().stage == EffectStage::kForce) options.diagnose.candidates.push_back(c);
  }
  const ExtendResult r = improve(model, {logs, {}, test}, options);
  expect_published(r);
  const double before = r.steps.front().before.find("force", "main")->rmse;
  const double after = r.steps.back().after.find("force", "main")->rmse;
  // Published with the data: least squares with a tip mass and Coulomb friction takes a run left out from 13472 to 4186 N.
  EXPECT_LT(after, before / 3.2) << steps_text(r);
  // An effect that is indistinguishable from one in the model is not kept: without the sine log, a payload error was
  // once added beside the jib's mass, and both had intervals of 36 000 t.
  for (const AppliedEffect& e : r.model.effects) {
    for (std::size_t k = 0; k < e.lower95.size(); ++k) {
      const EffectParameter& p = e.effect->info().parameters[k];
      if (p.choice) continue;
      if (!is_determined(e.values[k], e.lower95[k], e.upper95[k], p.typical)) {
        // the mass of main's link acts on no cylinder, its moment as the mass at its end, on the jib's link
        EXPECT_EQ(e.values[k], 0.0) << e.key(machine) << ", parameter " << k;
        continue;
      }
      EXPECT_LE(e.upper95[k] - e.lower95[k], 100.0 * std::abs(e.values[k]))
          << e.key(machine) << ", parameter " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(LeftOut, RealCraneImproved, testing::Values(0, 1, 3),
                         [](const auto& which) {
                           return std::string(which.param == 0   ? "MainStandard"
                                              : which.param == 1 ? "MainSine"
                                                                 : "DualSine");
                         });

TEST_F(RealCrane, ValveLogsShowTheDeadBand) {
  const std::string folder = kRealLogs + "data/hmf_2020_k4/";
  const std::vector<Log> valve = {logs[1],
                                  load_log(folder + "MainValveResponseTime_010425.csv", machine)};
  const CraneModel model = fit(machine, valve).model;
  ExtendOptions options;
  options.diagnose.candidates = {};
  for (const EffectAt& c : candidates(machine)) {
    if (c.effect->info().stage == EffectStage::kFlow) options.diagnose.candidates.push_back(c);
  }
  const ExtendResult r = improve(model, {valve, {}, {logs[0]}}, options);
  const AppliedEffect* band = effect_of(r.model, "valve_deadband:main");
  ASSERT_NE(band, nullptr) << steps_text(r);
  // Authors: 0.071 up, 0.126 down, read off by eye from slow ramps
  EXPECT_NEAR(band->values[0], 0.071, 0.025);
  EXPECT_NEAR(band->values[1], 0.126, 0.025);
}

/// A Butterworth low-pass of fourth order, forwards and backwards, so that nothing is delayed. @param cut share of the sampling rate
VectorXd zero_phase(VectorXd x, double cut) {
  const double w = std::tan(std::numbers::pi * cut);
  for (const double damping : {std::cos(std::numbers::pi / 8), std::sin(std::numbers::pi / 8)}) {
    const double norm = 1.0 / (1.0 + 2.0 * damping * w + w * w);
    const double b = w * w * norm, a1 = 2.0 * (w * w - 1.0) * norm,
                 a2 = (1.0 - 2.0 * damping * w + w * w) * norm;
    for (int pass = 0; pass < 2; ++pass) {
      double x1 = x[0], x2 = x[0], y1 = x[0], y2 = x[0];
      for (double& value : x) {
        const double y = b * (value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
        x2 = x1, x1 = value, y2 = y1, y1 = y;
        value = y;
      }
      x.reverseInPlace();
    }
  }
  return x;
}

VectorXd central_difference(const VectorXd& x, double step) {
  VectorXd d = VectorXd::Zero(x.size());
  const Eigen::Index n = x.size() - 2;
  d.segment(1, n) = (x.tail(n) - x.head(n)) / (2.0 * step);
  return d;
}

/// The benchmark's own procedure: positions filtered at 100 Hz, central differences, every column low-passed and one row in ten
/// taken, and the relative error |F - W theta| / |F| of the force.
struct BenchmarkRegression {
  MatrixXd w;
  VectorXd force;

  explicit BenchmarkRegression(const Log& log) {
    constexpr double kStep = 1e-3;
    const VectorXd q = zero_phase(log.find("q_axis")->values, 100.0 * kStep);
    const VectorXd speed = central_difference(q, kStep);
    MatrixXd all(q.size(), 5);
    all << central_difference(speed, kStep), speed, speed.cwiseSign(), VectorXd::Ones(q.size()),
        log.find("force_axis")->values;
    constexpr Eigen::Index kEnds = 500, kEvery = 10;  // the filter begins with its first value
    const Eigen::Index rows = (q.size() - 2 * kEnds) / kEvery;
    MatrixXd kept(rows, 5);
    for (Eigen::Index c = 0; c < 5; ++c) {
      const VectorXd smooth = zero_phase(all.col(c), 50.0 * kStep);
      for (Eigen::Index k = 0; k < rows; ++k) kept(k, c) = smooth[kEnds + kEvery * k];
    }
    w = kept.leftCols(4);
    force = kept.col(4);
  }
  double relative_error(const Eigen::Vector4d& theta) const {
    return (force - w * theta).norm() / force.norm();
  }
};

/// Published: 4.083 % with the parameters below. The same procedure applied to what `improve` finds.
TEST(RealDrive, RelativeForceErrorByTheBenchmarksProcedure) {
  const std::string path = kRealLogs + "data/emps/estimation.csv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no log of the drive beside the source tree";
  const Machine machine = load_machine(kRealLogs + "machines/emps.yaml");
  const Log log = load_log(path, machine);
  const BenchmarkRegression benchmark(log);
  const Eigen::Vector4d published(95.109, 203.50, 20.394, -3.165);
  const Eigen::Vector4d least = benchmark.w.colPivHouseholderQr().solve(benchmark.force);
  // The procedure is theirs: its least squares gives their parameters, but for the filter of the decimation, which is another, and
  // the ends, of which more is left out: that moves the small offset by a hundredth.
  const Eigen::Vector4d alike(0.005, 0.005, 0.005, 0.02);
  for (Eigen::Index k = 0; k < 4; ++k)
    EXPECT_NEAR(least[k], published[k], alike[k] * std::abs(published[k]));
  const CraneModel model = improve(fit(machine, {log}).model, {{log}}).model;
  const auto value = [&](const char* key) { return effect_of(model, key)->values[0]; };
  const Eigen::Vector4d found(95.11 * value("inertia"), value("viscous_friction:axis"),
                              value("coulomb_friction:axis"), value("force_offset:axis"));
  RecordProperty("relative_error_percent", std::to_string(100.0 * benchmark.relative_error(found)));
  std::printf(
      "relative force error: found %.3f %%, published parameters %.3f %%, least squares %.3f %%\n",
      100.0 * benchmark.relative_error(found), 100.0 * benchmark.relative_error(published),
      100.0 * benchmark.relative_error(least));
  EXPECT_LT(benchmark.relative_error(found), 0.0409);
}

TEST(RealDrive, FrictionAndInertiaAsPublished) {
  const std::string path = kRealLogs + "data/emps/estimation.csv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no log of the drive beside the source tree";
  const Machine machine = load_machine(kRealLogs + "machines/emps.yaml");
  const std::vector<Log> logs = {load_log(path, machine)};
  const ExtendResult r = improve(fit(machine, logs).model, {logs});
  std::vector<std::string> keys;
  for (const AppliedEffect& e : r.model.effects) keys.push_back(e.key(machine));
  ASSERT_THAT(keys, testing::UnorderedElementsAre("inertia", "viscous_friction:axis",
                                                  "coulomb_friction:axis", "force_offset:axis"));
  // Janot, Gautier, Brunot (2019): 203.50 N s/m, 20.394 N, -3.165 N; M = 95.109 kg, here as a share of the machine
  // file's 95.11 kg
  // 2 % and 0.3 N: starts and stops count less here than in the publication's regression, which moves them by 1.4 % and 0.23 N
  EXPECT_NEAR(effect_of(r.model, "viscous_friction:axis")->values[0], 203.50, 0.02 * 203.50);
  EXPECT_NEAR(effect_of(r.model, "coulomb_friction:axis")->values[0], 20.394, 0.02 * 20.394);
  EXPECT_NEAR(effect_of(r.model, "inertia")->values[0], 1.0, 0.01);
  EXPECT_NEAR(effect_of(r.model, "force_offset:axis")->values[0], -3.165, 0.3);
}

TEST(RealDrive, OnlyTheForceIsCompared) {
  const std::string path = kRealLogs + "data/emps/estimation.csv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no log of the drive beside the source tree";
  const Machine machine = load_machine(kRealLogs + "machines/emps.yaml");
  const FitResult r = fit(machine, {load_log(path, machine)});
  ASSERT_EQ(r.train.scores.size(), 1u);
  EXPECT_EQ(r.train.scores[0].stage, "force");
  EXPECT_GT(r.train.scores[0].n, 20000);
  // A level carriage has no static force: the measured force is friction and inertia, about 54 N RMS.
  EXPECT_NEAR(r.train.scores[0].rmse, 54.1, 1.0);
  EXPECT_THAT(r.train.notes, Contains(HasSubstr("flow and pressures of axis: not compared")));
  EXPECT_THAT(r.train.notes, Contains(HasSubstr("the machine has no pump")));
}

}  // namespace
}  // namespace sparflow
