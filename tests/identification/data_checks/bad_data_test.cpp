#include "identification/data_checks/bad_data.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "identification/data_checks/set_aside.h"
#include "models/files/machine_file.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing_support::arm_log;
using testing_support::arm_machine;
using testing_support::channel;

const std::filesystem::path kLogsBeside = SPARFLOW_SOURCE_DIR "/../shared";
constexpr double kBar = units::kBar;

std::vector<BadChannel> bad_of(const Machine& machine, const Log& log) {
  return find_bad_channels(machine, log, make_signals(machine, log));
}

std::vector<std::string> names(const std::vector<BadChannel>& bad) {
  std::vector<std::string> out;
  for (const BadChannel& b : bad) out.push_back(b.channel + " " + bad_data_word(b.kind));
  return out;
}

/// The arm with 0.5 bar of noise on its pressures and 0.2 mrad on its angle, as real sensors have.
Log noisy_arm(unsigned seed = 1) {
  Log log = arm_log(0.5, seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 2e-4);
  for (double& q : channel(log, "q_arm").values) q += normal(random);
  return log;
}

void add_noise(Log& log, const std::string& signal, double deviation, Eigen::Index from,
               Eigen::Index to) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, deviation);
  for (Eigen::Index k = from; k < to; ++k) channel(log, signal).values[k] += normal(random);
}

TEST(BadData, HealthyLogsHaveNoFindings) {
  EXPECT_THAT(names(bad_of(arm_machine(), arm_log())), IsEmpty()) << "without any noise";
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_THAT(names(bad_of(arm_machine(), noisy_arm(seed))), IsEmpty()) << seed;
  }
}

TEST(BadData, NoiseThroughoutIsFoundByComparisonWithThePeers) {
  Log log = noisy_arm();
  add_noise(log, "pA_arm", 2.5 * kBar, 0, log.samples());
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_THAT(names(bad), ElementsAre("pA_arm noisy"));
  EXPECT_GT(bad[0].share, 0.9);  // single blocks may fall short of three times
  EXPECT_THAT(bad[0].evidence, HasSubstr("other pressure channels"));
}

TEST(BadData, NoiseInAStretchIsLocated) {
  Log log = noisy_arm();
  add_noise(log, "pB_arm", 3.0 * kBar, 1000, 1500);  // 20 to 30 s
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_THAT(names(bad), ElementsAre("pB_arm noisy"));
  EXPECT_NEAR(bad[0].from_s, 20.0, 1.01);  // blocks of a second
  EXPECT_NEAR(bad[0].to_s, 30.0, 1.01);
  EXPECT_NEAR(bad[0].share, 500.0 / 3000.0, 0.04);
}

TEST(BadData, SensorsTwiceAsNoisyAsTheirPeersAreAccepted) {
  Log log = noisy_arm();
  add_noise(log, "pA_arm", std::sqrt(3.0) * 0.5 * kBar, 0, log.samples());
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, AnOscillationIsNotNoise) {
  // 5 Hz of 4 bar, as an oscillating boom causes it: ten times the noise of the peers, but not white.
  Log log = noisy_arm();
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    channel(log, "pA_arm").values[k] += 4.0 * kBar * std::sin(2.0 * M_PI * 5.0 * log.time[k]);
  }
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, NoiseOfAllPressuresIsAttributedToTheMachine) {
  Log log = noisy_arm();
  for (const char* signal : {"pA_arm", "pB_arm", "p_main"})
    add_noise(log, signal, 3.0 * kBar, 1000, 1500);
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, APositionThatNeverChangesIsStuckWhereverACommandIsFirm) {
  Log log = noisy_arm();
  channel(log, "q_arm").values.setConstant(0.3);
  Eigen::VectorXd& u = channel(log, "u_arm").values;
  u *= 0.2 / u.cwiseAbs().maxCoeff();  // outside any dead band, and no more
  EXPECT_THAT(names(bad_of(arm_machine(), log)), testing::Contains("q_arm stuck"));
  u *= 0.1 / 0.2;  // a dead band may explain it
  EXPECT_THAT(names(bad_of(arm_machine(), log)), testing::Not(testing::Contains("q_arm stuck")));
}

