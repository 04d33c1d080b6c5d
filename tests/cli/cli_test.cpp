// The program as a user runs it: exit codes, messages, no half-written files, the documented JSON keys.
#include <algorithm>
#include <map>
#include <vector>

#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

TEST_F(Cli, HelpAndVersionExitWithZero) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.code, 0);
  for (const char* verb : {"demo", "fit", "compare", "plan", "optimize"}) {
    EXPECT_THAT(help.out, HasSubstr(verb));
    const Outcome own = run(std::string(verb) + " --help");
    EXPECT_EQ(own.code, 0) << verb;
    EXPECT_THAT(own.out, HasSubstr("--"));
  }
  EXPECT_THAT(run("--version").out, HasSubstr("sparflow "));
}

TEST_F(Cli, WrongUsageExitsWithTwoAndASuggestion) {
  EXPECT_EQ(run("").code, 2);
  const Outcome verb = run("optimise -p x.yaml");
  EXPECT_EQ(verb.code, 2);
  EXPECT_THAT(verb.err, HasSubstr("sparflow optimize"));
  EXPECT_EQ(run("fit --machine x.yaml").code, 2);
  EXPECT_EQ(run("compare --log " + kData + "/logs/loader_crane_test.csv").code, 2);
  EXPECT_EQ(run("optimize -p " + kData + "/reaches/loader_crane_lift.yaml").code, 2);
}

TEST_F(Cli, BadInputExitsWithThreeAndWritesNothing) {
  const std::string fit = "fit -o " + at("m.json") + " -m ";
  Outcome o = run(fit + "nowhere.yaml -l x.csv");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("nowhere.yaml: cannot read"));

  write("broken.yaml", "name: x\njoints:\n  - {name: a, typ: revolute}\n");
  o = run(fit + at("broken.yaml") + " -l x.csv");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("broken.yaml:3:"));
  EXPECT_THAT(o.err, HasSubstr("did you mean \"type\""));

  write("log.csv", "t_s,q_boom_rad\n0,1\n1,1\n");
  o = run(fit + kData + "/machines/loader_crane.yaml -l " + at("log.csv"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("log.csv"));
  EXPECT_THAT(o.err, HasSubstr("jib"));

  write("model.json", "{\"sparflow_model\": 1");
  o = run("compare --model " + at("model.json") + " -l " + kData + "/logs/loader_crane_test.csv");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("model.json:1"));

  o = run(fit + kData + "/machines/loader_crane.yaml -l " + kData +
          "/logs/loader_crane_test.csv --report " + at("no/such/page.html"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("there is no folder"));
  EXPECT_FALSE(fs::exists(at("m.json")));
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path();
  }
}

