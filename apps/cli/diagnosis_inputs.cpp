#include "apps/cli/diagnosis_inputs.h"

#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/tasks/inputs.h"
#include "models/math/error.h"

namespace sparflow::cli {
void DiagnosisFiles::write_provenance(Page& page) const {
  const auto name = [&page](const char* what, const std::vector<Log>& some) {
    for (const Log& l : some) {
      page.provenance(
          what, fmt::format("{}, {} rows, sha256 {}", l.file, l.samples(), l.sha256.substr(0, 16)));
    }
  };
  name("log", logs.suspects);
  name("reference log", logs.references);
  name("test log", logs.tests);
}

void DiagnosisInputs::add_model(CLI::App& app) {
  app.add_option("--model", model_, "fitted model")->required()->type_name("MODEL.json");
}

void DiagnosisInputs::add_logs(CLI::App& app, const std::string& what) {
  app.add_option("--log,-l", logs_, what)->required()->type_name("FILE...");
}

void DiagnosisInputs::add_references(CLI::App& app, const std::string& what) {
  app.add_option("--reference,-r", references_, what)->type_name("FILE...");
}

void DiagnosisInputs::add_tests(CLI::App& app, const std::string& what) {
  app.add_option("--test,-t", tests_, what)->type_name("FILE...");
}

void DiagnosisInputs::add_candidates(CLI::App& app, const std::string& what) {
  app.add_option("--candidates", candidates_,
                 what +
                     " (ids as in `sparflow effects`; without :AT at all places); absent: the "
                     "whole catalogue")
      ->type_name("EFFECT[:AT]...");
}

void DiagnosisInputs::add_output(CLI::App& app) {
  app.add_option("--output,-o", output_, "model to write (JSON)")
      ->required()
      ->type_name("MODEL2.json");
}

void DiagnosisInputs::add_threads(CLI::App& app) {
  app.add_option("--threads", threads_, "threads for learning; 0: one for each processor")
      ->check(CLI::Range(0, 256));
}

void DiagnosisInputs::add_rest(CLI::App& app) {
  app.add_option("--mapping", mapping_, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  own_.add_to(app);
  outputs_.add_to(app);
}

void DiagnosisInputs::add_resume(CLI::App& app) {
  outputs_.add_resume_to(app);
  resumable_ = true;
}

std::unique_ptr<Journal> DiagnosisInputs::open_journal(const std::string& options) const {
  std::vector<std::string> files = {model_};
  std::string numbers;  // of files by purpose, because the fingerprint has their names alone
  for (const auto* list : {&logs_, &references_, &tests_, &own_.files}) {
    files.insert(files.end(), list->begin(), list->end());
    numbers += fmt::format(" {}", list->size());
  }
  if (!mapping_.empty()) files.push_back(mapping_);
  std::unique_ptr<Journal> journal = outputs_.open_journal(
      verb_,
      run_fingerprint(files, fmt::format("{} files{} candidates {} {}", verb_, numbers,
                                         fmt::join(candidates_, ","), options)),
      output_);
  if (journal->finished() > 0)
    note(fmt::format("{} round{} finished before", journal->finished(),
                     journal->finished() == 1 ? " was" : "s were"));
  return journal;
}

DiagnosisFiles DiagnosisInputs::read() const {
  std::vector<NamedFile> inputs = {{"--model", model_}, {"--mapping", mapping_}};
  const std::pair<const char*, const std::vector<std::string>*> lists[] = {
      {"--log", &logs_},
      {"--reference", &references_},
      {"--test", &tests_},
      {"--effects", &own_.files}};
  for (const auto& [option, paths] : lists) {
    for (NamedFile& f : named(option, *paths)) inputs.push_back(std::move(f));
  }
  std::vector<NamedFile> written = outputs_.files();
  written.push_back({"--output", output_});
  if (resumable_) written.push_back({"the journal", outputs_.journal(output_)});
  check_outputs_apart(verb_, written, inputs);
  if (!output_.empty()) check_writable(output_);
  outputs_.check();
  DiagnosisFiles files;
  files.model = load_model_with_warnings(model_);
  own_.load_into(files.model);
  const Machine& machine = files.model.machine;
  files.candidates = candidates_of(candidates_, machine);
  files.logs.suspects = load_logs(logs_, machine, mapping_);
  files.logs.references = load_logs(references_, machine, mapping_);
  files.logs.tests = load_logs(tests_, machine, mapping_);
  check_diagnosis_logs(verb_, machine, files.logs, console_listener());
  return files;
}

}  // namespace sparflow::cli
