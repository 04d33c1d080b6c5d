/// Simulated logs: reproducible, with the stated noise and format, similar to the shared example.
#include <filesystem>
#include <fstream>
#include <sstream>

#include "models/math/error.h"
#include "simulator/hidden_effects/random_machine.h"
#include "tests/simulator/hidden_log_support.h"

namespace sparflow::simulator {
namespace {

TEST(HiddenLog, DependsOnTheSeedsOnly) {
  LogRequest request = quiet_request(machine_named("loader_crane"));
  request.noise_factor = 1.0;
  const std::string once = csv_text(generate(request));
  EXPECT_EQ(once, csv_text(generate(request)));
  request.motion_seed += 1;
  EXPECT_NE(once, csv_text(generate(request)));
}

TEST(HiddenLog, AnotherEffectChangesNeitherMotionNorNoise) {
  LogRequest request = quiet_request(machine_named("loader_crane"));
  request.noise_factor = 1.0;
  const GeneratedLog plain = generate(request);
  request.effects = {{"coulomb_friction", "boom", 1.0, 0}};
  const GeneratedLog hidden = generate(request);
  EXPECT_EQ(difference(plain, hidden, "q_jib_rad"), 0.0);
  EXPECT_EQ(difference(plain, hidden, "pA_jib_bar"), 0.0);
  EXPECT_EQ(difference(plain, hidden, "u_boom"), 0.0);
}

TEST(HiddenLog, NoiseHasTheStatedLevel) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 120.0);
  const GeneratedLog clean = generate(request);
  for (const double factor : {1.0, 2.0}) {
    request.noise_factor = factor;
    const GeneratedLog noisy = generate(request);
    const auto deviation = [&](const std::string& column) {
      const auto &x = *clean.find(column), &y = *noisy.find(column);
      double square = 0.0;
      for (std::size_t i = 0; i < x.size(); ++i) square += (y[i] - x[i]) * (y[i] - x[i]);
      return std::sqrt(square / static_cast<double>(x.size()));
    };
    // With 6000 samples the standard deviation is known to 1 %; five times that is allowed, and rounding of 0.04 bar.
    EXPECT_NEAR(deviation("pA_boom_bar"), 0.8 * factor, 0.05 * factor);
    EXPECT_NEAR(deviation("p_main_bar"), 0.8 * factor, 0.05 * factor);
    EXPECT_NEAR(deviation("q_boom_rad"), 3e-4 * factor, 0.2e-4 * factor);
    EXPECT_NEAR(deviation("q_extension_m"), 1e-3 * factor, 0.6e-4 * factor);
  }
}

TEST(HiddenLog, HasTheRequestedColumns) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 10.0);
  request.rate = 30.0;
  const GeneratedLog all = generate(request);
  EXPECT_EQ(all.rows(), 300u);
  EXPECT_EQ(all.names.front(), "t_s");
  EXPECT_NEAR(all.columns[0][3], 0.1, 1e-9);
  request.channels = {false, false, false, false, false, true};
  const GeneratedLog few = generate(request);
  EXPECT_EQ(few.names, (std::vector<std::string>{"t_s", "x_boom_m", "x_jib_m", "x_extension_m",
                                                 "pA_boom_bar", "pA_jib_bar", "pA_extension_bar"}));
}

TEST(HiddenLog, ADriveWithoutChambersReportsItsForce) {
  const GeneratedLog log = generate(quiet_request(machine_named("emps"), 10.0));
  ASSERT_NE(log.find("force_axis_N"), nullptr);
  EXPECT_EQ(log.find("pA_axis_bar"), nullptr);
}

