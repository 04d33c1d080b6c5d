// Messages of the program: warnings about machine and log, files that would overwrite each other, progress of long
// work, Ctrl-C.
#include <chrono>
#include <cmath>
#include <csignal>
#include <regex>
#include <thread>

#include "tests/cli/cli_fixture.h"
#include "tests/cli/running_program.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

using ::testing::AllOf;
using ::testing::StartsWith;

/// The bundled crane with a joint range beyond its boom cylinder's stroke, which is possible but unusual.
std::string crane_with_short_stroke() {
  std::string text = slurp(kCrane);
  const std::string bore = "bore: 0.180";
  const std::size_t at = text.find(bore);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, bore.size(), bore + "\n    stroke: 0.1");
}

/// The bundled test log with the values of some columns multiplied. @param rows kept, 0 = all
template <class Which>
std::string scaled_log(double factor, const Which& which, int rows = 0) {
  std::istringstream lines(slurp(kTest));
  std::string line, field, out;
  std::vector<bool> scaled;
  for (int row = 0; std::getline(lines, line) && (rows == 0 || row <= rows); ++row) {
    std::istringstream fields(line);
    for (std::size_t i = 0; std::getline(fields, field, ','); ++i) {
      if (row == 0) scaled.push_back(which(field));
      if (i > 0) out += ",";
      out += row > 0 && scaled[i] ? std::to_string(factor * std::stod(field)) : field;
    }
    out += "\n";
  }
  return out;
}

bool none(const std::string&) { return false; }

class CliSays : public Cli {};

TEST_F(CliSays, WhatIsUnusualAboutTheMachineInEveryVerb) {
  write("short.yaml", crane_with_short_stroke());
  const auto says = AllOf(HasSubstr("warning: "), HasSubstr("cylinders[boom].stroke"));
  const Outcome fitted =
      run("fit -m " + at("short.yaml") + " -l " + kTrain + " -o " + at("m.json"));
  EXPECT_EQ(fitted.code, 0) << fitted.err;
  EXPECT_THAT(fitted.err, says);
  EXPECT_THAT(run("compare -m " + at("short.yaml") + " -l " + kTest).err, says);
  EXPECT_THAT(run("compare --model " + at("m.json") + " -l " + kTest).err, says);
  std::string problem = reach("loader_crane_lift");
  problem.replace(problem.find(kCrane), kCrane.size(), "short.yaml");
  write("p.yaml", problem);
  EXPECT_THAT(run("plan --paths 1 -p " + at("p.yaml")).err, says);
  EXPECT_THAT(
      run("optimize --paths 1 --intervals 20 -p " + at("p.yaml") + " --model " + at("m.json")).err,
      says);
  EXPECT_THAT(run("compare --model " + model() + " -l " + kTest).err, Not(HasSubstr("warning")));
}

TEST_F(CliSays, WhatALogLacksWhenNothingIsLearned) {
  write("log.csv", scaled_log(1.0, none, 29));  // 0.6 s at rest
  Outcome o = run("fit -m " + kCrane + " -l " + at("log.csv") + " -o " + at("m.json"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err,
              HasSubstr("nothing was learned, so no model is written: the logs lack motion"));
  EXPECT_FALSE(fs::exists(at("m.json")));

  std::string bare = slurp(kTest);
  for (const char* name : {"pA_", "pB_", "p_main", "u_"}) {
    for (std::size_t k; (k = bare.find(std::string(",") + name)) != std::string::npos;)
      bare.replace(k, 1, ",other_");
  }
  write("bare.csv", bare);
  o = run("fit -m " + kCrane + " -l " + at("bare.csv") + " -o " + at("m.json"));
  EXPECT_EQ(o.code, 3);
  for (const char* what : {"chamber pressures", "pump pressure (p_<pump>_bar)", "commands"})
    EXPECT_THAT(o.err, HasSubstr(what));
  EXPECT_THAT(o.err, Not(HasSubstr("lack motion")));
}

TEST_F(CliSays, ThatAMachineHasNothingToLearnAndExitsWithZero) {
  write("drive.yaml",
        "name: drive\njoints:\n  - {name: axis, type: prismatic, parent: base, axis: [1, 0, 0], "
        "position: [-1, 1], velocity: [-1, 1], acceleration: [-5, 5]}\n"
        "tip: {joint: axis, xyz: [0, 0, 0]}\nlinks:\n  - {name: sled, joint: axis, mass: 95, cog: "
        "[0, 0, 0], inertia: 0}\ncylinders:\n  - {name: axis, joint: axis, linkage: {type: "
        "direct}}\npumps: []\nvalves: []\n");
  std::string log = "t_s,q_axis_m,force_axis_N\n";
  for (int k = 0; k < 400; ++k) {
    const double t = 0.01 * k;
    log += std::to_string(t) + "," + std::to_string(0.3 * std::sin(2.0 * t)) + "," +
           std::to_string(20.0 * std::cos(2.0 * t)) + "\n";
  }
  write("log.csv", log);
  const Outcome o =
      run("fit -m " + at("drive.yaml") + " -l " + at("log.csv") + " -o " + at("m.json"));
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.err, HasSubstr("has no hydraulic cylinder: there is nothing to learn"));
  EXPECT_TRUE(fs::exists(at("m.json")));
}

