// `sparflow effects`: the table, one entry, JSON, and a wrong id.
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

using nlohmann::json;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

struct EffectsVerb : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / ("sparflow_effects_" + std::to_string(::getpid()));
  EffectsVerb() { fs::create_directories(folder); }
  ~EffectsVerb() override { fs::remove_all(folder); }

  std::string read(const char* name) const {
    std::ifstream in(folder / name);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  int run(const std::string& arguments) const {
    const std::string command = std::string(SPARFLOW_BINARY_DIR) + "/sparflow effects " +
                                arguments + " >" + (folder / "out").string() + " 2>" +
                                (folder / "err").string();
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
};

TEST_F(EffectsVerb, PrintsTheCatalogueByStage) {
  ASSERT_EQ(run(""), 0) << read("err");
  const std::string table = read("out");
  std::size_t before = 0;
  for (const char* stage : {"force\n", "flow\n", "pressure\n", "pump\n", "sensor\n"}) {
    const std::size_t at = table.find(stage, before);
    ASSERT_NE(at, std::string::npos) << stage;
    before = at;
  }
  EXPECT_THAT(table, HasSubstr("coulomb_friction:<cyl>"));
  EXPECT_THAT(table, HasSubstr("sensor_fault:<channel>"));
}

TEST_F(EffectsVerb, PrintsOneEntryAndItsJson) {
  const std::string file = (folder / "entry.json").string();
  ASSERT_EQ(run("coulomb_friction --json " + file), 0) << read("err");
  EXPECT_THAT(read("out"), HasSubstr("F_static + Fc sign(v)"));
  const json result = sparflow::test_support::parsed_json(read("entry.json"));
  ASSERT_EQ(result["effects"].size(), 1u);
  EXPECT_EQ(result["effects"][0]["id"], "coulomb_friction");
  EXPECT_EQ(result["effects"][0]["parameters"][0]["unit"], "N");
}

constexpr const char* kSeal =
    "effects:\n"
    "  - id: seal_drag\n"
    "    title: Drag of the seal\n"
    "    stage: force\n"
    "    law: Fc * tanh(v / v0)\n"
    "    parameters:\n"
    "      Fc: {unit: N, bounds: [0, 20000], typical: 3000, meaning: friction force}\n"
    "      v0: {unit: mm/s, bounds: [0.5, 50], typical: 5, meaning: speed at which it is full}\n";

TEST_F(EffectsVerb, PrintsAnEffectOfTheUsersOwn) {
  const std::string file = (folder / "mine.yaml").string();
  std::ofstream(file) << kSeal;
  ASSERT_EQ(run("seal_drag --effects " + file + " --json " + (folder / "e.json").string()), 0)
      << read("err");
  EXPECT_THAT(read("out"), HasSubstr("seal_drag:<cyl>: Drag of the seal"));
  EXPECT_THAT(read("out"), HasSubstr("Fc * tanh(v / v0)"));
  EXPECT_THAT(read("out"), HasSubstr("searched from 0.5,"));
  const json entry = sparflow::test_support::parsed_json(read("e.json"))["effects"][0];
  EXPECT_EQ(entry["built_in"], false);
  EXPECT_EQ(entry["shows_in"][0], "force");
  ASSERT_EQ(run("--effects " + file), 0) << read("err");
  EXPECT_THAT(read("out"), HasSubstr("seal_drag:<cyl>"));
  EXPECT_EQ(run("seal_drag"), 2);  // without the file the effect is unknown
}

TEST_F(EffectsVerb, AWrongUnitIsBadInputAndSaysWhere) {
  const std::string file = (folder / "mine.yaml").string();
  std::string text = kSeal;
  text.replace(text.find("unit: N,"), 8, "unit: bar,");
  std::ofstream(file) << text;
  EXPECT_EQ(run("--effects " + file), 3);
  EXPECT_THAT(read("err"), HasSubstr("mine.yaml:5:10: effects[seal_drag].law"));
  EXPECT_THAT(read("err"), HasSubstr("expected [N], the unit of stage force"));
  EXPECT_EQ(run("--effects " + (folder / "none.yaml").string()), 3);
}

TEST_F(EffectsVerb, SuggestsForATypingError) {
  EXPECT_EQ(run("viscous_frction"), 2);
  EXPECT_THAT(read("err"), HasSubstr("did you mean \"viscous_friction\"?"));
}

}  // namespace
