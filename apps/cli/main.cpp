#include <fmt/format.h>

#include <exception>

#include "apps/cli/console.h"
#include "apps/cli/verbs.h"
#include "models/files/model_file.h"
#include "models/math/error.h"

int main(int argc, char** argv) {
  using namespace sparflow;
  cli::catch_interrupts();
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
  cli::add_strategies_verb(app, code);
  cli::add_pareto_verb(app, code);
  try {
    app.parse(argc, argv);
    return code;
  } catch (const CLI::Success& e) {  // --help, --version
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    app.exit(e);
    if (argc > 1 && argv[1][0] != '-') {
      std::vector<std::string> verbs;
      bool known = false;
      for (const CLI::App* verb : app.get_subcommands({})) {
        verbs.push_back(verb->get_name());
        known = known || verb->get_name() == argv[1];
      }
      const std::string near = nearest_word(argv[1], verbs);
      if (!known && !near.empty()) fmt::print(stderr, "Did you mean \"sparflow {}\"?\n", near);
    }
    return cli::kUsage;
  } catch (const UsageError& e) {
    fmt::print(stderr, "sparflow: {}\n", e.what());
    return cli::kUsage;
  } catch (const InputError& e) {
    fmt::print(stderr, "sparflow: {}\n", e.what());
    return cli::kBadInput;
  } catch (const std::exception& e) {
    fmt::print(stderr,
               "sparflow: {}\nThis is a defect of the program; please report it with the command "
               "line above.\n",
               e.what());
    return cli::kInternal;
  }
}
