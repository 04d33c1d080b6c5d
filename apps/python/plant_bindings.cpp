/// The dynamic plant: simulate and benchmark, with controllers written in Python.
#include <fmt/format.h>

#include <deque>

#include "apps/python/bindings.h"
#include "apps/python/kept_parts.h"
#include "apps/python/long_call.h"
#include "apps/python/result.h"
#include "apps/report/motion_pages/benchmark_page.h"
#include "apps/tasks/benchmark/benchmark_task.h"
#include "apps/tasks/simulate/simulate_task.h"
#include "apps/tasks/trust/trust_task.h"
#include "models/math/error.h"
#include "simulator/controllers/foreign_process.h"
#include "simulator/plant/parameters/plant_effects.h"

namespace sparflow::python {
namespace {

/// Asks a Python function that takes and gives a line of JSON, by the calling thread.
/// @param ask must stay where it is while the call lasts, because only the calling thread may count its references
control::Ask asked_in_python(const py::object& ask, const std::shared_ptr<Telling>& telling) {
  return [&ask, telling](const std::string& line, double) {
    std::string answer;
    in_calling_thread(*telling, [&] { answer = py::cast<std::string>(ask(line)); });
    return answer;
  };
}

/// A text of Python, which may have characters that UTF-8 lacks; these become question marks. @throws what Python raised
std::string replaced_text(const py::object& text) {
  return py::cast<std::string>(py::str(text).attr("encode")("utf-8", "replace"));
}

/// What Python raised in a call, in words; "" where nothing. Ctrl-C and the like go on. The lock is held.
std::string failure_of(const std::function<void()>& call) {
  try {
    call();
    return "";
  } catch (py::error_already_set& e) {
    if (!e.matches(PyExc_Exception)) throw;
    const std::string name = replaced_text(e.type().attr("__name__"));
    try {
      return fmt::format("{}: {}", name, replaced_text(e.value()));
    } catch (py::error_already_set& untold) {  // an exception of the caller's own may have no text
      if (!untold.matches(PyExc_Exception)) throw;
      return name;
    }
  }
}

/// The same where what the function raises is a failure of its run and no end of all of them.
control::Ask asked_or_failed(const py::object& ask, const std::shared_ptr<Telling>& telling) {
  return [&ask, telling](const std::string& line, double t) {
    std::string answer, raised;
    in_calling_thread(
        *telling, [&] { raised = failure_of([&] { answer = py::cast<std::string>(ask(line)); }); });
    if (raised.empty()) return answer;
    throw control::ControllerFailure(
        fmt::format("its function raised {} at t = {:.2f} s", raised, t));
  };
}

class Simulated final : public Result {
 public:
  explicit Simulated(Simulation simulation) : simulation_(std::move(simulation)) {}
  std::string json() const override { return simulation_json(simulation_); }
  std::string text() const override { return simulation_table(simulation_, ""); }
  std::string headline() const override { return simulation_headline(simulation_); }
  Page page() const override { return simulation_page(simulation_view(simulation_)); }
  const Simulation& simulation() const { return simulation_; }
  std::shared_ptr<Log> log() const {
    if (log_) return log_;
    log_ = std::make_shared<Log>(log_from_text("simulated", simulation_.log, *simulation_.machine));
    for (const std::string& w : log_->warnings) warn(w);
    return log_;
  }

 private:
  Simulation simulation_;
  mutable std::shared_ptr<Log> log_;  // once it was asked for
};

class Benchmarked final : public Result {
 public:
  explicit Benchmarked(BenchmarkResult result) : result_(std::move(result)) {}
  std::string json() const override { return benchmark_json(result_); }
  std::string text() const override { return benchmark_table(result_); }
  std::string headline() const override { return benchmark_headline(result_); }
  Page page() const override { return benchmark_page(benchmark_view(result_)); }
  const BenchmarkResult& result() const { return result_; }

 private:
  BenchmarkResult result_;
};

class Trusted final : public Result {
 public:
  explicit Trusted(TrustLoop loop)
      : loop_(std::move(loop)),
        before_(std::make_shared<CraneModel>(loop_.before())),
        after_(std::make_shared<CraneModel>(loop_.after())) {}
  std::string json() const override { return trust_json(loop_); }
  std::string text() const override { return trust_table(loop_); }
  std::string headline() const override { return trust_headline(loop_); }
  Page page() const override { return trust_page(loop_); }
  const TrustLoop& loop() const { return loop_; }
  std::shared_ptr<CraneModel> before() const { return before_; }
  std::shared_ptr<CraneModel> after() const { return after_; }

