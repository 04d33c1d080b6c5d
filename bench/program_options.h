#pragma once
/// Command lines of the benchmark programs. CLI11 is a header of templates (five seconds of each program's build); here it is
/// compiled once, behind the few kinds of option they have.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace sparflow::bench {

class ProgramOptions {
 public:
  explicit ProgramOptions(const std::string& what_it_does);
  ~ProgramOptions();

  /// What the option added last may be; each returns the object, so that they can be chained.
  ProgramOptions& range(double lo, double hi);
  ProgramOptions& positive();
  ProgramOptions& one_of(const std::vector<std::string>& values);
  ProgramOptions& required();

  /// An option ("--seed", or "name" for an argument without dashes) that sets `value`; lists are separated by commas or spaces.
  ProgramOptions& add(const std::string& name, int& value, const std::string& help);
  ProgramOptions& add(const std::string& name, std::uint64_t& value, const std::string& help);
  ProgramOptions& add(const std::string& name, double& value, const std::string& help);
  ProgramOptions& add(const std::string& name, std::string& value, const std::string& help);
  ProgramOptions& add(const std::string& name, std::vector<std::string>& value,
                      const std::string& help);
  /// A flag; "!--no-bound" sets false.
  ProgramOptions& flag(const std::string& name, bool& value, const std::string& help);

  /// @return the exit code to end with: 0 after --help, 2 after a wrong command line (said on stderr); nothing to go on.
  std::optional<int> parse(int argc, char** argv);

 private:
  struct App;
  std::unique_ptr<App> app_;
};

/// A program's main: what `run` returns; 2 after a UsageError, 3 after any other, said on stderr behind the name.
int run_program(const char* name, int (*run)(int, char**), int argc, char** argv);

}  // namespace sparflow::bench
