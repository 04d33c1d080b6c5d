#include "apps/cli/context.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <new>

#include "models/effects/formula/user_effect.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/machine/machine_check.h"
#include "models/math/error.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/transcription/transcription.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"

namespace sparflow::cli {
namespace {

constexpr std::chrono::seconds kPrintPeriod{10};
/// In memory shared with the child processes. A Ctrl-C at a terminal reaches all of them, one sent by another program
/// reaches this process only; therefore only this process counts, and the children read the count.
std::atomic<int>* interrupt_count = nullptr;
static_assert(std::atomic<int>::is_always_lock_free, "used in a signal handler");
volatile std::sig_atomic_t finish_first = 0;
pid_t main_process = 0;

void on_interrupt(int) {
  if (::getpid() != main_process) return;
  const int before = interrupt_count->fetch_add(1);
  if (before > 0 || finish_first == 0) ::_exit(kInterrupted);
  constexpr char kText[] =
      "\ninterrupted: finishing with the best so far; Ctrl-C again ends at once\n";
  if (::write(2, kText, sizeof kText - 1) < 0) return;
}

}  // namespace

void catch_interrupts() {
  main_process = ::getpid();
  void* shared = ::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  SPARFLOW_CHECK(shared != MAP_FAILED, "mmap found no memory for the count of interrupts");
  interrupt_count = new (shared) std::atomic<int>(0);
  std::signal(SIGINT, on_interrupt);
}
void finish_on_interrupt() { finish_first = 1; }
bool interrupted() { return interrupt_count->load() > 0; }

void warn(const std::string& sentence) { fmt::print(stderr, "warning: {}\n", sentence); }
void note(const std::string& sentence) { fmt::print(stderr, "{}\n", sentence); }

Machine load_machine_with_warnings(const std::string& path) {
  std::vector<std::string> warnings;
  Machine machine = load_machine(path, &warnings);
  for (const std::string& w : warnings) warn(w);
  return machine;
}

CraneModel load_model_with_warnings(const std::string& path) {
  CraneModel model = load_model(path);
  MachinePlaces places;
  places.file = path;
  for (const std::string& w : check_machine(model.machine, places)) warn(w);
  return model;
}

void Outputs::add_to(CLI::App& verb, bool with_report) {
  verb.add_option("--json", json, "write the result to FILE as JSON")->type_name("FILE");
  if (with_report) {
    verb.add_option("--report", report,
                    "write a page with figures to FILE.html; it needs no network")
        ->type_name("FILE.html");
  }
}

void OwnEffects::add_to(CLI::App& verb) {
  verb.add_option("--effects", files,
                  "effects of your own (YAML), added to the catalogue; may be repeated")
      ->type_name("FILE.yaml")
      ->allow_extra_args(false);
}

std::vector<const Effect*> OwnEffects::load(const Machine* machine) const {
  std::vector<const Effect*> all;
  for (const std::string& file : files) {
    for (const Effect* e : register_user_effects_file(file, machine)) all.push_back(e);
  }
  return all;
}

void OwnEffects::load_into(CraneModel& model) const {
  for (const Effect* e : load(&model.machine)) {
    const auto known = std::find(model.user_effects.begin(), model.user_effects.end(), e);
    if (known == model.user_effects.end()) model.user_effects.push_back(e);
    if (!e->places(model.machine).empty()) continue;
    warn(fmt::format("{} has no place on {}, so diagnosis does not consider it", e->info().id,
                     model.machine.name));
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
        fmt::format("cannot write: there is no folder {}; create it first", folder.string()));
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    throw InputError({path, 0, 0}, "",
                     fmt::format("cannot write: no permission in {}", folder.string()));
  }
}

bool same_file(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::equivalent(a, b, error)) return true;
  const fs::path whole_a = fs::weakly_canonical(fs::absolute(a, error), error);
  const fs::path whole_b = fs::weakly_canonical(fs::absolute(b, error), error);
  return !whole_a.empty() && whole_a == whole_b;
}

std::vector<NamedFile> named(const std::string& option, const std::vector<std::string>& paths) {
  std::vector<NamedFile> files;
  files.reserve(paths.size());
  for (const std::string& path : paths) files.push_back({option, path});
  return files;
}

void check_outputs_apart(const std::string& verb, const std::vector<NamedFile>& outputs,
                         const std::vector<NamedFile>& inputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (outputs[i].path.empty()) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (outputs[j].path.empty() || !same_file(outputs[i].path, outputs[j].path)) continue;
      throw UsageError(
          fmt::format("{}: {} and {} name the same file, {}; give each a file of its own", verb,
                      outputs[j].option, outputs[i].option, outputs[i].path));
    }
    for (const NamedFile& input : inputs) {
      if (input.path.empty() || !same_file(outputs[i].path, input.path)) continue;
      throw UsageError(fmt::format("{}: {} would overwrite the input {} (given with {})", verb,
                                   outputs[i].option, input.path, input.option));
    }
  }
}

void Outputs::check() const {
  check_writable(json);
  check_writable(report);
}

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(::isatty(2) == 1) {
  if (terminal_) return;
  fmt::print(stderr, "{} ...\n", what_);
  printer_ = std::jthread([this](const std::stop_token& stop) { print_periodically(stop); });
}

void Progress::print_periodically(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, stop, kPrintPeriod, [&] { return stop.stop_requested(); })) {
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    fmt::print(stderr, "{}: {:.0f} s, {:.0f} %{}{}\n", what_, seconds, 100.0 * share_,
               doing_.empty() ? "" : ", ", doing_);
  }
}

Progress::~Progress() {
  if (terminal_ && width_ > 0) fmt::print(stderr, "\r{:{}}\r", "", width_);
}

void Progress::operator()(double share, const std::string& what) {
  if (!terminal_) {
    const std::lock_guard lock(mutex_);
    share_ = share;
    doing_ = what;
    return;
  }
  if (share < 1.0 && std::abs(share - last_) < 0.005) return;
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
    both.model = load_model_with_warnings(model_path);
    both.problem = load_problem(problem_path, &both.model.machine);
    try {
      const std::string own = load_problem(problem_path).machine.name;
      if (own != both.model.machine.name) {
        warn(
            fmt::format("the problem names machine {}, but the model was fitted for {}; the "
                        "model's machine is used",
                        own, both.model.machine.name));
      }
    } catch (const InputError&) {
      // A problem needs no machine of its own when the model file has one.
    }
    return both;
  }
  both.problem = load_problem(problem_path);
  if (both.problem.model_path.empty()) {
    throw UsageError(
        "no model: give --model MODEL.json, or name a model in the problem file (key `model`)");
  }
  both.model = load_model_with_warnings(both.problem.model_path);
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

const SeedMotion* baseline_seed(const Seeds& seeds, const OptimizeResult& result) {
  const std::string& name =
      result.straight_line_name.empty() ? result.best_seed_name : result.straight_line_name;
  for (const SeedMotion& s : seeds.motions) {
    if (s.name == name) return &s;
  }
  return nullptr;
}

}  // namespace sparflow::cli