TEST(BadData, AStuckChannelIsFoundWithItsStretch) {
  for (const char* signal : {"pA_arm", "pB_arm", "p_main", "q_arm"}) {
    Log log = noisy_arm();
    Eigen::VectorXd& x = channel(log, signal).values;
    x.segment(1000, 250).setConstant(x[1000]);  // 5 s from 20 s on
    const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
    ASSERT_THAT(names(bad), ElementsAre(std::string(signal) + " stuck"));
    EXPECT_NEAR(bad[0].from_s, 20.0, 0.021);  // a neighbour may have the same value
    EXPECT_NEAR(bad[0].to_s, 24.98, 0.021);
    EXPECT_THAT(bad_channel_sentence(bad[0]), HasSubstr(signal));
  }
}

TEST(BadData, WithoutNoiseAConstantValueIsStuckOnlyDuringMotion) {
  Log log = arm_log();
  Eigen::VectorXd& x = channel(log, "pA_arm").values;
  x.segment(1600, 100).setConstant(x[1600]);  // 2 s of a stroke
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("pA_arm stuck"));
}

TEST(BadData, AChannelThatNeverChangesWhileItsCylinderMovesIsFound) {
  Log log = noisy_arm();
  channel(log, "pB_arm").values.setZero();
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_THAT(names(bad), ElementsAre("pB_arm drop_out"));
  EXPECT_EQ(bad[0].share, 1.0);
}

TEST(BadData, APumpThatNeverChangesIsStuckUnlessItIsAConstantSupply) {
  Log log = noisy_arm();
  channel(log, "p_main").values.setConstant(120.0 * kBar);
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_THAT(names(bad), ElementsAre("p_main stuck"));
  EXPECT_EQ(bad[0].share, 1.0);
  EXPECT_THAT(bad[0].remedy, HasSubstr("constant_pressure"));
  Machine constant = arm_machine();
  constant.pumps[0].type = PumpType::kConstantPressure;
  EXPECT_THAT(names(bad_of(constant, log)), IsEmpty());
}

TEST(BadData, JumpsThatReturnAreFound) {
  for (const char* signal : {"pA_arm", "p_main"}) {
    Log log = noisy_arm();
    for (const Eigen::Index k : {700, 1300, 2200})
      channel(log, signal).values.segment(k, 3).array() += 12.0 * kBar;
    const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
    ASSERT_THAT(names(bad), ElementsAre(std::string(signal) + " jumping"));
    EXPECT_THAT(bad[0].evidence, HasSubstr("3 times"));
    EXPECT_DOUBLE_EQ(bad[0].share, 9.0 / 3000.0);
  }
  Log log = noisy_arm();
  channel(log, "q_arm").values[1300] += 0.05;
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("q_arm jumping"));
}

