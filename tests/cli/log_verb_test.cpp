// `sparflow log`: the channels of a log without a machine, their JSON, and files that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/parsed_json.h"

namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

struct LogVerb : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / ("sparflow_log_" + std::to_string(::getpid()));
  LogVerb() { fs::create_directories(folder); }
  ~LogVerb() override { fs::remove_all(folder); }

  std::string read(const char* name) const {
    std::ifstream in(folder / name);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  int run(const std::string& arguments) const {
    const std::string command = std::string(SPARFLOW_BINARY_DIR) + "/sparflow log " + arguments +
                                " >" + (folder / "out").string() + " 2>" +
                                (folder / "err").string();
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
};

TEST_F(LogVerb, ListsTheChannelsOfABundledLogWithoutAMachine) {
  const std::string log =
      std::string(SPARFLOW_SOURCE_DIR) + "/problems/logs/loader_crane_train.csv";
  ASSERT_EQ(run(log + " --json " + (folder / "log.json").string()), 0) << read("err");
  EXPECT_THAT(read("out"), HasSubstr("t_s is the time"));
  const auto result = sparflow::test_support::parsed_json(read("log.json"));
  ASSERT_EQ(result["channels"].size(), 15u);
  EXPECT_EQ(result["channels"][0]["name"], "q_boom_rad");
  EXPECT_EQ(result["channels"][0]["unit"], "rad");
  // the file writes four decimals of an angle every 20 ms
  EXPECT_NEAR(result["channels"][0]["resolution"].get<double>(), 1e-4, 1e-9);
  EXPECT_NEAR(result["channels"][0]["rate_Hz"].get<double>(), 50.0, 1e-6);
}

TEST_F(LogVerb, DatabasesDecodeTheFramesOfATrace) {
  std::ofstream(folder / "bus.log") << "(10.0) can0 123#0100\n(10.5) can0 123#0300\n";
  std::ofstream(folder / "bus.dbc")
      << "BO_ 291 A: 2 E\n SG_ pressure : 0|16@1+ (0.5,0) [0|0] \"bar\" E\n";
  EXPECT_EQ(run((folder / "bus.log").string()), 3);
  EXPECT_THAT(read("err"), HasSubstr("123 (2 frames)"));
  const std::string decoded = (folder / "bus.log").string() + " --json - --dbc ";
  ASSERT_EQ(run(decoded + (folder / "bus.dbc").string()), 0) << read("err");
  const auto channels = sparflow::test_support::parsed_json(read("out"))["channels"];
  ASSERT_EQ(channels.size(), 1u);
  EXPECT_EQ(channels[0]["name"], "pressure");
  EXPECT_EQ(channels[0]["largest"], 1.5);
}

TEST_F(LogVerb, ProposesAMappingForAMachineAndWritesItOnlyWhenAsked) {
  const std::string problems = std::string(SPARFLOW_SOURCE_DIR) + "/problems";
  // the bundled log under names of another kind
  std::ifstream in(problems + "/logs/loader_crane_train.csv");
  std::string header, rest((std::istreambuf_iterator<char>(in)), {});
  header = rest.substr(0, rest.find('\n'));
  rest = rest.substr(rest.find('\n'));
  const std::string other =
      "Zeit [s],Winkel Hubarm [rad],Winkel Knickarm [rad],Weg Teleskop [m],Hebel Hubarm,Hebel "
      "Knickarm,Hebel Teleskop,"
      "Druck Kolben Hubarm [bar],Druck Stange Hubarm [bar],Druck Kolben Knickarm [bar],Druck "
      "Stange Knickarm [bar],"
      "Druck Kolben Teleskop [bar],Druck Stange Teleskop [bar],Pumpendruck [bar],Nutzlast "
      "[kg],Temperatur Öl [°C]";
  ASSERT_EQ(std::count(other.begin(), other.end(), ','),
            std::count(header.begin(), header.end(), ','));
  const std::string log = (folder / "de.csv").string(),
                    mapping = (folder / "mapping.yaml").string();
  std::ofstream(log) << other << rest;
  const std::string machine = problems + "/machines/loader_crane.yaml";
  ASSERT_EQ(run(log + " -m " + machine), 0) << read("err");
  EXPECT_FALSE(fs::exists(mapping));
  EXPECT_THAT(read("out"), HasSubstr("bore-side pressure of cylinder boom -> pA_boom_bar"));
  ASSERT_EQ(run(log + " -m " + machine + " --write-mapping " + mapping + " --json " +
                (folder / "log.json").string() + " --report " + (folder / "log.html").string()),
            0)
      << read("err");
  EXPECT_THAT(read("mapping.yaml"), HasSubstr("pB_jib_bar: \"`Druck Stange Knickarm [bar]`\""));
  const auto result = sparflow::test_support::parsed_json(read("log.json"));
  EXPECT_GE(result["proposal"]["meanings"].size(), 14u);
  EXPECT_THAT(read("log.html"), HasSubstr("Proposed mapping"));
  // the mapping is what `--mapping` of the program reads
  ASSERT_EQ(run(log + " --mapping " + mapping), 0) << read("err");
  EXPECT_THAT(read("out"), HasSubstr("pA_extension_bar"));
}

TEST_F(LogVerb, AMappingWithoutAMachineIsWrongUse) {
  const std::string log =
      std::string(SPARFLOW_SOURCE_DIR) + "/problems/logs/loader_crane_train.csv";
  EXPECT_EQ(run(log + " --write-mapping " + (folder / "m.yaml").string()), 2);
  EXPECT_THAT(read("err"), HasSubstr("needs -m MACHINE"));
  EXPECT_FALSE(fs::exists(folder / "m.yaml"));
}

TEST_F(LogVerb, WithoutAMachineDerivativesAreNamed) {
  std::ofstream out(folder / "rates.csv");
  out << "t_s,way [mm],CH2\n";
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.02 * i;
    out << t << ',' << 100.0 * std::sin(0.5 * t) << ',' << 50.0 * std::cos(0.5 * t) << '\n';
  }
  out.close();
  ASSERT_EQ(run((folder / "rates.csv").string() + " --propose"), 0) << read("err");
  EXPECT_THAT(read("out"), HasSubstr("CH2 moves as the derivative of way [mm]"));
}

TEST_F(LogVerb, AFileWithoutAClockIsRefusedWithASentence) {
  std::ofstream(folder / "flat.csv") << "a,b\n1,2\n1,3\n1,2\n";
  EXPECT_EQ(run((folder / "flat.csv").string()), 3);
  EXPECT_THAT(read("err"), HasSubstr("no column rises from row to row"));
  // a time there is, but it falls
  std::ofstream(folder / "falling.csv") << "t_s,b\n3,2\n2,3\n1,2\n0,4\n";
  EXPECT_EQ(run((folder / "falling.csv").string()), 3);
  EXPECT_THAT(read("err"), HasSubstr("falling.csv:1: t_s: this column is the time by its name"));
}

TEST_F(LogVerb, AChannelWithoutValuesHasNeitherRangeNorNoise) {
  std::ofstream(folder / "hollow.csv") << "t_s,b,c\n0,nan,1\n1,nan,2\n2,nan,1\n3,nan,3\n";
  ASSERT_EQ(run((folder / "hollow.csv").string()), 0) << read("err");
  EXPECT_THAT(read("out"), HasSubstr("100 %"));
  EXPECT_THAT(read("out"), testing::Not(HasSubstr("nan")));
}

}  // namespace
