#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli/context.h"
#include "apps/report/diagnose_page.h"
#include "identification/extend.h"
#include "models/error.h"

namespace sparflow::cli {
namespace {

struct DiagnoseArguments {
  std::string model, mapping;
  std::vector<std::string> logs, references, tests, candidates;
  bool skip_data_checks = false;
  OwnEffects own;
  Outputs outputs;
};

/// The error on test logs with the effects found in the model, one by one; nothing when none was found.
std::optional<ExtendResult> judge_on_tests(const CraneModel& model, const Diagnosis& diagnosis,
                                           const std::vector<Log>& logs,
                                           const std::vector<Log>& references,
                                           const std::vector<Log>& tests) {
  std::vector<EffectAt> found;
  for (const DiagnosedEffect& e : diagnosis.effects) {
    if (e.probability >= 0.5) found.push_back(e.effect);
  }
  if (found.empty()) return std::nullopt;
  ExtendOptions options;
  options.references = references;
  Progress progress("test logs");
  return extend(model, found, logs, tests, options,
                [&](double share, const std::string& what) { progress(share, what); });
}

int run(const DiagnoseArguments& a) {
  std::vector<NamedFile> inputs = named("--log", a.logs);
  for (const NamedFile& f : named("--reference", a.references)) inputs.push_back(f);
  for (const NamedFile& f : named("--test", a.tests)) inputs.push_back(f);
  inputs.push_back({"--model", a.model});
  inputs.push_back({"--mapping", a.mapping});
  for (const NamedFile& f : named("--effects", a.own.files)) inputs.push_back(f);
  check_outputs_apart("diagnose", a.outputs.files(), inputs);
  a.outputs.check();
  CraneModel model = load_model_aloud(a.model);
  a.own.load_into(model);
  const std::vector<Log> logs = load_logs(a.logs, model.machine, a.mapping);
  const std::vector<Log> references = load_logs(a.references, model.machine, a.mapping);
  const std::vector<Log> tests = load_logs(a.tests, model.machine, a.mapping);
  refuse_shared_logs("diagnose", logs, references, tests);
  if (references.empty()) say_what_is_reference(model, logs);
  DiagnoseOptions options;
  for (const std::string& c : a.candidates)
    options.candidates.push_back(parse_effect(c, model.machine));
  options.check_data = !a.skip_data_checks;
  const Diagnosis result = [&] {
    Progress progress("diagnose");
    return diagnose(model, logs, references, options,
                    [&](double share, const std::string& what) { progress(share, what); });
  }();
  std::optional<ExtendResult> tested;
  if (!tests.empty()) tested = judge_on_tests(model, result, logs, references, tests);
  if (!a.outputs.json.empty()) {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(result.json());
    if (tested) json["test"] = nlohmann::ordered_json::parse(tested->json());
    write_file_atomically(a.outputs.json, json.dump(2) + "\n");
  }
  if (!a.outputs.report.empty()) {
    Page page = diagnose_page(model, result, tested ? &*tested : nullptr);
    const auto name = [&page](const char* what, const std::vector<Log>& some) {
      for (const Log& l : some) {
        page.provenance(what, fmt::format("{}, {} rows, sha256 {}", l.file, l.samples(),
                                          l.sha256.substr(0, 16)));
      }
    };
    name("diagnosed log", logs);
    name("reference log", references);
    name("test log", tests);
    page.write(a.outputs.report);
  }
  fmt::print("{}", result.table());
  if (tested)
    fmt::print("\non the test logs, with these effects in the model:\n{}", tested->table());
  return kDone;
}

}  // namespace

void refuse_shared_logs(const std::string& verb, const std::vector<Log>& logs,
                        const std::vector<Log>& references, const std::vector<Log>& tests) {
  const auto refuse = [&](const std::vector<Log>& some, const std::vector<Log>& others,
                          const char* one, const char* other) {
    for (const Log& a : some) {
      for (const Log& b : others) {
        if (a.sha256 != b.sha256) continue;
        throw UsageError(
            fmt::format("{}: {} is given as {} and as {}; a log can be only one of them", verb,
                        a.file, one, other));
      }
    }
  };
  refuse(logs, references, "--log", "--reference");
  refuse(logs, tests, "--log", "--test");
  refuse(references, tests, "--reference", "--test");
}

void say_what_is_reference(const CraneModel& model, const std::vector<Log>& logs) {
  const auto seen = [&](const Log& log) {
    return std::any_of(model.data.begin(), model.data.end(), [&](const DataSource& d) {
      return d.use == "train" && d.sha256 == log.sha256;
    });
  };
  const auto unseen =
      std::find_if_not(logs.begin(), logs.end(), [&](const Log& l) { return seen(l); });
  if (unseen == logs.end()) return;
  note(
      fmt::format("{}: the model was not fitted on this log; without --reference the model counts "
                  "as the reference for forces only, pressures and flows are learned anew",
                  unseen->file));
}

void add_diagnose_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<DiagnoseArguments>();
  CLI::App* verb = app.add_subcommand(
      "diagnose",
      "which physical effect is missing, ranked, with evidence; or nothing, or unknown");
  verb->add_option("--model", a->model, "fitted model")->required()->type_name("MODEL.json");
  verb->add_option("--log,-l", a->logs, "logs in which something may be missing (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--reference,-r", a->references,
                   "logs of the same machine without it: what is learned is taken from them")
      ->type_name("FILE...");
  verb->add_option("--test,-t", a->tests,
                   "logs to judge the effects found on, not used to find them")
      ->type_name("FILE...");
  verb->add_option("--candidates", a->candidates,
                   "effects to choose from, as in `sparflow effects`; else the whole catalogue")
      ->type_name("EFFECT[:AT]...");
  verb->add_flag("--skip-data-checks", a->skip_data_checks,
                 "do not look for stuck, jumping or noisy channels first");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  a->own.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow diagnose --model crane.json --log today.csv --reference new_machine.csv\n"
      "  sparflow diagnose --model crane.json --log train.csv --test test.csv --report why.html\n"
      "The exit code is 0 whatever the verdict; read `verdict` in --json.");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
