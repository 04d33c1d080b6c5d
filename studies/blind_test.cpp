/// The blind test of diagnosis on logs with a hidden effect from simulator/hidden_effects, which shares no law with the
/// catalogue. Prints one line for each run, then the table with the required values.
///   build/bench/blind_test --runs 40 --seed 1000 [--rows none,clear,small,outside,pairs,fault] [--way both] [--json F]
/// --ways bic,gp,correlation tests the baseline methods (studies/baseline_methods.h) instead, on the same logs.
/// Seeds on which thresholds were chosen: docs/blind_test.md.
#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <limits>
#include <mutex>
#include <thread>

#include "bench/program_options.h"
#include "models/math/error.h"
#include "studies/blind_table.h"

namespace {

using namespace sparflow;
using namespace sparflow::bench;

struct Options {
  int runs = 40, none = 0, jobs = 2;
  std::uint64_t seed = 1000;
  BlindCase how;
  std::vector<std::string> rows = {"none", "clear", "small", "outside", "pairs", "fault"};
  std::vector<std::string> ways = {"ours"};
  std::string way = "both", json;
  bool verbose = false, no_time = false;
};

/// Lists the cases; with --way both, every other seed has a reference log.
std::vector<BlindCase> cases_of(const Options& options) {
  std::vector<BlindCase> cases;
  // All rows of a seed are neighbours, so that an interrupted test still gives a table.
  for (int i = 0; i < std::max(options.runs, options.none); ++i) {
    for (const std::string& row : options.rows) {
      if (i >= options.runs && row != "none") continue;
      for (const std::string& judge : options.ways) {
        BlindCase one = options.how;
        one.row = row;
        one.judge = judge;
        one.reference = options.way == "reference" || (options.way == "both" && i % 2 == 0);
        const int step = options.way == "both" ? i : 2 * i + (one.reference ? 0 : 1);
        one.seed = options.seed + static_cast<std::uint64_t>(step);
        if (judge == "gp" && !one.reference) continue;  // gp needs a model from before the effect.
        cases.push_back(std::move(one));
      }
    }
  }
  return cases;
}

/// Set by Ctrl-C: the current runs are finished, then the table of all finished runs is printed.
volatile std::sig_atomic_t stopped = 0;

/// Name of a case in the journal.
std::string part_name(const BlindCase& c) {
  return fmt::format("{} {} {} {}", c.judge, c.row, c.seed, c.reference ? "reference" : "alone");
}

/// Runs all cases that the journal lacks on `jobs` threads and prints their lines in the order of the cases.
/// @return the finished runs
std::vector<BlindRun> run_all(const std::vector<BlindCase>& cases, const Options& options,
                              Journal& journal) {
  std::vector<BlindRun> runs(cases.size());
  std::vector<bool> done(cases.size(), false);
  std::mutex mutex;
  std::condition_variable ready;
  std::size_t next = 0, finished = cases.size();
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::jthread> pool;
  pool.reserve(static_cast<std::size_t>(options.jobs));
  for (int j = 0; j < options.jobs; ++j) {
    pool.emplace_back([&] {
      for (;;) {
        std::size_t i = 0;
        {
          const std::lock_guard lock(mutex);
          if (next == cases.size() || stopped != 0) {
            finished = std::min(finished, next);
            ready.notify_one();
            return;
          }
          i = next++;
        }
        BlindRun run = unpack_run(cases[i], journal.kept(part_name(cases[i]), [&] {
          return Journal::Part{pack_run(run_blind(cases[i])), true};
        }));
        const std::lock_guard lock(mutex);
        runs[i] = std::move(run);
        done[i] = true;
        ready.notify_one();
      }
    });
  }
  for (std::size_t i = 0; i < cases.size(); ++i) {
    std::unique_lock lock(mutex);
    ready.wait(lock, [&] { return done[i] || i >= finished; });
    if (i >= finished) break;
    if (options.verbose) fmt::print("\n{}", runs[i].details);
    fmt::print("{}", run_line(runs[i]));
    std::fflush(stdout);
    const double passed =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print(stderr, "\r{} of {} runs, {:.0f} s, about {:.0f} s left ", i + 1, cases.size(),
               passed,
               passed * static_cast<double>(cases.size() - i - 1) / static_cast<double>(i + 1));
  }
  fmt::print(stderr, "\n");
  pool.clear();
  runs.resize(finished);
  return runs;
}

int run(int argc, char** argv) {
  bench::ProgramOptions app("Blind test of diagnosis on simulated logs with a hidden effect");
  Options options;
  app.add("--runs", options.runs, "runs of each row, with and without a reference in turn");
  app.add("--none", options.none, "runs of row none, if more than --runs");
  app.add("--seed", options.seed, "first seed");
  app.add("--seconds", options.how.seconds, "length of a log [s]");
  app.add("--noise", options.how.noise, "sensor noise, 1 = 0.8 bar");
  app.add("--rows", options.rows, "none, clear, small, outside, pairs, fault");
  app.add("--way", options.way, "reference, alone or both").one_of({"reference", "alone", "both"});
  app.add("--ways", options.ways,
          "method: ours, and for comparison truth (is given the ids, tests extend alone), bic, gp, "
          "correlation (docs/blind_test.md)")
      .one_of({"ours", "truth", "bic", "gp", "correlation"});
  app.add("--only", options.how.only, "id of the only effect to hide");
  app.add("--missing", options.how.leave_out, "columns to leave out of the logs")
      .one_of({"rod", "payload", "commands", "oil", "pump"});
  app.add("--jobs", options.jobs, "runs in parallel").range(1, 64);
  app.add("--json", options.json, "file for all runs and the table (JSON)");
  app.add_journal();
  app.add("--write", options.how.folder, "folder for the logs and machine of every case");
  bool no_extend = false;
  app.flag("--no-extend", no_extend, "diagnose only: faster, without the measures on the test log");
  app.flag("--no-time", options.no_time, "do not time a diagnosis at the end");
  app.flag("-v,--verbose", options.verbose, "print the whole diagnosis of each run");
  if (const auto code = app.parse(argc, argv)) return *code;
  options.how.extend = !no_extend;

  std::signal(SIGINT, [](int) { stopped = 1; });
  std::signal(SIGTERM, [](int) { stopped = 1; });
  const std::unique_ptr<Journal> journal =
      app.journal({}, {"--runs", "--none", "--jobs", "--json", "-v", "--verbose", "--no-time"});
  const std::vector<BlindRun> all = run_all(cases_of(options), options, *journal);
  nlohmann::json json;
  json["runs"] = nlohmann::json::array();
  json["table"] = nlohmann::json::array();
  for (const BlindRun& r : all) json["runs"].push_back(run_json(r));
  for (const std::string& judge : options.ways) {
    std::vector<BlindRun> own;
    for (const BlindRun& r : all) {
      if (r.asked.judge == judge && r.left_out.empty()) own.push_back(r);
    }
    if (judge == "gp") {
      fmt::print("\n{}", absorbed_text(own));
      continue;
    }
    double seconds = std::numeric_limits<double>::quiet_NaN();
    if (judge == "ours" && !options.no_time &&
        stopped == 0) {  // median of three, with nothing else running
      std::vector<double> times;
      for (std::uint64_t k = 0; k < 3; ++k)
        times.push_back(time_of_diagnosis(options.seed + 2 * k));
      std::sort(times.begin(), times.end());
      seconds = times[1];
    }
    const std::vector<Measure> table = blind_table(own, seconds);
    if (judge == "ours") fmt::print("\n{}", coverage_text(own));
    fmt::print("\n{}", table_text(table, judge));
    std::vector<SaidEffect> said;
    for (const BlindRun& r : own) said.insert(said.end(), r.said.begin(), r.said.end());
    if (judge == "ours" && !said.empty()) fmt::print("\n{}", reliability_text(said));
    for (auto& line : table_json(table, judge)) json["table"].push_back(std::move(line));
  }
  if (!options.json.empty()) write_file_atomically(options.json, json.dump(1) + "\n");
  if (stopped == 0) journal->remove();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return sparflow::bench::run_program("blind_test", run, argc, argv);
}
