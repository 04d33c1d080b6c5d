#pragma once
/// Files that a verb writes: the options that name them, and checks before any long work.
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

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
  void add_to(CLI::App& verb, bool with_report = true);
  /// Checks, before any long work, that these files can be written. @throws InputError
  void check() const;
  std::vector<NamedFile> files() const { return {{"--json", json}, {"--report", report}}; }
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

}  // namespace sparflow::cli
