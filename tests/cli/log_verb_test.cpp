// `sparflow log`: the channels of a log without a machine, their JSON, and files that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
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

TEST_F(LogVerb, AFileWithoutAClockIsRefusedWithASentence) {
  std::ofstream(folder / "flat.csv") << "a,b\n1,2\n1,3\n1,2\n";
  EXPECT_EQ(run((folder / "flat.csv").string()), 3);
  EXPECT_THAT(read("err"), HasSubstr("no column rises from row to row"));
}

}  // namespace
