#pragma once
/// Errors that a user can cause, and the check for defects of the program.
#include <stdexcept>
#include <string>
#include <vector>

namespace sparflow {

/// Place in a user's file; zero means "not known".
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

/// An error inside a short text (a unit, a formula). The caller, who knows the file, turns it into an InputError.
class TextError : public std::runtime_error {
 public:
  TextError(int column_in, const std::string& message)
      : std::runtime_error(message), column(column_in) {}
  int column;  ///< 1-based, in characters
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

/// Writes a file whole or not at all: `content` goes to a new file of unpredictable name in the same folder, to disk, and
/// then in the place of `path`, whose mode is kept. A link is followed to its target; a device, a FIFO and the program's
/// own output are written through.
/// @throws InputError when that fails; what was at `path` before is then still there
void write_file_atomically(const std::string& path, const std::string& content);

/// The whole text of a file as UTF-8 (door.h). @throws InputError when it cannot be read
std::string read_file(const std::string& path);

}  // namespace sparflow

/// Always-on invariant: a failure is a defect of the program, never of the user's input.
#define SPARFLOW_CHECK(condition, message)                                                 \
  do {                                                                                     \
    if (!(condition)) ::sparflow::check_failed(#condition, __FILE__, __LINE__, (message)); \
  } while (false)