TEST_F(CliSays, WhichUnitALogSeemsToHave) {
  const auto pressures = [](const std::string& c) { return c.ends_with("_bar"); };
  write("mpa.csv", scaled_log(0.1, pressures));
  EXPECT_THAT(run("compare --model " + model() + " -l " + at("mpa.csv")).err,
              AllOf(HasSubstr("are they in MPa?"), HasSubstr("pA_boom_MPa")));
  // A boom between -2 and 56 degrees, scaled so that no single value shows that the unit is degrees.
  write("deg.csv", scaled_log(10.0, [](const std::string& c) { return c == "q_boom_rad"; }));
  EXPECT_THAT(run("compare --model " + model() + " -l " + at("deg.csv")).err,
              AllOf(HasSubstr("are they in degrees? Then name the column q_boom_deg"),
                    Not(HasSubstr("check sign, zero and unit"))));
  std::string machine = slurp(kCrane);
  const std::string range = "position: [-0.20, 1.35]";
  machine.replace(machine.find(range), range.size(), "position: [-11.5, 77]");
  write("deg.yaml", machine);
  const Outcome o = run("compare -m " + at("deg.yaml") + " -l " + kTest);
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, AllOf(HasSubstr("if these are degrees, write [-0.2007, 1.3439]"),
                           Not(HasSubstr("dead centre"))));
}

TEST_F(CliSays, WhichFilesWouldOverwriteEachOther) {
  const std::string compare = "compare --model " + model() + " -l " + kTest;
  const auto wrong = [&](const std::string& arguments, const std::string& sentence) {
    const Outcome o = run(arguments);
    EXPECT_EQ(o.code, 2) << arguments;
    EXPECT_THAT(o.err, HasSubstr(sentence)) << arguments;
  };
  const std::string here = folder_.string();
  wrong(compare + " --json " + at("x") + " --report " + here + "/./x", "name the same file");
  const std::string lift = " -p " + kData + "/reaches/loader_crane_lift.yaml";
  wrong("optimize" + lift + " --model " + model() + " -o " + at("x") + " --json " + at("x"),
        "--json and --output name the same file");
  wrong("plan" + lift + " -o " + at("x") + " --json " + at("x"), "name the same file");
  wrong("fit -m " + kCrane + " -l " + kTrain + " -o " + at("x") + " --report " + at("x"),
        "name the same file");
  wrong("fit -m " + kCrane + " -l " + kTrain + " -t " + kData + "/logs/../logs/" +
            fs::path(kTrain).filename().string() + " -o " + at("x"),
        "is given with --log and with --test");
  write("log.csv", scaled_log(1.0, none, 200));
  const std::string before = slurp(at("log.csv"));
  wrong("compare --model " + model() + " -l " + at("log.csv") + " --json " + at("log.csv"),
        "would overwrite the input");
  EXPECT_EQ(slurp(at("log.csv")), before);
  EXPECT_FALSE(fs::exists(at("x")));
}

