#pragma once
/// Files that a verb writes: the options that name them, and checks before any long work.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "models/math/journal.h"

namespace sparflow::cli {

/// A file named on the command line.
struct NamedFile {
  std::string option;  ///< "--json"
  std::string path;    ///< empty: not given
};

/// The options --json and --report of every verb that has a result.
struct Outputs {
  std::string json;
  std::string report;
  bool resume = false;  ///< --resume, of verbs that have it
  void add_to(CLI::App& verb, bool with_report = true);
  /// Checks, before any long work, that these files can be written; with `--json -` texts go to stderr from now on.
  /// @throws InputError
  void check() const;
  /// Writes the result to the file of --json, or to standard output where that is "-". @throws InputError
  void write_json(const std::string& text) const;
  std::vector<NamedFile> files() const { return {{"--json", json}, {"--report", report}}; }
  /// Adds --resume, for a verb that keeps a journal of its finished parts.
  void add_resume_to(CLI::App& verb);
  /// The journal's path: beside the first of these files, else beside the verb's own output; "" where that is none, or a
  /// device or FIFO.
  std::string journal(const std::string& own = "") const;
  /// Opens the journal, and tells what it holds. @param run of run_fingerprint()
  /// @throws UsageError for --resume without an output beside which a journal can lie  @throws InputError
  /// @param own the verb's own output, as in journal()
  std::unique_ptr<Journal> open_journal(const std::string& verb, const std::string& run,
                                        const std::string& own = "") const;
};

/// Checks, before any long work, that the folder of `path` exists and can be written. @throws InputError
void check_writable(const std::string& path);

/// Checks that no two outputs are the same file and that none overwrites an input; links and ./ are resolved.
/// @throws UsageError
void check_outputs_apart(const std::string& verb, const std::vector<NamedFile>& outputs,
                         const std::vector<NamedFile>& inputs);

/// True when both names refer to the same file, whether it exists already or not.
bool same_file(const std::string& a, const std::string& b);

/// Checks that a value is a number in this range, with a message that a reader can take in.
CLI::Validator number_from(double lo, double hi);

/// Every path of a repeatable option.
std::vector<NamedFile> named(const std::string& option, const std::vector<std::string>& paths);

}  // namespace sparflow::cli
