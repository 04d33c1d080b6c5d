#include <fmt/format.h>

#include "apps/python/bindings.h"
#include "apps/python/long_call.h"
#include "apps/python/result.h"
#include "apps/report/model_pages/compare_page.h"
#include "apps/report/model_pages/fit_text.h"
#include "apps/tasks/compare_task.h"
#include "identification/learning/fit.h"
#include "models/math/error.h"

namespace sparflow::python {
namespace {

/// Makes a view of one compared quantity of one log.
py::tuple series_of(const py::object& self, const CompareResult& r, const std::string& stage,
                    const std::string& at, std::size_t log) {
  if (log >= r.logs.size())
    throw py::index_error(fmt::format("no log {}; there are {}", log, r.logs.size()));
  std::vector<std::string> names;
  names.reserve(r.logs[log].series.size());
  for (const ComparedSeries& s : r.logs[log].series) names.push_back(s.stage + " " + s.at);
  const ComparedSeries& s =
      r.logs[log].series[index_of(names, stage + " " + at, "compared quantity")];
  return py::make_tuple(view(r.logs[log].signals.time, self), view(s.measured, self),
                        view(s.predicted, self));
}

class Comparison final : public Result {
 public:
  Comparison(std::shared_ptr<const CraneModel> model, CompareResult result)
      : model_(std::move(model)), result_(std::move(result)) {}
  std::string json() const override { return compare_json(result_); }
  std::string text() const override { return compare_table(result_); }
  std::string headline() const override { return compare_headline(result_); }
  Page page() const override { return compare_page(*model_, result_); }
  const CompareResult& result() const { return result_; }

 private:
  std::shared_ptr<const CraneModel> model_;
  CompareResult result_;
};

class Fitted final : public Result {
 public:
  explicit Fitted(FitResult result)
      : result_(std::move(result)), model_(std::make_shared<CraneModel>(result_.model)) {}
  std::string json() const override { return fit_json(result_); }
  std::string text() const override { return result_.full() + fit_judgement(result_); }
  std::string headline() const override { return result_.brief(); }
  Page page() const override { return fit_page(result_); }
  const FitResult& result() const { return result_; }
  std::shared_ptr<CraneModel> model() const { return model_; }

 private:
  FitResult result_;
  std::shared_ptr<CraneModel> model_;
};

/// Arguments of fit() as Python gives them.
struct FitArguments {
  py::object logs, test, effects, progress;
  int threads = 0;
};

std::shared_ptr<Fitted> fit_logs(const Machine& machine, const FitArguments& a) {
  auto own = std::make_shared<CraneModel>(CraneModel::untrained(machine));
  add_effects(a.effects, *own);  // before the fit, so that a wrong effect is found at once
  auto train = std::make_shared<std::vector<Log>>(logs_from(a.logs, machine));
  auto tests = std::make_shared<std::vector<Log>>(logs_from(a.test, machine));
  for (const Log& t : *tests) {
    for (const Log& l : *train) {
      if (t.sha256 != l.sha256) continue;
      throw UsageError(
          fmt::format("fit: {} is given as log and as test; a model is judged on data that it was "
                      "not learned from, so give it once",
                      t.file));
    }
  }
  FitOptions options;
  options.threads = a.threads;
  return long_call<Fitted>(a.progress, [own, train, tests, options](const Listener& listener) {
    const std::string only = train->size() == 1 ? train->front().path : "";
    FitResult result = fit(own->machine, std::move(*train), std::move(*tests), options,
                           progress_or_stop(listener));
    for (const SlipOfLog& s : result.train.slips)
      listener.say_warning(s.file + ": " + s.slip.sentence);
    check_learned(result, only);
    for (const std::string& sentence : learning_gaps(result)) listener.say_warning(sentence);
    result.model.user_effects = own->user_effects;
    return std::make_shared<Fitted>(std::move(result));
  });
}

std::shared_ptr<Comparison> compare_with(std::shared_ptr<const CraneModel> model, bool learned,
                                         const py::object& logs) {
  auto given = std::make_shared<std::vector<Log>>(logs_from(logs, model->machine));
  return long_call<Comparison>(py::none(), [model, learned, given](const Listener&) {
    return std::make_shared<Comparison>(model, compare_task(*model, std::move(*given), learned));
  });
}

}  // namespace

void bind_learning(py::module_& m) {
  py::class_<Fitted, Result, std::shared_ptr<Fitted>>(m, "FitResult", "What `fit` learned.")
      .def_property_readonly("model", &Fitted::model, "The fitted model.")
      .def_property_readonly(
          "notes", [](const Fitted& f) { return f.result().notes; },
          "What was left out or could not be learned, sentences.")
      .def_property_readonly(
          "seconds", [](const Fitted& f) { return f.result().seconds; }, "[s] that the fit took");
  py::class_<Comparison, Result, std::shared_ptr<Comparison>>(
      m, "CompareResult", "A model against measurements, stage by stage.")
      .def_property_readonly(
          "samples", [](const Comparison& c) { return c.result().samples; },
          "Number of samples of all logs.")
      .def_property_readonly(
          "notes", [](const Comparison& c) { return c.result().notes; },
          "What could not be compared, sentences.")
      .def(
          "series",
          [](const py::object& self, const std::string& stage, const std::string& at,
             std::size_t log) {
            return series_of(self, self.cast<const Comparison&>().result(), stage, at, log);
          },
          py::arg("stage"), py::arg("at"), py::arg("log") = 0,
          "(time, measured, predicted) of one quantity of one log as views, SI: stage 'force', "
          "'flow', 'pressure' or 'pump', at a cylinder or pump.");
  m.def("fit", [](const Machine& machine, const py::dict& a) {
    return fit_logs(machine,
                    {a["logs"], a["test"], a["effects"], a["progress"], a["threads"].cast<int>()});
  });
  m.def(
      "compare",
      [](const std::shared_ptr<CraneModel>& model, const py::object& logs) {
        return compare_with(model, true, logs);
      },
      py::arg("model"), py::arg("logs"));
  m.def(
      "compare",
      [](const Machine& machine, const py::object& logs) {
        return compare_with(std::make_shared<CraneModel>(CraneModel::untrained(machine)), false,
                            logs);
      },
      py::arg("machine"), py::arg("logs"));
}

}  // namespace sparflow::python
