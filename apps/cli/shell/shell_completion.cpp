#include "apps/cli/shell/shell_completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace sparflow::cli {
namespace {

std::string names_of(const std::vector<CompletedVerb>& verbs) {
  std::vector<std::string> names;
  names.reserve(verbs.size());
  for (const CompletedVerb& verb : verbs) names.push_back(verb.name);
  return fmt::format("{}", fmt::join(names, " "));
}

/// A text between single quotes, as bash and zsh read it.
std::string in_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// A text between single quotes, as fish reads it.
std::string in_fish_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

/// A description inside an entry of zsh's `_arguments`, where brackets and colons have a meaning.
std::string zsh_escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

/// Sets `files` to the endings that are offered, or to `*` for any.
std::string bash_files(const std::vector<std::string>& endings) {
  if (endings.empty()) return "files='*' ";
  return fmt::format("files={} ", in_quotes(fmt::format("{}", fmt::join(endings, " "))));
}

std::string bash_verb(const CompletedVerb& verb) {
  std::string all, cases;
  for (const CompletedOption& option : verb.options) {
    if (option.names.empty()) continue;
    all += fmt::format("{} ", fmt::join(option.names, " "));
    if (!option.takes_value) continue;
    const std::string offer =
        option.values.empty()
            ? fmt::format("{}words=", option.takes_file ? bash_files(option.endings) : "")
            : fmt::format("words={}", in_quotes(fmt::format("{}", fmt::join(option.values, " "))));
    cases += fmt::format("        {}) {} ;;\n", fmt::join(option.names, "|"), offer);
  }
  // a verb whose words are known takes no file
  const std::string rest =
      fmt::format("words={} {}", in_quotes(fmt::format("{}", fmt::join(verb.words, " "))),
                  verb.words.empty() ? bash_files(verb.endings) : "files=");
  return fmt::format(
      "    {})\n"
      "      options={}\n"
      "      {}\n"
      "      case $before in\n"
      "        -*) files= ;;&\n"
      "{}"
      "        -*) {} ;;\n"
      "      esac\n"
      "      ;;\n",
      verb.name, in_quotes(all), rest, cases, rest);
}

/// zsh offers any file where none has such an ending.
std::string zsh_files(const std::vector<std::string>& endings) {
  if (endings.empty()) return "_files";
  return fmt::format("_files -g \"*.({})\"", fmt::join(endings, "|"));
}

std::string zsh_value(const CompletedOption& option) {
  if (!option.values.empty()) return fmt::format(":value:({})", fmt::join(option.values, " "));
  return option.takes_file ? ":file:" + zsh_files(option.endings) : ":value: ";
}

std::string zsh_verb(const CompletedVerb& verb) {
  std::string out = fmt::format("    {})\n      _arguments -S \\\n", verb.name);
  for (const CompletedOption& option : verb.options) {
    for (const std::string& name : option.names) {
      out += fmt::format("        {} \\\n",
                         in_quotes(fmt::format("*{}[{}]{}", name, zsh_escaped(option.help),
                                               option.takes_value ? zsh_value(option) : "")));
    }
  }
  const std::string rest = verb.words.empty()
                               ? "*:file:" + zsh_files(verb.endings)
                               : fmt::format("*:word:({})", fmt::join(verb.words, " "));
  return out + fmt::format("        {}\n      ;;\n", in_quotes(rest));
}

/// The part of a fish line that names an option: `-s m -l machine`.
std::string fish_names(const CompletedOption& option) {
  std::string out;
  for (const std::string& name : option.names) {
    out += name.rfind("--", 0) == 0 ? " -l " + name.substr(2) : " -s " + name.substr(1);
  }
  return out;
}

}  // namespace