TEST_F(CliSays, WhyAnEnergyErrorIsUndefined) {
  write("log.csv", scaled_log(1.0, none, 29));  // 0.6 s at rest
  const Outcome o = run("compare --model " + model() + " -l " + at("log.csv") + " --report " +
                        at("c.html") + " --json " + at("c.json"));
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, Not(HasSubstr("nan")));
  EXPECT_THAT(o.out,
              HasSubstr("energy of pump main: \u2013 %, the pump delivered nothing in the 0.6 s"));
  EXPECT_THAT(slurp(at("c.html")), Not(HasSubstr("nan")));
  EXPECT_TRUE(test_support::parsed_json(slurp(at("c.json")))
                  .at("stages")
                  .at("energy")
                  .at("main")
                  .at("relative_error")
                  .is_null());
  const Outcome fitted =
      run("fit -m " + kCrane + " -l " + kTrain + " -t " + at("log.csv") + " -o " + at("m.json"));
  EXPECT_EQ(fitted.code, 0);
  EXPECT_THAT(fitted.out, AllOf(Not(HasSubstr("nan")), HasSubstr("energy of main \u2013 %")));
}

TEST_F(CliSays, HowFarLongWorkIsOffATerminalAndEndsAtOnceWithTheSecondCtrlC) {
  // Starts on a very fine mesh between obstacles take minutes.
  Running program({"optimize", "-p", kData + "/reaches/loader_crane_over_beam.yaml", "--model",
                   model(), "--intervals", "2000", "--json", at("o.json")},
                  at("out"), at("err"));
  // Paths are searched up to 20 %; there a first Ctrl-C ends at once, because nothing was found yet that could be kept.
  const std::regex solving("optimize: [0-9]+ s, ([2-9][0-9]|100) %");
  ASSERT_TRUE(comes(at("err"), solving, 180.0)) << slurp(at("err"));
  EXPECT_THAT(slurp(at("err")), StartsWith("optimize ...\n"));
  // A signal from another program reaches only the parent, and the children must end with it.
  ::kill(program.pid(), SIGINT);
  ASSERT_TRUE(comes(at("err"), "Ctrl-C again ends at once", 180.0));
  ::kill(program.pid(), SIGINT);
  const int code = program.wait(60.0);
  EXPECT_EQ(code, 130);
  for (int k = 0; k < 100 && program.alive() > 0; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_EQ(program.alive(), 0);
  EXPECT_FALSE(fs::exists(at("o.json.tmp")));
}

TEST_F(CliSays, OneCtrlCOrSigtermKeepsTheBestSoFar) {
  struct Way {
    bool whole_group;
    int signal;
  };
  for (const auto& [whole_group, signal] :
       {Way{false, SIGINT}, Way{true, SIGINT}, Way{false, SIGTERM}}) {
    // Before the first seed is timed there is no result; how long that takes depends on the machine.
    for (int seconds = 3; seconds < 60; seconds *= 2) {
      Running program({"optimize", "-p", kData + "/reaches/loader_crane_over_wall.yaml", "--model",
                       model(), "-o", at("motion.csv"), "--json", at("o.json")},
                      at("out"), at("err"));
      std::this_thread::sleep_for(std::chrono::seconds(seconds));
      ::kill(whole_group ? -program.pid() : program.pid(), signal);
      ASSERT_EQ(program.wait(120.0), 130) << slurp(at("err"));
      if (!slurp(at("out")).empty()) break;
      EXPECT_FALSE(fs::exists(at("o.json")));
    }
    ASSERT_THAT(slurp(at("out")), StartsWith("interrupted: ")) << slurp(at("err"));
    EXPECT_GT(test_support::parsed_json(slurp(at("o.json"))).at("energy_exact_J").get<double>(),
              0.0);
    EXPECT_THAT(slurp(at("motion.csv")), StartsWith("t_s,"));
    fs::remove(at("motion.csv"));
    fs::remove(at("o.json"));
  }
}

}  // namespace
}  // namespace sparflow::test
