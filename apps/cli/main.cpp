#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <exception>
#include <new>
#include <sstream>
#include <system_error>

#include "apps/cli/console.h"
#include "apps/cli/verbs.h"
#include "models/files/model_file.h"
#include "models/math/door.h"
#include "models/math/error.h"
#include "models/math/interruption.h"
#include "models/math/text_encoding.h"

namespace sparflow::cli {
namespace {

/// An empty value (`--json "$file"` with an unset variable) would silently mean "not given".
void refuse_empty_values(CLI::App& app) {
  for (CLI::App* verb : app.get_subcommands({})) {
    for (CLI::Option* option : verb->get_options()) {
      if (option->get_items_expected_max() == 0) continue;  // a flag
      option->check(CLI::Validator(
          [](const std::string& value) {
            return value.empty()
                       ? std::string("got an empty text; give a value, or leave the option out")
                       : std::string();
          },
          "", "not empty"));
    }
  }
}

void suggest_verb(const CLI::App& app, const std::string& given) {
  if (given == "help") return;
  std::vector<std::string> verbs;
  bool known = false;
  for (const CLI::App* verb : app.get_subcommands({})) {
    verbs.push_back(verb->get_name());
    known = known || verb->get_name() == given;
  }
  const std::string near = nearest_word(printable(given), verbs);
  if (!known && !near.empty()) complain(fmt::format("Did you mean \"sparflow {}\"?\n", near));
}

/// Suggests, for each option that the verb does not know, the one whose name is nearest.
void suggest_options(const CLI::App& app, int argc, char** argv) {
  if (argc < 2) return;
  const std::vector<const CLI::App*> verbs =
      app.get_subcommands([&](const CLI::App* v) { return v->get_name() == argv[1]; });
  if (verbs.empty()) return;
  std::vector<std::string> known;
  for (const CLI::Option* option : verbs.front()->get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  for (int i = 2; i < argc; ++i) {
    std::string given = argv[i];
    given = given.substr(0, given.find('='));
    if (given.rfind("--", 0) != 0 || given == "--") continue;
    if (std::find(known.begin(), known.end(), given) != known.end()) continue;
    const std::string near = nearest_word(printable(given), known);
    if (!near.empty()) complain(fmt::format("Did you mean {}?\n", near));
  }
}

bool is_verb(const CLI::App& app, const std::string& word) {
  const std::vector<const CLI::App*> verbs =
      app.get_subcommands([&](const CLI::App* v) { return v->get_name() == word; });
  return !verbs.empty();
}

/// `sparflow help VERB` is `sparflow VERB --help`, `sparflow help` is `sparflow --help`; what is no verb is asked for as one, so
/// that it is refused.
std::vector<std::string> spelt_out(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.resize(std::min<std::size_t>(words.size(), 1));
    if (words.empty() || words.front().rfind('-', 0) == 0 || is_verb(app, words.front()))
      words.emplace_back("--help");
  }
  std::reverse(words.begin(), words.end());  // as the command line's library takes them
  return words;
}

/// Prints the help or the error of the command line's library.
void print_parsed(const CLI::App& app, const CLI::ParseError& e) {
  std::ostringstream out, err;
  app.exit(e, out, err);
  complain(harmless(err.str(), QuoteOptions{}.sentence));
  tell(out.str());
}

int run(CLI::App& app, int argc, char** argv, const int& code) {
  try {
    app.parse(spelt_out(app, argc, argv));
    return code;
  } catch (const CLI::Success& e) {  // --help, --version
    print_parsed(app, e);
    return kDone;
  } catch (const CLI::ParseError& e) {
    print_parsed(app, e);
    const int verb = argc > 2 && std::string(argv[1]) == "help" ? 2 : 1;
    if (argc > verb && argv[verb][0] != '-') suggest_verb(app, argv[verb]);
    suggest_options(app, argc, argv);
    return kUsage;
  }
}

int out_of_memory() {
  note(
      fmt::format("sparflow: out of memory: {} needs more than this process may have{}; give "
                  "fewer or shorter logs, or use a machine with more memory (docs/limits.md)",
                  current_work(), memory_in_words()));
  return kBadInput;
}

/// Prints the sentence of an exception. @return the exit code
int report(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Interruption&) {
    note("interrupted: nothing was found yet that could be kept");
    return kInterrupted;
  } catch (const UsageError& e) {
    note(fmt::format("sparflow: {}", e.what()));
    return kUsage;
  } catch (const InputError& e) {
    note(fmt::format("sparflow: {}", e.what()));
    return kBadInput;
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  } catch (const std::system_error& e) {
    // A thread whose stack finds no place.
    if (e.code() == std::errc::resource_unavailable_try_again) return out_of_memory();
    note(fmt::format("sparflow: {}", e.what()));
    return kInternal;
  } catch (const std::exception& e) {
    note(
        fmt::format("sparflow: {}\nThis is a defect of the program; please report it with the "
                    "command line above.",
                    e.what()));
    return kInternal;
  }
}

/// Lets large arrays go back to the system when they are freed. glibc raises its limit by itself, and columns of long logs
/// then leave gaps that nothing else fills.
void return_large_memory() {
  /// Size of a block from which it is mapped by itself.
  /// @threshold [bytes] 131072..33554432; chosen: half a million rows of a column; smaller blocks are used again soon
  constexpr int kMapped = 4 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kMapped);
  ::mallopt(M_TRIM_THRESHOLD,
            8 * kMapped);  // freed memory of small blocks is kept, as glibc's own rule would
}

}  // namespace
}  // namespace sparflow::cli

int main(int argc, char** argv) {
  using namespace sparflow;
  cli::secure_standard_streams();
  cli::catch_interrupts();
  cli::return_large_memory();
  set_door_listener(cli::warn);
  CLI::App app{
      "Sparflow identifies the working pressures of a hydraulic machine from its logs and computes "
      "energy-optimal "
      "motions.\n"
      "Begin with `sparflow demo`; every verb has --help.",
      "sparflow"};
  app.set_version_flag("--version", std::string("sparflow ") + program_version());
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 internal error, 2 wrong usage, 3 bad input, 4 infeasible or not "
      "converged,\n"
      "            5 a verification failed, 130 interrupted.");
  int code = cli::kDone;
  cli::add_demo_verb(app, code);
  cli::add_machine_verb(app, code);
  cli::add_log_verb(app, code);
  cli::add_simulate_verb(app, code);
  cli::add_fit_verb(app, code);
  cli::add_compare_verb(app, code);
  cli::add_diagnose_verb(app, code);
  cli::add_selftest_verb(app, code);
  cli::add_extend_verb(app, code);
  cli::add_improve_verb(app, code);
  cli::add_effects_verb(app, code);
  cli::add_plan_verb(app, code);
  cli::add_optimize_verb(app, code);
  cli::add_audit_verb(app, code);
  cli::add_evaluate_verb(app, code);
  cli::add_strategies_verb(app, code);
  cli::add_pareto_verb(app, code);
  cli::add_benchmark_verb(app, code);
  cli::add_completion_verb(app, code);
  cli::refuse_empty_values(app);
  try {
    return cli::run(app, argc, argv, code);
  } catch (...) {
    return cli::report(std::current_exception());
  }
}
