#pragma once
/// The verbs of the program and the exit codes that they give.
#include <CLI/CLI.hpp>

namespace sparflow::cli {

/// Exit codes that docs/commands.md promises.
enum ExitCode {
  kDone = 0,
  kInternal = 1,
  kUsage = 2,
  kBadInput = 3,
  kNotSolved = 4,
  kVerification = 5,
  kInterrupted = 130
};

// Each of these adds the subcommand of one verb, whose callback writes its exit code to `code`.
void add_fit_verb(CLI::App& app, int& code);
void add_simulate_verb(CLI::App& app, int& code);
void add_compare_verb(CLI::App& app, int& code);
void add_diagnose_verb(CLI::App& app, int& code);
void add_selftest_verb(CLI::App& app, int& code);
void add_extend_verb(CLI::App& app, int& code);
void add_improve_verb(CLI::App& app, int& code);
void add_effects_verb(CLI::App& app, int& code);
void add_plan_verb(CLI::App& app, int& code);
void add_optimize_verb(CLI::App& app, int& code);
void add_strategies_verb(CLI::App& app, int& code);
void add_pareto_verb(CLI::App& app, int& code);
void add_benchmark_verb(CLI::App& app, int& code);
void add_audit_verb(CLI::App& app, int& code);
void add_evaluate_verb(CLI::App& app, int& code);
void add_machine_verb(CLI::App& app, int& code);
void add_log_verb(CLI::App& app, int& code);
void add_demo_verb(CLI::App& app, int& code);
void add_completion_verb(CLI::App& app, int& code);

}  // namespace sparflow::cli
