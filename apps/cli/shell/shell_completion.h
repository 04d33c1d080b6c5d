#pragma once
/// Scripts that complete verbs, options and their values in a shell, made of a plain description of the command line.
#include <string>
#include <vector>

namespace sparflow::cli {

/// One option of a verb. `names` are as typed, with their dashes; none: what stands without an option.
struct CompletedOption {
  std::vector<std::string> names;
  std::string help;
  bool takes_value = false;
  std::vector<std::string> values;  ///< values that are permitted; none: a file or a number
  bool takes_file = false;          ///< whether names of files are offered as values
  std::vector<std::string>
      endings;  ///< of these files, without dots, offered alone where there are such; none: any
};

struct CompletedVerb {
  std::string name, help;
  std::vector<CompletedOption> options;
  std::vector<std::string> words;    ///< what is offered where no option is begun, beside files
  std::vector<std::string> endings;  ///< of the files offered there; none: any
};

/// @return the script that bash reads at its start
std::string bash_completion(const std::vector<CompletedVerb>& verbs);
/// @return the function `_sparflow` of zsh, a file of its `fpath`
std::string zsh_completion(const std::vector<CompletedVerb>& verbs);
/// @return the lines that fish reads from its folder of completions
std::string fish_completion(const std::vector<CompletedVerb>& verbs);

}  // namespace sparflow::cli
