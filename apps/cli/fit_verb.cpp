#include <fmt/format.h>

#include <algorithm>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/compare_page.h"
#include "apps/report/model_pages/fit_text.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct FitArguments {
  std::string machine, output, mapping;
  std::vector<std::string> logs, tests;
  int threads = 0;
  OwnEffects own;
  Outputs outputs;
};

/// Checks, before any work, that no output overwrites a file in use and that no test log is learned from.
/// @throws UsageError, InputError
void check_files(const FitArguments& a) {
  for (const std::string& test : a.tests) {
    for (const std::string& log : a.logs) {
      if (!same_file(test, log)) continue;
      throw UsageError(
          fmt::format("fit: {} is given with --log and with --test; a model is judged on data that "
                      "it was not learned from, so give the log once (without --test every fourth "
                      "block of motion is held out)",
                      log));
    }
  }
  std::vector<NamedFile> inputs = named("--log", a.logs);
  for (const NamedFile& test : named("--test", a.tests)) inputs.push_back(test);
  inputs.push_back({"--machine", a.machine});
  inputs.push_back({"--mapping", a.mapping});
  for (const NamedFile& f : named("--effects", a.own.files)) inputs.push_back(f);
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("fit", outputs, inputs);
  check_writable(a.output);
  a.outputs.check();
}

int run(const FitArguments& a) {
  check_files(a);
  const Machine machine = load_machine_with_warnings(a.machine);
  a.own.load(&machine);  // before the fit, so that a wrong file is found at once
  std::vector<Log> logs = load_logs(a.logs, machine, a.mapping);
  std::vector<Log> tests = load_logs(a.tests, machine, a.mapping);
  FitOptions options;
  options.threads = a.threads;
  options.keep_held_out_series = !a.outputs.report.empty();
  options.signals.slim = a.outputs.report.empty();
  FitResult result = [&] {
    Progress progress("fit");
    return fit(machine, std::move(logs), std::move(tests), options,
               [&](double share, const std::string& what) { progress(share, what); });
  }();
  for (const SlipOfLog& s : result.train.slips) warn(s.file + ": " + s.slip.sentence);
  try {
    check_learned(result, a.logs.size() == 1 ? a.logs.front() : "");
  } catch (const InputError&) {
    for (const BadChannelOfLog& b : result.train.bad_data)
      note(fmt::format("  set aside: {}: {}", b.file, bad_channel_sentence(b.bad)));
    for (const std::string& n : result.notes) note("  " + n);
    throw;
  }
  a.own.load_into(result.model);
  save_model(result.model, a.output);
  if (!a.outputs.json.empty()) a.outputs.write_json(fit_json(result));
  if (!a.outputs.report.empty()) fit_page(result).write(a.outputs.report);
  tell(fmt::format("{}{}\nmodel written to {}\n", result.full(), fit_judgement(result), a.output));
  for (const std::string& sentence : learning_gaps(result)) warn(sentence);
  // The model is kept, because other stages can be judged by it; what `fit` is for did not come about.
  return no_pressure_learned(result) ? kBadInput : kDone;
}

}  // namespace

void add_fit_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<FitArguments>();
  CLI::App* verb = app.add_subcommand(
      "fit", "identify pressure models, margins, standby and valve gains from logs");
  verb->add_option("--machine,-m", a->machine, "machine file (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--log,-l", a->logs, "logs to learn from (CSV, MAT or a recording)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--test,-t", a->tests,
                   "logs to judge the model on; nothing is learned from them")
      ->type_name("FILE...");
  verb->add_option("--output,-o", a->output, "model to write (JSON)")
      ->required()
      ->type_name("MODEL.json");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--threads", a->threads, "threads for learning; 0: one for each processor")
      ->check(CLI::Range(0, 256));
  a->own.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
