#include "identification/data_checks/position_ripple.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <random>

#include "identification/data_checks/bad_data.h"
#include "models/machine/inertial_torque.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using testing::HasSubstr;
using testing_support::arm_log;
using testing_support::arm_machine;
using testing_support::channel;
using testing_support::remove_channel;

const std::filesystem::path kSharedLogs = SPARFLOW_SOURCE_DIR "/../shared";
constexpr double kHertz = 11.0, kFrom = 20.0, kTo = 30.0;
constexpr double kAmplitude = 4e-3;  // [m] of the rod

std::vector<BadChannel> faults_of(const Machine& machine, const Log& log) {
  return find_bad_channels(machine, log, make_signals(machine, log));
}

std::vector<BadChannel> ripples_of(const Machine& machine, const Log& log) {
  std::vector<BadChannel> out = faults_of(machine, log);
  std::erase_if(out, [](const BadChannel& b) { return b.kind != BadDataKind::kRippling; });
  return out;
}

Log noisy_arm(int hertz) {
  Log log = arm_log(0.5, 1, hertz);
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 2e-4);
  for (double& q : channel(log, "q_arm").values) q += normal(random);
  return log;
}

/// The arm's log with an oscillation of its angle, as of a rod with kAmplitude.
/// @param share of the force that this oscillation needs, which the bore's pressure shows
Log with_oscillation(int hertz, double share) {
  const Machine machine = arm_machine();
  Log log = noisy_arm(hertz);
  const MachineSignals signals = make_signals(machine, log);
  const double omega = 2.0 * M_PI * kHertz;
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    const double t = log.time[k];
    if (t < kFrom || t > kTo) continue;
    const double rate = signals.cylinders[0].rate[k];
    const double angle = kAmplitude / rate * std::sin(omega * (t - kFrom));
    channel(log, "q_arm").values[k] += angle;
    const Eigen::VectorXd torque =
        inertial_torque<double>(machine, signals.q.row(k).transpose(), Eigen::VectorXd::Zero(1),
                                Eigen::VectorXd::Constant(1, -omega * omega * angle), 0.0);
    channel(log, "pA_arm").values[k] +=
        share * torque[0] / rate / machine.cylinders[0].area_piston();
  }
  return log;
}

TEST(PositionRipple, IsFoundWithItsStretchAtAnySampling) {
  for (const int hertz : {25, 50, 100, 200}) {
    const std::vector<BadChannel> bad = faults_of(arm_machine(), with_oscillation(hertz, 0.0));
    ASSERT_EQ(bad.size(), 1u) << hertz;
    EXPECT_EQ(bad[0].channel, "q_arm");
    EXPECT_STREQ(bad_data_word(bad[0].kind), "rippling") << hertz;
    EXPECT_NEAR(bad[0].from_s, kFrom, 0.8) << hertz;  // blocks of a second that overlap by half
    EXPECT_NEAR(bad[0].to_s, kTo, 0.8) << hertz;
    EXPECT_THAT(bad_channel_sentence(bad[0]), HasSubstr("11 Hz")) << hertz;
    EXPECT_THAT(bad_channel_sentence(bad[0]), HasSubstr("mm")) << hertz;
  }
}

/// Both chambers swing against each other without a net force: the oil, and no mass, lets the rod oscillate.
TEST(PositionRipple, OilThatIsCompressedIsNone) {
  const Machine machine = arm_machine();
  Log log = with_oscillation(50, 0.0);
  ASSERT_EQ(ripples_of(machine, log).size(), 1u);
  const double areas = machine.cylinders[0].area_piston() / machine.cylinders[0].area_rod();
  const double pressure =
      1.5e6;  // [Pa] twice what 4 mm of the softest oil on a metre of stroke need
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    const double t = log.time[k];
    if (t < kFrom || t > kTo) continue;
    const double swing = pressure * std::sin(2.0 * M_PI * kHertz * (t - kFrom));
    channel(log, "pA_arm").values[k] += swing;
    channel(log, "pB_arm").values[k] += areas * swing;
  }
  EXPECT_THAT(ripples_of(machine, log), testing::IsEmpty());
}

