// Runs that are killed in the middle and resumed.
#include <fcntl.h>
#include <signal.h>

#include <chrono>
#include <random>
#include <thread>

#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

const std::string kModel = kData + "/models/hmf_2020_k4_load_sensing.json";

class Resume : public Cli {
 protected:
  Resume() {
    fs::create_directories(at("set"));
    put("a", 3.4);
    put("b", 3.6);
    put("c", 3.8);
  }
  void put(const std::string& name, double goal_x) const {
    write("set/" + name + ".yaml",
          "machine: " + kData + "/machines/hmf_2020_k4_load_sensing.yaml\nmodel: " + kModel +
              "\nstart: {q: {main: 0.0, jib: -1.6}}\ngoal: {tip: [" + std::to_string(goal_x) +
              ", 0, 2.5]}\nduration_s: 25\nknots: 41\n");
  }
  std::string command(const std::string& stem) const {
    return "strategies -p " + at("set") + " --orders 0 --paths 2 --intervals 40 --processes 1" +
           " --json " + at(stem + ".json") + " --report " + at(stem + ".html");
  }
  std::size_t lines(const std::string& name) const {
    const std::string text = slurp(at(name));
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
  /// Starts the program and kills it as soon as its journal holds one finished part.
  void kill_after_first_part(const std::string& stem) const {
    kill_after_part(command(stem), stem);
  }
  void kill_after_part(const std::string& arguments, const std::string& stem) const {
    const std::string line = "exec " + kProgram + " " + arguments + " >/dev/null 2>&1";
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    while (lines(stem + ".json.journal") < 2 && ::waitpid(child, nullptr, WNOHANG) == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ASSERT_EQ(lines(stem + ".json.journal"), 2U) << "the run was not killed in the middle";
    EXPECT_FALSE(fs::exists(at(stem + ".json")));
  }
  /// The result without what depends on the clock.
  json result(const std::string& stem) const {
    json j = test_support::parsed_json(slurp(at(stem + ".json")));
    for (json& problem : j["problems"]) EXPECT_EQ(problem.erase("solve_s"), 1U);
    return j;
  }
};

TEST_F(Resume, StrategiesEqualsAnUndisturbedRunAndDeletesItsJournal) {
  kill_after_first_part("killed");
  const Outcome resumed = run(command("killed") + " --resume");
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("1 of 3 problems were finished before"));
  const Outcome undisturbed = run(command("whole"));
  ASSERT_EQ(undisturbed.code, 0) << undisturbed.err;
  EXPECT_EQ(result("killed"), result("whole"));
  EXPECT_EQ(slurp(at("killed.html")), slurp(at("whole.html")));
  EXPECT_EQ(resumed.out, undisturbed.out);
  EXPECT_FALSE(fs::exists(at("killed.json.journal")));
  EXPECT_FALSE(fs::exists(at("whole.json.journal")));
}

TEST_F(Resume, StrategiesRefusesAJournalOfOtherInputsOrOptions) {
  kill_after_first_part("killed");
  const Outcome option = run(command("killed") + " --resume --seed 5");
  EXPECT_EQ(option.code, 3);
  EXPECT_THAT(option.err, HasSubstr("other inputs or options"));
  put("b", 3.7);
  const Outcome input = run(command("killed") + " --resume");
  EXPECT_EQ(input.code, 3);
  EXPECT_THAT(input.err, HasSubstr("other inputs or options"));
  EXPECT_EQ(lines("killed.json.journal"), 2U);
}

TEST_F(Resume, ParetoKilledAtRandomEqualsAnUndisturbedRun) {
  const std::string pareto =
      "pareto -p " + kData + "/reaches/hmf_lift.yaml --points 3 --paths 2 --intervals 30";
  const auto command = [&](const std::string& stem) {
    return pareto + " --json " + at(stem + ".json") + " --report " + at(stem + ".html") + " -o " +
           at(stem + ".csv");
  };
  const Outcome undisturbed = run(command("whole"));
  ASSERT_EQ(undisturbed.code, 0) << undisturbed.err;
  std::mt19937 random(std::random_device{}());
  int kills = 0;
  for (std::size_t parts = 2; parts <= 4; ++parts) {  // each run is killed after one solve more
    const std::string line = "exec " + kProgram + " " + command("killed") +
                             (parts > 2 ? " --resume" : "") + " >/dev/null 2>&1";
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      ::_exit(127);
    }
    while (lines("killed.json.journal") < parts && ::waitpid(child, nullptr, WNOHANG) == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 300));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    kills += fs::exists(at("killed.json")) ? 0 : 1;
  }
  EXPECT_GE(kills, 1) << "no run was killed in the middle";
  const Outcome resumed = run(command("killed") + " --resume");
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  for (const char* end : {".json", ".html", ".csv"})
    EXPECT_EQ(slurp(at(std::string("killed") + end)), slurp(at(std::string("whole") + end)));
  EXPECT_EQ(resumed.out, undisturbed.out);
  EXPECT_FALSE(fs::exists(at("killed.json.journal")));
}

/// A document without what depends on the clock, wherever it stands.
json without_times(json document) {
  if (document.is_object()) document.erase("seconds");
  if (document.is_structured())
    for (json& inside : document) inside = without_times(std::move(inside));
  return document;
}

TEST_F(Resume, ImproveEqualsAnUndisturbedRunAndRefusesOtherOptions) {
  // One round adds the friction, a second diagnosis finds nothing more: the kill falls into that.
  const std::string log = kData + "/logs/loader_crane_friction_";
  ASSERT_EQ(run("fit -m " + kCrane + " -l " + log + "train.csv -o " + at("off.json")).code, 0);
  const auto command = [&](const std::string& stem) {
    return "improve --model " + at("off.json") + " --log " + log + "train.csv --test " + log +
           "test.csv -o " + at(stem + "_model.json") + " --json " + at(stem + ".json") +
           " --report " + at(stem + ".html");
  };
  const Outcome undisturbed = run(command("whole"));
  ASSERT_EQ(undisturbed.code, 0) << undisturbed.err;
  EXPECT_FALSE(fs::exists(at("whole.json.journal")));
  kill_after_part(command("killed"), "killed");
  const Outcome other = run(command("killed") + " --resume --max-steps 3");
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.err, HasSubstr("other inputs or options"));
  const Outcome resumed = run(command("killed") + " --resume");
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("1 round was finished before"));
  EXPECT_EQ(slurp(at("killed_model.json")), slurp(at("whole_model.json")));
  EXPECT_EQ(slurp(at("killed.html")), slurp(at("whole.html")));
  const json whole = without_times(test_support::parsed_json(slurp(at("whole.json"))));
  EXPECT_EQ(without_times(test_support::parsed_json(slurp(at("killed.json")))), whole);
  EXPECT_EQ(whole.at("steps").size(), 1U);
  EXPECT_FALSE(fs::exists(at("killed.json.journal")));
}

TEST_F(Resume, NeedsAnOutputBesideWhichTheJournalLies) {
  const Outcome none = run("strategies -p " + at("set") + " --resume");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("--resume needs --json"));
}

}  // namespace
}  // namespace sparflow::test
