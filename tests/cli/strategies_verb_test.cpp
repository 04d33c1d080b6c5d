// strategies and pareto as a user runs them: keys, files, refused inputs.
#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

const std::string kHop = kData + "/reaches/hmf_lift.yaml";
const std::string kQuick = " --paths 2 --intervals 40 --processes 1";

TEST_F(Cli, StrategiesWritesTheKeysThatScriptsRead) {
  const Outcome o = run("strategies -p " + kHop + " --time equal,own --idle 5 --orders 1" + kQuick +
                        " --json " + at("s.json") + " --report " + at("s.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = test_support::parsed_json(slurp(at("s.json")));
  ASSERT_EQ(j.at("problems").size(), 1U);
  const json& p = j["problems"][0];
  EXPECT_EQ(p.at("name"), "HMF crane, lift");
  for (const char* kind : {"sequential", "simultaneous", "simultaneous_nearest", "actuator_line",
                           "tip_line", "minimum_control", "optimal"}) {
    const json& s = p.at("strategies").at(kind);
    ASSERT_TRUE(s.at("feasible").get<bool>()) << kind << s;
    EXPECT_GT(s.at("energy_J").get<double>(), 0.0) << kind;
    EXPECT_NEAR(s.at("duration_s").get<double>(), 25.0, 1e-6) << kind;
    EXPECT_TRUE(s.at("throttling_J").contains("main")) << kind;
    // In equal time no strategy takes less than the optimum.
    EXPECT_GE(s["energy_J"].get<double>(),
              p["strategies"]["optimal"]["energy_J"].get<double>() * (1 - 1e-12))
        << kind;
  }
  // Two joints move the tip in two directions, so the arm is not redundant.
  EXPECT_FALSE(p["strategies"].at("tip_line_best").at("feasible").get<bool>());
  EXPECT_THAT(p["strategies"]["tip_line_best"].at("why").get<std::string>(),
              HasSubstr("needs exactly one"));
  EXPECT_TRUE(p["strategies"]["sequential"].contains("order"));
  EXPECT_LT(p["strategies"]["minimum_time"]["duration_s"].get<double>(), 25.0);
  EXPECT_LT(p.at("own_time").at("optimal").at("duration_s").get<double>(), 25.0);
  EXPECT_TRUE(j.at("summary").at("equal").contains("sequential_against_simultaneous"));
  EXPECT_FALSE(p.at("orders").empty());
  EXPECT_THAT(slurp(at("s.html")), HasSubstr("one cylinder after another"));
  EXPECT_THAT(o.out, HasSubstr("energy-optimal"));
}

TEST_F(Cli, StrategiesTakesFoldersAndLeavesOutProblemsWithoutModel) {
  fs::create_directories(at("set"));
  const auto put = [&](const std::string& name, const std::string& model, double goal_x) {
    std::ofstream(at("set/" + name))
        << "machine: " << kData << "/machines/hmf_2020_k4_load_sensing.yaml\n"
        << model << "start: {q: {main: 0.0, jib: -1.6}}\ngoal: {tip: [" << goal_x
        << ", 0, 2.5]}\nduration_s: 25\nknots: 41\n";
  };
  const std::string model = "model: " + kData + "/models/hmf_2020_k4_load_sensing.json\n";
  put("a.yaml", model, 3.4);
  put("b.yaml", "", 3.4);
  put("c.yaml", model, 9.0);  // out of reach
  const Outcome o =
      run("strategies -p " + at("set") + " --orders 0" + kQuick + " --json " + at("s.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.err, HasSubstr("b.yaml is left out: it names no model"));
  const json j = test_support::parsed_json(slurp(at("s.json")));
  ASSERT_EQ(j["problems"].size(), 2U);
  EXPECT_THAT(j["problems"][1].at("message").get<std::string>(), HasSubstr("infeasible"));
  EXPECT_EQ(j["summary"].at("solved"), 1);
}

TEST_F(Cli, StrategiesNamesWhatItCannotRead) {
  const Outcome word = run("strategies -p " + kHop + " --time soon");
  EXPECT_EQ(word.code, 2);
  EXPECT_THAT(word.err, HasSubstr("\"soon\""));
  EXPECT_EQ(run("strategies -p " + kHop + " --time 0.5").code, 2);
  EXPECT_EQ(run("strategies -p " + at("nothing.yaml")).code, 3);
  fs::create_directories(at("empty"));
  EXPECT_EQ(run("strategies -p " + at("empty")).code, 3);
  EXPECT_EQ(run("strategies -p " + kHop + " --json " + kHop).code, 2);
}

TEST_F(Cli, ParetoFallsWithTimeAndNamesTheBestTimes) {
  const Outcome o =
      run("pareto -p " + kHop + " --points 4 --longest 3" + kQuick + " --idle 5 --json " +
          at("p.json") + " -o " + at("p.csv") + " --report " + at("p.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = test_support::parsed_json(slurp(at("p.json")));
  const json& points = j.at("points");
  ASSERT_GE(points.size(), 3U);
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_GT(points[i]["duration_s"].get<double>(), points[i - 1]["duration_s"].get<double>());
    // A slower motion takes no more energy, because it throttles less (0.1 % allowed for the meshes).
    EXPECT_LE(points[i]["energy_J"].get<double>(), 1.001 * points[i - 1]["energy_J"].get<double>());
  }
  EXPECT_NEAR(j.at("shortest_s").get<double>(), points[0]["duration_s"].get<double>(), 1e-9);
  EXPECT_GT(j.at("unlimited_time").at("sequential_J").get<double>(), 0.0);
  EXPECT_EQ(j.at("idle")[0].at("idle_power_W"), 5000.0);
  EXPECT_THAT(slurp(at("p.csv")), HasSubstr("duration_s,energy_J,sequential_J,simultaneous_J"));
  EXPECT_THAT(slurp(at("p.html")), HasSubstr("Pump energy against time"));
}

}  // namespace
}  // namespace sparflow::test
