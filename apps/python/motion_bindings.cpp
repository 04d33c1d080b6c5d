#include <fmt/format.h>

#include "apps/python/bindings.h"
#include "apps/python/long_call.h"
#include "apps/python/motion.h"
#include "apps/python/result.h"
#include "apps/tasks/argument_range.h"
#include "apps/tasks/evaluate_task.h"
#include "apps/tasks/optimize_task.h"
#include "problems/motion_table.h"
#include "problems/problem_file.h"

namespace sparflow::python {
namespace {

using Task = std::shared_ptr<const ProblemAndModel>;

Problem load_problem_file(const py::object& path, const std::shared_ptr<CraneModel>& model) {
  const Listener listener{warn, warn, {}, {}};
  const std::string file = path_from(path);
  if (model) {
    return {std::make_shared<ProblemAndModel>(load_problem_for(file, *model, listener)), true};
  }
  if (auto both = load_problem_with_model(file, "", listener))
    return {std::make_shared<ProblemAndModel>(std::move(*both)), true};
  auto alone = std::make_shared<ProblemAndModel>();
  alone->problem = load_problem(file);
  return {alone, false};
}

class Planned final : public Result {
 public:
  Planned(Task task, Seeds seeds) : task_(std::move(task)), seeds_(std::move(seeds)) {}
  std::string json() const override { return plan_json(task_->problem, seeds_); }
  std::string text() const override { return plan_table(task_->problem, seeds_); }
  std::string headline() const override { return seeds_.paths.message; }
  Page page() const override { return plan_page(task_->problem, drawn_paths(seeds_)); }
  const Seeds& seeds() const { return seeds_; }

 private:
  Task task_;
  Seeds seeds_;
};

class Optimum final : public Result {
 public:
  Optimum(Task task, Optimized found) : task_(std::move(task)), found_(std::move(found)) {}
  std::string json() const override {
    return optimize_json(task_->model, task_->problem, found_.result);
  }
  std::string text() const override {
    return optimize_table(task_->model, task_->problem, found_.result);
  }
  std::string headline() const override { return motion_headline(found_.result); }
  Page page() const override {
    return motion_page(task_->model, task_->problem, found_.result,
                       compared_motion(found_.seeds, found_.result));
  }
  std::string csv(double rate) const {
    const Trajectory& motion = found_.result.motion;
    return motion_csv(task_->model, task_->problem, rate > 0.0 ? at_rate(motion, rate) : motion);
  }
  const OptimizeResult& result() const { return found_.result; }

 private:
  Task task_;
  Optimized found_;
};

class Priced final : public Result {
 public:
  Priced(Task task, Evaluated done) : task_(std::move(task)), done_(std::move(done)) {}
  std::string json() const override {
    return evaluation_json(task_->model, done_.problem, done_.evaluation);
  }
  std::string text() const override {
    return evaluation_table(task_->model, done_.problem, done_.evaluation);
  }
  std::string headline() const override { return page().headline(); }
  Page page() const override {
    return evaluation_page(task_->model, done_.problem, done_.evaluation);
  }
  std::string csv(double rate) const { return evaluated_csv(task_->model, done_, rate); }
  const Evaluated& done() const { return done_; }

