#include <fmt/format.h>

#include <optional>

#include "apps/python/bindings.h"
#include "apps/python/kept_parts.h"
#include "apps/python/long_call.h"
#include "apps/python/result.h"
#include "apps/report/model_pages/diagnose_page.h"
#include "apps/report/model_pages/improve_page.h"
#include "apps/report/model_pages/selftest_page.h"
#include "apps/tasks/diagnose_task.h"
#include "apps/tasks/inputs.h"
#include "diagnosis/selftest/selftest.h"

namespace sparflow::python {
namespace {

/// What all four verbs are given. Shared with the work, which may outlive the call.
struct Inputs {
  CraneModel model;
  ExtendLogs logs;
  std::vector<EffectAt> candidates;
};

std::shared_ptr<Inputs> inputs_of(const std::string& verb, const CraneModel& model,
                                  const py::dict& a) {
  auto all = std::make_shared<Inputs>();
  all->model = model;
  add_effects(a["effects"], all->model);
  const Machine& machine = all->model.machine;
  if (a.contains("candidates") && !a["candidates"].is_none()) {
    all->candidates = candidates_of(a["candidates"].cast<std::vector<std::string>>(), machine);
  }
  all->logs.suspects = logs_from(a["logs"], machine);
  if (a.contains("references")) all->logs.references = logs_from(a["references"], machine);
  if (a.contains("test")) all->logs.tests = logs_from(a["test"], machine);
  const Listener listener{warn, warn, {}, {}};
  check_diagnosis_logs(verb, machine, all->logs, listener);
  return all;
}

class Diagnosed final : public Result {
 public:
  Diagnosed(std::shared_ptr<const Inputs> inputs, Diagnosis diagnosis)
      : inputs_(std::move(inputs)), diagnosis_(std::move(diagnosis)) {}
  void judge(std::optional<ExtendResult> tested) { tested_ = std::move(tested); }
  std::string json() const override { return diagnosis_json(diagnosis_, tested()); }
  std::string text() const override { return diagnosis_table(diagnosis_, tested()); }
  std::string headline() const override { return headline_on_tests(diagnosis_, tested()); }
  Page page() const override { return diagnose_page(inputs_->model, diagnosis_, tested()); }
  const Diagnosis& diagnosis() const { return diagnosis_; }

 private:
  const ExtendResult* tested() const { return tested_ ? &*tested_ : nullptr; }
  std::shared_ptr<const Inputs> inputs_;
  Diagnosis diagnosis_;
  std::optional<ExtendResult> tested_;
};

class Extended final : public Result {
 public:
  explicit Extended(ExtendResult result)
      : result_(std::move(result)), model_(std::make_shared<CraneModel>(result_.model)) {}
  std::string json() const override { return result_.json(); }
  std::string text() const override { return result_.table(); }
  std::string headline() const override { return result_.brief(); }
  Page page() const override { return improve_page(result_); }
  std::shared_ptr<CraneModel> model() const { return model_; }
  const ExtendResult& result() const { return result_; }

 private:
  ExtendResult result_;
  std::shared_ptr<CraneModel> model_;
};

class Selftested final : public Result {
 public:
  Selftested(std::shared_ptr<const Inputs> inputs, Selftest result)
      : inputs_(std::move(inputs)), result_(std::move(result)) {}
  std::string json() const override { return result_.json(); }
  std::string text() const override { return result_.table(); }
  std::string headline() const override { return result_.headline(); }
  Page page() const override { return selftest_page(inputs_->model, result_); }