TEST(HiddenLog, NamesWhatIsPossibleForAWrongRequest) {
  const auto message = [](const HiddenEffect& effect) {
    LogRequest request = quiet_request(machine_named("loader_crane"), 5.0);
    request.effects = {effect};
    try {
      generate(request);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_NE(message({"colomb_friction", "", 1.0, -1}).find("coulomb_friction"), std::string::npos);
  EXPECT_NE(message({"coulomb_friction", "arm", 1.0, -1}).find("boom, jib, extension"),
            std::string::npos);
  EXPECT_NE(message({"pad_friction", "boom", 1.0, -1}).find("extension"), std::string::npos);
  EXPECT_NE(message({"pump_lag", "main", 1.0, 9}).find("laws 0.."), std::string::npos);
}

struct Statistics {
  double rest = 0.0, one = 0.0, two = 0.0, standby = 0.0, busy = 0.0;
};

Statistics statistics(const GeneratedLog& log) {
  Statistics s;
  const auto &a = *log.find("u_boom"), &b = *log.find("u_jib"), &c = *log.find("u_extension");
  const auto& pump = *log.find("p_main_bar");
  double moving = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int n = (a[i] != 0.0) + (b[i] != 0.0) + (c[i] != 0.0);
    s.rest += n == 0;
    s.one += n == 1;
    s.two += n == 2;
    (n == 0 ? s.standby : s.busy) += pump[i];
    moving += n > 0;
  }
  const auto rows = static_cast<double>(a.size());
  s.standby /= s.rest;
  s.busy /= moving;
  for (double* share : {&s.rest, &s.one, &s.two}) *share /= rows;
  return s;
}

GeneratedLog read_log(const std::string& path) {
  GeneratedLog log;
  std::ifstream file(path);
  std::string line, cell;
  std::getline(file, line);
  for (std::stringstream header(line); std::getline(header, cell, ',');) log.names.push_back(cell);
  log.columns.resize(log.names.size());
  while (std::getline(file, line)) {
    std::stringstream row(line);
    for (auto& column : log.columns) {
      std::getline(row, cell, ',');
      column.push_back(std::stod(cell));
    }
  }
  return log;
}

TEST(HiddenLog, PlainLogsAreLikeTheSharedExample) {
  const std::string path = SPARFLOW_SOURCE_DIR "/../shared/data/loader_crane/plain/train.csv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no shared data beside the project";
  const Statistics example = statistics(read_log(path));
  Statistics mean;
  constexpr int kLogs = 8;
  for (int k = 0; k < kLogs; ++k) {
    LogRequest request = quiet_request(machine_named("loader_crane"), 240.0);
    request.crane_seed = static_cast<std::uint64_t>(k);
    request.motion_seed = static_cast<std::uint64_t>(100 + k);
    request.noise_factor = 1.0;
    const Statistics s = statistics(generate(request));
    mean.rest += s.rest / kLogs;
    mean.one += s.one / kLogs;
    mean.two += s.two / kLogs;
    mean.standby += s.standby / kLogs;
    mean.busy += s.busy / kLogs;
  }
  // In a log of 40 moves shares have a standard deviation of 0.07; pressures of cranes differ by 20 %.
  EXPECT_NEAR(mean.rest, example.rest, 0.05);
  EXPECT_NEAR(mean.one, example.one, 0.15);
  EXPECT_NEAR(mean.two, example.two, 0.15);
  EXPECT_NEAR(mean.standby, example.standby, 3.0);
  EXPECT_NEAR(mean.busy / example.busy, 1.0, 0.3);
}

TEST(HiddenLog, TheReferenceIsTheSameCrane) {
  CaseRequest request;
  request.log = quiet_request(machine_named("loader_crane"), 60.0);
  request.log.effects = {{"pump_lag", "main", 1.0, 0}};
  request.test_seconds = 30.0;
  const GeneratedCase logs = generate_case(request);
  EXPECT_EQ(logs.test.rows(), 1500u);
  EXPECT_TRUE(logs.reference.truth.empty());
  ASSERT_EQ(logs.train.truth.size(), 1u);
  // Only the pump is changed, and standby belongs to the crane: it is the lowest pump pressure of both logs.
  const auto lowest = [](const GeneratedLog& log) {
    const auto& p = *log.find("p_main_bar");
    return *std::min_element(p.begin(), p.end());
  };
  EXPECT_NEAR(lowest(logs.reference), lowest(logs.train), 0.2);
}

TEST(HiddenLog, RandomMachinesPassTheirChecksAndMove) {
  const std::vector<Machine> drawings = {machine_named("loader_crane"),
                                         machine_named("hmf_2020_k4"),
                                         machine_named("swing_crane_two_pumps")};
  bool slewing = false, two_joints = false, two_pumps = false;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Machine machine = random_machine(drawings, seed);
    slewing = slewing || machine.joint_index("slew") == 0;
    two_joints = two_joints || machine.joint_count() == 2;
    two_pumps = two_pumps || machine.pump_count() == 2;
    const GeneratedLog log = generate(quiet_request(machine, 40.0));
    bool finite = true, moved = false;
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      const auto& column = log.columns[c];
      for (const double v : column) finite = finite && std::isfinite(v);
      if (log.names[c].rfind("q_", 0) == 0)
        moved = moved || std::abs(column.back() - column.front()) > 0.02;
    }
    EXPECT_TRUE(finite) << machine.name;
    EXPECT_TRUE(moved) << machine.name;
  }
  EXPECT_TRUE(slewing && two_joints && two_pumps);
}

}  // namespace
}  // namespace sparflow::simulator