 private:
  TrustLoop loop_;
  std::shared_ptr<CraneModel> before_, after_;
};

std::shared_ptr<Trusted> loop_of_trust(const std::shared_ptr<Machine>& machine, const py::dict& a) {
  TrustTask task;
  task.effects = a["effects"].cast<std::vector<std::string>>();
  task.train_seconds = a["train_seconds"].cast<double>();
  task.test_seconds = a["test_seconds"].cast<double>();
  task.rate = a["rate"].cast<double>();
  task.most_effects = a["most_effects"].cast<int>();
  task.moves = a["moves"].cast<int>();
  task.seed = a["seed"].cast<std::uint64_t>();
  task.processes = a["processes"].cast<int>();
  return long_call<Trusted>(a["progress"], [machine, task](const Listener& listener) {
    return std::make_shared<Trusted>(trust_task(machine, task, listener));
  });
}

/// Positions by joint for those that Python names, the middle of their ranges for others. @throws KeyError
std::vector<double> start_of(const py::dict& given, const Machine& machine) {
  std::vector<double> start;
  start.reserve(machine.joints.size());
  for (const Joint& j : machine.joints) start.push_back(0.5 * (j.position.lo + j.position.hi));
  const std::vector<std::string> names = joint_names(machine);
  for (const auto& [name, value] : given)
    start[index_of(names, py::cast<std::string>(name), "joint")] = py::cast<double>(value);
  return start;
}

std::shared_ptr<Simulated> simulate(const std::shared_ptr<Machine>& machine, const py::dict& a) {
  SimulateTask task;
  const auto text = [&](const char* key) {
    return a[key].is_none() ? std::string() : path_from(a[key]);
  };
  task.effects = a["effects"].cast<std::vector<std::string>>();
  task.plant = text("plant");
  task.programme = a["programme"].cast<std::string>();
  task.replay = text("replay");
  task.motion = a["motion"].is_none() ? "" : py::cast<std::string>(py::str(a["motion"]));
  if (py::isinstance<Trajectory>(a["track"])) {
    task.trajectory = a["track"].cast<const Trajectory&>();
  } else {
    task.track = text("track");
  }
  task.seconds = a["seconds"].cast<double>();
  task.rate = a["rate"].cast<double>();
  task.seed = a["seed"].cast<std::uint64_t>();
  if (!a["payload_kg"].is_none()) task.payload = a["payload_kg"].cast<double>();
  const std::shared_ptr<Telling> telling = new_telling();
  const py::object ask = a["ask"];
  if (!ask.is_none()) {
    task.start = start_of(a["start"], *machine);
    task.controller = [&ask, telling](const control::Knowledge& know) {
      return control::asked_controller(know, "simulate: the controller",
                                       asked_in_python(ask, telling));
    };
  }
  std::shared_ptr<Simulated> result = long_call<Simulated>(
      a["progress"],
      [machine, task](const Listener& listener) {
        return std::make_shared<Simulated>(simulate_task(machine, task, listener));
      },
      telling);
  const Simulation& s = result->simulation();
  if (!s.whole()) warn(fmt::format("the run ended at {:.2f} s: {}", s.time, s.message));
  return result;
}

/// A controller of the caller's own as Python gives it.
struct Function {
  std::string name, words;
  py::object make;               ///< gives what is asked in a run
  std::deque<py::object> asked;  ///< one a run; the calling thread alone makes and ends them
};

std::deque<Function> functions_of(const py::list& given) {
  std::deque<Function> all;
  for (const py::handle item : given) {
    auto [name, words, make] = item.cast<std::tuple<std::string, std::string, py::object>>();
    all.push_back({name, words, make, {}});
  }
  return all;
}

/// Begins a run: the controller of a class starts anew. What its constructor raises is the run's failure.
std::unique_ptr<control::Controller> begun(Function& function, const control::Knowledge& know,
                                           const std::shared_ptr<Telling>& telling) {
  std::string raised;
  in_calling_thread(
      *telling, [&] { raised = failure_of([&] { function.asked.push_back(function.make()); }); });
  if (!raised.empty()) throw control::ControllerFailure("its function raised " + raised);
  return control::asked_controller(know, "its function",
                                   asked_or_failed(function.asked.back(), telling));
}

BenchmarkTask benchmark_of(const py::dict& a) {
  BenchmarkTask task;
  for (const py::handle path : a["scenarios"])
    task.scenarios.push_back(path_from(py::reinterpret_borrow<py::object>(path)));
  task.controllers = a["controllers"].cast<std::vector<std::string>>();
  task.no_others = a["no_others"].cast<bool>();
  task.processes = a["processes"].cast<std::vector<std::string>>();
  task.gains = a["gains"].cast<std::vector<std::string>>();
  if (py::isinstance<CraneModel>(a["model"])) {
    task.model = a["model"].cast<std::shared_ptr<CraneModel>>();
  } else if (!a["model"].is_none()) {
    task.model_file = path_from(a["model"]);
  }
  task.reference = a["reference"].cast<std::string>();
  task.seeds = a["seeds"].cast<int>();
  task.jobs = a["jobs"].cast<int>();
  task.step_budget = a["step_budget_s"].cast<double>();
  task.no_optimum = !a["optimum"].cast<bool>();
  task.sway_limit = a["sway_deg"].cast<double>();
  task.no_bound = !a["bound"].cast<bool>();
  return task;
}

std::shared_ptr<Benchmarked> run_benchmark(const py::dict& a) {
  BenchmarkTask task = benchmark_of(a);
  std::deque<Function> functions = functions_of(a["functions"]);
  const std::shared_ptr<Telling> telling = new_telling();
  task.own.reserve(functions.size());
  for (Function& function : functions) {
    task.own.push_back(
        {function.name, function.words, [&function, telling](const control::Knowledge& know) {
           return begun(function, know, telling);
         }});
  }
  const auto work =
      std::make_shared<BenchmarkWork>(benchmark_work(task, Listener{warn, warn, {}, {}}));
  std::string options = benchmark_fingerprint(*work, task);
  if (task.model) options += "; " + identity_of(*task.model);
  const std::shared_ptr<Journal> journal = journal_of("benchmark", a, {}, options);
  return long_call<Benchmarked>(
      a["progress"],
      [work, task, journal](const Listener& listener) {
        tell_of_trouble(*journal, listener);
        auto done = std::make_shared<Benchmarked>(benchmark_task(*work, task, *journal, listener));
        if (!done->result().interrupted && done->result().broken == 0) journal->remove();
        return done;
      },
      telling);
}

const char* status_of(const Simulation& s) {
  if (s.interrupted) return "interrupted";
  return s.status == plant::RunStatus::kRunning         ? "done"
         : s.status == plant::RunStatus::kKinematicsEnd ? "kinematics_end"
                                                        : "failed";
}

double sum_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum;
}

}  // namespace