TEST(PositionRipple, IsFoundInSlimSignalsToo) {
  SignalOptions options;
  options.slim = true;
  const Log log = with_oscillation(50, 0.0);
  const std::vector<BadChannel> bad =
      find_bad_channels(arm_machine(), log, make_signals(arm_machine(), log, options));
  ASSERT_EQ(bad.size(), 1u);
  EXPECT_EQ(bad[0].kind, BadDataKind::kRippling);
}

TEST(PositionRipple, ALoadThatRingsIsNone) {
  // A third of the force: a structure that bends between rod and masses takes less of it than rigid links.
  for (const int hertz : {25, 50, 100, 200})
    for (const double share : {1.0, 0.33})
      for (const BadChannel& b : ripples_of(arm_machine(), with_oscillation(hertz, share)))
        ADD_FAILURE() << hertz << " " << share << " " << bad_channel_sentence(b);
}

TEST(PositionRipple, ThroughoutTheLogIsFoundByTheNoiseBetweenTheLines) {
  Log log = noisy_arm(50);
  const Eigen::ArrayXd t = log.time.array();
  channel(log, "q_arm").values.array() += 6e-3 * (2.0 * M_PI * 7.0 * t).sin();
  const std::vector<BadChannel> bad = ripples_of(arm_machine(), log);
  ASSERT_EQ(bad.size(), 1u);
  EXPECT_GT(bad[0].share, 0.95);
}

TEST(PositionRipple, NoiseIsNone) {
  for (const int hertz : {50, 100}) {
    Log log = noisy_arm(hertz);
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0.0, 5e-3);
    for (Eigen::Index k = 20 * hertz; k < 30 * hertz; ++k)
      channel(log, "q_arm").values[k] += normal(random);
    EXPECT_TRUE(ripples_of(arm_machine(), log).empty()) << hertz;
  }
}

TEST(PositionRipple, IsNotJudgedWithoutPressures) {
  Log log = with_oscillation(50, 0.0);
  remove_channel(log, "pA_arm");
  EXPECT_TRUE(ripples_of(arm_machine(), log).empty());
}

/// From 10.7 to 19.0 s the jib's position ripples while its pressures are smooth; another log does so from 21 to 28.5 s.
TEST(PositionRippleOnCranes, OnlyTheJibOfTwoRealLogsRipples) {
  const std::filesystem::path data = kSharedLogs / "data";
  if (!std::filesystem::exists(data / "hmf_2020_k4")) GTEST_SKIP() << "no logs of cranes here";
  const std::pair<const char*, const char*> machines[] = {{"hmf_2020_k4", "hmf_2020_k4"},
                                                          {"foreign_plant", "three_axis"},
                                                          {"lab_crane", "lab_crane"},
                                                          {"emps", "emps"}};
  for (const auto& [folder, name] : machines) {
    const Machine machine =
        load_machine((kSharedLogs / "machines" / (std::string(name) + ".yaml")).string());
    for (const auto& entry : std::filesystem::directory_iterator(data / folder)) {
      const std::string file = entry.path().filename().string();
      const std::vector<BadChannel> bad =
          ripples_of(machine, load_log(entry.path().string(), machine));
      const bool ramp = file.find("Ramp") == 0, dual = file.find("Dual1") == 0;
      ASSERT_EQ(bad.size(), ramp || dual ? 1u : 0u) << file;
      if (bad.empty()) continue;
      EXPECT_EQ(bad[0].channel, "x_jib");
      // It begins and ends with less than a millimetre, within a second or two.
      EXPECT_NEAR(bad[0].from_s, ramp ? 10.0 : 21.0, 1.01) << file;
      EXPECT_NEAR(bad[0].to_s, ramp ? 19.5 : 28.5, 1.01) << file;
    }
  }
}

}  // namespace
}  // namespace sparflow
