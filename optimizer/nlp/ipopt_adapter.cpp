#include "optimizer/nlp/ipopt_adapter.h"

#include <time.h>

namespace sparflow::detail {
namespace {
using ConstMap = Eigen::Map<const Eigen::VectorXd>;
using Map = Eigen::Map<Eigen::VectorXd>;
using IndexMap = Eigen::Map<Eigen::VectorXi>;
}  // namespace

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

IpoptAdapter::IpoptAdapter(NlpProblem& problem, const NlpOptions& options, NlpResult& result)
    : problem_(problem),
      options_(options),
      result_(result),
      size_(problem.size()),
      began_(Clock::now()) {}

/// After an exception every further evaluation fails, so that Ipopt reduces its step to zero and returns.
template <class Evaluation>
bool IpoptAdapter::guarded(int& count, const Evaluation& evaluation) {
  if (error_) return false;
  const auto begin = Clock::now();
  const double cpu_begin = thread_cpu_seconds();
  ++count;
  try {
    evaluation();
  } catch (...) {
    error_ = std::current_exception();
  }
  result_.callbacks_cpu_s += thread_cpu_seconds() - cpu_begin;
  result_.callbacks_s += std::chrono::duration<double>(Clock::now() - begin).count();
  return !error_;
}

bool IpoptAdapter::get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess,
                                IndexStyleEnum& style) {
  n = size_.variables;
  m = size_.constraints;
  nnz_jac = size_.jacobian_nonzeros;
  nnz_hess = size_.hessian_nonzeros;
  style = C_STYLE;
  return true;
}

bool IpoptAdapter::get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                                   Number* g_u) {
  int ignored = 0;
  // Ipopt treats values beyond +-1e19 as no bound, infinity included.
  return guarded(ignored,
                 [&] { problem_.bounds(Map(x_l, n), Map(x_u, n), Map(g_l, m), Map(g_u, m)); });
}

bool IpoptAdapter::get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_l,
                                      Number* z_u, Index m, bool init_lambda, Number* lambda) {
  int ignored = 0;
  return guarded(ignored, [&] {
    if (init_x) problem_.start(Map(x, n));
    const NlpMultipliers* multipliers = problem_.start_multipliers();
    if (init_z) {
      Map(z_l, n) = multipliers->lower;
      Map(z_u, n) = multipliers->upper;
    }
    if (init_lambda) Map(lambda, m) = multipliers->constraint;
  });
}

bool IpoptAdapter::eval_f(Index n, const Number* x, bool, Number& value) {
  return guarded(result_.evaluations.objective,
                 [&] { value = problem_.objective(ConstMap(x, n)); });
}

bool IpoptAdapter::eval_grad_f(Index n, const Number* x, bool, Number* gradient) {
  return guarded(result_.evaluations.gradient,
                 [&] { problem_.gradient(ConstMap(x, n), Map(gradient, n)); });
}

bool IpoptAdapter::eval_g(Index n, const Number* x, bool, Index m, Number* g) {
  return guarded(result_.evaluations.constraints,
                 [&] { problem_.constraints(ConstMap(x, n), Map(g, m)); });
}

bool IpoptAdapter::eval_jac_g(Index n, const Number* x, bool, Index, Index nonzeros, Index* row,
                              Index* column, Number* values) {
  if (values == nullptr) {
    int ignored = 0;
    return guarded(ignored, [&] {
      problem_.jacobian_structure(IndexMap(row, nonzeros), IndexMap(column, nonzeros));
    });
  }
  return guarded(result_.evaluations.jacobian,
                 [&] { problem_.jacobian(ConstMap(x, n), Map(values, nonzeros)); });
}

bool IpoptAdapter::eval_h(Index n, const Number* x, bool, Number factor, Index m,
                          const Number* lambda, bool, Index nonzeros, Index* row, Index* column,
                          Number* values) {
  if (values == nullptr) {
    int ignored = 0;
    return guarded(ignored, [&] {
      problem_.hessian_structure(IndexMap(row, nonzeros), IndexMap(column, nonzeros));
    });
  }
  return guarded(result_.evaluations.hessian, [&] {
    problem_.hessian(ConstMap(x, n), factor, ConstMap(lambda, m), Map(values, nonzeros));
  });
}

bool IpoptAdapter::intermediate_callback(Ipopt::AlgorithmMode mode, Index iteration,
                                         Number objective, Number inf_pr, Number inf_du, Number mu,
                                         Number, Number, Number, Number, Index trials,
                                         const Ipopt::IpoptData*,
                                         Ipopt::IpoptCalculatedQuantities*) {
  if (error_) return false;
  const bool restoration = mode == Ipopt::RestorationPhaseMode;
  result_.restoration_iterations += restoration ? 1 : 0;
  const double elapsed = std::chrono::duration<double>(Clock::now() - began_).count();
  if (options_.on_iteration) {
    try {
      if (!options_.on_iteration(NlpIteration{iteration, objective, inf_pr, inf_du, mu, trials,
                                              restoration, elapsed})) {
        return false;
      }
    } catch (...) {
      error_ = std::current_exception();
      return false;
    }
  }
  out_of_time_ = elapsed > options_.max_seconds;
  return !out_of_time_;
}

void IpoptAdapter::finalize_solution(Ipopt::SolverReturn, Index n, const Number* x,
                                     const Number* z_l, const Number* z_u, Index m, const Number* g,
                                     const Number* lambda, Number objective,
                                     const Ipopt::IpoptData* data,
                                     Ipopt::IpoptCalculatedQuantities*) {
  result_.x = ConstMap(x, n);
  result_.constraints = ConstMap(g, m);
  result_.multipliers = {ConstMap(lambda, m), ConstMap(z_l, n), ConstMap(z_u, n)};
  result_.objective = objective;
  if (data != nullptr) result_.iterations = data->iter_count();
}

}  // namespace sparflow::detail
