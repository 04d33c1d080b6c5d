#include "optimizer/nlp/ipopt_solver.h"

#include <fmt/format.h>

#include <mutex>

#include "models/math/error.h"
#include "optimizer/nlp/chain_ldl_ipopt.h"
#include "optimizer/nlp/ipopt_adapter.h"

namespace sparflow {
namespace {

using detail::IpoptAdapter;

std::mutex& ipopt_mutex() {
  static std::mutex mutex;
  return mutex;
}
thread_local bool solving_in_this_thread = false;

/// Sets options and remembers what was set, for the result.
class OptionSetter {
 public:
  OptionSetter(Ipopt::IpoptApplication& app, std::map<std::string, std::string>& used)
      : app_(app), used_(used) {}
  void set(const std::string& name, const std::string& value) {
    const auto option = app_.RegOptions()->GetOption(name);
    if (!Ipopt::IsValid(option)) {
      throw UsageError("Ipopt has no option \"" + name +
                       "\"; see the option reference of Ipopt 3.11");
    }
    bool accepted = false;
    char* end = nullptr;
    if (option->Type() == Ipopt::OT_String) {
      accepted = app_.Options()->SetStringValue(name, value);
    } else if (option->Type() == Ipopt::OT_Integer) {
      const long number = std::strtol(value.c_str(), &end, 10);
      accepted =
          *end == '\0' && app_.Options()->SetIntegerValue(name, static_cast<Ipopt::Index>(number));
    } else {
      const double number = std::strtod(value.c_str(), &end);
      accepted = *end == '\0' && app_.Options()->SetNumericValue(name, number);
    }
    if (!accepted) {
      throw UsageError("Ipopt does not take \"" + value + "\" for its option " + name);
    }
    used_[name] = value;
  }
  void set(const std::string& name, double value) { set(name, fmt::format("{:.17g}", value)); }
  void set(const std::string& name, int value) { set(name, std::to_string(value)); }

