#include <algorithm>
#include <array>

#include "apps/cli/console.h"
#include "apps/cli/shell/shell_completion.h"
#include "apps/cli/verbs.h"
#include "models/effects/registry.h"
#include "simulator/controllers/registry.h"
#include "simulator/plant/parameters/plant_effects.h"

namespace sparflow::cli {
namespace {

const std::array<const char*, 3> kShells = {"bash", "zsh", "fish"};

/// The words between the braces of a type name such as `TEXT:{operator,cycles}`.
std::vector<std::string> permitted_values(const std::string& type) {
  std::vector<std::string> out;
  const std::size_t open = type.find('{'), close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) return out;
  std::string word;
  for (std::size_t i = open + 1; i <= close; ++i) {
    if (type[i] == ',' || i == close) {
      out.push_back(word);
      word.clear();
    } else {
      word += type[i];
    }
  }
  return out;
}

/// A type's name says whether files are meant: FILE, DIR, LOG, or a file's ending.
bool is_file(const std::string& type) {
  const std::array<const char*, 5> words = {"FILE", "DIR", "LOG", ".json", ".csv"};
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return type.find(word) != std::string::npos; });
}

std::vector<std::string> effect_ids() {
  std::vector<std::string> ids;
  ids.reserve(effect_catalogue().size());
  for (const auto& effect : effect_catalogue()) ids.push_back(effect->info().id);
  return ids;
}

std::vector<std::string> plant_effect_ids() {
  std::vector<std::string> ids = {"none", "all"};
  for (const plant::PlantEffect& effect : plant::plant_effects()) ids.emplace_back(effect.name);
  return ids;
}

/// Endings of the files that an option means, by its type's name ("MODEL.json") or else its description ("logs (CSV, MAT or
/// a recording)"); none where both are silent.
std::vector<std::string> endings_of(const std::string& type, const std::string& help) {
  for (const char* ending : {"json", "csv", "html", "dbc"})
    if (type.find(std::string(".") + ending) != std::string::npos) return {ending};
  const auto says = [&](const char* words) { return help.find(words) != std::string::npos; };
  if (type.rfind("LOG", 0) == 0 || says("CSV, MAT") || help.rfind("logs", 0) == 0)
    return {"csv", "txt", "mat", "mf4", "mdf", "mcap", "asc", "log"};
  if (says("YAML") || type.find(".yaml") != std::string::npos) return {"yaml", "yml"};
  if (says("(CSV)")) return {"csv"};
  return {};
}

/// Names of the registry that an option's values are of.
std::vector<std::string> registered_values(const std::string& verb, const std::string& option,
                                           const std::string& type) {
  if (type.rfind("EFFECT", 0) == 0) return effect_ids();
  if (verb == "benchmark" && type == "NAME") return control::controller_names();
  if (verb == "simulate" && option == "--effects") return plant_effect_ids();
  return {};
}

CompletedOption completed(const std::string& verb, const CLI::Option& option) {
  CompletedOption out;
  for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  out.help = option.get_description();
  out.takes_value = option.get_items_expected_max() != 0;
  out.values = permitted_values(option.get_type_name());
  if (out.takes_value && out.values.empty()) {
    out.values =
        registered_values(verb, out.names.empty() ? "" : out.names.back(), option.get_type_name());
  }
  out.takes_file = out.takes_value && out.values.empty() && is_file(option.get_type_name());
  if (out.takes_file) out.endings = endings_of(option.get_type_name(), out.help);
  return out;
}

std::vector<CompletedVerb> described(const CLI::App& app) {
  std::vector<CompletedVerb> verbs;
  for (const CLI::App* verb : app.get_subcommands({})) {
    CompletedVerb out{verb->get_name(), verb->get_description(), {}, {}, {}};
    for (const CLI::Option* option : verb->get_options()) {
      out.options.push_back(completed(out.name, *option));
      if (option->get_positional()) out.endings = out.options.back().endings;
    }
    if (out.name == "effects") out.words = effect_ids();
    if (out.name == "completion") out.words.assign(kShells.begin(), kShells.end());
    verbs.push_back(out);
  }
  return verbs;
}

}  // namespace

void add_completion_verb(CLI::App& app, int& code) {
  auto shell = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand(
      "completion", "print the script that completes verbs and options in a shell");
  verb->add_option("shell", *shell, "the shell")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kShells.begin(), kShells.end())));
  verb->footer(
      "The Debian package installs all three. By hand:\n"
      "  sparflow completion bash >~/.local/share/bash-completion/completions/sparflow\n"
      "  sparflow completion zsh >~/.zfunc/_sparflow\n"
      "  sparflow completion fish >~/.config/fish/completions/sparflow.fish");
  verb->callback([&app, shell, &code] {
    const std::vector<CompletedVerb> verbs = described(app);
    if (*shell == "bash") tell(bash_completion(verbs));
    if (*shell == "zsh") tell(zsh_completion(verbs));
    if (*shell == "fish") tell(fish_completion(verbs));
    code = kDone;
  });
}

}  // namespace sparflow::cli
