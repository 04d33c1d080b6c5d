// What a new user tries first with files of his own: each of these once ended in silence, in a wrong word or in a file that no
// verb could read (docs/commands.md has the verbs).
#include <functional>
#include <map>
#include <regex>

#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

const std::string kBundledModel = kData + "/models/loader_crane.json";
const std::string kLiftProblem = kData + "/reaches/loader_crane_lift.yaml";

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  return fields;
}

/// A change of one cell by its column; an empty answer drops the column.
using CellChange = std::function<std::string(const std::string& column, const std::string& value)>;
using NameChange = std::function<std::string(const std::string& column)>;

/// The first rows of the bundled log, changed.
std::string changed_log(const NameChange& name, const CellChange& cell, int rows = 4000) {
  std::ifstream in(kTrain);
  std::string line, out;
  std::getline(in, line);
  const std::vector<std::string> header = fields_of(line);
  const auto add = [&](const std::vector<std::string>& fields, bool names) {
    std::string text;
    for (std::size_t i = 0; i < header.size(); ++i) {
      if (name(header[i]).empty()) continue;
      text += (text.empty() ? "" : ",") + (names ? name(header[i]) : cell(header[i], fields[i]));
    }
    out += text + "\n";
  };
  add(header, true);
  for (int k = 0; k < rows && std::getline(in, line); ++k) add(fields_of(line), false);
  return out;
}

std::string same_name(const std::string& column) { return column; }
std::string same_cell(const std::string&, const std::string& value) { return value; }
CellChange times(const std::string& prefix, double factor) {
  return [=](const std::string& column, const std::string& value) {
    if (column.rfind(prefix, 0) != 0) return value;
    std::ostringstream text;
    text.precision(12);
    text << factor * std::stod(value);
    return text.str();
  };
}

TEST_F(Cli, AModelWithoutPressuresIsAFailureAndWrittenSoThatEveryVerbReadsIt) {
  write("no_chambers.csv",
        changed_log(
            [](const std::string& c) {
              return c.rfind("pA_", 0) == 0 || c.rfind("pB_", 0) == 0 ? std::string() : c;
            },
            same_cell));
  const Outcome fit =
      run("fit -m " + kCrane + " -l " + at("no_chambers.csv") + " -o " + at("m.json"));
  ASSERT_EQ(fit.code, 3) << fit.err;  // the data are such that nothing comes of them
  EXPECT_THAT(fit.err, HasSubstr("none of 6 pressure models was learned"));
  EXPECT_THAT(slurp(at("m.json")), Not(HasSubstr("\"rmse\": null")));
  const Outcome compare = run("compare --model " + at("m.json") + " -l " + at("no_chambers.csv"));
  EXPECT_EQ(compare.code, 0) << compare.err;
}

/// The lift at a coarse mesh, once for all tests: as solved and at 100 Hz.
struct Lift {
  std::string solved, at_100_hz;
  json result;
};

const Lift& lift() {
  static const Lift made = [] {
    const std::string folder =
        (fs::temp_directory_path() / ("sparflow_newcomer_" + std::to_string(::getpid()))).string();
    fs::create_directories(folder);
    Lift l{folder + "/m.csv", folder + "/m100.csv", {}};
    const std::string command = kProgram + " optimize -p " + kLiftProblem + " --model " +
                                kBundledModel + " --paths 2 --intervals 40 --seed 1 ";
    EXPECT_EQ(
        std::system(
            (command + "-o " + l.solved + " --json " + folder + "/m.json >/dev/null 2>&1").c_str()),
        0);
    EXPECT_EQ(std::system((command + "-o " + l.at_100_hz + " --rate 100 >/dev/null 2>&1").c_str()),
              0);
    l.result = test_support::parsed_json(slurp(folder + "/m.json"));
    return l;
  }();
  return made;
}

