#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "models/math/error.h"
#include "optimizer/nlp/derivative_check.h"
#include "optimizer/nlp/ipopt_solver.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Problem 71 of Hock and Schittkowski (1981): minimise x0 x3 (x0 + x1 + x2) + x2
/// subject to x0 x1 x2 x3 >= 25, |x|^2 = 40, 1 <= x <= 5. Optimum 17.0140173 (their table).
class HockSchittkowski71 : public NlpProblem {
 public:
  NlpSize size() const override { return {4, 2, 8, 10}; }
  void bounds(Out x_lower, Out x_upper, Out g_lower, Out g_upper) const override {
    x_lower.setConstant(1.0);
    x_upper.setConstant(5.0);
    g_lower << least_product, 40.0;
    g_upper << kNoBound, 40.0;
  }
  void start(Out x) const override { x << 1.0, 5.0, 5.0, 1.0; }
  const NlpMultipliers* start_multipliers() const override {
    return multipliers.lower.size() == 0 ? nullptr : &multipliers;
  }
  double objective(In x) override {
    if (throw_at == ++calls) throw std::out_of_range("the model left its domain");
    return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2];
  }
  void gradient(In x, Out g) override {
    g << x[3] * (2.0 * x[0] + x[1] + x[2]), x[0] * x[3], x[0] * x[3] + 1.0,
        x[0] * (x[0] + x[1] + x[2]);
  }
  void constraints(In x, Out g) override { g << x.prod(), x.squaredNorm(); }
  void jacobian_structure(OutIndex row, OutIndex column) const override {
    row << 0, 0, 0, 0, 1, 1, 1, 1;
    column << 0, 1, 2, 3, 0, 1, 2, 3;
  }
  void jacobian(In x, Out v) override {
    v << x[1] * x[2] * x[3], x[0] * x[2] * x[3], x[0] * x[1] * x[3], x[0] * x[1] * x[2], 2.0 * x;
  }
  void hessian_structure(OutIndex row, OutIndex column) const override {
    row << 0, 1, 1, 2, 2, 2, 3, 3, 3, 3;
    column << 0, 0, 1, 0, 1, 2, 0, 1, 2, 3;
  }
  void hessian(In x, double f, In m, Out v) override {
    if (throw_in_hessian) throw std::domain_error("no curvature here");
    const double p = m[0], s = 2.0 * m[1];
    v << 2.0 * f * x[3] + s, f * x[3] + p * x[2] * x[3], s, f * x[3] + p * x[1] * x[3],
        p * x[0] * x[3], s, f * (2.0 * x[0] + x[1] + x[2]) + p * x[1] * x[2],
        f * x[0] + p * x[0] * x[2], f * x[0] + p * x[0] * x[1], s;
  }
  double least_product = 25.0;
  int calls = 0, throw_at = -1;
  bool throw_in_hessian = false;
  NlpMultipliers multipliers;
};

/// minimise x - log(x - 1) subject to x <= 3, x + y = 4; not defined for x <= 1. Optimum x = 2.
class LogBarrier : public NlpProblem {
 public:
  NlpSize size() const override { return {2, 1, 2, 1}; }
  void bounds(Out x_lower, Out x_upper, Out g_lower, Out g_upper) const override {
    x_lower << lower, lower;
    x_upper << 3.0, kNoBound;
    g_lower << 4.0;
    g_upper << 4.0;
  }
  void start(Out x) const override { x << 2.9, 0.0; }
  double objective(In x) override { return x[0] - std::log(x[0] - 1.0); }
  void gradient(In x, Out g) override { g << 1.0 - 1.0 / (x[0] - 1.0), 0.0; }
  void constraints(In x, Out g) override { g << x.sum(); }
  void jacobian_structure(OutIndex row, OutIndex column) const override {
    row << 0, 0;
    column << 0, 1;
  }
  void jacobian(In, Out v) override { v << 1.0, 1.0; }
  void hessian_structure(OutIndex row, OutIndex column) const override {
    row << 0;
    column << 0;
  }
  void hessian(In x, double f, In, Out v) override { v << f / ((x[0] - 1.0) * (x[0] - 1.0)); }
  double lower = -kNoBound;
};

constexpr double kHs71 = 17.0140172891520;
// Ipopt stops at a scaled error of 1e-6 (the default here) and relaxes bounds by 1e-8.
constexpr double kSolverError = 1e-6;

