#include <fmt/format.h>

#include <chrono>
#include <ctime>

#include "apps/cli/context.h"
#include "apps/report/improve_page.h"
#include "identification/extend.h"
#include "models/error.h"
#include "models/model_file.h"

namespace sparflow::cli {
namespace {

struct ExtendArguments {
  std::string model, output, mapping, remove;
  std::vector<std::string> add, logs, tests;
  int threads = 0;
  OwnEffects own;
  Outputs outputs;
};

int run(const ExtendArguments& a) {
  if (a.add.empty() == a.remove.empty()) {
    throw UsageError("extend: give either --add EFFECT[:AT] ... or --remove EFFECT[:AT]");
  }
  std::vector<NamedFile> inputs = named("--log", a.logs);
  for (const NamedFile& f : named("--test", a.tests)) inputs.push_back(f);
  inputs.push_back({"--mapping", a.mapping});
  for (const NamedFile& f : named("--effects", a.own.files)) inputs.push_back(f);
  inputs.push_back({"--model", a.model});
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("extend", outputs, inputs);
  check_writable(a.output);
  a.outputs.check();
  CraneModel model = load_model_aloud(a.model);
  a.own.load_into(model);
  std::vector<EffectAt> add;
  for (const std::string& key : a.add) add.push_back(parse_effect(key, model.machine));
  const std::vector<Log> logs = load_logs(a.logs, model.machine, a.mapping);
  const std::vector<Log> tests = load_logs(a.tests, model.machine, a.mapping);
  refuse_shared_logs("extend", logs, {}, tests);
  ExtendOptions options;
  options.fit.threads = a.threads;
  options.date = today();
  const ExtendResult result = [&] {
    Progress progress("extend");
    const auto tell = [&](double share, const std::string& what) { progress(share, what); };
    return a.remove.empty() ? extend(model, add, logs, tests, options, tell)
                            : take_back(model, parse_effect(a.remove, model.machine), logs, tests,
                                        options, tell);
  }();
  save_model(result.model, a.output);
  if (!a.outputs.json.empty()) write_file_atomically(a.outputs.json, result.json());
  if (!a.outputs.report.empty()) improve_page(result).write(a.outputs.report);
  fmt::print("{}model written to {}\n", result.table(), a.output);
  return kDone;
}

}  // namespace

std::string today() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  return fmt::format("{:04}-{:02}-{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

void add_extend_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<ExtendArguments>();
  CLI::App* verb = app.add_subcommand(
      "extend",
      "add a physical effect to a model, learn everything around it, error before -> after");
  verb->add_option("--model", a->model, "fitted model")->required()->type_name("MODEL.json");
  verb->add_option("--add,-a", a->add, "effects to add, in this order; `sparflow effects` has them")
      ->type_name("EFFECT[:AT]...");
  verb->add_option("--remove", a->remove, "effect to take back out instead")
      ->type_name("EFFECT[:AT]");
  verb->add_option("--log,-l", a->logs, "logs to learn from (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--test,-t", a->tests,
                   "logs to judge the error on; without them motions of --log are held out")
      ->type_name("FILE...");
  verb->add_option("--output,-o", a->output, "model to write (JSON)")
      ->required()
      ->type_name("MODEL2.json");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--threads", a->threads, "threads for learning, 0 = one a processor")
      ->check(CLI::Range(0, 256));
  a->own.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow extend --model crane.json --add coulomb_friction:boom --log train.csv "
      "--test test.csv -o crane2.json\n"
      "  sparflow extend --model crane2.json --remove coulomb_friction:boom --log train.csv "
      "-o crane3.json");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
