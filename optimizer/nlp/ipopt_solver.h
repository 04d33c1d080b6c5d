#pragma once
/// Ipopt behind one function. Source: Waechter & Biegler (2006), Math. Programming 106, 25-57.
/// Ipopt 3.11 with MUMPS is not thread-safe (MUMPS keeps module variables), so only one solve runs in a process:
/// a second thread waits. To use several cores, solve in child processes.
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "optimizer/nlp/nlp_problem.h"

namespace sparflow {

enum class NlpStatus {
  kOptimal,     ///< all tolerances met
  kAcceptable,  ///< stalled at the looser, acceptable tolerances
  kInfeasible,  ///< a local minimum of the constraint violation that is not zero, or crossed bounds
  kIterationLimit,
  kTimeLimit,
  kFailed,  ///< restoration failed, derivatives not finite, too few degrees of freedom, ...: see `message`
  kInterrupted,  ///< on_iteration returned false
};
const char* to_string(NlpStatus status);

/// Linear solver of the KKT systems.
enum class KktSolver {
  kChain,  ///< ChainLdl: faster for a problem that is a chain in time; MUMPS replaces it for others
  kMumps,
};
const char* to_string(KktSolver solver);

/// Progress of one iteration.
struct NlpIteration {
  int iteration = 0;
  double objective = 0.0;
  double primal_infeasibility = 0.0;  ///< largest scaled violation
  double dual_infeasibility = 0.0;
  double barrier = 0.0;  ///< mu
  int line_search_trials = 0;
  bool restoration = false;  ///< minimising infeasibility alone at the moment
  double elapsed_s = 0.0;    ///< wall time since the solve began
};

struct NlpOptions {
  /// Relative tolerance of the optimality conditions.
  /// @threshold [1] 1e-12..1e-2; chosen: the energy then changes by less than its mesh error
  double tolerance = 1e-6;
  /// Absent = Ipopt's own default (1e-6, 1e-4 for the unscaled violation).
  std::optional<double> acceptable_tolerance;
  std::optional<double> constraint_tolerance;
  /// Largest number of iterations.
  /// @threshold [iterations] 1..1e6; chosen: Ipopt's own default
  int max_iterations = 3000;
  /// Wall time, checked in every iteration.
  double max_seconds = std::numeric_limits<double>::infinity();
  /// Start of the barrier parameter; absent = 0.1 cold (Ipopt's default), warm_start_mu warm.
  std::optional<double> mu_init;
  /// Barrier parameter at the start where the problem has start_multipliers().
  /// @threshold [1] 1e-12..0.1; chosen: the start is nearly optimal, so the barrier may be low
  double warm_start_mu = 1e-5;
  /// How far start values are then pushed off their bounds.
  /// @threshold [1] 1e-16..0.1; chosen: values at a bound shall stay there
  double warm_start_push = 1e-8;
  int print_level = 0;  ///< Ipopt's table on stdout; 0 = silent
  KktSolver kkt_solver = KktSolver::kChain;
  /// Any other Ipopt option by its name, e.g. {"bound_relax_factor", "0"}.
  std::map<std::string, std::string> more;
  /// Called once an iteration; false stops with the current iterate. May throw: rethrown after the solve.
  std::function<bool(const NlpIteration&)> on_iteration;
};

struct NlpEvaluations {
  int objective = 0, gradient = 0, constraints = 0, jacobian = 0, hessian = 0;
};

struct NlpResult {
  NlpStatus status = NlpStatus::kFailed;
  std::string message;  ///< one sentence
  Eigen::VectorXd x;
  double objective = 0.0;
  Eigen::VectorXd constraints;  ///< g(x)
  NlpMultipliers multipliers;
  int iterations = 0;
  int restoration_iterations = 0;
  /// Largest unscaled distance of x or g(x) outside its bounds, and its name (empty when below 1e-12).
  double max_violation = 0.0;
  std::string max_violation_at;
  NlpEvaluations evaluations;
  double solve_s = 0.0;  ///< wall time in Ipopt; waiting for another thread's solve is not in it
  double callbacks_s = 0.0;  ///< share of it in the problem's evaluations [s]
  /// The same two as processor time of the solving thread, which other programs on the machine do not change.
  double solve_cpu_s = 0.0;
  double callbacks_cpu_s = 0.0;
  KktSolver kkt_solver = KktSolver::kMumps;  ///< linear solver with which the solve ended
  std::string kkt_note;                      ///< why it is not the requested one; empty = it is
  /// Share of solve_s in solving KKT systems: assembling the augmented matrix, ordering, factorisation and back
  /// substitution, refinement. From Ipopt's timing statistics (its narrower timers leave the factorisation out),
  /// which do not cover the restoration phase: a lower bound when restoration_iterations > 0.
  double linear_solver_s = 0.0;
  std::map<std::string, std::string>
      options_used;  ///< every option that was set, with the value passed to Ipopt

  bool solved() const { return status == NlpStatus::kOptimal || status == NlpStatus::kAcceptable; }
  std::string brief() const;  ///< one line
};

/// Solves from problem.start(). The outcome of the solver is a status, never an exception.
/// @throws an exception of the problem's callbacks or of on_iteration, after Ipopt has returned;
///         UsageError when an option of `more` is unknown to Ipopt
NlpResult solve_with_ipopt(NlpProblem& problem, const NlpOptions& options = {});

}  // namespace sparflow