TEST_F(Cli, CompareWritesTheDocumentedKeys) {
  const Outcome o = run("compare --model " + model() + " -l " + kData +
                        "/logs/loader_crane_test.csv --json " + at("c.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json c = test_support::parsed_json(slurp(at("c.json")));
  EXPECT_EQ(c.at("samples").get<int>(), 6000);
  for (const char* cylinder : {"boom", "jib", "extension"}) {
    const json& force = c.at("stages").at("force").at(cylinder);
    for (const char* key : {"rmse", "unit", "fit_percent", "n"})
      EXPECT_TRUE(force.contains(key)) << key;
    EXPECT_TRUE(c.at("stages").at("flow").contains(cylinder));
    for (const char* direction : {"extend", "retract"}) {
      // The sensor noise is 0.8 bar; 1.5 bar is what is required on a test log.
      EXPECT_LE(c.at("stages").at("pressure").at(cylinder).at(direction).at("rmse").get<double>(),
                1.5)
          << cylinder;
    }
  }
  EXPECT_LE(c.at("stages").at("pump").at("main").at("rmse").get<double>(), 2.0);
  const json& energy = c.at("stages").at("energy").at("main");
  EXPECT_LE(std::abs(energy.at("relative_error").get<double>()), 0.02);
  EXPECT_GT(energy.at("measured_J").get<double>(), 1e5);
  EXPECT_TRUE(energy.contains("predicted_J"));
  ASSERT_FALSE(c.at("worst").empty()) << "the log fails somewhere more than elsewhere";
  for (const json& w : c.at("worst")) {
    for (const char* key : {"stage", "at", "where", "rmse", "share_of_error"})
      EXPECT_TRUE(w.contains(key)) << key;
  }
}

/// Columns of a motion by name.
std::map<std::string, std::vector<double>> columns_of(const std::string& csv) {
  std::istringstream lines(csv);
  std::string line, field;
  std::getline(lines, line);
  std::vector<std::string> header;
  for (std::istringstream fields(line); std::getline(fields, field, ',');) header.push_back(field);
  std::map<std::string, std::vector<double>> columns;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    for (const std::string& name : header) {
      std::getline(fields, field, ',');
      columns[name].push_back(std::stod(field));
    }
  }
  return columns;
}

/// Evaluates the motion's file without the program: the exact pump law on its pressures and the model's margins, power
/// from pressure and flow, energy by the trapezoidal rule.
void expect_motion_costs(const std::string& csv, const json& model, double energy) {
  constexpr double kBar = 1e5, kLitrePerMinute = 1.0 / 60000.0;
  const auto c = columns_of(csv);
  const std::vector<double>& t = c.at("t_s");
  ASSERT_GT(t.size(), 50u);  // phases have their own shares of the intervals
  std::vector<double> power(t.size());
  double largest = 0.0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    double flow = 0.0, demand = model.at("pumps")[0].at("standby").get<double>();
    for (const json& cylinder : model.at("cylinders")) {
      const std::string name = cylinder.at("name").get<std::string>();
      const double q = c.at("Q_" + name + "_lpm")[k] * kLitrePerMinute;
      EXPECT_GE(q, 0.0);
      flow += q;
      if (q > 0.0) {
        demand = std::max(
            demand, c.at("P_" + name + "_bar")[k] * kBar + cylinder.at("margin").get<double>());
      }
    }
    power[k] = flow * c.at("p_main_bar")[k] * kBar;
    largest = std::max(largest, power[k]);
    // six digits are written: half a unit of the last of 1.00000 is 5e-6 of each of two pressures; of power and factors
    EXPECT_NEAR(c.at("p_main_bar")[k] * kBar, demand, 10e-6 * demand) << "at " << t[k] << " s";
    EXPECT_NEAR(c.at("power_W")[k], power[k], 15e-6 * power[k] + 1e-6) << "at " << t[k] << " s";
  }
  EXPECT_GT(largest, 1e3) << "the crane lifts 400 kg";
  double sum = 0.0;
  for (std::size_t k = 0; k + 1 < t.size(); ++k)
    sum += 0.5 * (t[k + 1] - t[k]) * (power[k] + power[k + 1]);
  // the rule's error falls with the step squared: 1.05e-4 at 60 intervals, 3.7e-5 at 100, 1.0e-5 at 200
  EXPECT_NEAR(sum, energy, 3e-4 * energy);
}

