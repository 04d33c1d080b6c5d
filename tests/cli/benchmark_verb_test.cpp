// `sparflow benchmark` as a user runs it.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

class CliBenchmark : public Cli {
 protected:
  CliBenchmark() {
    write("lift.yaml", scenario("lift", "{boom: 0.3, jib: -1.1, extension: 0.7}"));
    write("reach.yaml", scenario("reach", "{boom: 0.2, jib: -1.0, extension: 0.9}"));
  }
  static std::string scenario(const std::string& id, const std::string& goal) {
    return "id: " + id +
           "\nmachine: loader_crane\nstart: {q: {boom: 0.2, jib: -1.2, extension: 0.6}}\n"
           "payload_kg: 200\ngoals: [{q: " +
           goal + ", duration_s: 8}]\ntolerance_m: 0.2\nseeds: [1, 2]\n";
  }
  std::string both() const { return "benchmark " + at("lift.yaml") + " " + at("reach.yaml") + " "; }
  /// The rows without what depends on the machine's speed.
  json rows(const std::string& file) const {
    json rows = test_support::parsed_json(slurp(at(file)))["rows"];
    for (json& row : rows) {
      row.erase("step_median_s");
      row.erase("step_worst_s");
    }
    return rows;
  }
};

TEST_F(CliBenchmark, GivesTheSameRowsForAnyNumberOfJobs) {
  const std::string which = "--controllers joint_pi,sequential_operator ";
  ASSERT_EQ(run(both() + which + "--jobs 1 --json " + at("a.json")).code, 0);
  const Outcome o = run(both() + which + "--jobs 3 --json " + at("b.json") + " --csv " +
                        at("b.csv") + " --report " + at("b.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(rows("a.json").size(), 8u);
  EXPECT_EQ(rows("a.json"), rows("b.json"));
  EXPECT_THAT(o.out, HasSubstr("2 scenarios, 2 controllers, 8 runs, 0 of them failed"));
  EXPECT_THAT(slurp(at("b.html")), HasSubstr("Where the energy went"));
  const std::string table = slurp(at("b.csv"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 9);
  const json result = test_support::parsed_json(slurp(at("b.json")));
  EXPECT_EQ(result["reference"], "joint_pi");
  EXPECT_EQ(result["summary"][1]["energy_above_reference"]["scenarios"], 2);
  EXPECT_FALSE(fs::exists(at("b.json.journal")));
}

TEST_F(CliBenchmark, ARunThatIsKilledKeepsItsRowsAndResumeDoesNotRunThemAgain) {
  // The process counts in a file how often it was asked to begin.
  write("count.sh", "echo x >> " + at("begun") + "\nread l\necho '{\"type\": \"ready\"}'\n" +
                        "while read l; do echo '{\"u\": {\"boom\": 0.3}}'; done\n");
  const std::string task = both() + "--controllers joint_pi --process own='sh " + at("count.sh") +
                           "' --jobs 1 --seeds 4 --json " + at("r.json");
  const std::string line = "exec " + kProgram + " " + task + " >/dev/null 2>&1";
  const auto kept = [&] {
    const std::string journal = slurp(at("r.json.journal"));
    return std::count(journal.begin(), journal.end(), '\n');
  };
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  // head, two optima, and eleven of the sixteen runs
  while (kept() < 14 && ::waitpid(child, nullptr, WNOHANG) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ASSERT_GE(kept(), 14) << "the run was not killed in the middle";
  const Outcome o = run(task + " --resume --csv " + at("r.csv"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.err, HasSubstr("runs were finished before"));
  EXPECT_EQ(rows("r.json").size(), 16u);
  const std::string begun = slurp(at("begun"));
  // each of the eight runs of the process began once, but for one that was killed on its way
  EXPECT_GE(std::count(begun.begin(), begun.end(), '\n'), 8);
  EXPECT_LE(std::count(begun.begin(), begun.end(), '\n'), 9);
  EXPECT_FALSE(fs::exists(at("r.json.journal")));
}

TEST_F(CliBenchmark, AProcessThatFailsIsARowAndTheRestGoesOn) {
  const Outcome o = run("benchmark " + at("lift.yaml") +
                        " --controllers joint_pi,tracked_optimum --process bad='echo hello' "
                        "--json " +
                        at("f.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json rows = test_support::parsed_json(slurp(at("f.json")))["rows"];
  ASSERT_EQ(rows.size(), 6u);
  int done = 0;
  for (const json& row : rows) {
    done += row["status"] == "done" ? 1 : 0;
    const std::string reason = row["reason"];
    const std::string expected = row["controller"] == "bad"               ? "hello"
                                 : row["controller"] == "tracked_optimum" ? "learned model"
                                                                          : "";
    EXPECT_THAT(reason, HasSubstr(expected));
  }
  EXPECT_EQ(done, 2);
  EXPECT_THAT(o.out, HasSubstr("failed: lift, bad, seed 1: its process printed a line that is no"));
  EXPECT_THAT(o.err, HasSubstr("have no model"));
}

TEST_F(CliBenchmark, WrongUsageAndBadInputSayWhatIsWrong) {
  const std::string lift = "benchmark " + at("lift.yaml");
  Outcome o = run(lift + " --controllers joint_pe");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("did you mean joint_pi?"));
  o = run(lift + " --process foo");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("expected NAME=COMMAND"));
  o = run(lift + " --controllers joint_pi --gain joint_pi.lead=7");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("expected 0.01 to 0.5 [s]"));
  o = run(lift + " --reference tip_rate --controllers joint_pi");
  EXPECT_EQ(o.code, 2);
  write("same.yaml", scenario("lift", "{boom: 0.3, jib: -1.1, extension: 0.7}"));
  o = run(lift + " " + at("same.yaml"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("\"lift\" is the id of"));
  o = run(lift + " --model " + kData + "/models/swing_crane.json");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("with other joints or cylinders"));
  o = run("benchmark " + at("nothing.yaml"));
  EXPECT_EQ(o.code, 3);
  EXPECT_EQ(run("benchmark").code, 2);
}

TEST_F(CliBenchmark, TheOptimumIsPlannedTrackedAndPlannedAnew) {
  write("model.yaml",
        scenario("planned", "{boom: 0.5, jib: -0.9, extension: 1.2}") + "model: loader_crane\n");
  const Outcome o = run(
      "benchmark " + at("model.yaml") +
      " --seeds 1 --controllers joint_pi,tracked_optimum,replanned_optimum --json " + at("p.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json result = test_support::parsed_json(slurp(at("p.json")));
  for (const json& row : result["rows"]) EXPECT_EQ(row["status"], "done") << row.dump();
  EXPECT_GT(result["scenarios"][0]["predicted_optimum_J"].get<double>(),
            result["scenarios"][0]["bound_J"].get<double>());
  EXPECT_EQ(result["reference"], "tracked_optimum");
}

}  // namespace
}  // namespace sparflow::test
