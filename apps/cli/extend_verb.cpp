#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/diagnosis_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/improve_page.h"
#include "apps/tasks/inputs.h"
#include "diagnosis/extension/extend.h"
#include "models/files/model_file.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct ExtendArguments {
  DiagnosisInputs inputs{"extend"};
  std::vector<std::string> add;
  std::string remove;
};

int run(const ExtendArguments& a) {
  if (a.add.empty() == a.remove.empty()) {
    throw UsageError("extend: give either --add EFFECT[:AT] ... or --remove EFFECT[:AT]");
  }
  const DiagnosisFiles files = a.inputs.read();
  const Machine& machine = files.model.machine;
  std::vector<EffectAt> add;
  for (const std::string& key : a.add) add.push_back(parse_effect(key, machine));
  ExtendOptions options;
  options.fit.threads = a.inputs.threads();
  options.date = today();
  const ExtendResult result = [&] {
    Progress progress("extend");
    const auto tell = [&](double share, const std::string& what) { progress(share, what); };
    return a.remove.empty()
               ? extend(files.model, add, files.logs, options, tell)
               : take_back(files.model, parse_effect(a.remove, machine), files.logs, options, tell);
  }();
  write_extended(a.inputs, result);
  return kDone;
}

}  // namespace

void write_extended(const DiagnosisInputs& inputs, const ExtendResult& result) {
  save_model(result.model, inputs.output());
  const Outputs& outputs = inputs.outputs();
  if (!outputs.json.empty()) outputs.write_json(result.json());
  if (!outputs.report.empty()) improve_page(result).write(outputs.report);
  tell(fmt::format("{}model written to {}\n", result.table(), inputs.output()));
}

void add_extend_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<ExtendArguments>();
  CLI::App* verb = app.add_subcommand("extend",
                                      "add physical effects to a model, learn the rest again with "
                                      "them, report errors before and after");
  a->inputs.add_model(*verb);
  verb->add_option("--add,-a", a->add,
                   "effects to add, in this order; `sparflow effects` lists them")
      ->type_name("EFFECT[:AT]...");
  verb->add_option("--remove", a->remove, "effect to remove instead")->type_name("EFFECT[:AT]");
  a->inputs.add_logs(*verb, "logs to learn from (CSV, MAT or a recording)");
  a->inputs.add_tests(*verb, "logs to judge the error on; absent: motions of --log are held out");
  a->inputs.add_output(*verb);
  a->inputs.add_threads(*verb);
  a->inputs.add_rest(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow extend --model crane.json --add coulomb_friction:boom --log train.csv "
      "--test test.csv -o crane2.json\n"
      "  sparflow extend --model crane2.json --remove coulomb_friction:boom --log train.csv "
      "-o crane3.json");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
