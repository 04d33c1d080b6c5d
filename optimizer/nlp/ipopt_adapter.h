#pragma once
/// Adapts NlpProblem to Ipopt's TNLP: measures and counts every evaluation, and lets no exception pass through Ipopt.
/// Private to optimizer/nlp.
#include <IpIpoptApplication.hpp>
#include <IpIpoptCalculatedQuantities.hpp>
#include <IpIpoptData.hpp>
#include <IpRegOptions.hpp>
#include <IpTNLP.hpp>
#include <chrono>
#include <exception>

#include "optimizer/nlp/ipopt_solver.h"

namespace sparflow::detail {

/// Processor time of the calling thread [s].
double thread_cpu_seconds();

class IpoptAdapter final : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  IpoptAdapter(NlpProblem& problem, const NlpOptions& options, NlpResult& result);

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess,
                    IndexStyleEnum& style) override;
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override;
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_l, Number* z_u,
                          Index m, bool init_lambda, Number* lambda) override;
  bool eval_f(Index n, const Number* x, bool new_x, Number& value) override;
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) override;
  bool eval_g(Index n, const Number* x, bool new_x, Index m, Number* g) override;
  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index nonzeros, Index* row,
                  Index* column, Number* values) override;
  bool eval_h(Index n, const Number* x, bool new_x, Number factor, Index m, const Number* lambda,
              bool new_lambda, Index nonzeros, Index* row, Index* column, Number* values) override;
  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iteration, Number objective,
                             Number inf_pr, Number inf_du, Number mu, Number d_norm,
                             Number regularization, Number alpha_du, Number alpha_pr, Index trials,
                             const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* quantities) override;
  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_l,
                         const Number* z_u, Index m, const Number* g, const Number* lambda,
                         Number objective, const Ipopt::IpoptData* data,
                         Ipopt::IpoptCalculatedQuantities* quantities) override;

  std::exception_ptr error() const { return error_; }
  bool out_of_time() const { return out_of_time_; }

 private:
  using Clock = std::chrono::steady_clock;
  template <class Evaluation>
  bool guarded(int& count, const Evaluation& evaluation);

  NlpProblem& problem_;
  const NlpOptions& options_;
  NlpResult& result_;
  NlpSize size_;
  Clock::time_point began_;
  std::exception_ptr error_;
  bool out_of_time_ = false;
};

}  // namespace sparflow::detail