// An oscillating load empties one chamber and fills the other, from the tank's pressure upwards by 10 bar per sample.
TEST(BadData, AChamberThatFillsIsNoJump) {
  Log log = noisy_arm();
  for (const Eigen::Index k : {700, 1300, 2200}) {
    for (Eigen::Index i = 0; i < 8; ++i)
      channel(log, "pB_arm").values[k + i] +=
          static_cast<double>(std::min(i + 1, 8 - i)) * 10.0 * kBar;
  }
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

/// Two steep samples of a smooth swing, up at first and down 0.4 s later, look like a level that jumps away and comes back.
TEST(BadData, APumpThatHuntsIsNoJump) {
  for (const bool smooth : {true, false}) {
    Log log = noisy_arm();
    Eigen::VectorXd& p = channel(log, "p_main").values;
    const Eigen::Index first = 1400, last = 1420;
    const double flank[] = {4.0, 10.0, 18.0, 7.0, 5.0};  // [bar] from sample to sample
    for (Eigen::Index k = first - 2; k <= last + 2; ++k)
      for (Eigen::Index i = -2; i <= 2; ++i) {
        if (!smooth && i != 0) continue;
        if (k >= first + i) p[k] += flank[i + 2] * kBar;
        if (k >= last + i) p[k] -= flank[i + 2] * kBar;
      }
    EXPECT_THAT(names(bad_of(arm_machine(), log)),
                smooth ? testing::Matcher<std::vector<std::string>>(IsEmpty())
                       : testing::Matcher<std::vector<std::string>>(ElementsAre("p_main jumping")));
  }
}

TEST(BadData, APumpThatFollowsAMovingLeverIsNoJump) {
  Log log = noisy_arm();
  for (const Eigen::Index k : {700, 1300, 2200})  // for 2 s, as when a valve leaves its dead band
    channel(log, "p_main").values.segment(k, 100).array() += 12.0 * kBar;
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

// 7 bar at 0.5 bar of noise are small for a pressure, but repeatedly far from both neighbours.
TEST(BadData, ManyWildSamplesNeedNotBeLarge) {
  Log log = noisy_arm();
  std::mt19937 random(5);
  int wild = 0;
  for (double& p : channel(log, "pA_arm").values) {
    if (random() % 100 != 0) continue;
    p += random() % 2 == 0 ? 7.0 * kBar : -7.0 * kBar;
    ++wild;
  }
  ASSERT_GT(wild, 10);
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_THAT(names(bad), ElementsAre("pA_arm wild"));
  EXPECT_THAT(bad[0].evidence, HasSubstr("single samples"));
  // A single impact in a log is no faulty sensor.
  log = noisy_arm();
  channel(log, "pA_arm").values[log.samples() / 2] += 7.0 * kBar;
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

// In a channel that is known to have them, they are left out beside motions of a lever, too, and where two follow each other.
TEST(BadData, WildSamplesOfAKnownFaultAreAllSetAside) {
  Log log = noisy_arm();
  const VectorXd u = channel(log, "u_arm").values;
  VectorXd& p = channel(log, "pA_arm").values;
  const VectorXd clean = p;
  std::mt19937 random(7);
  Mask wild = Mask::Constant(p.size(), false);
  const auto disturb = [&](Eigen::Index k, double off) {
    if (std::abs(clean[k + 1] - clean[k - 1]) > 3.0 * kBar)
      return;  // a true step at the same instant
    p[k] += off * kBar;
    wild[k] = true;
  };
  for (Eigen::Index k = 10; k + 10 < p.size(); k += 40 + static_cast<Eigen::Index>(random() % 20))
    disturb(k, random() % 2 == 0 ? 15.0 : -15.0);
  for (const Eigen::Index k : {655, 1855}) {
    wild.segment(k - 1, 3).setConstant(false);
    p.segment(k - 1, 3) = clean.segment(k - 1, 3);
    disturb(k, 15.0);
    disturb(k + 1, -20.0);
  }
  int starts = 0;
  for (Eigen::Index k = 10; k + 10 < p.size(); ++k) {
    if ((u[k] == 0.0) == (u[k + 1] == 0.0) || wild.segment(k - 5, 10).any()) continue;
    disturb(k + 3, 15.0);  // the pressure itself steps with the command
    ++starts;
  }
  ASSERT_GT(starts, 0);
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_THAT(names(bad), ElementsAre("pA_arm wild"));
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    const bool aside = std::any_of(
        bad[0].stretches.begin(), bad[0].stretches.end(), [&](const std::pair<double, double>& s) {
          return s.first - 1e-9 <= log.time[k] && log.time[k] <= s.second + 1e-9;
        });
    // between a true step and a wild sample the median may be on the other side of the step
    const Eigen::Index first = std::max<Eigen::Index>(0, k - 3);
    const auto around = clean.segment(first, std::min(p.size(), k + 4) - first);
    const bool at_step = around.maxCoeff() - around.minCoeff() > 5.0 * kBar;
    EXPECT_TRUE(at_step || aside == wild[k]) << "sample " << k;
    EXPECT_TRUE(aside || !wild[k]) << "sample " << k;
  }
}

/// Where they come often, the white part of a block's differences is large for that reason alone.
TEST(BadData, WildSamplesThatMakeAStretchNoisyAreWild) {
  Log log = noisy_arm();
  std::mt19937 random(11);
  VectorXd& p = channel(log, "pA_arm").values;
  const auto disturb = [&](Eigen::Index from, Eigen::Index to, unsigned every) {
    for (Eigen::Index k = from; k < to; ++k)
      if (random() % every == 0) p[k] += (random() % 2 == 0 ? 25.0 : -25.0) * kBar;
  };
  disturb(0, p.size(), 50);
  disturb(1000, 1200, 7);
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("pA_arm wild"));
}

TEST(BadData, APressureStepThatAnotherChannelShowsIsNoJump) {
  Log log = noisy_arm();
  for (const Eigen::Index k : {700, 1300, 2200}) {
    channel(log, "pA_arm").values.segment(k, 20).array() += 12.0 * kBar;
    channel(log, "p_main").values.segment(k, 20).array() += 12.0 * kBar;
  }
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, ALevelThatDoesNotReturnIsNoJump) {
  Log log = noisy_arm();
  channel(log, "pA_arm").values.tail(1300).array() += 12.0 * kBar;
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, DropOutsToZeroAndMissingValuesAreFound) {
  Log log = noisy_arm();
  for (const Eigen::Index k : {700, 1300, 2200})
    channel(log, "pA_arm").values.segment(k, 10).setZero();
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("pA_arm drop_out"));
  log = noisy_arm();
  channel(log, "pB_arm").values.head(900).setConstant(std::nan(""));
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("pB_arm drop_out"));
}