 private:
  std::shared_ptr<const Inputs> inputs_;
  Selftest result_;
};

std::shared_ptr<Diagnosed> diagnose_logs(const CraneModel& model, const py::dict& a) {
  const std::shared_ptr<Inputs> inputs = inputs_of("diagnose", model, a);
  DiagnoseOptions options;
  options.candidates = inputs->candidates;
  options.check_data = a["check_data"].cast<bool>();
  return long_call<Diagnosed>(a["progress"], [inputs, options](const Listener& listener) {
    tell_what_is_reference(inputs->model, inputs->logs, listener);
    auto result = std::make_shared<Diagnosed>(
        inputs, diagnose(inputs->model, inputs->logs.suspects, inputs->logs.references, options,
                         progress_or_stop(listener)));
    result->judge(judge_on_tests(inputs->model, inputs->logs, result->diagnosis(),
                                 progress_or_stop(listener)));
    return result;
  });
}

std::shared_ptr<Extended> extend_model(const CraneModel& model, const py::dict& a) {
  const std::shared_ptr<Inputs> inputs = inputs_of("extend", model, a);
  const auto keys = a["add"].cast<std::vector<std::string>>();
  const auto remove = a["remove"].cast<std::string>();
  std::vector<EffectAt> add;
  add.reserve(keys.size());
  for (const std::string& key : keys) add.push_back(parse_effect(key, inputs->model.machine));
  std::optional<EffectAt> removed;
  if (!remove.empty()) removed = parse_effect(remove, inputs->model.machine);
  ExtendOptions options;
  options.fit.threads = a["threads"].cast<int>();
  options.date = today();
  return long_call<Extended>(
      a["progress"], [inputs, add, removed, options](const Listener& listener) {
        const WorkProgress tell = progress_or_stop(listener);
        return std::make_shared<Extended>(
            removed ? take_back(inputs->model, *removed, inputs->logs, options, tell)
                    : extend(inputs->model, add, inputs->logs, options, tell));
      });
}

/// All that an improvement depends on; its logs are objects as a rule.
std::string inputs_in_words(const Inputs& inputs, const py::dict& a) {
  std::string words =
      fmt::format("improve --max-steps {} candidates {}; {}", a["max_steps"].cast<int>(),
                  py::str(a["candidates"]).cast<std::string>(), identity_of(inputs.model));
  for (const auto* list : {&inputs.logs.suspects, &inputs.logs.references, &inputs.logs.tests}) {
    words += fmt::format("; {} logs", list->size());
    for (const Log& log : *list) words += fmt::format(" {} {}", log.file, log.sha256);
  }
  return words;
}

std::shared_ptr<Extended> improve_model(const CraneModel& model, const py::dict& a) {
  const std::shared_ptr<Inputs> inputs = inputs_of("improve", model, a);
  ExtendOptions options;
  options.fit.threads = a["threads"].cast<int>();
  options.max_steps = a["max_steps"].cast<int>();
  options.date = today();
  options.diagnose.candidates = inputs->candidates;
  const std::shared_ptr<Journal> journal =
      journal_of("improve", a, {}, inputs_in_words(*inputs, a));
  options.journal = journal.get();
  return long_call<Extended>(a["progress"], [inputs, options, journal](const Listener& listener) {
    tell_of_trouble(*journal, listener);
    tell_what_is_reference(inputs->model, inputs->logs, listener);
    auto done = std::make_shared<Extended>(
        improve(inputs->model, inputs->logs, options, progress_or_stop(listener)));
    if (!done->result().interrupted) journal->remove();
    return done;
  });
}

std::shared_ptr<Selftested> selftest_logs(const CraneModel& model, const py::dict& a) {
  const std::shared_ptr<Inputs> inputs = inputs_of("selftest", model, a);
  SelftestOptions options;
  options.check = a["check"].cast<int>();
  options.candidates = inputs->candidates;
  return long_call<Selftested>(a["progress"], [inputs, options](const Listener& listener) {
    return std::make_shared<Selftested>(
        inputs, selftest(inputs->model, inputs->logs.suspects, inputs->logs.references, options,
                         progress_or_stop(listener)));
  });
}

}  // namespace

void bind_diagnosis(py::module_& m) {
  py::class_<Diagnosed, Result, std::shared_ptr<Diagnosed>>(
      m, "Diagnosis", "Which physical effect a model lacks, with evidence.")
      .def_property_readonly(
          "verdict", [](const Diagnosed& d) { return verdict_name(d.diagnosis().verdict); },
          "'missing', 'none', 'unknown' or 'bad_data'.")
      .def_property_readonly(
          "named",
          [](const Diagnosed& d) {
            std::vector<std::string> keys;
            for (const DiagnosedEffect& e : d.diagnosis().effects) {
              if (d.diagnosis().named(e)) keys.push_back(e.key());
            }
            return keys;
          },
          "Keys of the effects that the verdict names, most probable first.");
  py::class_<Extended, Result, std::shared_ptr<Extended>>(
      m, "ExtendResult", "A model with effects, and each error before and after.")
      .def_property_readonly("model", &Extended::model,
                             "The model with the effects that were kept.")
      .def_property_readonly(
          "interrupted", [](const Extended& e) { return e.result().interrupted; },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def_property_readonly(
          "stopped_because", [](const Extended& e) { return e.result().stopped_because; },
          "Why no further effect was added, a phrase.");
  const py::class_<Selftested, Result, std::shared_ptr<Selftested>> selftested(
      m, "Selftest", "What these logs could reveal.");
  m.def("diagnose", &diagnose_logs);
  m.def("extend", &extend_model);
  m.def("improve", &improve_model);
  m.def("selftest", &selftest_logs);
}

}  // namespace sparflow::python