std::string bash_completion(const std::vector<CompletedVerb>& verbs) {
  std::string cases;
  for (const CompletedVerb& verb : verbs) cases += bash_verb(verb);
  return fmt::format(
      "# bash completion of sparflow; written by `sparflow completion bash`\n"
      "_sparflow() {{\n"
      "  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} options= "
      "words= files=\n"
      "  # bash takes `--option=value` for three words\n"
      "  if [[ $word == \"=\" ]]; then word=; fi\n"
      "  if [[ $before == \"=\" ]]; then before=${{COMP_WORDS[COMP_CWORD-2]}}; fi\n"
      "  COMPREPLY=()\n"
      "  if [[ $COMP_CWORD == 1 ]]; then\n"
      "    COMPREPLY=($(compgen -W {} -- \"$word\"))\n"
      "    return\n"
      "  fi\n"
      "  case ${{COMP_WORDS[1]}} in\n"
      "    help) words={} ;;\n"
      "{}"
      "  esac\n"
      "  if [[ $word == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
      "    return\n"
      "  fi\n"
      "  # of a list, the word behind the last comma\n"
      "  local list=\n"
      "  if [[ -n $words && $word == *,* ]]; then list=${{word%,*}},; fi\n"
      "  COMPREPLY=($(compgen -P \"$list\" -W \"$words\" -- \"${{word#\"$list\"}}\"))\n"
      "  if [[ -z $files ]]; then return; fi\n"
      "  compopt -o filenames 2>/dev/null\n"
      "  local -a endings found=()\n"
      "  read -ra endings <<<\"$files\"\n"
      "  local IFS=$'\\n' ending\n"
      "  if [[ $files != '*' ]]; then\n"
      "    for ending in \"${{endings[@]}}\"; do\n"
      "      found+=($(compgen -f -X \"!*.$ending\" -- \"$word\"))\n"
      "    done\n"
      "    # where no file has such an ending, any is offered\n"
      "    if [[ ${{#found[@]}} != 0 ]]; then found+=($(compgen -d -- \"$word\")); fi\n"
      "  fi\n"
      "  if [[ ${{#found[@]}} == 0 ]]; then found=($(compgen -f -- \"$word\")); fi\n"
      "  COMPREPLY+=(\"${{found[@]}}\")\n"
      "}}\n"
      "complete -F _sparflow sparflow\n",
      in_quotes(names_of(verbs) + " help"), in_quotes(names_of(verbs)), cases);
}

std::string zsh_completion(const std::vector<CompletedVerb>& verbs) {
  std::string described, cases;
  for (const CompletedVerb& verb : verbs) {
    described += fmt::format("    {}\n", in_quotes(verb.name + ":" + verb.help));
    cases += zsh_verb(verb);
  }
  return fmt::format(
      "#compdef sparflow\n"
      "# zsh completion of sparflow; written by `sparflow completion zsh`\n"
      "_sparflow() {{\n"
      "  local -a verbs\n"
      "  verbs=(\n{}  )\n"
      "  if (( CURRENT == 2 )); then\n"
      "    _describe verb verbs\n"
      "    return\n"
      "  fi\n"
      "  local verb=$words[2]\n"
      "  shift words\n"
      "  (( CURRENT-- ))\n"
      "  case $verb in\n"
      "    help) _describe verb verbs ;;\n"
      "{}"
      "  esac\n"
      "}}\n"
      "_sparflow \"$@\"\n",
      described, cases);
}

std::string fish_completion(const std::vector<CompletedVerb>& verbs) {
  std::string out = "# fish completion of sparflow; written by `sparflow completion fish`\n";
  for (const CompletedVerb& verb : verbs) {
    out += fmt::format("complete -c sparflow -n __fish_use_subcommand -f -a {} -d {}\n", verb.name,
                       in_fish_quotes(verb.help));
    const std::string here =
        fmt::format("complete -c sparflow -n '__fish_seen_subcommand_from {}'", verb.name);
    for (const CompletedOption& option : verb.options) {
      if (option.names.empty()) continue;
      std::string value;
      if (option.takes_value) value = option.takes_file ? " -r" : " -x";
      if (!option.values.empty()) {
        value += " -a " + in_fish_quotes(fmt::format("{}", fmt::join(option.values, " ")));
      }
      out += fmt::format("{}{}{} -d {}\n", here, fish_names(option), value,
                         in_fish_quotes(option.help));
    }
    if (!verb.words.empty()) {
      out += fmt::format("{} -f -a {}\n", here,
                         in_fish_quotes(fmt::format("{}", fmt::join(verb.words, " "))));
    }
  }
  return out;
}

}  // namespace sparflow::cli
