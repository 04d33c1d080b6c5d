#pragma once
/// What diagnose, selftest, extend and improve share: a fitted model, logs in their parts, effects to choose from.
#include <string>
#include <vector>

#include "apps/cli/context.h"
#include "apps/report/page/page.h"
#include "diagnosis/extension/extend.h"

namespace sparflow::cli {

/// Everything read.
struct DiagnosisFiles {
  CraneModel model;  ///< knows the user's effects
  std::vector<Log> logs, references, tests;
  std::vector<EffectAt> candidates;  ///< empty: the whole catalogue

  /// Names the logs at the end of a page.
  void write_provenance(Page& page) const;
};

/// The options of one such verb and the files they name.
class DiagnosisInputs {
 public:
  explicit DiagnosisInputs(std::string verb) : verb_(std::move(verb)) {}

  // Each adds one option; what it does for the verb is said in its own words.
  void add_model(CLI::App& app);
  void add_logs(CLI::App& app, const std::string& what);
  void add_references(CLI::App& app, const std::string& what);
  void add_tests(CLI::App& app, const std::string& what);
  void add_candidates(CLI::App& app, const std::string& what);
  void add_output(CLI::App& app);
  void add_threads(CLI::App& app);
  /// --mapping, --effects, --json, --report; last.
  void add_rest(CLI::App& app);

  /// Checks before anything is read: outputs can be written and overwrite no input. Then reads all.
  /// @throws UsageError when a log is given twice for different purposes
  DiagnosisFiles read() const;

  const Outputs& outputs() const { return outputs_; }
  const std::string& output() const { return output_; }  ///< model to write
  int threads() const { return threads_; }

 private:
  std::string verb_, model_, mapping_, output_;
  std::vector<std::string> logs_, references_, tests_, candidates_;
  int threads_ = 0;
  OwnEffects own_;
  Outputs outputs_;
};

/// Without references: says on stderr what a model that was not fitted on one of the logs can be a reference for.
void say_what_is_reference(const DiagnosisFiles& files);

/// What extend and improve end with: the model, the files asked for, the table on stdout.
void write_extended(const DiagnosisInputs& inputs, const ExtendResult& result);

/// "2025-03-14", today, for a model's record.
std::string today();

}  // namespace sparflow::cli