TEST_F(Cli, EvaluatePricesTheProgramsOwnMotionAsOptimizeDid) {
  const double energy = lift().result.at("energy_exact_J").get<double>();
  const Outcome o = run("evaluate " + lift().solved + " -p " + kLiftProblem + " --model " +
                        kBundledModel + " --json " + at("e.json") + " --report " + at("e.html"));
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  const json e = test_support::parsed_json(slurp(at("e.json")));
  // The file has twelve digits of every number.
  EXPECT_NEAR(e.at("energy_exact_J").get<double>(), energy, 1e-6 * energy);
  EXPECT_TRUE(e.at("limits_kept").get<bool>());
  EXPECT_GT(e.at("throttling_J").at("jib").get<double>(), 0.0);
  EXPECT_THAT(o.out, HasSubstr("throttling loss"));
  EXPECT_THAT(slurp(at("e.html")), HasSubstr("All limits are kept"));
}

TEST_F(Cli, AMotionAtAFixedRateCostsTheSameAndHasStrokesAndCommands) {
  const std::string text = slurp(lift().at_100_hz);
  const std::vector<std::string> header = fields_of(text.substr(0, text.find('\n')));
  for (const char* column : {"x_boom_m", "x_jib_m", "x_extension_m", "u_boom", "u_jib"})
    EXPECT_THAT(header, ::testing::Contains(column));
  // 16 s at 100 Hz and the header
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1602);
  const Outcome o = run("evaluate " + lift().at_100_hz + " --payload 500 --model " + kBundledModel +
                        " --json " + at("e.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const double energy = lift().result.at("energy_exact_J").get<double>();
  // Starts and stops fall between rows: 10 ms of 16 s.
  EXPECT_NEAR(test_support::parsed_json(slurp(at("e.json"))).at("energy_exact_J").get<double>(),
              energy, 2e-3 * energy);
}

TEST_F(Cli, AMotionThatTakesTooLongBreaksTheProblemsDuration) {
  // the same start and goal in 9 s; the motion takes 16 s
  const Outcome o = run("evaluate " + lift().solved + " -p " + kData +
                        "/reaches/loader_crane_hurry.yaml --model " + kBundledModel);
  EXPECT_EQ(o.code, 5) << o.err << o.out;
  EXPECT_THAT(o.out, HasSubstr("duration: 16 of 9 s"));
}

TEST_F(Cli, PositionsAloneArePricedToo) {
  std::istringstream in(slurp(lift().at_100_hz));
  std::string text, line;
  while (std::getline(in, line)) {
    const std::vector<std::string> f = fields_of(line);
    text += f[0] + "," + f[1] + "," + f[2] + "," + f[3] + "\n";
  }
  write("positions.csv", text);
  const Outcome o = run("evaluate " + at("positions.csv") + " --payload 500 --model " +
                        kBundledModel + " --json " + at("e.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json e = test_support::parsed_json(slurp(at("e.json")));
  EXPECT_TRUE(e.at("from_positions").get<bool>());
  const double energy = lift().result.at("energy_exact_J").get<double>();
  // Smoothing rounds starts and stops, and a rod slower than 2 mm/s stands.
  EXPECT_NEAR(e.at("energy_exact_J").get<double>(), energy, 0.03 * energy);
}

TEST_F(Cli, EvaluateEndsWithFiveWhereTheProblemIsBroken) {
  std::string other = reach("loader_crane_lift");
  other.replace(other.find("3.5]"), 4, "3.1]");
  write("other.yaml", other);
  const Outcome o =
      run("evaluate " + lift().solved + " -p " + at("other.yaml") + " --model " + kBundledModel);
  EXPECT_EQ(o.code, 5) << o.err << o.out;
  EXPECT_THAT(o.out, HasSubstr("distance of the tip from its goal"));
}

TEST_F(Cli, AComputedMotionHasNoBadSensors) {
  for (const std::string& file : {lift().solved, lift().at_100_hz}) {
    const Outcome o =
        run("compare --model " + kBundledModel + " -l " + file + " --json " + at("c.json"));
    ASSERT_EQ(o.code, 0) << o.err;
    const json c = test_support::parsed_json(slurp(at("c.json")));
    EXPECT_TRUE(c.at("bad_data").empty()) << o.out;
    // The file tells the payload, so that the model predicts its own pressures; speeds are smoothed over starts and stops.
    EXPECT_LT(std::abs(c.at("stages").at("energy").at("main").at("relative_error").get<double>()),
              0.02)
        << o.out;
  }
}

TEST_F(Cli, SensorSlipsAreNamed) {
  struct Case {
    std::string what;
    NameChange name;
    CellChange cell;
    std::string kind, channel, says;
  };
  const NameChange swapped = [](const std::string& c) {
    return c == "pA_boom_bar"   ? std::string("pB_boom_bar")
           : c == "pB_boom_bar" ? std::string("pA_boom_bar")
                                : c;
  };
  const std::vector<Case> cases = {
      {"lever", same_name, times("u_jib", -1.0), "sign", "u_jib", "reversed"},
      {"chambers", swapped, same_cell, "swapped", "pA_boom", "exchanged"},
      {"payload", same_name, times("payload", 1e-3), "unit", "payload", "tonnes"},
      {"psi", same_name,
       [](const std::string& c, const std::string& v) {
         return times("pB_jib", 14.5038)(c, times("pA_jib", 14.5038)(c, v));
       },
       "unit", "pA_jib", "psi"},
      {"psi of the pump", same_name, times("p_main", 14.5038), "unit", "p_main", "psi"},
      {"nothing", same_name, same_cell, "", "", ""}};
  for (const Case& c : cases) {
    write("log.csv", changed_log(c.name, c.cell));
    const Outcome o = run("compare --model " + kBundledModel + " -l " + at("log.csv") + " --json " +
                          at("c.json"));
    ASSERT_EQ(o.code, 0) << c.what << o.err;
    const json slips = test_support::parsed_json(slurp(at("c.json"))).at("slips");
    ASSERT_EQ(slips.size(), c.kind.empty() ? 0u : 1u) << c.what << ": " << slips.dump();
    if (c.kind.empty()) continue;
    EXPECT_EQ(slips.at(0).at("kind"), c.kind) << c.what;
    EXPECT_EQ(slips.at(0).at("channels").at(0), c.channel) << c.what;
    EXPECT_THAT(slips.at(0).at("sentence").get<std::string>(), HasSubstr(c.says)) << c.what;
  }
}

TEST_F(Cli, AnglesInDegreesAreNamed) {
  write("deg.csv", changed_log(same_name, times("q_boom_rad", 57.29577951308232)));
  const Outcome o =
      run("compare --model " + kBundledModel + " -l " + at("deg.csv") + " --json " + at("c.json"));
  EXPECT_TRUE(test_support::parsed_json(slurp(at("c.json"))).at("slips").empty())
      << "forces at a wrong posture judge no other sensor";
  EXPECT_THAT(o.err, HasSubstr("are they in degrees? Then name the column q_boom_deg"));
}

TEST_F(Cli, MachineTabulatesDrawsAndDoubtsAWrongBranch) {
  const std::string hmf = kData + "/machines/hmf_2020_k4.yaml";
  const Outcome right = run("machine " + hmf + " --payload 500 --rows 5 --json " + at("m.json") +
                            " --report " + at("m.html"));
  ASSERT_EQ(right.code, 0) << right.err;
  EXPECT_THAT(right.err, Not(HasSubstr("branch")));
  const json m = test_support::parsed_json(slurp(at("m.json")));
  const json& main = m.at("cylinders").at(0);
  EXPECT_EQ(main.at("name"), "main");
  ASSERT_EQ(main.at("rows").size(), 5u);
  const json &first = main.at("rows").at(0), &last = main.at("rows").at(4);
  EXPECT_GT(last.at("length_m").get<double>(), first.at("length_m").get<double>());
  EXPECT_GT(last.at("rate").get<double>(), 0.0);
  EXPECT_NE(last.at("force_loaded_N"), last.at("force_empty_N"));
  EXPECT_THAT(right.out, HasSubstr("dx/dq [m/rad]"));
  EXPECT_THAT(slurp(at("m.html")), HasSubstr("Nothing unusual"));

  std::string text = slurp(hmf);
  text.replace(text.find("branch: -1"), 10, "branch: 1");
  write("flipped.yaml", text);
  const Outcome wrong = run("machine " + at("flipped.yaml"));
  EXPECT_EQ(wrong.code, 0) << wrong.err;
  EXPECT_THAT(wrong.err, HasSubstr("wrong branch"));
  EXPECT_THAT(wrong.err, HasSubstr("try branch: -1"));
}

TEST_F(Cli, AForceThatRoundsToZeroHasNoSign) {
  const Outcome o =
      run("machine " + kData + "/machines/excavator.yaml --report " + at("excavator.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  // the swing carries no static force but rounding, of either sign
  EXPECT_THAT(slurp(at("excavator.html")), Not(HasSubstr("\u22120<")));
}

TEST_F(Cli, PlanDrawsItsPaths) {
  const Outcome o = run("plan -p " + kLiftProblem + " --paths 2 --report " + at("p.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  const std::string page = slurp(at("p.html"));
  EXPECT_THAT(page, HasSubstr("the quickest in"));
  EXPECT_THAT(page, HasSubstr("way of the tip"));
}

TEST_F(Cli, WordsOfTheCommandLineHelp) {
  const Outcome help = run("help fit");
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.out, run("fit --help").out);
  const Outcome unknown = run("help optimise");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("Did you mean \"sparflow optimize\"?"));
  const Outcome typo = run("compare --modle x.json -l " + kTest);
  EXPECT_EQ(typo.code, 2);
  EXPECT_THAT(typo.err, HasSubstr("Did you mean --model?"));
  const Outcome number = run("plan -p " + kLiftProblem + " --seconds abc");
  EXPECT_EQ(number.code, 2);
  EXPECT_THAT(number.err, HasSubstr("got \"abc\", expected a number from 0.001 to 1e+06"));
  EXPECT_LT(number.err.size(), 300u);
  const Outcome no_folder = run("optimize -p " + kLiftProblem + " --model " + kBundledModel +
                                " -o " + at("no/such/m.csv"));
  EXPECT_EQ(no_folder.code, 3);
  EXPECT_THAT(no_folder.err, Not(HasSubstr("optimize ...")));
}

TEST_F(Cli, JsonGoesToStandardOutputAndTextsToStderr) {
  const Outcome o = run("machine " + kCrane + " --json -");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(test_support::parsed_json(o.out).at("machine"), "loader-crane");
  EXPECT_THAT(o.err, HasSubstr("dx/dq"));
}

TEST_F(Cli, PreambleLinesAreExplained) {
  write("preamble.csv", "Logger 3000\nserial 12\n" + changed_log(same_name, same_cell, 200));
  const Outcome o = run("fit -m " + kCrane + " -l " + at("preamble.csv") + " -o " + at("m.json"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("skip_rows: N"));
}

TEST_F(Cli, IdleEnergyStandsBesideTheMotionsOwn) {
  write("idle.yaml", reach("loader_crane_lift") + "\nidle_power_W: 4000\n");
  const Outcome o = run("evaluate " + lift().solved + " -p " + at("idle.yaml") + " --model " +
                        kBundledModel + " --json " + at("e.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("idle energy"));
  EXPECT_NEAR(test_support::parsed_json(slurp(at("e.json"))).at("idle_energy_J").get<double>(),
              64e3, 1.0);
}

TEST_F(Cli, ProgressNeverGoesBack) {
  // `script` gives the program a terminal, on which every change of the share is drawn.
  const std::string command = "script -qec '" + kProgram + " optimize -p " + kLiftProblem +
                              " --model " + kBundledModel + " --paths 2 --intervals 40' " +
                              at("typescript") + " >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string text = slurp(at("typescript"));
  const std::regex share("optimize +([0-9]+) %");
  int last = 0, seen = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), share), end; it != end; ++it, ++seen) {
    const int now = std::stoi((*it)[1]);
    EXPECT_GE(now, last) << "after " << seen << " lines";
    last = now;
  }
  EXPECT_GT(seen, 10);
}

TEST_F(Cli, SigtermActsAsCtrlC) {
  // A mesh that takes far longer than the three seconds.
  const std::string command = "timeout --preserve-status -s TERM 3 " + kProgram + " optimize -p " +
                              kLiftProblem + " --model " + kBundledModel +
                              " --intervals 3000 >/dev/null 2>&1";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
}

}  // namespace
}  // namespace sparflow::test
