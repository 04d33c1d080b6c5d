#pragma once
/// Errors a user can cause, and the one check for errors only we can cause.
#include <stdexcept>
#include <string>
#include <vector>

namespace sparflow {

/// Where in a user's file something was found; zero means "not known".
struct FilePlace {
  std::string file;
  int line = 0;    ///< 1-based
  int column = 0;  ///< 1-based
};

/// Bad input file or data (exit code 3). `what()` is one sentence: place, key, found, expected, remedy,
/// e.g. `crane.yaml:42:9: cylinders[boom].bore: got -0.18, expected a positive length [m]`.
class InputError : public std::runtime_error {
 public:
  InputError(FilePlace where, std::string key_path, const std::string& message);
  FilePlace place;
  std::string key;
};

/// Wrong use of the program (exit code 2).
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

[[noreturn]] void check_failed(const char* expression, const char* file, int line,
                               const std::string& message);

/// The candidate nearest to `word` (edit distance), or "" when none is near enough to suggest.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

/// Writes `content` beside `path` and renames it into place, so nothing half-written is ever seen.
/// @throws InputError when the folder cannot be written
void write_file_atomically(const std::string& path, const std::string& content);

/// Whole file as bytes. @throws InputError "cannot read"
std::string read_file(const std::string& path);

}  // namespace sparflow

/// Always-on invariant: a failure is a defect of the program, never of the user's input.
#define SPARFLOW_CHECK(condition, message)                                                 \
  do {                                                                                     \
    if (!(condition)) ::sparflow::check_failed(#condition, __FILE__, __LINE__, (message)); \
  } while (false)