TEST(BadData, APressureClippedAtZeroIsAcceptedWhereItIsLow) {
  Log log = noisy_arm();
  Eigen::VectorXd& x = channel(log, "pB_arm").values;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    x[k] = std::max(0.0, x[k] - x.minCoeff() - 3.0 * kBar);
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, AChamberEmptiedByTheMachineBelowASensorsZeroIsNoDropOut) {
  // The sensor reads 12 bar too little, so whenever the arm stops the chamber's pressure is below its zero.
  Log log = noisy_arm();
  const MachineSignals signals = make_signals(arm_machine(), log);
  const Eigen::VectorXi& direction = signals.cylinders[0].direction;
  Eigen::VectorXd& x = channel(log, "pA_arm").values;
  const double most = x.maxCoeff();
  Eigen::Index rests = 0;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (direction[k] == 0) x[k] = 0.0;
    rests += k > 0 && direction[k] == 0 && direction[k - 1] != 0 ? 1 : 0;
  }
  ASSERT_GT(rests, 1);
  ASSERT_GT(most, 30.0 * kBar) << "steps that are not gentle";
  EXPECT_THAT(names(bad_of(arm_machine(), log)), IsEmpty());
}

TEST(BadData, ASensorAtTheEndOfItsRangeIsSaturated) {
  Log log = noisy_arm();
  Eigen::VectorXd& x = channel(log, "p_main").values;
  x = x.cwiseMin(0.6 * x.maxCoeff());
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("p_main saturated"));
}

TEST(BadData, ACommandThatTheMachineDoesNotFollowIsStuck) {
  Log log = noisy_arm();
  Eigen::VectorXd& u = channel(log, "u_arm").values;
  Eigen::Index at = 0;
  u.head(2000).maxCoeff(&at);
  u.segment(at, 250).setConstant(u[at]);  // the stroke ends 1.2 s later
  EXPECT_THAT(names(bad_of(arm_machine(), log)), ElementsAre("u_arm stuck"));
}

TEST(BadData, OnlyTheStretchInWhichTheMachineDoesNotFollowItsCommandIsAffected) {
  Log log = noisy_arm();
  Eigen::VectorXd& u = channel(log, "u_arm").values;
  Eigen::Index at = 0;
  u.head(2000).maxCoeff(&at);
  u.segment(at, 250).setConstant(u[at]);
  const std::vector<BadChannel> bad = bad_of(arm_machine(), log);
  ASSERT_EQ(bad.size(), 1u);
  // the stroke, in which it follows, ends 1.2 s after the begin of the constant command
  EXPECT_GT(bad[0].from_s, log.time[at] + 0.5);
  EXPECT_LE(bad[0].to_s, log.time[at + 250] + 0.1);
}

TEST(BadData, WhatIsSetAsideIsMissingThereAndNowhereElse) {
  const Log log = noisy_arm();
  BadChannel one;
  one.channel = "pA_arm";
  one.from_s = 3.0;
  one.to_s = 9.0;
  one.stretches = {{3.0, 4.0}, {8.0, 9.0}};
  const Log left = without_bad_data(log, {one});
  Eigen::Index missing = 0;
  for (std::size_t c = 0; c < log.channels.size(); ++c) {
    const Channel &before = log.channels[c], &after = left.channels[c];
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const double t = log.time[k];
      const bool aside =
          before.signal == "pA_arm" && ((t >= 3.0 && t <= 4.0) || (t >= 8.0 && t <= 9.0));
      ASSERT_EQ(after.valid[k], before.valid[k] && !aside) << before.signal << " " << t;
      ASSERT_EQ(std::isnan(after.values[k]), aside) << before.signal << " " << t;
      missing += aside ? 1 : 0;
    }
  }
  EXPECT_GT(missing, 20);
}

// A filter does not reach across a hole, so single wild samples would cost their whole neighbourhood.
TEST(BadData, SingleSamplesThatAreSetAsideAreInterpolated) {
  const Log log = noisy_arm();
  Log wild = log;
  BadChannel one;
  one.channel = "pA_arm";
  one.kind = BadDataKind::kWild;
  for (const Eigen::Index k : {300, 340, 341, 700}) {
    channel(wild, "pA_arm").values[k] += 20.0 * kBar;
    one.stretches.emplace_back(log.time[k], log.time[k]);
  }
  Log left = without_bad_data(wild, {one});
  const VectorXd& p = channel(left, "pA_arm").values;
  EXPECT_TRUE(channel(left, "pA_arm").valid.all());
  EXPECT_NEAR(p[300], 0.5 * (p[299] + p[301]), 1.0);
  EXPECT_NEAR(p[341], p[339] + 2.0 / 3.0 * (p[342] - p[339]), 1.0);
  EXPECT_EQ(p[500], channel(wild, "pA_arm").values[500]);
}