TEST(Ipopt, SolvesHockSchittkowski71) {
  HockSchittkowski71 problem;
  testing::internal::CaptureStdout();
  const NlpResult result = solve_with_ipopt(problem);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "") << "silent by default";
  ASSERT_EQ(result.status, NlpStatus::kOptimal) << result.brief();
  EXPECT_NEAR(result.objective, kHs71, kHs71 * kSolverError);
  VectorXd expected(4);
  expected << 1.0, 4.7429994, 3.8211503, 1.3794082;  // Hock and Schittkowski's table, 7 digits
  EXPECT_LT((result.x - expected).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(result.max_violation, 1e-6);
  EXPECT_EQ(result.constraints.size(), 2);
  EXPECT_GT(result.iterations, 3);
  EXPECT_GE(result.evaluations.objective, result.iterations);
  EXPECT_GE(result.evaluations.hessian, result.iterations);
  EXPECT_GE(result.solve_s, result.callbacks_s);
  EXPECT_GE(result.solve_s, result.linear_solver_s);
  EXPECT_GT(result.linear_solver_s, 0.0);
  EXPECT_EQ(result.kkt_solver, KktSolver::kChain);
  EXPECT_EQ(result.options_used.at("linear_solver"), "ma27");  // the interface that ChainLdl uses
  EXPECT_EQ(result.options_used.at("tol"), "9.9999999999999995e-07");
}

TEST(Ipopt, MultipliersMakeTheLagrangianStationary) {
  HockSchittkowski71 problem;
  const NlpResult result = solve_with_ipopt(problem);
  VectorXd slope(4), values(8);
  problem.gradient(result.x, slope);
  problem.jacobian(result.x, values);
  for (int i = 0; i < 8; ++i) slope[i % 4] += result.multipliers.constraint[i / 4] * values[i];
  slope += result.multipliers.upper - result.multipliers.lower;
  EXPECT_LT(slope.cwiseAbs().maxCoeff(), 1e-5) << "signs as documented in NlpMultipliers";
  EXPECT_LT(result.multipliers.constraint[0], 0.0) << "the product's lower bound is active";
  EXPECT_GT(result.multipliers.lower[0], 0.1) << "x0 is at its lower bound";
}

TEST(Ipopt, HandWrittenTestDerivativesAreRight) {
  HockSchittkowski71 problem;
  VectorXd x(4);
  x << 1.3, 4.1, 3.7, 1.9;
  const DerivativeCheck check = check_derivatives(problem, x);
  EXPECT_LT(check.worst(), 1e-10)
      << check.worst_hessian;  // rounding of 1e-3 steps on values of 100
}

TEST(Ipopt, DerivativeCheckFindsAWrongEntryAndNamesIt) {
  class Wrong : public HockSchittkowski71 {
    void hessian_structure(OutIndex row, OutIndex column) const override {
      HockSchittkowski71::hessian_structure(row, column);
      column[3] = 1;  // entry (2, 0) is put at (2, 1)
    }
  } problem;
  VectorXd x(4);
  x << 1.3, 4.1, 3.7, 1.9;
  const DerivativeCheck check = check_derivatives(problem, x);
  EXPECT_LT(check.gradient_error, 1e-10);
  EXPECT_GT(check.hessian_error, 1e-2);
  EXPECT_NE(check.worst_hessian.find("x[2]"), std::string::npos) << check.worst_hessian;
}

TEST(Ipopt, WarmStartAtTheSolutionTakesFewIterations) {
  HockSchittkowski71 cold;
  const NlpResult first = solve_with_ipopt(cold);
  class Warm : public HockSchittkowski71 {
   public:
    void start(Out x) const override { x = at; }
    VectorXd at;
  } warm;
  warm.at = first.x;
  warm.multipliers = first.multipliers;
  NlpOptions options;
  options.warm_start_mu = 1e-8;
  const NlpResult again = solve_with_ipopt(warm, options);
  ASSERT_EQ(again.status, NlpStatus::kOptimal) << again.brief();
  EXPECT_LE(again.iterations, first.iterations / 2);
  EXPECT_NEAR(again.objective, kHs71, kHs71 * kSolverError);
  EXPECT_EQ(again.options_used.at("warm_start_init_point"), "yes");
}

TEST(Ipopt, InfeasibleProblemIsCalledInfeasible) {
  HockSchittkowski71 problem;
  problem.least_product = 700.0;  // |x|^2 = 40 allows at most (40/4)^2 = 100
  const NlpResult result = solve_with_ipopt(problem);
  EXPECT_EQ(result.status, NlpStatus::kInfeasible) << result.brief();
  EXPECT_GT(result.max_violation, 1.0);
  EXPECT_EQ(result.max_violation_at.substr(0, 2), "g[");
}

TEST(Ipopt, CrossedBoundsAreInfeasibleAndNamed) {
  LogBarrier problem;
  problem.lower = 3.5;
  const NlpResult result = solve_with_ipopt(problem);
  EXPECT_EQ(result.status, NlpStatus::kInfeasible);
  EXPECT_NE(result.message.find("x[0] must lie in [3.5, 3]"), std::string::npos) << result.message;
}

TEST(Ipopt, AProblemWithoutFreeVariablesIsEvaluatedWithoutASolve) {
  class Fixed : public HockSchittkowski71 {
    void bounds(Out x_lower, Out x_upper, Out g_lower, Out g_upper) const override {
      HockSchittkowski71::bounds(x_lower, x_upper, g_lower, g_upper);
      x_lower << 2.0, 4.0, 4.0, 2.0;  // |x|^2 = 40, product 64
      x_upper = x_lower;
    }
  } problem;
  EXPECT_EQ(solve_with_ipopt(problem).status, NlpStatus::kOptimal);
  EXPECT_EQ(solve_with_ipopt(problem).objective, 44.0);
  problem.least_product = 65.0;
  const NlpResult result = solve_with_ipopt(problem);
  EXPECT_EQ(result.status, NlpStatus::kInfeasible);
  EXPECT_EQ(result.max_violation, 1.0);
}

