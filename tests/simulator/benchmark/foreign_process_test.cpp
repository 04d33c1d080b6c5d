// A controller that is a process: what it does wrong is a sentence in its row, and nothing of it stays behind.
#include "simulator/controllers/foreign_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "problems/bundled.h"
#include "simulator/benchmark/closed_loop.h"
#include "simulator/benchmark/scenario_file.h"
#include "simulator/controllers/section_valves.h"

namespace sparflow::benchmark {
namespace {

using ::testing::HasSubstr;

class ForeignProcess : public ::testing::Test {
 protected:
  ForeignProcess()
      : scenario_(parse_scenario(R"(
id: lift
machine: loader_crane
start: {q: {boom: 0.2, jib: -1.2, extension: 0.6}}
payload_kg: 200
goals: [{q: {boom: 0.4, jib: -1.0, extension: 0.8}, duration_s: 10}]
tolerance_m: 0.15
)",
                                 "lift.yaml", ".", bundled_file)),
        valves_(control::sections_of(scenario_.machine)) {
    know_.machine = &scenario_.machine;
    know_.valves = &valves_;
  }
  Row run(const std::string& command, double budget = 0.5) {
    control::ForeignOptions options;
    options.step_budget = budget;
    options.start_budget = 2.0;  // as short as a busy machine allows for sh and Python
    return run_closed_loop(
        scenario_, "foreign", [&] { return control::foreign_controller(know_, command, options); },
        1);
  }
  Scenario scenario_;
  control::SectionValves valves_;
  control::Knowledge know_;
};

const std::string kReady = R"(read l; echo '{"type": "ready"}'; )";

TEST_F(ForeignProcess, TheExampleReachesItsGoal) {
  const Row row =
      run(std::string("python3 ") + SPARFLOW_SOURCE_DIR + "/examples/own_controller.py", 5.0);
  EXPECT_TRUE(row.done) << row.reason;
  EXPECT_GT(row.energy, 0.0);
}

TEST_F(ForeignProcess, OneThatHangsIsEndedWithinItsTime) {
  const auto begin = std::chrono::steady_clock::now();
  const Row row = run(kReady + "read l; sleep 100", 0.2);
  EXPECT_FALSE(row.done);
  EXPECT_THAT(row.reason, HasSubstr("gave no answer within 0.2 s at t = 0.00 s"));
  // far less than its sleep, far more than a busy machine needs
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
  EXPECT_THAT(run("sleep 100").reason, HasSubstr("gave no answer within 2 s"));
}

TEST_F(ForeignProcess, OneThatEndsIsNamedWithItsEnd) {
  EXPECT_THAT(run("exit 7").reason, HasSubstr("ended with code 7 at t = 0.00 s"));
  EXPECT_THAT(run(kReady + "read l; kill -9 $$").reason, HasSubstr("ended by signal 9"));
  EXPECT_THAT(run("no_such_program_anywhere 2>/dev/null").reason, HasSubstr("code 127"));
}

TEST_F(ForeignProcess, ItsLastMessageTellsWhyItEnded) {
  EXPECT_THAT(run("echo one >&2; echo 'no model of the pump' >&2; echo >&2; exit 3").reason,
              HasSubstr("ended with code 3 at t = 0.00 s; its last message: no model of the pump"));
  EXPECT_THAT(run(kReady + "read l; python3 -c 'import no_such_module'; exit 1", 5.0).reason,
              HasSubstr("its last message: ModuleNotFoundError: No module named"));
  EXPECT_THAT(run(kReady + "read l; echo 'still waiting' >&2; sleep 100", 0.2).reason,
              HasSubstr("no answer within 0.2 s at t = 0.00 s; its last message: still waiting"));
  // more than a pipe holds before it answers
  EXPECT_THAT(run("head -c 100000 /dev/zero >&2; read l; echo hello", 5.0).reason,
              HasSubstr("no JSON object at t = 0.00 s: hello"));
}

TEST_F(ForeignProcess, OneThatPrintsRubbishIsQuoted) {
  EXPECT_THAT(run("read l; echo hello").reason, HasSubstr("no JSON object at t = 0.00 s: hello"));
  EXPECT_THAT(run(kReady + "read l; echo '{\"v\": 1}'").reason, HasSubstr("gave no commands"));
  EXPECT_THAT(run(kReady + "read l; echo '{\"u\": {\"arm\": 1}}'").reason,
              HasSubstr("cylinder that the machine does not have at t = 0.00 s: arm"));
  EXPECT_THAT(run(kReady + "read l; echo '{\"u\": {\"boom\": \"x\"}}'").reason,
              HasSubstr("no number"));
  EXPECT_THAT(run("cat /dev/zero").reason, HasSubstr("more than 1048576 bytes"));
}

}  // namespace
}  // namespace sparflow::benchmark
