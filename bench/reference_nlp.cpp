// reference_nlp PROBLEM.json [--json OUT.json]: solves the reference NLP and reports where the time is spent.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bench/program_options.h"
#include "bench/reference_model.h"
#include "models/math/error.h"
#include "optimizer/nlp/ipopt_solver.h"

namespace {

using namespace sparflow;

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string host() {
  char name[256] = "unknown";
  gethostname(name, sizeof(name) - 1);
  return name;
}

struct Arguments {
  std::string problem, json;
  int repeat = 1;
  NlpOptions options;
};

struct Outcome {
  NlpResult result;
  double energy_kJ = 0.0;
  double setup_s = 0.0;  ///< reading the file and laying out the NLP
};

/// Solves `repeat` times from the same start and reports the run with the median solve time.
Outcome run(const Arguments& arguments) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  const auto problem = std::make_shared<const bench::ReferenceProblem>(
      bench::read_reference_problem(arguments.problem));
  Transcription nlp = bench::reference_transcription(problem);
  Outcome outcome;
  outcome.setup_s = std::chrono::duration<double>(Clock::now() - begin).count();
  std::vector<NlpResult> results;
  for (int i = 0; i < arguments.repeat; ++i) {
    // Each run has a new transcription, so that it does not use data of the run before.
    Transcription fresh = bench::reference_transcription(problem);
    results.push_back(solve_with_ipopt(fresh, arguments.options));
  }
  std::sort(results.begin(), results.end(),
            [](const NlpResult& a, const NlpResult& b) { return a.solve_s < b.solve_s; });
  outcome.result = results[results.size() / 2];
  outcome.energy_kJ = nlp.model_cost(outcome.result.x);
  return outcome;
}

nlohmann::json as_json(const Outcome& outcome, const Arguments& arguments) {
  const NlpResult& r = outcome.result;
  return {{"status", to_string(r.status)},
          {"objective", r.objective},
          {"energy_kJ", outcome.energy_kJ},
          {"iterations", r.iterations},
          {"restoration_iterations", r.restoration_iterations},
          {"solve_s", r.solve_s},
          {"callbacks_s", r.callbacks_s},
          {"linear_solver_s", r.linear_solver_s},
          {"kkt_solver", to_string(r.kkt_solver)},
          {"solve_cpu_s", r.solve_cpu_s},
          {"callbacks_cpu_s", r.callbacks_cpu_s},
          {"setup_s", outcome.setup_s},
          {"constraint_violation", r.max_violation},
          {"evaluations",
           {{"objective", r.evaluations.objective},
            {"gradient", r.evaluations.gradient},
            {"constraints", r.evaluations.constraints},
            {"jacobian", r.evaluations.jacobian},
            {"hessian", r.evaluations.hessian}}},
          {"options", r.options_used},
          {"runs", arguments.repeat},
          {"kernel", kernel_isa_name(kernel_isa())},
          {"compiler", "g++ " __VERSION__},
          {"host", host()},
          {"cpu", processor()}};
}

void print(const Outcome& outcome, const Arguments& arguments) {
  const NlpResult& r = outcome.result;
  const NlpEvaluations& e = r.evaluations;
  const double rest = r.solve_s - r.callbacks_s - r.linear_solver_s;
  fmt::print(
      "{}: {} after {} iterations\n"
      "  objective        {:.9f}   (energy {:.9f} kJ + acceleration term {:.9f})\n"
      "  violation        {:.2e}\n"
      "  evaluations      {} objective, {} gradient, {} constraints, {} Jacobian, {} Hessian\n"
      "                      wall ms    cpu ms   (median of {} runs, one core)\n"
      "  solve            {:10.2f}{:10.2f}\n"
      "    callbacks      {:10.2f}{:10.2f}   model and derivatives, {} kernels\n"
      "    linear solver  {:10.2f}             {}, and assembling its matrix\n"
      "    rest of Ipopt  {:10.2f}\n"
      "  before           {:10.2f}             reading the file, laying out the NLP\n",
      arguments.problem, to_string(r.status), r.iterations, r.objective, outcome.energy_kJ,
      r.objective - outcome.energy_kJ, r.max_violation, e.objective, e.gradient, e.constraints,
      e.jacobian, e.hessian, arguments.repeat, 1e3 * r.solve_s, 1e3 * r.solve_cpu_s,
      1e3 * r.callbacks_s, 1e3 * r.callbacks_cpu_s, kernel_isa_name(kernel_isa()),
      1e3 * r.linear_solver_s, to_string(r.kkt_solver), 1e3 * rest, 1e3 * outcome.setup_s);
  if (!r.solved()) fmt::print("  {}\n", r.message);
}

int solve(const Arguments& arguments) {
  const Outcome outcome = run(arguments);
  print(outcome, arguments);
  if (!arguments.json.empty()) {
    write_file_atomically(arguments.json, as_json(outcome, arguments).dump(2) + "\n");
  }
  return outcome.result.solved() ? 0 : 4;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  bench::ProgramOptions app(
      "Solves the reference NLP (bench/data/reference_problem.json) with Ipopt.");
  app.add("problem", arguments.problem, "the problem file (JSON)").required();
  app.add("--json", arguments.json, "file for the result (JSON)");
  app.add("--repeat", arguments.repeat, "number of solves, of which the median run is reported")
      .range(1, 10000);
  app.add("--tol", arguments.options.tolerance, "Ipopt's tolerance (default 1e-6)").positive();
  std::string kkt = arguments.options.kkt_solver == KktSolver::kChain ? "chain" : "mumps";
  app.add("--kkt", kkt, "solver of the KKT systems").one_of({"chain", "mumps"});
  app.add("--print-level", arguments.options.print_level, "Ipopt's table, 0 to 12").range(0, 12);
  if (const auto code = app.parse(argc, argv)) return *code;
  arguments.options.kkt_solver = kkt == "chain" ? KktSolver::kChain : KktSolver::kMumps;
  try {
    return solve(arguments);
  } catch (const InputError& error) {
    std::cerr << "reference_nlp: " << error.what() << "\n";
    return 3;
  } catch (const std::exception& error) {
    std::cerr << "reference_nlp: internal error: " << error.what() << "\n";
    return 1;
  }
}
