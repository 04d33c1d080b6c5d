#pragma once
/// Every reader of the program as a function of bytes.
#include <string>
#include <vector>

namespace sparflow::fuzz {

struct Target {
  const char* name;  ///< also of its folder below tests/fuzz/corpus
  /// Reads the bytes. It returns, whatever they are: a refusal by InputError, TextError or UsageError is an answer (false), any
  /// other exception is a finding and leaves the function.
  bool (*read)(const std::string& bytes);
  std::vector<std::string> seeds;  ///< bundled files that it reads, below problems/
};

const std::vector<Target>& targets();

}  // namespace sparflow::fuzz
