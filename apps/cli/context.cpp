#include "apps/cli/context.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>

#include "models/error.h"
#include "models/model_file.h"
#include "optimizer/exact_energy.h"
#include "optimizer/transcription.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow::cli {
namespace {

volatile std::sig_atomic_t interrupt_count = 0;

void on_interrupt(int) {
  interrupt_count = interrupt_count + 1;
  if (interrupt_count > 1) ::_exit(kInterrupted);
}

}  // namespace

void catch_interrupts() { std::signal(SIGINT, on_interrupt); }
bool interrupted() { return interrupt_count > 0; }

void warn(const std::string& sentence) { fmt::print(stderr, "warning: {}\n", sentence); }
void note(const std::string& sentence) { fmt::print(stderr, "{}\n", sentence); }

void Outputs::add_to(CLI::App& verb, bool with_report) {
  verb.add_option("--json", json, "write the machine-readable result to FILE")->type_name("FILE");
  if (with_report) {
    verb.add_option("--report", report, "write a self-contained page to FILE.html")
        ->type_name("FILE.html");
  }
}

void check_writable(const std::string& path) {
  if (path.empty()) return;
  namespace fs = std::filesystem;
  const fs::path folder =
      fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
  std::error_code error;
  if (fs::is_directory(path, error))
    throw InputError({path, 0, 0}, "", "cannot write: this is a folder; give a file name");
  if (!fs::is_directory(folder, error)) {
    throw InputError(
        {path, 0, 0}, "",
        fmt::format("cannot write: there is no folder {}; make it first", folder.string()));
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    throw InputError({path, 0, 0}, "",
                     fmt::format("cannot write: no permission in {}", folder.string()));
  }
}

void Outputs::check() const {
  check_writable(json);
  check_writable(report);
}

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(::isatty(2) == 1) {
  if (!terminal_) fmt::print(stderr, "{} ...\n", what_);
}

Progress::~Progress() {
  if (terminal_ && width_ > 0) fmt::print(stderr, "\r{:{}}\r", "", width_);
}

void Progress::operator()(double share, const std::string& what) {
  if (!terminal_ || (share < 1.0 && std::abs(share - last_) < 0.005)) return;
  last_ = share;
  const std::string line =
      fmt::format("{} {:3.0f} %  {}", what_, 100.0 * share, what).substr(0, 110);
  fmt::print(stderr, "\r{:{}}", line, std::max(width_, line.size()));
  std::fflush(stderr);
  width_ = line.size();
}

std::vector<Log> load_logs(const std::vector<std::string>& paths, const Machine& machine,
                           const std::string& mapping) {
  LogOptions options;
  options.mapping_file = mapping;
  std::vector<Log> logs;
  for (const std::string& path : paths) {
    logs.push_back(load_log(path, machine, options));
    for (const std::string& sentence : logs.back().warnings)
      warn(logs.back().file + ": " + sentence);
  }
  return logs;
}

ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path) {
  ProblemAndModel both;
  if (!model_path.empty()) {
    both.model = load_model(model_path);
    both.problem = load_problem(problem_path, &both.model.machine);
    try {
      const std::string own = load_problem(problem_path).machine.name;
      if (own != both.model.machine.name) {
        warn(fmt::format(
            "the problem's machine is {}, the model was fitted for {}: the model's machine is used",
            own, both.model.machine.name));
      }
    } catch (const InputError&) {
      // a problem need not name a machine of its own when the model carries one
    }
    return both;
  }
  both.problem = load_problem(problem_path);
  if (both.problem.model_path.empty()) {
    throw UsageError(
        "no model: give --model MODEL.json, or name one in the problem file (key `model`)");
  }
  both.model = load_model(both.problem.model_path);
  both.problem = load_problem(problem_path, &both.model.machine);
  return both;
}

Seeds make_seeds(const MotionProblem& problem, const SeedOptions& options, int intervals) {
  Seeds seeds;
  seeds.paths = find_seed_paths(problem, options);
  TimingOptions timing;
  timing.intervals = intervals;
  int number = 0;
  for (const SeedPath& path : seeds.paths.paths) {
    const std::string name = fmt::format("{} {}", path.planner, ++number);
    const TimedMotion timed = time_parametrise(problem, path.path, 0.0, timing);
    if (timed.motion.size() < 2) {
      seeds.refused.push_back(name + ": " + timed.message);
      continue;
    }
    seeds.motions.push_back({name, timed.motion, timed.shortest, path.planner == "straight line"});
  }
  return seeds;
}

const SeedMotion* cheapest_straight_line(const Seeds& seeds, const OptimizeResult& result) {
  for (const SeedMotion& s : seeds.motions) {
    if (s.name == result.straight_line_name) return &s;
  }
  return nullptr;
}

}  // namespace sparflow::cli
