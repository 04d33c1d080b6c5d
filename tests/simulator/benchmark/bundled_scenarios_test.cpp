// The bundled scenarios: each can be read, and tuning and test are apart.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "problems/bundled.h"
#include "simulator/benchmark/scenario_file.h"

namespace sparflow::benchmark {
namespace {

TEST(BundledScenarios, AreSixtyWithIdsOfTheirFilesAndSetsOfTheirFolders) {
  std::set<std::string> ids;
  std::size_t count = 0;
  for (const std::string set : {"tuning", "test"}) {
    for (const std::string& file : bundled_files("scenarios/" + set, ".yaml")) {
      SCOPED_TRACE(file);
      const Scenario s = load_scenario(file, bundled_file);
      EXPECT_EQ(s.id, std::filesystem::path(file).stem().string());
      EXPECT_EQ(s.set, set);
      EXPECT_FALSE(s.model_path.empty());
      ids.insert(s.id);
      ++count;
    }
  }
  EXPECT_EQ(count, 60u);
  EXPECT_EQ(ids.size(), count);
}

}  // namespace
}  // namespace sparflow::benchmark
