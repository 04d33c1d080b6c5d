#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/compare_page.h"
#include "apps/report/motion_pages/motion_page.h"
#include "apps/report/trust/trust_page.h"
#include "apps/tasks/trust/trust_task.h"
#include "identification/learning/fit.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "problems/motion_table.h"
#include "problems/problem_file.h"

namespace sparflow::cli {
namespace {

FitResult learn(const Machine& machine, const std::vector<Log>& train,
                const std::vector<Log>& test) {
  Progress progress("fit");
  return fit(machine, train, test, {},
             [&](double share, const std::string& what) { progress(share, what); });
}

OptimizeResult optimize_from_seeds(const CraneModel& model, const MotionProblem& problem,
                                   Seeds& seeds) {
  OptimizeOptions options;
  options.interrupted = interrupted;
  Progress progress("optimize");
  SeedOptions seed_options;
  seed_options.count = 6;
  seeds = make_seeds(problem, seed_options, options.intervals);
  finish_on_interrupt();
  options.progress = [&](double share, const std::string& what) { progress(share, what); };
  return optimize(model, problem, seeds.motions, options);
}

/// The same crane as a dynamic plant: does what the model promises come true?
TrustLoop loop_of_trust(const Machine& machine) {
  TrustTask task;
  /// Length of the log to learn from.
  /// @threshold [s] 20..1e5; chosen: every pressure is learned from it, with the loads that inertia adds
  constexpr double kTrainSeconds = 200.0;
  /// Length of the log to judge on.
  /// @threshold [s] 10..1e5; chosen: half of what is learned from
  constexpr double kTestSeconds = 100.0;
  /// Effects that may enter the model.
  /// @threshold [1] 1..20; chosen: the largest ones; each takes some seconds
  constexpr int kMostEffects = 4;
  task.train_seconds = kTrainSeconds;
  task.test_seconds = kTestSeconds;
  task.most_effects = kMostEffects;
  /// Moves that are optimised with both models and tracked.
  /// @threshold [1] 1..100; chosen: the demo stays below a minute and a half on two cores
  constexpr int kMoves = 2;
  task.moves = kMoves;
  task.told = [](const std::string& sentence) { tell("   " + sentence + "\n"); };
  Progress progress("trust");
  return trust_task(
      std::make_shared<Machine>(machine), task,
      console_listener([&](double share, const std::string& what) { progress(share, what); }));
}

/// What the demo has found.
struct DemoResult {
  FitResult fitted;
  Eigen::Index rows = 0;  ///< samples of the log that was learned from
  Seeds seeds;
  OptimizeResult optimum;
  std::optional<TrustLoop> trust;  ///< absent before it is closed
};

Page demo_page(const DemoResult& demo, const MotionProblem& problem) {
  const FitResult& fitted = demo.fitted;
  const OptimizeResult& result = demo.optimum;
  Page page("Sparflow demo");
  page.subtitle(
      "One loader crane: pressure models identified from a log and compared with a test log, and "
      "the "
      "energy-optimal motion of one reach; then the same crane as a dynamic plant, where a model "
      "is "
      "improved and its motions are tracked.");
  const std::string against = against_seeds(result);
  page.verdict(
      Tone::kGood,
      fmt::format("The reach takes {:.1f} kJ{}{}.", result.energy.total / 1e3,
                  against.empty() ? "" : ": ", against),
      fmt::format("Learned from {} rows; the energy of the test log is predicted within {:.2f} "
                  "%. Energies are those of the exact law.",
                  demo.rows, 100.0 * std::abs(fitted.test->energy.front().relative_error)));
  add_motion(page, fitted.model, problem, result, compared_motion(demo.seeds, result));
  if (demo.trust) add_trust(page, *demo.trust, "On the plant: ");
  add_comparison(page, fitted.model, *fitted.test, "Held-out log: ");
  add_fit(page, fitted);
  page.provenance("program", std::string("sparflow ") + program_version());
  for (const DataSource& d : fitted.model.data)
    page.provenance(d.use + " log", d.file + ", sha256 " + d.sha256.substr(0, 16));
  return page;
}

int run(const std::string& folder) {
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError({folder, 0, 0}, "", "cannot create this folder: " + error.message());
  const auto in = [&](const char* name) { return (std::filesystem::path(folder) / name).string(); };
  check_writable(in("index.html"));

  tell(
      "Sparflow demo: from a measured log to an energy-optimal motion, on a simulated 21 t.m "
      "loader crane.\n\n");
  const Machine machine = load_machine_with_warnings(bundled_file("machines/loader_crane.yaml"));
  const std::vector<Log> train =
      load_logs({bundled_file("logs/loader_crane_train.csv")}, machine, "");
  const std::vector<Log> test =
      load_logs({bundled_file("logs/loader_crane_test.csv")}, machine, "");
  tell(fmt::format("1. Learn pressures from {} ({} rows, {:.0f} s of work)\n", train[0].file,
                   train[0].samples(), train[0].duration()));
  DemoResult demo;
  demo.rows = train[0].samples();
  demo.fitted = learn(machine, train, test);
  const CraneModel& model = demo.fitted.model;
  save_model(model, in("model.json"));
  tell(fmt::format("   {}\n\n", demo.fitted.brief()));

  tell(fmt::format("2. Compare with a test log ({}, {} rows)\n{}\n", test[0].file,
                   test[0].samples(), compare_table(*demo.fitted.test)));

  const MotionProblem problem =
      load_problem(bundled_file("reaches/loader_crane_lift.yaml"), &machine);
  tell(fmt::format("3. Optimise a reach: {}, {} kg\n", problem.name, problem.payload));
  demo.optimum = optimize_from_seeds(model, problem, demo.seeds);
  tell(fmt::format("{}\n", optimize_table(model, problem, demo.optimum)));
  if (demo.optimum.status == OptimizeStatus::kInterrupted) return kInterrupted;
  if (demo.optimum.motion.size() < 2) return kNotSolved;
  write_file_atomically(in("motion.csv"), motion_csv(model, demo.optimum.motion, problem.payload));

  tell(
      "4. Close the loop on a dynamic plant of the crane, which has friction, oil that yields, "
      "lags "
      "and a swinging load\n");
  demo_page(demo, problem).write(in("index.html"));  // what an interruption then leaves
  demo.trust = loop_of_trust(machine);
  save_model(demo.trust->after(), in("improved.json"));
  tell(fmt::format("   Optima of the model before and after, tracked on the plant:\n{}\n",
                   trust_table(*demo.trust)));
  demo_page(demo, problem).write(in("index.html"));
  tell(
      fmt::format("Written to {}: index.html (open it in a browser), model.json, motion.csv, "
                  "improved.json; {:.1f} "
                  "s in all.\n",
                  folder, seconds()));
  return demo.trust->interrupted ? kInterrupted : kDone;
}

}  // namespace

void add_demo_verb(CLI::App& app, int& code) {
  auto out = std::make_shared<std::string>("sparflow-demo");
  CLI::App* verb = app.add_subcommand(
      "demo",
      "run fit, compare and optimize on bundled inputs, close the loop on the dynamic plant, "
      "and write one page");
  verb->add_option("--out", *out, "folder for the page, the models and the motion")
      ->type_name("DIR")
      ->capture_default_str();
  verb->callback([out, &code] { code = run(*out); });
}

}  // namespace sparflow::cli
