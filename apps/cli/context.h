#pragma once
/// What all verbs share: output conventions, progress, interruption, and the door to the seeds.
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "identification/log.h"
#include "optimizer/optimize.h"
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

/// Options that every verb with a result offers.
struct Outputs {
  std::string json;
  std::string report;
  void add_to(CLI::App& verb, bool with_report = true);
  /// Checks before any long work that the files can be written where they are asked for.
  void check() const;
};

/// Before long work: the folder of `path` exists and can be written.
void check_writable(const std::string& path);

/// One line on stderr that is rewritten on a terminal; silent when stderr is not one, except for begin and end.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void operator()(double share, const std::string& what);

 private:
  std::string what_;
  bool terminal_ = false;
  std::size_t width_ = 0;
  double last_ = -1.0;
};

/// True once Ctrl-C was pressed (first time: finish with the best so far; second time: the process ends).
bool interrupted();
void catch_interrupts();

/// A sentence on stderr, "warning: ...".
void warn(const std::string& sentence);
void note(const std::string& sentence);

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

/// The straight joint line of the seeds that costs least at this duration, timed; null when none holds it.
const SeedMotion* cheapest_straight_line(const Seeds& seeds, const OptimizeResult& result);

// One function a verb; each adds its subcommand and sets its callback's exit code through `code`.
void add_fit_verb(CLI::App& app, int& code);
void add_compare_verb(CLI::App& app, int& code);
void add_plan_verb(CLI::App& app, int& code);
void add_optimize_verb(CLI::App& app, int& code);
void add_demo_verb(CLI::App& app, int& code);

}  // namespace sparflow::cli
