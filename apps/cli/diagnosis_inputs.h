#pragma once
/// Inputs that diagnose, selftest, extend and improve share: a fitted model, logs by purpose, candidate effects.
#include <memory>
#include <string>
#include <vector>

#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/report/page/page.h"
#include "diagnosis/extension/extend.h"

namespace sparflow::cli {

/// The contents of all input files.
struct DiagnosisFiles {
  CraneModel model;  ///< with the user's own effects registered
  ExtendLogs logs;
  std::vector<EffectAt> candidates;  ///< empty: the whole catalogue

  /// Lists the logs with their hashes in the footer of a page.
  void write_provenance(Page& page) const;
};

/// The command-line options of one of these verbs and the files that they name.
class DiagnosisInputs {
 public:
  explicit DiagnosisInputs(std::string verb) : verb_(std::move(verb)) {}

  // Each adds one option; `what` is its help text, since the verbs use the same option for different purposes.
  void add_model(CLI::App& app);
  void add_logs(CLI::App& app, const std::string& what);
  void add_references(CLI::App& app, const std::string& what);
  void add_tests(CLI::App& app, const std::string& what);
  void add_candidates(CLI::App& app, const std::string& what);
  void add_output(CLI::App& app);
  void add_threads(CLI::App& app);
  /// Adds --mapping, --effects, --json and --report, which --help lists last.
  void add_rest(CLI::App& app);
  /// Adds --resume; the journal lies beside the JSON, the page or the model to write.
  void add_resume(CLI::App& app);
  /// @param options in words: all that the result depends on besides the files
  std::unique_ptr<Journal> open_journal(const std::string& options) const;

  /// Checks that the outputs can be written and overwrite no input, then reads all inputs.
  /// @throws UsageError when a log is given for two purposes  @throws InputError
  DiagnosisFiles read() const;

  const Outputs& outputs() const { return outputs_; }
  const std::string& output() const { return output_; }  ///< path of the model to write
  int threads() const { return threads_; }

 private:
  std::string verb_, model_, mapping_, output_;
  std::vector<std::string> logs_, references_, tests_, candidates_;
  int threads_ = 0;
  OwnEffects own_;
  Outputs outputs_;
  bool resumable_ = false;
};

/// Writes the results of extend and improve: the model, the files asked for, the table on stdout.
void write_extended(const DiagnosisInputs& inputs, const ExtendResult& result);

}  // namespace sparflow::cli
