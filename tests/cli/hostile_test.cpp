/// Runs the program on hostile input, full disks and closed streams, and ends it while it works.
#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "tests/cli/cli_fixture.h"

namespace sparflow::test {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

class HostileCli : public Cli {
 protected:
  /// Runs a line of shell in which $S is the program. @return its exit code, and what it wrote to stdout and stderr
  Outcome shell(const std::string& line) const {
    const std::string command = "S=" + kProgram + "; cd " + folder_.string() + "; { " + line +
                                "; } >" + at(".out") + " 2>" + at(".err");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
            slurp(folder_ / ".out"), slurp(folder_ / ".err")};
  }
  /// The line of shell under a limit of address space, in KiB. AddressSanitizer reserves more than any limit that bites,
  /// so that under it the program runs without one.
  static std::string within_memory(int kib, const std::string& line) {
    return kSanitized ? line : "ulimit -v " + std::to_string(kib) + "; " + line;
  }
  /// Shell that waits until process $p catches `signal` (a busy machine may take a second to start it), then for `seconds`,
  /// sends it the signal, and ends with the exit code of the process.
  static std::string send(int signal, double seconds) {
    const unsigned bit = 1U << unsigned(signal - 1);
    return "until [ $((0x$(sed -n 's/^SigCgt:[[:space:]]*//p' /proc/$p/status) & " +
           std::to_string(bit) + ")) -ne 0 ]; do kill -0 $p || exit 1; sleep 0.02; done; sleep " +
           std::to_string(seconds) + "; kill -" + std::to_string(signal) + " $p; wait $p";
  }
  std::string fit(const std::string& rest) const {
    return "$S fit -m " + kCrane + " -l " + at("short.csv") + " " + rest;
  }
  /// The first rows of the bundled log.
  void write_short_log(int rows = 1500) const {
    const std::string all = slurp(kTrain);
    std::size_t end = 0;
    for (int i = 0; i <= rows; ++i) end = all.find('\n', end) + 1;
    write("short.csv", all.substr(0, end));
  }
};

TEST_F(HostileCli, AFullStandardOutputIsAnError) {
  for (const char* line : {"$S effects >/dev/full", "$S --help >/dev/full", "$S effects >&-"}) {
    const Outcome o = shell(line);
    EXPECT_EQ(o.code, 3) << line;
    EXPECT_THAT(o.err, HasSubstr("standard output: cannot write"));
  }
}

TEST_F(HostileCli, AFullOrClosedStandardErrorEndsNoRun) {
  write_short_log();
  for (const char* where : {"2>/dev/full", "2>&-", "2>&1 >/dev/null | true"}) {
    std::remove(at("m.json").c_str());
    const Outcome o = shell(fit("-o m.json --json f.json " + std::string(where)));
    EXPECT_EQ(o.code, 0) << where;
    EXPECT_TRUE(json::accept(slurp(at("m.json")))) << where;
  }
}

TEST_F(HostileCli, AFullDiskUnderAnOutputIsAnErrorAndStaysADevice) {
  EXPECT_EQ(shell("$S effects --json /dev/full").code, 3);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(HostileCli, OutputsGoThroughLinksAndFifosAndKeepTheirMode) {
  write("target", "before");
  ::chmod(at("target").c_str(), 0600);
  fs::create_symlink("target", at("link"));
  EXPECT_EQ(shell("$S effects --json link").code, 0);
  EXPECT_TRUE(fs::is_symlink(at("link")));
  EXPECT_TRUE(json::accept(slurp(at("target"))));
  struct stat about {};
  ASSERT_EQ(::stat(at("target").c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 07777U, 0600U);
  const Outcome piped = shell(
      "mkfifo pipe; cat pipe > got & $S effects --json pipe > table; code=$?; wait; (exit $code)");
  EXPECT_EQ(piped.code, 0);
  EXPECT_TRUE(fs::is_fifo(at("pipe")));
  EXPECT_TRUE(json::accept(slurp(at("got"))));
  EXPECT_TRUE(json::accept(shell("$S effects --json /dev/stderr > table").err));
}

TEST_F(HostileCli, AnEmptyNameOfAFileIsWrongUsage) {
  const Outcome o = shell("$S effects --json ''");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("--json: got an empty text"));
}

TEST_F(HostileCli, ACsvGivenAsMachineIsRefusedAtOnce) {
  write("log.csv", "\"t_s\",\"q\"\n0,1\n");
  write("comma.yaml", ",");
  for (const char* file : {"log.csv", "comma.yaml"}) {
    const Outcome o =
        shell(within_memory(4'000'000, "$S fit -m " + std::string(file) + " -l x.csv -o y.json"));
    EXPECT_EQ(o.code, 3);
    EXPECT_THAT(o.err, HasSubstr("is the file YAML?"));
  }
}

TEST_F(HostileCli, TextThatIsNotUtf8EndsNoWork) {
  write_short_log();
  std::string machine = slurp(kCrane);
  const std::size_t name = machine.find("name:");
  machine.insert(machine.find('\n', name),
                 " Gr\xFC\xDF"
                 "e # Latin-1: \xE4\xF6\xFC");
  write("machine.yaml", machine);
  const Outcome o =
      shell("$S fit -m machine.yaml -l short.csv -o m.json --json f.json --report p.html");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.err, HasSubstr("machine.yaml: line "));
  EXPECT_THAT(o.err, HasSubstr("Windows-1252"));
  EXPECT_TRUE(json::accept(slurp(at("m.json"))));
  EXPECT_EQ(shell("$S compare --model m.json -l short.csv --json c.json").code, 0);
}

