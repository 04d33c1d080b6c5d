#include <fmt/format.h>

#include "apps/cli/context.h"
#include "apps/report/improve_page.h"
#include "identification/extend.h"
#include "models/error.h"
#include "models/model_file.h"

namespace sparflow::cli {
namespace {

struct ImproveArguments {
  std::string model, output, mapping;
  std::vector<std::string> logs, references, tests, candidates;
  int max_steps = 6, threads = 0;
  OwnEffects own;
  Outputs outputs;
};

int run(const ImproveArguments& a) {
  std::vector<NamedFile> inputs = named("--log", a.logs);
  for (const NamedFile& f : named("--reference", a.references)) inputs.push_back(f);
  for (const NamedFile& f : named("--test", a.tests)) inputs.push_back(f);
  inputs.push_back({"--mapping", a.mapping});
  for (const NamedFile& f : named("--effects", a.own.files)) inputs.push_back(f);
  inputs.push_back({"--model", a.model});
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("improve", outputs, inputs);
  check_writable(a.output);
  a.outputs.check();
  CraneModel model = load_model_aloud(a.model);
  a.own.load_into(model);
  const std::vector<Log> logs = load_logs(a.logs, model.machine, a.mapping);
  const std::vector<Log> references = load_logs(a.references, model.machine, a.mapping);
  const std::vector<Log> tests = load_logs(a.tests, model.machine, a.mapping);
  refuse_shared_logs("improve", logs, references, tests);
  if (references.empty()) say_what_is_reference(model, logs);
  ExtendOptions options;
  options.fit.threads = a.threads;
  options.max_steps = a.max_steps;
  options.date = today();
  for (const std::string& c : a.candidates)
    options.diagnose.candidates.push_back(parse_effect(c, model.machine));
  const ExtendResult result = [&] {
    Progress progress("improve");
    return improve(model, logs, references, tests, options,
                   [&](double share, const std::string& what) { progress(share, what); });
  }();
  save_model(result.model, a.output);
  if (!a.outputs.json.empty()) write_file_atomically(a.outputs.json, result.json());
  if (!a.outputs.report.empty()) improve_page(result).write(a.outputs.report);
  fmt::print("{}model written to {}\n", result.table(), a.output);
  return kDone;
}

}  // namespace

void add_improve_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<ImproveArguments>();
  CLI::App* verb = app.add_subcommand(
      "improve", "diagnose and extend until nothing is missing; the error falls step by step");
  verb->add_option("--model", a->model, "fitted model")->required()->type_name("MODEL.json");
  verb->add_option("--log,-l", a->logs, "logs to diagnose and learn from (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--reference,-r", a->references,
                   "logs of the same machine without what is missing: what the model has learned "
                   "then stays as it is")
      ->type_name("FILE...");
  verb->add_option("--test,-t", a->tests,
                   "logs to judge the error on; without them motions of --log are held out")
      ->type_name("FILE...");
  verb->add_option("--output,-o", a->output, "model to write (JSON)")
      ->required()
      ->type_name("MODEL2.json");
  verb->add_option("--max-steps", a->max_steps, "effects to add at most")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  verb->add_option("--candidates", a->candidates,
                   "effects to choose from, as in `sparflow effects`; else the whole catalogue")
      ->type_name("EFFECT[:AT]...");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--threads", a->threads, "threads for learning, 0 = one a processor")
      ->check(CLI::Range(0, 256));
  a->own.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow improve --model crane.json --log train.csv --test test.csv -o crane2.json\n"
      "  sparflow improve --model crane.json --log today.csv --reference new_machine.csv "
      "-o crane2.json --report improve.html");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
