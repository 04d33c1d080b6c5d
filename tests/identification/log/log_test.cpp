/// Tests of a loaded log: SI values, runs, holes, counts.
#include "identification/log/log.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <numbers>

#include "identification/log/log_columns.h"
#include "models/math/sha256.h"
#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::LogFiles;
using test::plain_log;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Sha256, KnownAnswers) {  // FIPS 180-2, appendix B
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_hex(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_F(LogFiles, PlainLogInSiUnits) {
  const Log log = load(plain_log());
  EXPECT_EQ(log.file, "log.csv");
  EXPECT_EQ(log.sha256, sha256_hex(plain_log()));
  EXPECT_EQ(log.samples(), 30);
  EXPECT_DOUBLE_EQ(log.time[1], 0.02);
  EXPECT_NEAR(log.step, 0.02, 1e-12);  // differences of printed decimals
  ASSERT_EQ(log.runs.size(), 1u);
  EXPECT_EQ(log.runs[0].size(), 30);
  EXPECT_THAT(log.warnings, IsEmpty());
  EXPECT_EQ(log.line.front(), 2);
  EXPECT_EQ(log.line.back(), 31);
  const Channel* pressure = log.find(Role::kPressureA, 0);
  ASSERT_NE(pressure, nullptr);
  EXPECT_EQ(pressure->unit, "Pa");
  EXPECT_EQ(pressure->signal, "pA_boom");
  EXPECT_EQ(pressure->column, "pA_boom_bar");
  EXPECT_DOUBLE_EQ(pressure->values[3], 80.3e5);
  EXPECT_TRUE(pressure->complete());
  EXPECT_DOUBLE_EQ(log.find(Role::kPumpPressure, 0)->values[0], 120.5e5);
  EXPECT_DOUBLE_EQ(log.find("payload")->values[7], 800.0);
  EXPECT_EQ(log.find(Role::kOilTemperature)->unit, "degC");
  EXPECT_EQ(log.find(Role::kPressureB, 0), nullptr);
  const Eigen::MatrixXd commands = log.matrix(Role::kCommand, 2);
  EXPECT_DOUBLE_EQ(commands(4, 0), 0.25);
  EXPECT_TRUE(std::isnan(commands(4, 1)));  // not logged
}

TEST(LogColumns, EverySpellingOfAUnitIsConverted) {
  const Machine machine = test::small_crane();
  struct Case {
    const char* name;
    const char* unit_below;
    Role role;
    double factor, offset;
  };
  const double deg = std::numbers::pi / 180.0;
  for (const Case& c : std::vector<Case>{
           {"q_boom_deg", "", Role::kJointPosition, deg, 0.0},
           {"q_boom", "°", Role::kJointPosition, deg, 0.0},
           {"q_boom_mrad", "", Role::kJointPosition, 1e-3, 0.0},
           {"q_extension_mm", "", Role::kJointPosition, 1e-3, 0.0},
           {"q_extension [cm]", "", Role::kJointPosition, 1e-2, 0.0},
           {"x_boom_mm", "", Role::kStroke, 1e-3, 0.0},
           {"u_boom", "%", Role::kCommand, 0.01, 0.0},
           {"u_boom_percent", "", Role::kCommand, 0.01, 0.0},
           {"pA_boom_Pa", "", Role::kPressureA, 1.0, 0.0},
           {"pB_boom_MPa", "", Role::kPressureB, 1e6, 0.0},
           {"p_main_kPa", "", Role::kPumpPressure, 1e3, 0.0},
           {"p_main_psi", "", Role::kPumpPressure, 6894.757293168361, 0.0},
           {"p_return_mbar", "", Role::kReturnPressure, 100.0, 0.0},
           {"force_boom_kN", "", Role::kForce, 1e3, 0.0},
           {"Q_boom_lpm", "", Role::kFlow, 1.0 / 6e4, 0.0},
           {"Q_boom_m3_s", "", Role::kFlow, 1.0, 0.0},
           {"Q_boom [l/min]", "", Role::kFlow, 1.0 / 6e4, 0.0},
           {"payload_t", "", Role::kPayload, 1e3, 0.0},
           {"oil_K", "", Role::kOilTemperature, 1.0, -273.15},
           {"oil_F", "", Role::kOilTemperature, 5.0 / 9.0, -160.0 / 9.0},
           {"pA_valve_boom_bar", "", Role::kCandidate, 1e5, 0.0},
           {"engine speed", "rpm", Role::kCandidate, 1.0, 0.0},
       }) {
    const ColumnMeaning meaning = column_meaning(c.name, c.unit_below, machine);
    EXPECT_EQ(meaning.error, "") << c.name;
    EXPECT_EQ(meaning.role, c.role) << c.name;
    EXPECT_DOUBLE_EQ(meaning.factor, c.factor) << c.name;
    EXPECT_DOUBLE_EQ(meaning.offset, c.offset) << c.name;
  }
}

TEST(LogColumns, TheLongestPartNameIsTaken) {
  Machine machine = test::small_crane();
  machine.joints.push_back(test::joint("boom_2", JointType::kRevolute, {-1.0, 1.0}, 0.1));
  const ColumnMeaning meaning = column_meaning("q_boom_2_rad", "", machine);
  EXPECT_EQ(meaning.role, Role::kJointPosition);
  EXPECT_EQ(meaning.index, 2);
}

TEST(LogColumns, StandardNamesHaveTheirMeaning) {
  const Machine machine = test::loader_crane();
  for (const std::string& name : usual_names(machine)) {
    const ColumnMeaning meaning = column_meaning(name, "", machine);
    EXPECT_EQ(meaning.error, "") << name;
    EXPECT_TRUE(meaning.is_time || meaning.role != Role::kCandidate) << name;
  }
}

TEST_F(LogFiles, MillisecondsAndDegreesAreConverted) {
  const Log log = load("t_ms,q_boom_deg,x_extension_mm\n0,90,1000\n20,45,1001\n40,30,1002\n");
  EXPECT_DOUBLE_EQ(log.time[2], 0.04);
  EXPECT_DOUBLE_EQ(log.find(Role::kJointPosition, 0)->values[0], std::numbers::pi / 2.0);
  EXPECT_DOUBLE_EQ(log.find(Role::kStroke, 1)->values[2], 1.002);
  EXPECT_EQ(log.find(Role::kJointPosition, 1), nullptr);  // the log has its stroke
}

TEST_F(LogFiles, UnknownColumnsAreCandidatesAndTextIsLeftOut) {
  const Log log = load(
      "state,t_s,q_boom_rad,q_extension_m,rpm,pA_valve_boom_bar,q_boom_raw\n"
      "idle,0.00,0.1,1,900,12,5\nidle,0.02,0.1,1,901,13,6\nrun,0.04,0.1,1,902,14,7\n");
  ASSERT_EQ(log.channels.size(), 5u);
  EXPECT_EQ(log.channels[2].signal, "rpm");
  EXPECT_EQ(log.channels[2].role, Role::kCandidate);
  EXPECT_EQ(log.channels[2].unit, "");
  EXPECT_EQ(log.channels[3].signal, "pA_valve_boom");
  EXPECT_EQ(log.channels[3].unit, "Pa");
  EXPECT_DOUBLE_EQ(log.channels[3].values[1], 13e5);
  EXPECT_EQ(log.channels[4].signal, "q_boom_raw");
  EXPECT_THAT(log.warnings,
              ElementsAre("column state left out: it holds text (\"idle\" in line 2)"));
}

/// 100 rows at 50 Hz; `edit` may change a row's time and cells, or drop the row (return false).
template <class Edit>
std::string edited_log(Edit edit) {
  std::string text = "t_s,q_boom_rad,q_extension_m,pA_boom_bar\n";
  for (int i = 0; i < 100; ++i) {
    std::string t = fmt::format("{:.2f}", 0.02 * i), q = fmt::format("{:.4f}", 0.5 + 0.001 * i),
                p = fmt::format("{:.1f}", 80.0 + 0.1 * i);
    if (edit(i, &t, &q, &p)) text += t + "," + q + ",1.5," + p + "\n";
  }
  return text;
}

TEST_F(LogFiles, AGapSplitsTheLog) {
  // 9 of 100 rows gone: 0.2 s between neighbours is no gap; 10 gone: 0.22 s is one.
  const auto without = [&](int count) {
    return load(edited_log([&](int i, auto...) { return i < 40 || i >= 40 + count; }));
  };
  EXPECT_EQ(without(9).runs.size(), 1u);
  const Log log = without(10);
  ASSERT_EQ(log.runs.size(), 2u);
  EXPECT_EQ(log.runs[0].end, 40);
  EXPECT_EQ(log.runs[1].begin, 40);
  EXPECT_EQ(log.runs[1].end, 90);
  EXPECT_THAT(log.warnings, ElementsAre("1 gap in time split the log into 2 runs; the longest is "
                                        "0.22 s after t = 0.780 s"));
}

TEST_F(LogFiles, ShortHolesAreFilledAndLongOnesMarked) {
  const Log log = load(edited_log([](int i, auto*, auto*, auto* p) {
    if ((i >= 10 && i < 13) || (i >= 50 && i < 60) || i < 2) *p = "nan";
    return true;
  }));
  const Channel& pressure = *log.find(Role::kPressureA, 0);
  EXPECT_TRUE(pressure.valid.segment(10, 3).all());
  EXPECT_NEAR(pressure.values[11], 81.1e5, 1e-3);  // linear data, linear fill
  EXPECT_FALSE(pressure.valid.segment(50, 10).any());
  EXPECT_FALSE(pressure.valid.head(2).any());  // nothing before it to fill from
  EXPECT_EQ(pressure.valid.count(), 88);
  EXPECT_TRUE(std::isnan(pressure.values[55]));
  EXPECT_EQ(log.counts.cells_missing, 15);
  EXPECT_EQ(log.counts.cells_interpolated, 3);
  EXPECT_TRUE(log.find(Role::kJointPosition, 0)->complete());  // position data is not harmed
  EXPECT_EQ(log.runs.size(), 1u);
}

TEST_F(LogFiles, HolesAreNotFilledAcrossAGap) {
  const Log log = load(edited_log([](int i, auto*, auto*, auto* p) {
    if (i == 39 || i == 60) *p = "";
    return i < 40 || i >= 60;
  }));
  const Channel& pressure = *log.find(Role::kPressureA, 0);
  EXPECT_FALSE(pressure.valid[39]);
  EXPECT_FALSE(pressure.valid[40]);
}

TEST_F(LogFiles, SlowChannelsAreHeld) {
  std::string text = "t_s,q_boom_rad,q_extension_m,oil_C,payload_kg\n";
  for (int i = 0; i < 200; ++i) {
    text += fmt::format("{:.2f},0.5,1.5,{},{}\n", 0.02 * i,
                        i % 50 == 10 ? fmt::format("{}", 30 + i / 50) : "", i == 0 ? "500" : "");
  }
  const Log log = load(text);
  EXPECT_TRUE(log.find("oil")->complete());
  EXPECT_DOUBLE_EQ(log.find("oil")->values[0], 30.0);
  // Rounding of an interpolation, here and of a sampling interval below.
  EXPECT_NEAR(log.find("oil")->values[35], 30.5, 1e-9);
  EXPECT_DOUBLE_EQ(log.find("oil")->values[199], 33.0);
  EXPECT_DOUBLE_EQ(log.find("payload")->values[199], 500.0);
}

TEST_F(LogFiles, RepeatedRowsAreDroppedAndCounted) {
  std::string text = edited_log([](auto...) { return true; });
  const std::string row = "0.20,0.5100,1.5,81.0\n";
  ASSERT_NE(text.find(row), text.npos);
  text.insert(text.find(row), row);                        // an exact repetition
  text.insert(text.find("0.42,"), "0.40,0.7,1.5,99.0\n");  // same time, other values
  const Log log = load(text);
  EXPECT_EQ(log.samples(), 100);
  EXPECT_EQ(log.counts.rows_repeated, 1);
  EXPECT_EQ(log.counts.rows_same_time, 1);
  EXPECT_DOUBLE_EQ(log.find(Role::kPressureA, 0)->values[20], 82.0e5);  // the first one counts
  EXPECT_THAT(log.warnings, ElementsAre("1 rows left out: repetitions of the row before",
                                        "1 rows left out (0.98 %): same t_s as the row before"));
}

TEST_F(LogFiles, UnevenSamplingIsAccepted) {
  const Log log = load(edited_log([](int i, auto* t, auto...) {
    *t = fmt::format("{:.4f}", 0.02 * i + 0.004 * std::sin(1.7 * i));
    return true;
  }));
  EXPECT_EQ(log.samples(), 100);
  EXPECT_EQ(log.runs.size(), 1u);
}

struct RealLog {
  const char* file;
  Eigen::Index samples;
  std::size_t channels;
};

TEST(RealLogs, AreReadWithoutLoss) {
  if (!std::filesystem::exists(test::shared_file("hmf_2020_k4")))
    GTEST_SKIP() << "real logs are not here";
  const Machine machine = test::real_crane();
  for (const RealLog& real : std::vector<RealLog>{{"Dual1SineRun_230425", 3010, 13},
                                                  {"Dual2SineTest_230425", 2684, 13},
                                                  {"JibSTDTest2_270325", 3123, 13},
                                                  {"JibSineTest_230425", 2516, 13},
                                                  {"JibValveResponseTime_010425", 1371, 13},
                                                  {"MainSTDTest1_270325", 2636, 13},
                                                  {"MainSineTest_230425", 2339, 13},
                                                  {"MainValveResponseTime_010425", 1516, 13},
                                                  {"RampDisturbanceTest_230425", 1715, 13}}) {
    SCOPED_TRACE(real.file);
    const Log log = load_log(test::shared_file("hmf_2020_k4/") + real.file + ".csv", machine);
    EXPECT_EQ(log.samples(), real.samples);
    EXPECT_EQ(log.channels.size(), real.channels);
    EXPECT_EQ(log.runs.size(), 1u);
    EXPECT_NEAR(log.step, 0.02, 1e-9);
    EXPECT_NE(log.find(Role::kStroke, 0), nullptr);
    EXPECT_NE(log.find(Role::kPumpPressure, 0), nullptr);
    EXPECT_EQ(log.find("pA_valve_main")->role, Role::kCandidate);
    EXPECT_EQ(log.counts.cells_missing, 0);
    // The rod-side sensor of one test reads -3.6 bar, the only warning.
    EXPECT_THAT(log.warnings, Each(HasSubstr("below vacuum")));
  }
}

TEST(RealLogs, DriveWithAMeasuredForce) {
  const std::string path = test::shared_file("emps/estimation.csv");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the EMPS log is not here";
  const Log log = load_log(path, test::drive());
  EXPECT_EQ(log.samples(), 24841);
  EXPECT_EQ(log.find(Role::kForce, 0)->unit, "N");
  EXPECT_THAT(log.warnings, IsEmpty());
}

TEST(SimulatedLogs, AreReadWithoutLoss) {
  const std::string path = test::shared_file("loader_crane/plain/train.csv");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the simulated logs are not here";
  const Log log = load_log(path, test::loader_crane());
  EXPECT_EQ(log.samples(), 12000);
  EXPECT_EQ(log.channels.size(), 15u);
  for (const Channel& channel : log.channels) EXPECT_NE(channel.role, Role::kCandidate);
  EXPECT_THAT(log.warnings, IsEmpty());
}

}  // namespace
}  // namespace sparflow
