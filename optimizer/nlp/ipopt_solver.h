#pragma once
/// Ipopt behind one function. Source: Waechter & Biegler (2006), Math. Programming 106, 25-57.
/// Ipopt 3.11 with MUMPS is not thread-safe (MUMPS keeps module variables), so solves of one process take turns:
/// a second thread waits. Solve in child processes to use several cores.
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

/// What solves the KKT systems.
enum class KktSolver {
  kChain,  ///< ChainLdl: faster where the problem is a chain in time; MUMPS takes over where it is none
  kMumps,
};
const char* to_string(KktSolver solver);

/// One line of progress.
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
  double tolerance = 1e-6;
  /// Absent = Ipopt's own default (1e-6, 1e-4 for the unscaled violation).
  std::optional<double> acceptable_tolerance;
  std::optional<double> constraint_tolerance;
  int max_iterations = 3000;
  double max_seconds =
      std::numeric_limits<double>::infinity();  ///< wall time, looked at once an iteration
  /// Start of the barrier parameter; absent = 0.1 cold (Ipopt's default), warm_start_mu warm.
  std::optional<double> mu_init;
  /// Used when the problem offers start_multipliers(): barrier parameter, and how far start values are
  /// pushed off their bounds.
  double warm_start_mu = 1e-5;
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
  /// Largest unscaled distance of x or g(x) outside its bounds, and who it is (empty when below 1e-12).
  double max_violation = 0.0;
  std::string max_violation_at;
  NlpEvaluations evaluations;
  double solve_s = 0.0;  ///< wall time in Ipopt; waiting for another thread's solve is not in it
  double callbacks_s = 0.0;  ///< wall time of it in the problem's evaluations
  /// The same two as processor time of the solving thread: what they are on a machine that does other things too.
  double solve_cpu_s = 0.0;
  double callbacks_cpu_s = 0.0;
  KktSolver kkt_solver = KktSolver::kMumps;  ///< that ended the solve
  std::string kkt_note;                      ///< why it was not the one asked for; empty = it was
  /// Wall time of it in solving KKT systems: assembling the augmented matrix, ordering, factorisation and back
  /// substitution, refinement. From Ipopt's timing statistics (its narrower timers leave the factorisation out),
  /// which do not cover the restoration phase: a lower bound when restoration_iterations > 0.
  double linear_solver_s = 0.0;
  std::map<std::string, std::string>
      options_used;  ///< every option that was set, as Ipopt was given it

  bool solved() const { return status == NlpStatus::kOptimal || status == NlpStatus::kAcceptable; }
  std::string brief() const;  ///< one line
};

/// Solves from problem.start(). A solver's outcome is a status, never an exception.
/// @throws whatever a callback of the problem or on_iteration threw, once Ipopt has been left;
///         UsageError when an option of `more` is unknown to Ipopt
NlpResult solve_with_ipopt(NlpProblem& problem, const NlpOptions& options = {});

}  // namespace sparflow
