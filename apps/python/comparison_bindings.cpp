/// Comparisons of motions: strategies, energy against time, and recorded moves beside their optimum.
#include <fmt/format.h>

#include "apps/python/kept_parts.h"
#include "apps/python/long_call.h"
#include "apps/python/motion.h"
#include "apps/python/result.h"
#include "apps/report/motion_pages/pareto_page.h"
#include "apps/report/motion_pages/strategies_page.h"
#include "apps/tasks/argument_range.h"
#include "apps/tasks/audit_task.h"
#include "apps/tasks/inputs.h"
#include "apps/tasks/pareto_task.h"
#include "apps/tasks/strategies_task.h"
#include "models/files/engine_map_file.h"
#include "problems/motion_table.h"

namespace sparflow::python {
namespace {

class Strategies final : public Result {
 public:
  Strategies(std::vector<SharedProblem> problems, ComparedStrategies compared)
      : problems_(std::move(problems)), compared_(std::move(compared)) {}
  std::string json() const override {
    return strategies_json(compared_.all, machines_of(problems_));
  }
  std::string text() const override { return strategies_table(compared_.all); }
  std::string headline() const override { return page().headline(); }
  Page page() const override {
    const ProblemAndModel* one = problems_.size() == 1 ? problems_.front().get() : nullptr;
    return strategies_page(compared_.all, one ? &one->model : nullptr,
                           one ? &one->problem : nullptr);
  }
  const ComparedStrategies& compared() const { return compared_; }
  /// @throws KeyError where the row or the strategy is not there or has no motion
  const Trajectory& motion(const std::string& kind, const std::string& row,
                           std::size_t problem) const {
    if (problem >= compared_.all.size())
      throw py::index_error(
          fmt::format("no problem {}; there are {}", problem, compared_.all.size()));
    const StrategyRow* there = compared_.all[problem].row(row);
    const StrategyOutcome* outcome = there != nullptr ? there->find(kind) : nullptr;
    if (outcome == nullptr || !outcome->found())
      throw py::key_error(fmt::format("there is no motion of strategy \"{}\" at time \"{}\"{}",
                                      kind, row, outcome == nullptr ? "" : ": " + outcome->why));
    return outcome->motion;
  }

 private:
  std::vector<SharedProblem> problems_;
  ComparedStrategies compared_;
};

class Pareto final : public Result {
 public:
  Pareto(std::shared_ptr<const ProblemAndModel> both, ParetoCurve curve)
      : both_(std::move(both)), curve_(std::move(curve)) {}
  std::string json() const override { return pareto_json(both_->problem, curve_); }
  std::string text() const override { return pareto_table(both_->problem, curve_); }
  std::string headline() const override { return page().headline(); }
  Page page() const override { return pareto_page(both_->model, both_->problem, curve_); }
  const ParetoCurve& curve() const { return curve_; }

 private:
  std::shared_ptr<const ProblemAndModel> both_;
  ParetoCurve curve_;
};

class Audited final : public Result {
 public:
  Audited(std::shared_ptr<const CraneModel> model, AuditResult result)
      : model_(std::move(model)), result_(std::move(result)) {}
  std::string json() const override { return audit_json(*model_, result_); }
  std::string text() const override { return audit_table(*model_, result_); }
  std::string headline() const override { return page().headline(); }
  Page page() const override { return audit_page(*model_, result_); }
  const AuditResult& result() const { return result_; }
  std::string csv(std::size_t move) const {
    if (move >= result_.moves.size())
      throw py::index_error(fmt::format("no move {}; there are {}", move, result_.moves.size()));
    const AuditedMove& m = result_.moves[move];
    if (!m.audit.judged())
      throw py::key_error(fmt::format("move {} was not judged: {}", move, m.audit.not_judged));
    return motion_csv(*model_, m.audit.best, m.payload,
                      least_flows(model_->machine, m.audit.problem.limits));
  }

