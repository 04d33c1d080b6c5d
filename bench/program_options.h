#pragma once
/// Command lines of the benchmark programs. CLI11 is a header of templates (five seconds of each program's build), so it
/// is compiled once here, for the few kinds of options that these programs have.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "models/math/journal.h"

namespace sparflow::bench {

class ProgramOptions {
 public:
  explicit ProgramOptions(const std::string& what_it_does);
  ~ProgramOptions();

  /// Restrict the values of the option added last; each returns the object, so that calls can be chained.
  ProgramOptions& range(double lo, double hi);
  ProgramOptions& positive();
  ProgramOptions& one_of(const std::vector<std::string>& values);
  ProgramOptions& required();

  /// Adds an option ("--seed", or "name" for an argument without dashes) that sets `value`. The elements of lists are
  /// separated by commas or spaces.
  ProgramOptions& add(const std::string& name, int& value, const std::string& help);
  ProgramOptions& add(const std::string& name, std::uint64_t& value, const std::string& help);
  ProgramOptions& add(const std::string& name, double& value, const std::string& help);
  ProgramOptions& add(const std::string& name, std::string& value, const std::string& help);
  ProgramOptions& add(const std::string& name, std::vector<std::string>& value,
                      const std::string& help);
  /// Adds a flag; the name "!--no-bound" makes it set false.
  ProgramOptions& flag(const std::string& name, bool& value, const std::string& help);

  /// Adds --journal FILE, in which each finished part of a long study stands as soon as it is complete, and --resume.
  ProgramOptions& add_journal();
  /// Opens it after `parse`; without --journal it keeps nothing. It belongs to this program, to the files and to the options.
  /// @param not_of_result options that change no result ("--processes")  @throws UsageError for --resume without --journal
  std::unique_ptr<Journal> journal(const std::vector<std::string>& files,
                                   const std::vector<std::string>& not_of_result) const;

  /// @return the exit code when the program must end: 0 after --help, 2 after a wrong command line (with a message on
  /// stderr); nothing otherwise
  std::optional<int> parse(int argc, char** argv);

 private:
  struct App;
  std::unique_ptr<App> app_;
};

/// Body of a program's main(). @return the result of `run`, 2 after a UsageError, 3 after any other exception, whose
/// message is printed on stderr behind the name
int run_program(const char* name, int (*run)(int, char**), int argc, char** argv);

}  // namespace sparflow::bench
