#include "apps/cli/diagnosis_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "identification/data_checks/sensor_slips.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

/// Checks that each log is diagnosed, a reference or a test log, and only one of these. @throws UsageError
void refuse_shared_logs(const std::string& verb, const ExtendLogs& logs) {
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
  refuse(logs.suspects, logs.references, "--log", "--reference");
  refuse(logs.suspects, logs.tests, "--log", "--test");
  refuse(logs.references, logs.tests, "--reference", "--test");
}

/// Warns of sensors that seem to be connected or named wrongly: a diagnosis would take them for missing physics.
void warn_of_slips(const Machine& machine, const std::vector<Log>& logs) {
  for (const Log& log : logs) {
    for (const SensorSlip& slip : find_sensor_slips(machine, make_signals(machine, log)))
      warn(log.file + ": " + slip.sentence);
  }
}

}  // namespace

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
  for (const std::string& c : candidates_) {
    const Effect* everywhere = c.find(':') == std::string::npos ? find_effect(c) : nullptr;
    if (everywhere == nullptr || everywhere->places(machine).empty()) {
      files.candidates.push_back(parse_effect(c, machine));  // its InputError names the mistake
      continue;
    }
    for (const int at : everywhere->places(machine)) files.candidates.push_back({everywhere, at});
  }
  files.logs.suspects = load_logs(logs_, machine, mapping_);
  files.logs.references = load_logs(references_, machine, mapping_);
  files.logs.tests = load_logs(tests_, machine, mapping_);
  warn_of_slips(machine, files.logs.suspects);
  refuse_shared_logs(verb_, files.logs);
  return files;
}

void note_what_is_reference(const DiagnosisFiles& files) {
  if (!files.logs.references.empty()) return;
  const auto seen = [&](const Log& log) {
    return std::any_of(files.model.data.begin(), files.model.data.end(), [&](const DataSource& d) {
      return d.use == "train" && d.sha256 == log.sha256;
    });
  };
  const std::vector<Log>& suspects = files.logs.suspects;
  const auto unseen = std::find_if_not(suspects.begin(), suspects.end(), seen);
  if (unseen == suspects.end()) return;
  note(
      fmt::format("{}: the model was not fitted on this log; without --reference the model serves "
                  "as reference for forces only, and pressures and flows are learned again",
                  unseen->file));
}

std::string today() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  return fmt::format("{:04}-{:02}-{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

}  // namespace sparflow::cli