void bind_plant(py::module_& m) {
  py::class_<Simulated, Result, std::shared_ptr<Simulated>>(m, "Simulation",
                                                            "What the dynamic plant did.")
      .def_property_readonly("log", &Simulated::log, "Its measurements as a Log.")
      .def_property_readonly(
          "csv", [](const Simulated& s) { return s.simulation().log; },
          "The text of the log that `-o LOG.csv` writes (docs/log_format.md).")
      .def_property_readonly(
          "status", [](const Simulated& s) { return status_of(s.simulation()); },
          "'done', 'interrupted', 'kinematics_end' or 'failed'.")
      .def_property_readonly(
          "interrupted", [](const Simulated& s) { return s.simulation().interrupted; },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def_property_readonly(
          "seconds", [](const Simulated& s) { return s.simulation().time; }, "[s] of the plant")
      .def_property_readonly(
          "pump_work_J", [](const Simulated& s) { return sum_of(s.simulation().ledger.pump_work); },
          "[J] ideal work of all pumps on their oil")
      .def_property_readonly(
          "energy_J", [](const Simulated& s) { return sum_of(s.simulation().ledger.delivered); },
          "[J] integral of the pumps' pressure times flow into the valves");
  py::class_<Benchmarked, Result, std::shared_ptr<Benchmarked>>(
      m, "BenchmarkResult", "Controllers compared on the dynamic plant, a row a run.")
      .def_property_readonly(
          "interrupted", [](const Benchmarked& b) { return b.result().interrupted; },
          "Whether Ctrl-C ended it, so that something is missing.")
      .def_property_readonly(
          "controllers", [](const Benchmarked& b) { return b.result().controllers; },
          "Names of the controllers, in the order of the table.")
      .def(
          "csv", [](const Benchmarked& b) { return benchmark_csv(b.result()); },
          "The text that `--csv` writes.");
  py::class_<Trusted, Result, std::shared_ptr<Trusted>>(
      m, "TrustLoop",
      "Predicted energy against true energy on the plant, before and after improve.")
      .def_property_readonly("before", &Trusted::before, "The model as it was fitted.")
      .def_property_readonly("after", &Trusted::after, "The model that improve made of it.")
      .def_property_readonly(
          "interrupted", [](const Trusted& t) { return t.loop().interrupted; },
          "Whether Ctrl-C ended it, so that something is missing.");
  m.def("plant_effects", &plant::effects_help,
        "Lists the effects that `simulate` can switch: name, nominal value, what it is.");
  m.def("simulate", &simulate);
  m.def("benchmark", &run_benchmark);
  m.def("loop_of_trust", &loop_of_trust);
}

}  // namespace sparflow::python
