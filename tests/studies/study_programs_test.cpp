// The studies' programs, each run on one small case: the figures that they print are those of the program itself, found on
// another way.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "models/files/machine_file.h"
#include "models/math/error.h"

namespace sparflow::bench {
namespace {

namespace fs = std::filesystem;

class StudyPrograms : public testing::Test {
 protected:
  StudyPrograms()
      : folder_(fs::temp_directory_path() / ("sparflow_studies_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  void SetUp() override {
    for (const char* program : {"bench/prediction_study", "bench/machine_coverage", "sparflow"})
      if (!fs::exists(std::string(SPARFLOW_BINARY_DIR) + "/" + program))
        GTEST_SKIP() << "this build is without " << program;
  }
  ~StudyPrograms() override { fs::remove_all(folder_); }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  /// What a program of the build prints. @param command from the folder of the build
  std::string printed(const std::string& command) const {
    const std::string out = at("out"), all = std::string(SPARFLOW_BINARY_DIR) + "/" + command +
                                             " >" + out + " 2>" + at("err");
    const int status = std::system(all.c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << all << "\n"
                                                               << read_file(at("err"));
    return read_file(out);
  }

  fs::path folder_;
};

/// The numbers in a text, in their order, units and signs of tables left out.
std::vector<double> numbers(const std::string& text) {
  static const std::regex number("[-+]?[0-9]+(\\.[0-9]+)?(e[-+]?[0-9]+)?");
  std::vector<double> all;
  for (std::sregex_iterator i(text.begin(), text.end(), number), end; i != end; ++i)
    all.push_back(std::stod(i->str()));
  return all;
}

/// The only line that begins with these words, without them.
std::string line_of(const std::string& text, const std::string& begin) {
  std::istringstream in(text);
  std::string line, found;
  int count = 0;
  while (std::getline(in, line)) {
    if (line.rfind(begin, 0) != 0) continue;
    found = line.substr(begin.size());
    ++count;
  }
  EXPECT_EQ(count, 1) << begin << " in\n" << text;
  return found;
}

/// A short move of the HMF crane, whose plan and run take a second.
const char* const kScenario =
    "id: short\nset: tuning\nmachine: hmf_2020_k4_load_sensing\n"
    "model: hmf_2020_k4_load_sensing_plant\nstart: {q: {main: 0.378, jib: -1.4}}\npayload_kg: 200\n"
    "goals:\n- {q: {main: 0.5, jib: -1.25}, duration_s: 12}\noil_C: 45\ntolerance_m: 0.1\n"
    "seeds: [3]\n";

TEST_F(StudyPrograms, PredictionStudyTellsTheEnergiesOfTheBenchmark) {
  std::ofstream(at("short.yaml")) << kScenario;
  const std::string table =
      printed("bench/prediction_study " + at("short.yaml") + " --logs " + at("logs"));
  printed("sparflow benchmark " + at("short.yaml") +
          " --controllers tracked_optimum --no-bound --json " + at("result.json"));
  const auto result = nlohmann::json::parse(read_file(at("result.json")));
  const auto& row = result["rows"][0];
  ASSERT_EQ(row["status"], "done");

  // predicted, true, error | tracking, late | flow, pressure, starts, count | sway, tip errors at the end and on the way
  const std::vector<double> v = numbers(line_of(table, "short "));
  ASSERT_EQ(v.size(), 12U) << table;
  const double half = 0.0051;  // of the last digit of kJ, and the rounding of a sum
  EXPECT_NEAR(v[0], result["scenarios"][0]["predicted_optimum_J"].get<double>() / 1e3, half);
  EXPECT_NEAR(v[1], row["energy_J"].get<double>() / 1e3, half);
  EXPECT_NEAR(v[2], 100.0 * (v[0] / v[1] - 1.0), 0.1);
  EXPECT_NEAR(v[10], 1e3 * row["tip_error_end_m"].get<double>(), 0.51);
  EXPECT_NEAR(v[11], 1e3 * row["tip_error_path_m"].get<double>(), 0.51);
  // the parts: true - predicted = tracking + flow + pressure, but for what a sample of 20 ms leaves out
  EXPECT_NEAR(v[1] - v[0], v[3] + v[5] + v[6], 0.01 * v[1]);

  // the log is one that the program reads: as long as the run, with the pump's pressure
  const std::string log = printed("sparflow log " + at("logs/short.csv"));
  EXPECT_NE(log.find("p_main_bar"), std::string::npos) << log;
  const std::string rows = read_file(at("logs/short.csv"));
  EXPECT_GT(std::count(rows.begin(), rows.end(), '\n'), 12 * 50);  // of 12 s, 50 a second

  // the last line is of this one run
  const std::vector<double> sum = numbers(line_of(table, "gains "));
  ASSERT_GE(sum.size(), 10U) << table;
  EXPECT_EQ(sum[3], 1.0);                        // done
  EXPECT_EQ(sum[4], 0.0);                        // failed
  EXPECT_NEAR(sum[5], std::abs(v[2]), 0.051);    // error, median
  EXPECT_NEAR(sum[6], std::abs(v[2]), 0.051);    // and worst
  EXPECT_NEAR(sum[8] + sum[9], -sum[7], 0.151);  // tracking and law are what the bias lacks
  EXPECT_NEAR(sum[10], v[1], 0.051);             // true energy of all
}

/// What the lines of one kind of value say: how many there are, how many intervals hold the truth, and the relative half widths.
struct Counted {
  int values = 0, held = 0;
  std::vector<double> widths;
};

TEST_F(StudyPrograms, MachineCoverageCountsTheIntervalsThatHoldTheTruth) {
  const std::string table = printed(
      "bench/machine_coverage --seeds 1 --seed 1 --seconds 160 --machines loader_crane --laws "
      "coulomb_friction viscous_friction -v");
  const Machine truth =
      load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/loader_crane.yaml");
  std::map<std::string, Counted> found;
  const std::regex diameter(
      R"(cylinders\[(\w+)\]\.(bore|rod): ([0-9.e-]+) ± ([0-9.e-]+), truth ([0-9.e-]+),)");
  std::istringstream in(table);
  std::string line;
  while (std::getline(in, line)) {
    std::smatch m;
    if (!std::regex_search(line, m, diameter)) continue;
    const Cylinder& c = truth.cylinders[static_cast<std::size_t>(truth.cylinder_index(m[1]))];
    const double expected = m[2] == "bore" ? c.bore : c.rod;
    const double value = std::stod(m[3]), half = std::stod(m[4]);
    EXPECT_NEAR(std::stod(m[5]), expected, 1e-5 * expected) << line;
    // found from the log: near the truth, and not the truth itself
    EXPECT_NEAR(value, expected, 0.2 * expected) << line;
    EXPECT_NE(value, expected) << line;
    Counted& kind = found[m[2]];
    ++kind.values;
    kind.held += std::abs(value - expected) <= half;
    kind.widths.push_back(100.0 * half / expected);
  }
  EXPECT_EQ(found["bore"].values, 2) << "two of each are blanked";
  const std::vector<double> row = numbers(line_of(table, "| coulomb_friction, viscous_friction |"));
  ASSERT_EQ(row.size(), 10U) << table;  // percent, of how many and half width, three times; asked
  EXPECT_EQ(found["rod"].values + row[9], 2.0) << "what is not found is asked for";
  for (const auto& [kind, at] : {std::pair<std::string, std::size_t>{"bore", 0}, {"rod", 3}}) {
    const Counted& counted = found[kind];
    ASSERT_GT(counted.values, 0) << kind;
    EXPECT_EQ(row[at + 1], counted.values) << kind;
    EXPECT_NEAR(row[at], 100.0 * counted.held / counted.values, 0.51) << kind;
    const auto [least, most] = std::minmax_element(counted.widths.begin(), counted.widths.end());
    // both are printed with two digits
    EXPECT_GE(row[at + 2], 0.95 * *least) << kind;
    EXPECT_LE(row[at + 2], 1.05 * *most) << kind;
  }
}

}  // namespace
}  // namespace sparflow::bench