 private:
  Task task_;
  Evaluated done_;
};

std::shared_ptr<Planned> plan_paths(const Problem& problem, const py::dict& a) {
  SeedOptions options;
  options.count = a["paths"].cast<int>();
  options.seconds = a["seconds"].cast<double>();
  options.random_seed = a["seed"].cast<std::uint64_t>();
  const Task task = problem.task;
  std::shared_ptr<Planned> result =
      long_call<Planned>(a["progress"], [task, options](const Listener& listener) {
        Listener stopping = listener;
        stopping.progress = progress_or_stop(listener);
        return std::make_shared<Planned>(task, plan_task(task->problem, options, stopping));
      });
  if (result->seeds().paths.status != SeedStatus::kFound)
    raise_unsolved("InfeasibleError", result->headline(), py::cast(result));
  for (const std::string& r : result->seeds().refused) warn(r);
  return result;
}

std::shared_ptr<Optimum> optimize_motion(const Problem& problem, const py::dict& a) {
  if (!problem.has_model) throw no_model();
  OptimizeTask task;
  task.seeds.count = a["paths"].cast<int>();
  task.seeds.seconds = a["seconds"].cast<double>();
  task.seeds.random_seed = a["seed"].cast<std::uint64_t>();
  task.intervals = a["intervals"].cast<int>();
  task.processes = a["processes"].cast<int>();
  if (!a["start_from"].is_none()) task.from = a["start_from"].cast<const Trajectory&>();
  const bool bound = a["bound"].cast<bool>();
  const Task both = problem.task;
  std::shared_ptr<Optimum> result =
      long_call<Optimum>(a["progress"], [both, task, bound](const Listener& listener) {
        Optimized found = optimize_task(both->model, both->problem, task, listener);
        if (bound && found.result.motion.size() > 1)
          add_bound(both->model, both->problem, listener, found.result);
        return std::make_shared<Optimum>(both, std::move(found));
      });
  const OptimizeResult& r = result->result();
  if (r.status == OptimizeStatus::kInfeasible)
    raise_unsolved("InfeasibleError", r.message, py::cast(result));
  if (r.status == OptimizeStatus::kFailed)
    raise_unsolved("NotConvergedError", r.message, py::cast(result));
  return result;
}

OwnMotion motion_from(const py::object& given, const Machine& machine, const std::string& mapping) {
  if (py::isinstance<Trajectory>(given))
    return own_motion("trajectory", given.cast<const Trajectory&>(), machine);
  if (py::isinstance<Log>(given)) return own_motion(given.cast<const Log&>(), machine);
  if (py::isinstance<py::dict>(given))
    return own_motion("columns", columns_from(given.cast<py::dict>()), machine, mapping);
  return load_own_motion(path_from(given), machine, mapping, {warn, warn, {}, {}});
}

/// @param problem null: the machine's own limits judge
std::shared_ptr<Priced> price_motion(const Problem* problem,
                                     const std::shared_ptr<CraneModel>& model, const py::dict& a) {
  Task both;
  if (problem != nullptr) {
    if (!problem->has_model) throw no_model();
    both = problem->task;
  } else {
    both = std::make_shared<ProblemAndModel>(ProblemAndModel{{}, *model});
  }
  EvaluateTask task;
  task.verb = "price";
  if (!a["payload_kg"].is_none()) {
    task.payload = a["payload_kg"].cast<double>();
    require_range("price: --payload", task.payload, 0.0, 1e6);
  }
  auto motion = std::make_shared<OwnMotion>(
      motion_from(a["motion"], both->model.machine, a["mapping"].cast<std::string>()));
  const bool by_problem = problem != nullptr;
  return long_call<Priced>(py::none(), [both, task, motion, by_problem](const Listener&) {
    return std::make_shared<Priced>(
        both, evaluate_task(both->model, by_problem ? &both->problem : nullptr, std::move(*motion),
                            task));
  });
}

void bind_price(py::module_& m) {
  py::class_<Priced, Result, std::shared_ptr<Priced>>(m, "PriceResult",
                                                      "A motion of one's own and what it costs.")
      .def_property_readonly(
          "energy_exact_J", [](const Priced& p) { return p.done().evaluation.energy.total; },
          "[J] by the exact law")
      .def_property_readonly(
          "duration_s", [](const Priced& p) { return p.done().evaluation.motion.duration(); },
          "[s] of the motion")
      .def_property_readonly(
          "payload_kg", [](const Priced& p) { return p.done().problem.payload; },
          "[kg] that it is priced with")
      .def_property_readonly(
          "limits_kept", [](const Priced& p) { return limits_kept(p.done().evaluation); },
          "Whether every limit is kept, by the measure of optimize.")
      .def_property_readonly(
          "notes", [](const Priced& p) { return p.done().evaluation.notes; },
          "What was found by smoothing, left out or missing, sentences.")
      .def_property_readonly(
          "motion", [](const Priced& p) -> const Trajectory& { return p.done().evaluation.motion; },
          py::return_value_policy::reference_internal, "The motion that was priced, a Trajectory.")
      .def("motion_csv", &Priced::csv, py::arg("rate") = 0.0,
           "The text that `-o MOTION.csv` writes; rate [Hz], 0 is as in the motion.");
  m.def("price", &price_motion);
}

}  // namespace

void raise_unsolved(const char* type, const std::string& sentence, const py::object& result) {
  const py::object cls = py::module_::import("sparflow._errors").attr(type);
  py::object error = cls(in_python_words(sentence));
  error.attr("result") = result;
  PyErr_SetObject(cls.ptr(), error.ptr());
  throw py::error_already_set();
}

void bind_motion(py::module_& m) {
  py::class_<Problem>(m, "Problem", "A motion to be planned, from rest to rest, with its model.")
      .def_static("load", &load_problem_file, py::arg("path"), py::arg("model") = nullptr,
                  "Reads a problem file (YAML, docs/problem_file.md) and the model that it names, "
                  "unless one is given. Raises InputError.")
      .def_property_readonly(
          "name", [](const Problem& p) { return p.task->problem.name; }, "Name in its file.")
      .def_property_readonly(
          "payload", [](const Problem& p) { return p.task->problem.payload; }, "[kg] at the tip");
  const auto viewed = [](auto member) {
    return [member](const py::object& self) {
      return view(self.cast<const Trajectory&>().*member, self);
    };
  };
  py::class_<Trajectory>(m, "Trajectory",
                         "A motion; rows are instants, columns the machine's joints. Views.")
      .def_property_readonly("t", viewed(&Trajectory::t), "[s] of each row")
      .def_property_readonly("q", viewed(&Trajectory::q), "[rad] or [m]")
      .def_property_readonly("qd", viewed(&Trajectory::qd), "[rad/s] or [m/s]")
      .def_property_readonly("qdd", viewed(&Trajectory::qdd), "[rad/s^2] or [m/s^2]")
      .def_property_readonly("duration", &Trajectory::duration,
                             "[s] from the first to the last row")
      .def("__len__", &Trajectory::size);
  py::class_<Planned, Result, std::shared_ptr<Planned>>(m, "PlanResult", "Collision-free paths.")
      .def_property_readonly(
          "paths",
          [](const py::object& self) {
            py::list paths;
            for (const SeedPath& p : self.cast<const Planned&>().seeds().paths.paths)
              paths.append(view(p.path, self));
            return paths;
          },
          "Waypoints of each path [waypoints x joints], [rad] or [m], as views.");
  py::class_<Optimum, Result, std::shared_ptr<Optimum>>(m, "OptimizeResult",
                                                        "The energy-optimal motion.")
      .def_property_readonly(
          "status", [](const Optimum& o) { return to_string(o.result().status); },
          "'optimal', 'feasible', 'infeasible', 'failed' or 'interrupted'.")
      .def_property_readonly(
          "energy_exact_J", [](const Optimum& o) { return o.result().energy.total; },
          "[J] by the exact law")
      .def_property_readonly(
          "duration_s", [](const Optimum& o) { return o.result().duration; }, "[s] of the motion")
      .def_property_readonly(
          "interrupted",
          [](const Optimum& o) {
            return o.result().interrupted || o.result().status == OptimizeStatus::kInterrupted;
          },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def_property_readonly(
          "motion", [](const Optimum& o) -> const Trajectory& { return o.result().motion; },
          py::return_value_policy::reference_internal, "The motion, a Trajectory.")
      .def("motion_csv", &Optimum::csv, py::arg("rate") = 0.0,
           "The text that `-o MOTION.csv` writes; rate [Hz], 0 is the mesh of the solve.");
  m.def("plan", &plan_paths);
  m.def("optimize", &optimize_motion);
  bind_price(m);
}

}  // namespace sparflow::python
