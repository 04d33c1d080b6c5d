// Ctrl-C, once and twice, and what long work tells of its progress.
#include <fcntl.h>

#include <random>

#include "tests/cli/running_program.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

const std::string kWall = kData + "/reaches/loader_crane_over_wall.yaml";
const std::string kFold = kData + "/reaches/loader_crane_fold.yaml";
const std::string kCraneModel = kData + "/models/loader_crane.json";

class InterruptedRun : public Cli {
 protected:
  /// Runs of minutes.
  std::vector<std::vector<std::string>> long_runs() const {
    return {
        {"optimize", "-p", kWall, "--model", kCraneModel, "--intervals", "3000", "--json",
         at("o.json")},
        {"strategies", "-p", kWall, kFold, "--model", kCraneModel, "--intervals", "800", "--json",
         at("s.json")},
        {"pareto", "-p", kFold, "--model", kCraneModel, "--points", "200", "--json", at("p.json")},
        {"improve", "--model", kCraneModel, "-l", kTrain, "-o", at("better.json")},
        {"diagnose", "--model", kCraneModel, "-l", kTrain, "--json", at("d.json")},
        {"simulate", "-m", kCrane, "--seconds", "20000", "-o", at("log.csv")}};
  }
};

TEST_F(InterruptedRun, TheSecondCtrlCEndsEveryVerbWhateverItIsDoing) {
  std::mt19937 random(1);
  // signals do not queue: on a busy machine two within some thousandths of a second arrive as one
  std::uniform_int_distribution<int> wait_ms(100, 1500), gap_ms(50, 250);
  int second = 0;
  for (const bool by_term : {false, true}) {
    for (const std::vector<std::string>& arguments : long_runs()) {
      Running program(arguments, at("out"), at("err"));
      const int wait = wait_ms(random), gap = gap_ms(random);
      std::this_thread::sleep_for(std::chrono::milliseconds(wait));
      ::kill(program.pid(), SIGINT);
      std::this_thread::sleep_for(std::chrono::milliseconds(gap));
      if (program.wait(0.05) == -1) {
        ++second;
        ::kill(program.pid(), by_term ? SIGTERM : SIGINT);
      }
      // A run that misses the signal would take minutes.
      EXPECT_EQ(program.wait(20.0), 130) << arguments[0] << " " << wait << " " << gap;
      for (int k = 0; k < 200 && program.alive() > 0; ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      EXPECT_EQ(program.alive(), 0) << arguments[0];
    }
  }
  EXPECT_GT(second, 0) << "no run lived to the second signal";
}

TEST_F(InterruptedRun, TheSecondCtrlCEndsARunWhoseMessagesNobodyReads) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  const std::string block(4096, 'x');
  while (::write(ends[1], block.data(), block.size()) > 0) {
  }
  while (::write(ends[1], "x", 1) > 0) {
  }
  ASSERT_EQ(::fcntl(ends[1], F_SETFL, 0), 0);
  int second = 0;
  // Before the verb has begun, the first Ctrl-C ends it; how long that takes depends on the machine.
  for (int ms = 300; ms < 20000 && second == 0; ms *= 2) {
    Running program({"simulate", "-m", kCrane, "--seconds", "20000", "-o", at("log.csv")},
                    at("out"), "", ends[1]);
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    ::kill(program.pid(), SIGINT);
    if (program.wait(1.0) == -1) {
      ++second;
      ::kill(program.pid(), SIGINT);
    }
    EXPECT_EQ(program.wait(20.0), 130);
  }
  EXPECT_EQ(second, 1) << "no run lived to the second signal";
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_F(InterruptedRun, StrategiesAnswerTheFirstCtrlCAtOnce) {
  // Near the wall a single start takes seconds, in which it is not asked; it is ended half a second after Ctrl-C.
  Running program({"strategies", "-p", kWall, "--model", kCraneModel, "--intervals", "800",
                   "--json", at("s.json")},
                  at("out"), at("err"));
  std::this_thread::sleep_for(std::chrono::seconds(3));
  ::kill(program.pid(), SIGINT);
  // One second is asked for; the rest is for a busy machine. Undisturbed the run takes minutes.
  EXPECT_EQ(program.wait(4.0), 130) << slurp(at("err"));
  EXPECT_EQ(test_support::parsed_json(slurp(at("s.json"))).at("interrupted"), true);
}

/// The shares in per cent that a run with a terminal has drawn, in their order.
struct Drawn {
  std::vector<int> shares;
  std::string text;
};

class LongWorkTells : public Cli {
 protected:
  /// Runs the program with a terminal, on which a line is drawn each second and at each change.
  Drawn drawn(const std::string& arguments, const std::string& line) const {
    const std::string command =
        "script -qec '" + kProgram + " " + arguments + "' " + at("typescript") + " >/dev/null 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << arguments;
    Drawn seen{{}, slurp(at("typescript"))};
    const std::regex share(line + " +([0-9]+) %");
    for (std::sregex_iterator it(seen.text.begin(), seen.text.end(), share), end; it != end; ++it)
      seen.shares.push_back(std::stoi((*it)[1]));
    EXPECT_TRUE(std::is_sorted(seen.shares.begin(), seen.shares.end()));
    return seen;
  }
};

TEST_F(LongWorkTells, StrategiesSayHowFarTheyAreInsideAProblem) {
  Drawn d = drawn("strategies -p " + kWall + " --time equal --paths 3 --orders 1 --model " +
                      kCraneModel + " --json " + at("s.json"),
                  "strategies");
  // The last line is drawn when the problem is finished.
  d.shares.erase(std::remove(d.shares.begin(), d.shares.end(), 100), d.shares.end());
  ASSERT_GE(d.shares.size(), 3U);
  EXPECT_GT(d.shares.back(), d.shares.front());
  EXPECT_GT(d.shares.back(), 20);
  EXPECT_THAT(d.text, HasSubstr("0 of 1 problem finished"));
}

TEST_F(LongWorkTells, TheBoundHasPartsAndItsTimeCounts) {
  const Drawn d =
      drawn("optimize -p " + kData + "/reaches/loader_crane_hurry.yaml --model " + kCraneModel +
                " --paths 2 --intervals 40 --bound --json " + at("o.json"),
            "bound");
  EXPECT_GE(d.shares.size(), 1U);
  EXPECT_THAT(d.text, HasSubstr("bound of the longest duration"));
  EXPECT_THAT(d.text, HasSubstr("s for the bound"));
  const json j = test_support::parsed_json(slurp(at("o.json")));
  EXPECT_GT(j.at("bound_s").get<double>(), 0.0);
  EXPECT_GT(j.at("solve_s").get<double>(), j.at("bound_s").get<double>());
}

TEST_F(LongWorkTells, ParetoForecastsTheTimeLeft) {
  Running program({"pareto", "-p", kFold, "--model", kCraneModel, "--points", "100"}, at("out"),
                  at("err"));
  // The first line off a terminal comes after ten seconds.
  EXPECT_TRUE(
      comes(at("err"), std::regex("pareto: [0-9]+ s, [0-9]+ %, about [0-9]+ s left"), 120.0))
      << slurp(at("err"));
}

}  // namespace
}  // namespace sparflow::test
