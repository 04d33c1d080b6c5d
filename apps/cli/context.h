#pragma once
/// What all verbs share: output conventions, progress, interruption, and the door to the seeds.
#include <CLI/CLI.hpp>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "identification/log/log.h"
#include "models/chain/crane_model.h"
#include "optimizer/solve/optimize.h"
#include "planners/seed_paths.h"

namespace sparflow::cli {

/// Exit codes of the contract.
enum ExitCode {
  kDone = 0,
  kInternal = 1,
  kUsage = 2,
  kBadInput = 3,
  kNotSolved = 4,
  kVerification = 5,
  kInterrupted = 130
};

/// A file named on the command line.
struct NamedFile {
  std::string option;  ///< "--json"
  std::string path;    ///< empty: not given
};

/// Options that every verb with a result offers.
struct Outputs {
  std::string json;
  std::string report;
  void add_to(CLI::App& verb, bool with_report = true);
  /// Checks before any long work that the files can be written where they are asked for.
  void check() const;
  std::vector<NamedFile> files() const { return {{"--json", json}, {"--report", report}}; }
};

/// Option --effects: files with effects of the user's own (docs/user_effects.md).
struct OwnEffects {
  std::vector<std::string> files;
  void add_to(CLI::App& verb);
  /// Puts them into the catalogue. @param machine their joints and units are checked against it; may be null
  /// @throws InputError
  std::vector<const Effect*> load(const Machine* machine) const;
  /// The same; from then on the model carries them.
  void load_into(CraneModel& model) const;
};

/// Before long work: the folder of `path` exists and can be written.
void check_writable(const std::string& path);

/// No two outputs are one file, and none overwrites an input. Links and ./ are seen through.
/// @throws UsageError
void check_outputs_apart(const std::string& verb, const std::vector<NamedFile>& outputs,
                         const std::vector<NamedFile>& inputs);

/// True when both names lead to one file, whether it exists already or not.
bool same_file(const std::string& a, const std::string& b);

/// Every path of a repeatable option.
std::vector<NamedFile> named(const std::string& option, const std::vector<std::string>& paths);

/// One line on stderr that is rewritten on a terminal. Where stderr is none (a file, a job's log), a plain line
/// at the beginning and one every ten seconds, also while nothing new is reported: the work is alive.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void operator()(double share, const std::string& what);

 private:
  void tell_now_and_then(const std::stop_token& stop);

  std::string what_;
  bool terminal_ = false;
  std::size_t width_ = 0;
  double last_ = -1.0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< guards share_ and doing_
  double share_ = 0.0;
  std::string doing_;
  std::condition_variable_any ended_;
  std::jthread teller_;  ///< last: ends before what it uses
};

/// From now on Ctrl-C ends the program with exit code 130.
void catch_interrupts();
/// From now on the first Ctrl-C only makes interrupted() true: finish with the best so far. The second ends the program.
void finish_on_interrupt();
/// True once Ctrl-C was pressed, in child processes too.
bool interrupted();

/// A sentence on stderr, "warning: ...".
void warn(const std::string& sentence);
void note(const std::string& sentence);

/// A machine file read, with what is unusual about the machine said on stderr.
Machine load_machine_aloud(const std::string& path);
/// The same for a model and the machine it carries.
CraneModel load_model_aloud(const std::string& path);

std::vector<Log> load_logs(const std::vector<std::string>& paths, const Machine& machine,
                           const std::string& mapping);

/// Problem and model together: the model's own machine rules when there is a model.
struct ProblemAndModel {
  MotionProblem problem;
  CraneModel model;
};
ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path);

/// OMPL paths, each timed as a motion.
struct Seeds {
  SeedResult paths;
  std::vector<SeedMotion> motions;   ///< those that could be timed
  std::vector<std::string> refused;  ///< why the others could not
};
Seeds make_seeds(const MotionProblem& problem, const SeedOptions& options, int intervals);

/// What a motion is drawn beside: the straight joint line that costs least at this duration, or the best seed where
/// no straight line keeps the limits; null when no seed does.
const SeedMotion* baseline_seed(const Seeds& seeds, const OptimizeResult& result);

// One function a verb; each adds its subcommand and sets its callback's exit code through `code`.
void add_fit_verb(CLI::App& app, int& code);
void add_compare_verb(CLI::App& app, int& code);
void add_diagnose_verb(CLI::App& app, int& code);
void add_selftest_verb(CLI::App& app, int& code);
void add_extend_verb(CLI::App& app, int& code);
void add_improve_verb(CLI::App& app, int& code);
void add_effects_verb(CLI::App& app, int& code);
void add_plan_verb(CLI::App& app, int& code);
void add_optimize_verb(CLI::App& app, int& code);
void add_strategies_verb(CLI::App& app, int& code);
void add_pareto_verb(CLI::App& app, int& code);
void add_demo_verb(CLI::App& app, int& code);

}  // namespace sparflow::cli