TEST(Ipopt, ValueOutsideTheDomainShortensTheStep) {
  LogBarrier problem;  // a full Newton step from 2.9 ends below 1, where the log is NaN
  const NlpResult result = solve_with_ipopt(problem);
  ASSERT_EQ(result.status, NlpStatus::kOptimal) << result.brief();
  EXPECT_NEAR(result.x[0], 2.0, 1e-6);
}

TEST(Ipopt, LimitsAndInterruptionAreStatuses) {
  HockSchittkowski71 problem;
  NlpOptions options;
  options.max_iterations = 2;
  EXPECT_EQ(solve_with_ipopt(problem, options).status, NlpStatus::kIterationLimit);
  options.max_iterations = 3000;
  options.max_seconds = 0.0;
  const NlpResult late = solve_with_ipopt(problem, options);
  EXPECT_EQ(late.status, NlpStatus::kTimeLimit);
  EXPECT_EQ(late.x.size(), 4) << "the last iterate is kept";
  options.max_seconds = 1e9;
  int seen = -1;
  options.on_iteration = [&](const NlpIteration& now) {
    seen = now.iteration;
    return now.iteration < 3;
  };
  const NlpResult stopped = solve_with_ipopt(problem, options);
  EXPECT_EQ(stopped.status, NlpStatus::kInterrupted);
  EXPECT_EQ(seen, 3);
  EXPECT_EQ(stopped.iterations, 3);
}

TEST(Ipopt, ExceptionsOfCallbacksArriveUnchanged) {
  HockSchittkowski71 problem;
  for (const int at : {1, 2, 5}) {  // first value, first trial, in the middle
    problem.calls = 0;
    problem.throw_at = at;
    try {
      solve_with_ipopt(problem);
      FAIL() << "call " << at;
    } catch (const std::out_of_range& error) {
      EXPECT_STREQ(error.what(), "the model left its domain");
    }
    EXPECT_EQ(problem.calls, at) << "nothing is evaluated after an exception";
  }
  problem.throw_at = -1;
  problem.throw_in_hessian = true;
  EXPECT_THROW(solve_with_ipopt(problem), std::domain_error);
  problem.throw_in_hessian = false;
  NlpOptions options;
  options.on_iteration = [](const NlpIteration&) -> bool { throw std::length_error("full"); };
  EXPECT_THROW(solve_with_ipopt(problem, options), std::length_error);
  // A solve within a solve would be a deadlock.
  options.on_iteration = [&](const NlpIteration&) {
    HockSchittkowski71 inner;
    return solve_with_ipopt(inner).solved();
  };
  EXPECT_THROW(solve_with_ipopt(problem, options), std::logic_error);
  EXPECT_EQ(solve_with_ipopt(problem).status, NlpStatus::kOptimal) << "and the next solve works";
}

TEST(Ipopt, UnknownOptionIsAUsageError) {
  HockSchittkowski71 problem;
  NlpOptions options;
  options.more["max_itre"] = "5";
  EXPECT_THROW(solve_with_ipopt(problem, options), UsageError);
  options.more = {{"mu_strategy", "daring"}};
  EXPECT_THROW(solve_with_ipopt(problem, options), UsageError);
  options.more = {{"max_iter", "many"}};
  EXPECT_THROW(solve_with_ipopt(problem, options), UsageError);
  options.more = {{"mu_strategy", "adaptive"}, {"bound_relax_factor", "0"}, {"max_iter", "50"}};
  const NlpResult result = solve_with_ipopt(problem, options);
  EXPECT_EQ(result.status, NlpStatus::kOptimal);
  EXPECT_EQ(result.options_used.at("mu_strategy"), "adaptive");
}

TEST(Ipopt, TwoThreadsSolveAtOnceAndBothAreRight) {
  // Without the lock both solves share MUMPS' module variables, and nearly every such run fails or crashes.
  constexpr int kSolves = 60;
  std::atomic<int> wrong{0};
  const auto work = [&](double least_product, double expected) {
    for (int i = 0; i < kSolves; ++i) {
      HockSchittkowski71 problem;
      problem.least_product = least_product;
      const NlpResult result = solve_with_ipopt(problem);
      if (result.status != NlpStatus::kOptimal ||
          std::abs(result.objective - expected) > expected * kSolverError) {
        ++wrong;
      }
    }
  };
  HockSchittkowski71 alone;
  alone.least_product = 30.0;
  const double other = solve_with_ipopt(alone).objective;
  ASSERT_GT(other, kHs71);
  std::thread first(work, 25.0, kHs71), second(work, 30.0, other);
  first.join();
  second.join();
  EXPECT_EQ(wrong, 0) << "of " << 2 * kSolves;
}

}  // namespace
}  // namespace sparflow