// ---- logs of real and simulated cranes -------------------------------------------------------------------------

std::vector<std::filesystem::path> logs_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(BadDataOnCranes, RealAndSimulatedLogsHaveNoFindings) {
  if (!std::filesystem::exists(kLogsBeside / "data")) GTEST_SKIP() << "no logs of cranes here";
  for (const char* name : {"hmf_2020_k4", "emps", "loader_crane"}) {
    const Machine machine =
        load_machine((kLogsBeside / "machines" / (std::string(name) + ".yaml")).string());
    for (const auto& path : logs_below(kLogsBeside / "data" / name)) {
      const Log log = load_log(path.string(), machine);
      for (const BadChannel& b : bad_of(machine, log)) {
        if (b.kind == BadDataKind::kRippling)
          continue;  // true of two logs: position_ripple_test.cpp
        ADD_FAILURE() << path.filename() << ": " << bad_channel_sentence(b);
      }
    }
  }
}

/// Faults are injected into every position and pressure channel of the simulated cranes' logs while all cylinders move.
TEST(BadDataOnCranes, InjectedFaultsAreFound) {
  if (!std::filesystem::exists(kLogsBeside / "data/loader_crane")) GTEST_SKIP() << "no logs here";
  const Machine machine = load_machine((kLogsBeside / "machines/loader_crane.yaml").string());
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  int injected = 0, found = 0, others = 0;
  for (const auto& path : logs_below(kLogsBeside / "data/loader_crane")) {
    if (path.filename() != "test.csv") continue;
    const Log log = load_log(path.string(), machine);
    const MachineSignals signals = make_signals(machine, log);
    std::vector<Eigen::Index> moving;
    for (Eigen::Index k = 50; k + 300 < log.samples(); ++k) {
      bool all = true;  // at this sample every channel should change
      for (const CylinderSignals& c : signals.cylinders) all = all && c.direction[k] != 0;
      if (all) moving.push_back(k);
    }
    ASSERT_FALSE(moving.empty());
    for (const Channel& c : log.channels) {
      const bool position = c.role == Role::kJointPosition;
      if (!position && c.role != Role::kPressureA && c.role != Role::kPressureB &&
          c.role != Role::kPumpPressure) {
        continue;
      }
      // the generator's sensors: 0.8 bar, 0.3 mrad, 1 mm
      const double noise = !position ? 0.8 * kBar : c.signal == "q_extension" ? 1e-3 : 3e-4;
      for (const std::string fault : {"noise", "burst", "stuck", "jumps"}) {
        Log faulty = log;
        Eigen::VectorXd& x = channel(faulty, c.signal).values;
        const auto pick = [&] { return moving[random() % moving.size()]; };
        if (fault == "noise") {
          for (double& v : x) v += std::sqrt(24.0) * noise * normal(random);  // five times in all
        } else if (fault == "burst") {
          for (double& v : x.segment(pick() - 50, 300))
            v += std::sqrt(24.0) * noise * normal(random);
        } else if (fault == "stuck") {
          const Eigen::Index k = pick();
          x.segment(k, 250).setConstant(x[k]);
        } else {
          for (int i = 0; i < 6; ++i) {
            const double sign = random() % 2 == 0 ? 1.0 : -1.0;
            x.segment(pick(), 1 + static_cast<Eigen::Index>(random() % 4)).array() +=
                sign * (position ? 100.0 : 25.0) * noise;
          }
        }
        ++injected;
        bool hit = false;
        for (const BadChannel& b : bad_of(machine, faulty)) {
          if (b.channel == c.signal) {
            hit = true;
          } else {
            ++others;
          }
        }
        if (hit) ++found;
        EXPECT_TRUE(hit || fault == "jumps") << path << " " << c.signal << " " << fault;
      }
    }
  }
  // Only jumps may be missed (above), where one falls on a change of the signal itself.
  EXPECT_GE(found, 0.98 * injected);
  EXPECT_LE(others, 0.01 * injected) << "findings on other channels than the faulty one";
  RecordProperty("injected", injected);
  RecordProperty("found", found);
}

}  // namespace
}  // namespace sparflow