 private:
  Ipopt::IpoptApplication& app_;
  std::map<std::string, std::string>& used_;
};

void set_options(Ipopt::IpoptApplication& app, const NlpOptions& options, KktSolver kkt, bool warm,
                 std::map<std::string, std::string>& used) {
  OptionSetter setter(app, used);
  setter.set("sb", std::string("yes"));  // no banner
  setter.set("print_level", options.print_level);
  if (kkt == KktSolver::kChain) {
    for (const auto& [name, value] : detail::ChainLdlSession::ipopt_options())
      setter.set(name, value);
  } else {
    setter.set("linear_solver", std::string("mumps"));
  }
  setter.set("tol", options.tolerance);
  setter.set("max_iter", options.max_iterations);
  if (options.acceptable_tolerance) setter.set("acceptable_tol", *options.acceptable_tolerance);
  if (options.constraint_tolerance) setter.set("constr_viol_tol", *options.constraint_tolerance);
  if (warm) {
    setter.set("warm_start_init_point", std::string("yes"));
    for (const char* name :
         {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
          "warm_start_slack_bound_frac", "warm_start_mult_bound_push"}) {
      setter.set(name, options.warm_start_push);
    }
  }
  if (options.mu_init || warm)
    setter.set("mu_init", options.mu_init.value_or(options.warm_start_mu));
  for (const auto& [name, value] : options.more) setter.set(name, value);
}

struct Outcome {
  NlpStatus status;
  const char* message;
};

Outcome outcome_of(Ipopt::ApplicationReturnStatus code, bool out_of_time) {
  switch (code) {
    case Ipopt::Solve_Succeeded:
      return {NlpStatus::kOptimal, "optimal within the tolerances"};
    case Ipopt::Solved_To_Acceptable_Level:
      return {NlpStatus::kAcceptable, "no further progress, but within the acceptable tolerances"};
    case Ipopt::Feasible_Point_Found:
      return {NlpStatus::kOptimal, "a feasible point of a square problem"};
    case Ipopt::Infeasible_Problem_Detected:
      return {NlpStatus::kInfeasible, "converged to a point of locally least violation"};
    case Ipopt::Maximum_Iterations_Exceeded:
      return {NlpStatus::kIterationLimit, "the iteration limit was reached"};
    case Ipopt::Maximum_CpuTime_Exceeded:
      return {NlpStatus::kTimeLimit, "the time limit was reached"};
    case Ipopt::User_Requested_Stop:
      return out_of_time ? Outcome{NlpStatus::kTimeLimit, "the time limit was reached"}
                         : Outcome{NlpStatus::kInterrupted, "interrupted"};
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return {NlpStatus::kFailed, "the search direction became too small"};
    case Ipopt::Diverging_Iterates:
      return {NlpStatus::kFailed, "the iterates diverge; the problem may be unbounded"};
    case Ipopt::Restoration_Failed:
      return {NlpStatus::kFailed, "the restoration phase failed"};
    case Ipopt::Error_In_Step_Computation:
      return {NlpStatus::kFailed, "no step could be computed"};
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return {NlpStatus::kFailed, "more equality constraints than free variables"};
    case Ipopt::Invalid_Number_Detected:
      return {NlpStatus::kFailed, "a function value or derivative was not finite"};
    case Ipopt::Insufficient_Memory:
      return {NlpStatus::kFailed, "out of memory"};
    default:
      return {NlpStatus::kFailed, "Ipopt reported an internal error"};
  }
}

struct Bounds {
  explicit Bounds(const NlpProblem& problem) {
    const NlpSize size = problem.size();
    x_lower.resize(size.variables);
    x_upper.resize(size.variables);
    g_lower.resize(size.constraints);
    g_upper.resize(size.constraints);
    problem.bounds(x_lower, x_upper, g_lower, g_upper);
  }
  Eigen::VectorXd x_lower, x_upper, g_lower, g_upper;
};

/// Sentence on the first pair of bounds that exclude each other; "" when there is none.
std::string crossed_bounds(const NlpProblem& problem, const Bounds& bounds) {
  for (int i = 0; i < bounds.x_lower.size(); ++i) {
    if (!(bounds.x_lower[i] <= bounds.x_upper[i])) {
      return fmt::format("{} must lie in [{:.9g}, {:.9g}], which is empty",
                         problem.variable_name(i), bounds.x_lower[i], bounds.x_upper[i]);
    }
  }
  for (int i = 0; i < bounds.g_lower.size(); ++i) {
    if (!(bounds.g_lower[i] <= bounds.g_upper[i])) {
      return fmt::format("{} must lie in [{:.9g}, {:.9g}], which is empty",
                         problem.constraint_name(i), bounds.g_lower[i], bounds.g_upper[i]);
    }
  }
  return "";
}

void find_violation(const NlpProblem& problem, const Bounds& bounds, NlpResult& result) {
  /// Violation up to which no constraint is named.
  /// @threshold [1] 0..1e-6; numerical: rounding
  constexpr double kWorthNaming = 1e-12;
  auto look = [&](const Eigen::VectorXd& value, const Eigen::VectorXd& lower,
                  const Eigen::VectorXd& upper, auto name) {
    for (int i = 0; i < value.size(); ++i) {
      const double violation = std::max(lower[i] - value[i], value[i] - upper[i]);
      if (violation > result.max_violation) {
        result.max_violation = violation;
        if (violation > kWorthNaming) result.max_violation_at = name(i);
      }
    }
  };
  look(result.x, bounds.x_lower, bounds.x_upper, [&](int i) { return problem.variable_name(i); });
  look(result.constraints, bounds.g_lower, bounds.g_upper,
       [&](int i) { return problem.constraint_name(i); });
}

/// Evaluates a problem without free variables, which Ipopt refuses: the only candidate is the point itself.
void judge_fixed_point(NlpProblem& problem, const Bounds& bounds, const NlpOptions& options,
                       NlpResult& result) {
  result.x = bounds.x_lower;
  result.constraints.resize(bounds.g_lower.size());
  problem.constraints(result.x, result.constraints);
  result.objective = problem.objective(result.x);
  result.evaluations.objective = result.evaluations.constraints = 1;
  result.multipliers = {Eigen::VectorXd::Zero(bounds.g_lower.size()),
                        Eigen::VectorXd::Zero(bounds.x_lower.size()),
                        Eigen::VectorXd::Zero(bounds.x_lower.size())};
  find_violation(problem, bounds, result);
  const bool feasible = result.max_violation <= options.constraint_tolerance.value_or(1e-4);
  result.status = feasible ? NlpStatus::kOptimal : NlpStatus::kInfeasible;
  result.message =
      feasible ? "every variable is fixed" : "every variable is fixed, and they violate";
}

/// Ipopt 3.11 has a timer for the factorisation but never starts it; the one around the whole solution of the
/// augmented system is the narrowest that holds the factorisation.
double linear_solver_seconds(Ipopt::IpoptApplication& app) {
  const Ipopt::SmartPtr<Ipopt::IpoptData> data = app.IpoptDataObject();
  if (!Ipopt::IsValid(data)) return 0.0;
  return data->TimingStats().StdAugSystemSolverMultiSolve().TotalWallclockTime();
}

/// One solve. @return what a callback threw, or nullptr
std::exception_ptr run_ipopt(NlpProblem& problem, const NlpOptions& options, KktSolver kkt,
                             NlpResult& result) {
  result.kkt_solver = kkt;
  std::optional<detail::ChainLdlSession> session;
  if (kkt == KktSolver::kChain) session.emplace();
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> app =
      new Ipopt::IpoptApplication(options.print_level > 0);
  app->RethrowNonIpoptException(false);
  set_options(*app, options, kkt, problem.start_multipliers() != nullptr, result.options_used);
  // "" = do not look for an options file in the current folder.
  if (app->Initialize("") != Ipopt::Solve_Succeeded) {
    throw UsageError("Ipopt refused its options");
  }
  auto* adapter = new IpoptAdapter(problem, options, result);
  const Ipopt::SmartPtr<Ipopt::TNLP> owner = adapter;
  const auto begin = std::chrono::steady_clock::now();
  const double cpu_begin = detail::thread_cpu_seconds();
  const Ipopt::ApplicationReturnStatus code = app->OptimizeTNLP(owner);
  result.solve_cpu_s += detail::thread_cpu_seconds() - cpu_begin;
  result.solve_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.linear_solver_s += linear_solver_seconds(*app);
  const Outcome outcome = outcome_of(code, adapter->out_of_time());
  result.status = outcome.status;
  result.message = outcome.message;
  if (session && adapter->error() == nullptr) {
    if (!session->refusal().empty()) result.kkt_note = session->refusal();
    if (code == Ipopt::Error_In_Step_Computation)
      result.kkt_note = "no step could be computed with the chain's factors";
  }
  return adapter->error();
}

/// Solves with the requested linear solver, and again with MUMPS if that one gave up.
std::exception_ptr run_ipopt(NlpProblem& problem, const NlpOptions& options, NlpResult& result) {
  // The lock also covers the destruction of the linear solver's instance at the end of this scope.
  const std::lock_guard<std::mutex> lock(ipopt_mutex());
  const bool named = options.more.count("linear_solver") > 0;
  const KktSolver asked = named ? KktSolver::kMumps : options.kkt_solver;
  const std::exception_ptr thrown = run_ipopt(problem, options, asked, result);
  if (thrown != nullptr || result.kkt_note.empty()) return thrown;
  NlpResult again;
  again.kkt_note = result.kkt_note;
  again.evaluations = result.evaluations;
  again.solve_s = result.solve_s;
  again.callbacks_s = result.callbacks_s;
  again.solve_cpu_s = result.solve_cpu_s;
  again.callbacks_cpu_s = result.callbacks_cpu_s;
  again.linear_solver_s = result.linear_solver_s;
  result = std::move(again);
  return run_ipopt(problem, options, KktSolver::kMumps, result);
}

}  // namespace

const char* to_string(NlpStatus status) {
  switch (status) {
    case NlpStatus::kOptimal:
      return "optimal";
    case NlpStatus::kAcceptable:
      return "acceptable";
    case NlpStatus::kInfeasible:
      return "infeasible";
    case NlpStatus::kIterationLimit:
      return "iteration_limit";
    case NlpStatus::kTimeLimit:
      return "time_limit";
    case NlpStatus::kFailed:
      return "failed";
    case NlpStatus::kInterrupted:
      return "interrupted";
  }
  return "unknown";
}

const char* to_string(KktSolver solver) { return solver == KktSolver::kChain ? "chain" : "mumps"; }

std::string NlpResult::brief() const {
  std::string line = fmt::format(
      "{} after {} iterations: objective {:.9g}, violation {:.2g}, {:.3f} s "
      "(callbacks {:.3f} s, linear solver {:.3f} s)",
      to_string(status), iterations, objective, max_violation, solve_s, callbacks_s,
      linear_solver_s);
  if (!solved()) line += fmt::format(": {}", message);
  return line;
}

NlpResult solve_with_ipopt(NlpProblem& problem, const NlpOptions& options) {
  SPARFLOW_CHECK(!solving_in_this_thread, "a callback of a solve cannot start another solve");
  NlpResult result;
  const Bounds bounds(problem);
  if (const std::string crossed = crossed_bounds(problem, bounds); !crossed.empty()) {
    result.x.resize(problem.size().variables);
    problem.start(result.x);
    result.status = NlpStatus::kInfeasible;
    result.message = crossed;
    return result;
  }
  if (bounds.x_lower == bounds.x_upper) {
    judge_fixed_point(problem, bounds, options, result);
    return result;
  }
  solving_in_this_thread = true;
  std::exception_ptr thrown;
  try {
    thrown = run_ipopt(problem, options, result);
  } catch (...) {
    thrown = std::current_exception();
  }
  solving_in_this_thread = false;
  if (thrown) std::rethrow_exception(thrown);
  if (result.x.size() > 0) {
    find_violation(problem, bounds, result);
  } else {  // Ipopt gave up before its first iterate
    result.x.resize(problem.size().variables);
    problem.start(result.x);
  }
  return result;
}

}  // namespace sparflow
