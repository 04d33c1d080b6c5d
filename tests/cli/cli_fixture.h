#pragma once
/// Runs the program as a user does, in a folder of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace sparflow::test {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

inline const std::string kProgram = std::string(SPARFLOW_BINARY_DIR) + "/sparflow";
inline const std::string kData = std::string(SPARFLOW_SOURCE_DIR) + "/problems";
inline const std::string kCrane = kData + "/machines/loader_crane.yaml";
inline const std::string kTrain = kData + "/logs/loader_crane_train.csv";
inline const std::string kTest = kData + "/logs/loader_crane_test.csv";

struct Outcome {
  int code = -1;
  std::string out, err;
};

inline std::string slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

class Cli : public ::testing::Test {
 protected:
  Cli() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              (std::string("sparflow_cli_") + info->name() + "_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  ~Cli() override { fs::remove_all(folder_); }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  Outcome run(const std::string& arguments) const {
    const std::string command = kProgram + " " + arguments + " >" + at(".out") + " 2>" + at(".err");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
            slurp(folder_ / ".out"), slurp(folder_ / ".err")};
  }

  /// A bundled reach with the absolute path of its machine, so that the file can be moved.
  static std::string reach(const std::string& name) {
    std::string text = slurp(kData + "/reaches/" + name + ".yaml");
    const std::string relative = "../machines/loader_crane.yaml";
    text.replace(text.find(relative), relative.size(), kCrane);
    return text;
  }

  /// A model that is fitted once for all tests of this program.
  static const std::string& model() {
    static const std::string path = [] {
      const std::string file = (fs::temp_directory_path() /
                                ("sparflow_cli_model_" + std::to_string(::getpid()) + ".json"))
                                   .string();
      const std::string command =
          kProgram + " fit -m " + kCrane + " -l " + kTrain + " -o " + file + " >/dev/null 2>&1";
      EXPECT_EQ(std::system(command.c_str()), 0);
      return file;
    }();
    return path;
  }

  fs::path folder_;
};

}  // namespace sparflow::test