 private:
  std::shared_ptr<const CraneModel> model_;
  AuditResult result_;
};

/// A number of which a negative one stands for none in the task, but not in Python. @throws UsageError outside 0 to `most`
double number_given(const char* option, const py::object& value, double most) {
  const auto number = value.cast<double>();
  require_range(option, number, 0.0, most);
  return number;
}

/// All that a comparison depends on but its problems. The number of processes is no part of it.
std::string options_of(const StrategiesTask& task, const py::dict& a) {
  return fmt::format(
      "strategies --time {} --idle {} --paths {} --orders {} --seed {} --intervals {}",
      a["time"].cast<std::string>(), task.idle_kw, task.seeds.count,
      task.options.baselines.polished_orders, task.seeds.random_seed, task.intervals);
}

std::shared_ptr<Strategies> compare_problems(const std::vector<Problem>& given, const py::dict& a) {
  StrategiesTask task;
  read_times(a["time"].cast<std::string>(), task.options);
  task.options.baselines.polished_orders = a["orders"].cast<int>();
  task.seeds.count = a["paths"].cast<int>();
  task.seeds.random_seed = a["seed"].cast<std::uint64_t>();
  if (!a["idle_kW"].is_none())
    task.idle_kw = number_given("strategies: --idle", a["idle_kW"], 1000.0);
  task.intervals = a["intervals"].cast<int>();
  task.processes = a["processes"].cast<int>();
  check_ranges(task);
  const Listener listener{warn, warn, {}, {}};
  std::vector<SharedProblem> problems;
  problems.reserve(given.size());
  for (const Problem& p : given) {
    if (!p.has_model) throw no_model();
    check_strategies_problem(task, *p.task, listener);
    problems.push_back(p.task);
  }
  if (problems.empty()) throw UsageError("strategies: expected at least one problem, got none");
  std::vector<std::string> files;
  std::string options = options_of(task, a);
  for (const SharedProblem& p : problems) {
    files.push_back(p->problem.file);
    options += "; " + identity_of(p->model);
  }
  const std::shared_ptr<Journal> journal = journal_of("strategies", a, files, options);
  std::shared_ptr<Strategies> result =
      long_call<Strategies>(a["progress"], [problems, task, journal](const Listener& working) {
        tell_of_trouble(*journal, working);
        auto done = std::make_shared<Strategies>(
            problems, strategies_task(problems, task, *journal, working));
        const ComparedStrategies& c = done->compared();
        if (!c.interrupted && !any_interrupted(c.all) && c.broken == 0) journal->remove();
        return done;
      });
  if (!result->compared().has_optimum())
    raise_unsolved("InfeasibleError", result->headline(), py::cast(result));
  return result;
}

std::shared_ptr<Pareto> energy_over_time(const Problem& problem, const py::dict& a) {
  if (!problem.has_model) throw no_model();
  require_pressures(problem.task->model, problem.task->problem.file, "model");
  ParetoTask task;
  task.points = a["points"].cast<int>();
  task.longest = a["longest"].cast<double>();
  task.idle_kw = a["idle_kW"].cast<std::vector<double>>();
  task.seeds.count = a["paths"].cast<int>();
  task.seeds.random_seed = a["seed"].cast<std::uint64_t>();
  task.intervals = a["intervals"].cast<int>();
  task.processes = a["processes"].cast<int>();
  const std::shared_ptr<Journal> journal = journal_of(
      "pareto", a, {problem.task->problem.file},
      fmt::format(
          "pareto --points {} --longest {} --idle {} --paths {} --seed {} --intervals {}; {}",
          task.points, task.longest, fmt::join(task.idle_kw, ","), task.seeds.count,
          task.seeds.random_seed, task.intervals, identity_of(problem.task->model)));
  std::shared_ptr<Pareto> result = long_call<Pareto>(
      a["progress"], [both = problem.task, task, journal](const Listener& listener) {
        tell_of_trouble(*journal, listener);
        auto done = std::make_shared<Pareto>(both, pareto_task(*both, task, *journal, listener));
        if (!done->curve().interrupted) journal->remove();
        return done;
      });
  if (result->curve().points.empty())
    raise_unsolved("InfeasibleError", result->curve().message, py::cast(result));
  return result;
}

std::shared_ptr<Audited> audit_logs(const std::shared_ptr<CraneModel>& model, const py::dict& a) {
  require_pressures(*model, model->machine.name, "cylinders");
  AuditTask task;
  if (!a["payload_kg"].is_none())
    task.payload = number_given("audit: --payload", a["payload_kg"], 1e6);
  task.litres_per_kWh = a["litres_per_kWh"].cast<double>();
  if (!a["engine_map"].is_none()) task.engine = load_engine_map(path_from(a["engine_map"]));
  task.cutting.pause_s = a["pause_s"].cast<double>();
  task.most = a["moves"].cast<int>();
  task.bound = a["bound"].cast<bool>();
  task.processes = a["processes"].cast<int>();
  check_ranges(task);
  auto logs = std::make_shared<std::vector<Log>>(logs_from(a["logs"], model->machine));
  if (logs->empty()) throw UsageError("audit: expected at least one log, got none");
  return long_call<Audited>(a["progress"], [model, logs, task](const Listener& listener) {
    return std::make_shared<Audited>(model, audit_task(*model, std::move(*logs), task, listener));
  });
}

void bind_audit(py::module_& m) {
  const auto within = py::return_value_policy::reference_internal;
  py::class_<AuditedMove>(m, "AuditedMove", "A recorded move and the motion proposed in its place.")
      .def_readonly("log", &AuditedMove::log, "Name of its log.")
      .def_readonly("begin", &AuditedMove::from, "[s] of the log")
      .def_readonly("end", &AuditedMove::to, "[s] of the log")
      .def_readonly("payload", &AuditedMove::payload, "[kg]")
      .def_readonly("measured_J", &AuditedMove::measured,
                    "[J] by logged pressures and measured speeds, NaN without pressures")
      .def_readonly("recorded", &AuditedMove::recorded, "The recorded motion, a Trajectory.")
      .def_property_readonly(
          "proposed", [](const AuditedMove& v) -> const Trajectory& { return v.audit.best; },
          within, "The energy-optimal motion, a Trajectory; empty where the move is not judged.")
      .def_property_readonly(
          "not_judged", [](const AuditedMove& v) { return v.audit.not_judged; },
          "Why the move is not judged, a sentence; '' where it is.")
      .def_property_readonly(
          "saving_J", [](const AuditedMove& v) { return v.audit.saving(); },
          "[J] energy of the recorded motion less that of the proposed one, by the model");
  py::class_<Audited, Result, std::shared_ptr<Audited>>(
      m, "AuditResult", "Recorded moves, each beside its energy-optimal motion.")
      .def_property_readonly(
          "moves",
          [](const py::object& self) {
            py::list all;
            for (const AuditedMove& v : self.cast<const Audited&>().result().moves)
              all.append(py::cast(&v, py::return_value_policy::reference_internal, self));
            return all;
          },
          "The moves that were examined, in order of time.")
      .def_property_readonly(
          "interrupted", [](const Audited& r) { return r.result().interrupted; },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def("motion_csv", &Audited::csv, py::arg("move"),
           "The proposed motion of a judged move as the text of a motion file (docs/commands.md).");
  m.def("audit", &audit_logs);
}

}  // namespace

void bind_comparison(py::module_& m) {
  py::class_<Strategies, Result, std::shared_ptr<Strategies>>(
      m, "StrategiesResult", "Sequential, simultaneous and energy-optimal motions compared.")
      .def_property_readonly(
          "interrupted",
          [](const Strategies& r) {
            return r.compared().interrupted || any_interrupted(r.compared().all);
          },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def("motion", &Strategies::motion, py::arg("strategy"), py::arg("time") = "equal",
           py::arg("problem") = 0, py::return_value_policy::reference_internal,
           "The Trajectory of a strategy ('optimal', 'sequential', 'simultaneous', ...) at a time\n"
           "('equal', 'own', '1.5 x shortest') in a problem by its number.");
  py::class_<Pareto, Result, std::shared_ptr<Pareto>>(m, "ParetoResult",
                                                      "The least energy over the duration.")
      .def_property_readonly(
          "interrupted", [](const Pareto& r) { return r.curve().interrupted; },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def_property_readonly(
          "shortest_s", [](const Pareto& r) { return r.curve().shortest; },
          "[s] of the fastest motion found")
      .def(
          "csv", [](const Pareto& r) { return pareto_csv(r.curve()); },
          "The text that `-o CURVE.csv` writes.")
      .def(
          "motion",
          [](const Pareto& r, std::size_t point) -> const Trajectory& {
            if (point >= r.curve().points.size())
              throw py::index_error(
                  fmt::format("no point {}; there are {}", point, r.curve().points.size()));
            return r.curve().points[point].optimal.motion;
          },
          py::arg("point"), py::return_value_policy::reference_internal,
          "The energy-optimal Trajectory of a point, by its number from the shortest duration.");
  m.def("strategies", &compare_problems);
  m.def("pareto", &energy_over_time);
  bind_audit(m);
}

}  // namespace sparflow::python
