#include <fmt/format.h>

#include "apps/cli/context.h"
#include "apps/report/selftest_page.h"
#include "identification/selftest.h"
#include "models/error.h"

namespace sparflow::cli {
namespace {

struct SelftestArguments {
  std::string model, mapping;
  std::vector<std::string> logs, references, candidates;
  int check = SelftestOptions{}.check;
  OwnEffects own;
  Outputs outputs;
};

int run(const SelftestArguments& a) {
  std::vector<NamedFile> inputs = named("--log", a.logs);
  for (const NamedFile& f : named("--reference", a.references)) inputs.push_back(f);
  for (const NamedFile& f : named("--effects", a.own.files)) inputs.push_back(f);
  inputs.push_back({"--model", a.model});
  inputs.push_back({"--mapping", a.mapping});
  check_outputs_apart("selftest", a.outputs.files(), inputs);
  a.outputs.check();
  CraneModel model = load_model_aloud(a.model);
  a.own.load_into(model);
  const std::vector<Log> logs = load_logs(a.logs, model.machine, a.mapping);
  const std::vector<Log> references = load_logs(a.references, model.machine, a.mapping);
  refuse_shared_logs("selftest", logs, references, {});
  SelftestOptions options;
  options.check = a.check;
  for (const std::string& c : a.candidates)
    options.candidates.push_back(parse_effect(c, model.machine));
  const Selftest result = [&] {
    Progress progress("selftest");
    return selftest(model, logs, references, options,
                    [&](double share, const std::string& what) { progress(share, what); });
  }();
  if (!a.outputs.json.empty()) write_file_atomically(a.outputs.json, result.json());
  if (!a.outputs.report.empty()) {
    Page page = selftest_page(model, result);
    for (const auto& [what, some] : {std::pair{"log", &logs}, {"reference log", &references}}) {
      for (const Log& l : *some) {
        page.provenance(what, fmt::format("{}, {} rows, sha256 {}", l.file, l.samples(),
                                          l.sha256.substr(0, 16)));
      }
    }
    page.write(a.outputs.report);
  }
  fmt::print("{}", result.table());
  return kDone;
}

}  // namespace

void add_selftest_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<SelftestArguments>();
  CLI::App* verb = app.add_subcommand(
      "selftest", "what this log could reveal: every effect injected into it, power and confusion");
  verb->add_option("--model", a->model, "fitted model")->required()->type_name("MODEL.json");
  verb->add_option("--log,-l", a->logs, "logs whose motions are judged (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--reference,-r", a->references,
                   "logs of the same machine that would serve as reference")
      ->type_name("FILE...");
  verb->add_option("--candidates", a->candidates,
                   "effects to inject, as in `sparflow effects`; else the whole catalogue")
      ->type_name("EFFECT[:AT]...");
  verb->add_option("--check", a->check, "how many effects are really injected and searched for")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  a->own.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow selftest --model crane.json --log today.csv\n"
      "  sparflow selftest --model crane.json --log today.csv --reference new_machine.csv "
      "--report power.html\n"
      "What these logs cannot tell apart is listed with the motion that would.");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