TEST_F(HostileCli, NamesOfFilesThatAreNotUtf8EndNoWork) {
  write_short_log();
  const Outcome o = shell("cp short.csv $(printf 'l\\374.csv'); $S fit -m " + kCrane +
                          " -l $(printf 'l\\374.csv') -o m.json --json f.json --report p.html");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(json::accept(slurp(at("m.json"))));
  EXPECT_TRUE(json::accept(slurp(at("f.json"))));
}

TEST_F(HostileCli, AbsurdPressuresAreASentenceAboutUnits) {
  write_short_log(200);
  const std::string all = slurp(at("short.csv"));
  std::string scaled = all.substr(0, all.find('\n') + 1);
  std::istringstream lines(all.substr(scaled.size()));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::string cell;
    for (int i = 0; std::getline(cells, cell, ','); ++i) {
      scaled += (i == 0 ? "" : ",") + cell + (i >= 7 && i <= 13 ? "e300" : "");
    }
    scaled += '\n';
  }
  write("short.csv", scaled);
  const Outcome o = shell(fit("-o m.json"));
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("check the unit"));
}

TEST_F(HostileCli, MemoryThatEndsIsNoDefectOfTheProgram) {
  if (kSanitized) GTEST_SKIP() << "AddressSanitizer needs more address space than the limit leaves";
  std::string text = slurp(kTrain);
  const std::string header = text.substr(0, text.find('\n') + 1), rows = text.substr(header.size());
  // twenty megabytes of text need more than the limit leaves
  std::string big = header;
  big.reserve(32U << 20U);
  double t = 0.0;
  while (big.size() < (20U << 20U)) {
    std::istringstream lines(rows);
    for (std::string line; std::getline(lines, line); t += 0.02) {
      big += std::to_string(t) + line.substr(line.find(',')) + "\n";
    }
  }
  write("short.csv", big);
  const Outcome o = shell(within_memory(180'000, fit("-o m.json")));
  EXPECT_EQ(o.code, 3) << o.err;
  EXPECT_THAT(o.err, HasSubstr("out of memory: "));
  EXPECT_THAT(o.err, Not(HasSubstr("defect of the program")));
}

TEST_F(HostileCli, MemoryThatEndsWhileThreadsBeginIsNoDefectOfTheProgram) {
  if (kSanitized) GTEST_SKIP() << "AddressSanitizer needs more address space than the limit leaves";
  write_short_log(3000);
  int ended = 0;
  for (int limit = 70'000; limit <= 140'000; limit += 10'000) {
    const Outcome o = shell(within_memory(limit, fit("-o m.json")));
    EXPECT_NE(o.code, 1) << limit << " kB: " << o.err;
    EXPECT_THAT(o.err, Not(HasSubstr("defect of the program")));
    ended += o.code == 3 ? 1 : 0;
  }
  EXPECT_GE(ended, 1);
}

TEST_F(HostileCli, MessagesAreClippedAndShowNoEscape) {
  write("m.yaml", "name: x\njoints: \"" + std::string(1'600'000, 'x') + "\\e]0;owned\\a\"\n");
  const Outcome o = shell("$S fit -m m.yaml -l x.csv -o y.json; $S \"$(printf 'a\\033[2Jb')\"");
  EXPECT_LT(o.err.size(), 10'000U);
  EXPECT_THAT(o.err, Not(HasSubstr("\x1b")));
}

TEST_F(HostileCli, SigtermEndsLikeCtrlC) {
  const Outcome o = shell("$S simulate -m " + kCrane + " --seconds 100000 -o l.csv & p=$!; " +
                          send(SIGTERM, 0.3));
  EXPECT_EQ(o.code, 130);
}

/// Work that a signal ends: what it leaves says so.
class InterruptedCli : public HostileCli {
 protected:
  InterruptedCli() { write("p.yaml", reach("loader_crane_lift")); }
  /// Ends `arguments` by Ctrl-C after a while.
  Outcome interrupted_after(double seconds, const std::string& arguments) const {
    return shell("$S " + arguments + " & p=$!; " + send(SIGINT, seconds));
  }
  json document(const std::string& name) const { return json::parse(slurp(folder_ / name)); }
};

TEST_F(InterruptedCli, ParetoSaysThatItIsNotWhole) {
  const Outcome o = interrupted_after(
      1.5, "pareto -p p.yaml --model " + model() + " --points 150 --json c.json --report c.html");
  EXPECT_EQ(o.code, 130);
  EXPECT_EQ(document("c.json").at("interrupted"), true);
  EXPECT_NE(document("c.json").at("status"), "optimal");
  EXPECT_THAT(slurp(at("c.html")), HasSubstr("Interrupted: "));
}

TEST_F(InterruptedCli, StrategiesSayThatTheyAreNotWhole) {
  write("q.yaml", reach("loader_crane_lift"));
  const Outcome o = interrupted_after(
      2.5,  // of 22 s, and late enough for a machine that other programs keep busy
      "strategies -p p.yaml q.yaml --time equal,1.1,1.2,1.3,1.5,2,3,4 --model " + model() +
          " --json s.json --report s.html");
  EXPECT_EQ(o.code, 130);
  EXPECT_EQ(document("s.json").at("interrupted"), true);
  EXPECT_THAT(slurp(at("s.html")), HasSubstr("Interrupted: "));
}

TEST_F(InterruptedCli, AWholeResultSaysThatToo) {
  EXPECT_EQ(
      shell("$S optimize -p p.yaml --model " + model() + " --json o.json --report o.html").code, 0);
  EXPECT_EQ(document("o.json").at("interrupted"), false);
  EXPECT_THAT(slurp(at("o.html")), Not(HasSubstr("Interrupted: ")));
}

TEST_F(InterruptedCli, TheBoundEndsWithinASecond) {
  // on a terminal, since only there the progress says at once which part has begun
  const Outcome o = shell(
      "export S; script -qfec 'echo $$ > pid; exec $S optimize -p p.yaml --bound --model " +
      model() +
      " --json o.json --report o.html' screen > /dev/null & p=$!;"
      " for i in $(seq 600); do grep -q 'bound [ 0-9]*%' screen && break; sleep 0.1; done;"
      " kill -INT $(cat pid); date +%s.%N > begin; wait $p; c=$?; date +%s.%N > end; exit $c");
  EXPECT_EQ(o.code, 130);
  EXPECT_EQ(document("o.json").at("interrupted"), true);
  EXPECT_GT(document("o.json").at("energy_J").get<double>(), 0.0);  // the solve had ended
  EXPECT_FALSE(document("o.json").contains("lower_bound_J"));
  // one second to end, one for a busy machine
  EXPECT_LT(std::stod(slurp(at("end"))) - std::stod(slurp(at("begin"))), 2.0);
}

TEST_F(InterruptedCli, AChildThatWasKilledIsNoSuccess) {
  write("q.yaml", reach("loader_crane_lift"));
  const Outcome o = shell(
      "$S strategies -p p.yaml q.yaml --processes 2 --model " + model() +
      " --json s.json & p=$!; until pgrep -P $p > children; do kill -0 $p || exit 1; sleep 0.02;"
      " done; kill -KILL $(head -1 children); wait $p");
  EXPECT_EQ(o.code, 4);
  EXPECT_THAT(o.err, HasSubstr("ended by signal 9"));
}

TEST_F(InterruptedCli, PagesAreTheSameFromRunToRun) {
  write_short_log(6000);
  std::string first;
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(shell(fit("-o m.json --report f.html")).code, 0);
    EXPECT_EQ(shell("$S optimize -p p.yaml --model m.json --report o.html").code, 0);
    EXPECT_EQ(shell("$S compare --model m.json -l short.csv --report c.html").code, 0);
    const std::string all = slurp(at("f.html")) + slurp(at("o.html")) + slurp(at("c.html"));
    if (i == 0) {
      first = all;
    } else {
      EXPECT_TRUE(first == all);
    }
  }
}

TEST_F(InterruptedCli, ImproveKeepsTheStepsDone) {
  const std::string logs = kData + "/logs/loader_crane_friction_";
  ASSERT_EQ(shell("$S fit -m " + kCrane + " -l " + logs + "train.csv -o off.json").code, 0);
  const std::string command = "improve --model off.json --log " + logs + "train.csv --test " +
                              logs + "test.csv -o better.json --json i.json --report i.html";
  ASSERT_EQ(shell("$S " + command).code, 0);
  const json whole = document("i.json");
  EXPECT_EQ(whole.at("interrupted"), false);
  ASSERT_FALSE(whole.at("steps").empty());
  // after half of the time the first step is done or is being made
  const Outcome o = interrupted_after(0.5 * whole.at("seconds").get<double>(), command);
  EXPECT_EQ(o.code, 130);
  const json cut = document("i.json");
  EXPECT_EQ(cut.at("interrupted"), true);
  EXPECT_THAT(slurp(at("i.html")), HasSubstr("Interrupted: "));
  EXPECT_LE(cut.at("steps").size(), whole.at("steps").size());
  for (std::size_t i = 0; i < cut.at("steps").size(); ++i)
    EXPECT_EQ(cut.at("steps")[i].at("added"), whole.at("steps")[i].at("added"));
  EXPECT_TRUE(json::accept(slurp(at("better.json"))));
}

}  // namespace
}  // namespace sparflow::test