TEST_F(Cli, ComparesOnlyForcesOfAMachineFile) {
  const Outcome o = run("compare -m " + kCrane + " -l " + kTest + " --json " + at("c.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json stages = test_support::parsed_json(slurp(at("c.json"))).at("stages");
  EXPECT_EQ(stages.at("force").size(), 3u);
  for (const char* learned : {"flow", "pressure", "pump", "energy"})
    EXPECT_TRUE(stages.at(learned).empty()) << learned;
}

TEST_F(Cli, OptimizeWritesMotionPageAndTheDocumentedKeys) {
  const Outcome o =
      run("optimize -p " + kData +
          "/reaches/loader_crane_lift.yaml --paths 3 --intervals 60 --model " + model() + " -o " +
          at("motion.csv") + " --json " + at("o.json") + " --report " + at("o.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json r = test_support::parsed_json(slurp(at("o.json")));
  EXPECT_EQ(r.at("status"), "optimal");
  for (const char* key : {"energy_J", "energy_exact_J", "duration_s", "iterations", "solve_s",
                          "throttling_J", "seed", "constraint_violation", "starts"}) {
    EXPECT_TRUE(r.contains(key)) << key;
  }
  EXPECT_LE(r.at("constraint_violation").get<double>(), 1e-5);
  EXPECT_LT(r.at("energy_exact_J").get<double>(),
            r.at("straight_line_energy_exact_J").get<double>());
  EXPECT_LT(r.at("energy_exact_J").get<double>(), r.at("best_seed_energy_exact_J").get<double>());
  EXPECT_GT(r.at("duration_s").get<double>(), 0.0);
  // every joule of the pump is useful or throttled: sums of the same samples, so equal to rounding
  double parts = 0.0;
  for (const char* share : {"useful_J", "throttling_J"}) {
    for (const json& joule : r.at(share)) parts += joule.get<double>();
  }
  const double energy = r.at("energy_exact_J").get<double>();
  EXPECT_NEAR(parts, energy, 1e-9 * energy);
  EXPECT_EQ(r.at("throttling_J").size(), 3u);
  for (const json& lost : r.at("throttling_J")) EXPECT_GE(lost.get<double>(), 0.0);
  const std::string csv = slurp(at("motion.csv"));
  expect_motion_costs(csv, test_support::parsed_json(slurp(model())), energy);
  EXPECT_THAT(
      csv.substr(0, csv.find('\n')),
      "t_s,q_boom_rad,q_jib_rad,q_extension_m,qd_boom_rad_s,qd_jib_rad_s,qd_extension_m_s,qdd_boom_"
      "rad_s2,"
      "qdd_jib_rad_s2,qdd_extension_m_s2,Q_boom_lpm,Q_jib_lpm,Q_extension_lpm,P_boom_bar,P_jib_bar,"
      "P_extension_bar,p_main_bar,power_W,"
      "x_boom_m,x_jib_m,x_extension_m,u_boom,u_jib,u_extension,payload_kg");
  const std::string page = slurp(at("o.html"));
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(page, HasSubstr("at the limit"));
  EXPECT_THAT(page, Not(::testing::ContainsRegex("[0-9]e-[0-9][0-9] ?%")));
}

// The same reach with a long duration and with 9 s: the bound is that of any motion, and that of motions in 9 s.
TEST_F(Cli, BoundSaysForWhichMotions) {
  const auto bound_of = [&](const std::string& path) {
    const Outcome o = run("optimize --bound --paths 1 --intervals 40 -p " + path + " --model " +
                          model() + " --json " + at("b.json"));
    EXPECT_EQ(o.code, 0) << o.err;
    json r = test_support::parsed_json(slurp(at("b.json")));
    EXPECT_LT(r.at("lower_bound_J"), r.at("energy_exact_J"));
    // the solver starts from such paths and only makes them cheaper; a finer grid gains less than a percent
    EXPECT_GT(r.at("grid_path_energy_exact_J"), 0.99 * r.at("energy_exact_J").get<double>());
    // The grid's path is slow, so it is no measure of a bound at a short duration.
    if (r.at("lower_bound_time_s").is_null()) {
      EXPECT_GT(r.at("unlimited_time_J"), r.at("lower_bound_J"));
    }
    EXPECT_THAT(o.out, HasSubstr("dynamic programming"));
    EXPECT_THAT(o.out, HasSubstr("at unlimited time"));
    r["text"] = o.out;
    return r;
  };
  std::string text = reach("loader_crane_lift");
  text.replace(text.find("duration_s: 16"), 14, "duration_s: 300");
  write("slow.yaml", text);
  const json slow = bound_of(at("slow.yaml")),
             brief = bound_of(kData + "/reaches/loader_crane_hurry.yaml");
  EXPECT_TRUE(slow.at("lower_bound_time_s").is_null());
  EXPECT_THAT(slow.at("text"), HasSubstr("of motions of any duration"));
  EXPECT_EQ(brief.at("lower_bound_time_s"), 9.0);
  EXPECT_THAT(brief.at("text"), HasSubstr("of motions of 9.00 s or less"));
  EXPECT_GT(brief.at("lower_bound_J"), slow.at("lower_bound_J"));
}

TEST_F(Cli, InfeasibleExitsWithFourAndNamesTheLimit) {
  const std::string text = reach("loader_crane_lift");
  std::string hurried = text;
  hurried.replace(hurried.find("duration_s: 16"), 14, "duration_s: 2");
  write("hurried.yaml", hurried);
  Outcome o = run("optimize -p " + at("hurried.yaml") + " --paths 2 --intervals 40 --model " +
                  model() + " --json " + at("h.json") + " -o " + at("h.csv"));
  EXPECT_EQ(o.code, 4);
  EXPECT_FALSE(fs::exists(at("h.csv"))) << "there is no motion to write";
  EXPECT_THAT(o.out, HasSubstr("infeasible"));
  EXPECT_EQ(test_support::parsed_json(slurp(at("h.json"))).at("status"), "infeasible");

  std::string far = text;
  far.replace(far.find("[7.5, 0, 3.5]"), 13, "[75, 0, 3.5]");
  write("far.yaml", far);
  o = run("optimize -p " + at("far.yaml") + " --model " + model());
  EXPECT_EQ(o.code, 4);
  EXPECT_THAT(o.out, HasSubstr("infeasible"));
  EXPECT_EQ(run("plan -p " + at("far.yaml")).code, 4);
}

TEST_F(Cli, PlanListsPathsWithTheirShortestDurations) {
  const Outcome o = run("plan -p " + kData + "/reaches/loader_crane_over_wall.yaml --paths 4 -o " +
                        at("p.csv") + " --json " + at("p.json"));
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  const json p = test_support::parsed_json(slurp(at("p.json")));
  ASSERT_GE(p.at("paths").size(), 1u);
  EXPECT_GT(p.at("paths")[0].at("shortest_duration_s").get<double>(), 0.0);
  EXPECT_THAT(slurp(at("p.csv")), HasSubstr("q_boom_rad"));
}

}  // namespace
}  // namespace sparflow::test
