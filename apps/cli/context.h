#pragma once
/// What all verbs share: result files, warnings and progress on stderr, interruption by Ctrl-C, seed paths.
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

/// Exit codes that docs/commands.md promises.
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

/// The options --json and --report of every verb that has a result.
struct Outputs {
  std::string json;
  std::string report;
  void add_to(CLI::App& verb, bool with_report = true);
  /// Checks, before any long work, that these files can be written. @throws InputError
  void check() const;
  std::vector<NamedFile> files() const { return {{"--json", json}, {"--report", report}}; }
};

/// Option --effects: files with effects of the user's own (docs/user_effects.md).
struct OwnEffects {
  std::vector<std::string> files;
  void add_to(CLI::App& verb);
  /// Registers them in the catalogue. @param machine against which their joints and units are checked; may be null
  /// @throws InputError
  std::vector<const Effect*> load(const Machine* machine) const;
  /// Registers them and adds them to the model, whose file then stores them. @throws InputError
  void load_into(CraneModel& model) const;
};

/// Checks, before any long work, that the folder of `path` exists and can be written. @throws InputError
void check_writable(const std::string& path);

/// Checks that no two outputs are the same file and that none overwrites an input; links and ./ are resolved.
/// @throws UsageError
void check_outputs_apart(const std::string& verb, const std::vector<NamedFile>& outputs,
                         const std::vector<NamedFile>& inputs);

/// True when both names refer to the same file, whether it exists already or not.
bool same_file(const std::string& a, const std::string& b);

/// Every path of a repeatable option.
std::vector<NamedFile> named(const std::string& option, const std::vector<std::string>& paths);

/// Progress on stderr. On a terminal it rewrites one line; elsewhere (a file, a job's log) it prints a plain line at
/// the beginning and one every ten seconds, also while nothing new is reported, to show that the work goes on.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void operator()(double share, const std::string& what);

 private:
  void print_periodically(const std::stop_token& stop);

  std::string what_;
  bool terminal_ = false;
  std::size_t width_ = 0;
  double last_ = -1.0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< guards share_ and doing_
  double share_ = 0.0;
  std::string doing_;
  std::condition_variable_any ended_;
  std::jthread printer_;  ///< declared last, so that it ends before the members that it uses
};

/// Lets Ctrl-C end the program with exit code 130 from now on.
void catch_interrupts();
/// Lets the first Ctrl-C only set interrupted() from now on, so that the verb finishes with the best result so far;
/// the second ends the program.
void finish_on_interrupt();
/// True once Ctrl-C was pressed, in child processes too.
bool interrupted();

/// Prints "warning: " and the sentence on stderr.
void warn(const std::string& sentence);
/// Prints the sentence on stderr.
void note(const std::string& sentence);

/// Reads a machine file and prints warnings about unusual values on stderr. @throws InputError
Machine load_machine_with_warnings(const std::string& path);
/// Reads a model file and prints the same warnings about its machine. @throws InputError
CraneModel load_model_with_warnings(const std::string& path);

/// Reads the logs and prints their warnings on stderr. @param mapping path of a mapping file, or empty
std::vector<Log> load_logs(const std::vector<std::string>& paths, const Machine& machine,
                           const std::string& mapping);

/// A motion problem with its model. The machine in the model file replaces the one that the problem file names.
struct ProblemAndModel {
  MotionProblem problem;
  CraneModel model;
};
ProblemAndModel load_problem_and_model(const std::string& problem_path,
                                       const std::string& model_path);

/// Seed paths of OMPL and the motions made of them by time parametrisation.
struct Seeds {
  SeedResult paths;
  std::vector<SeedMotion> motions;   ///< the paths that the limits allow to be driven
  std::vector<std::string> refused;  ///< why the other paths cannot be driven
};
Seeds make_seeds(const MotionProblem& problem, const SeedOptions& options, int intervals);

/// The seed that a page draws beside the optimum: the cheapest straight joint line at this duration, or the cheapest
/// seed where no straight line keeps the limits; null when no seed does.
const SeedMotion* baseline_seed(const Seeds& seeds, const OptimizeResult& result);

// Each of these adds the subcommand of one verb, whose callback writes its exit code to `code`.
void add_fit_verb(CLI::App& app, int& code);
void add_simulate_verb(CLI::App& app, int& code);
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
