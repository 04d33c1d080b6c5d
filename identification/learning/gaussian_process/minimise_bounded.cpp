#include "identification/learning/gaussian_process/minimise_bounded.h"

#include <nlopt.h>

#include <cmath>
#include <memory>
#include <vector>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
/// [1] A relative step at which rounding of the value hides any descent: sqrt of the machine precision.
constexpr double kSmallestStep = 1e-8;

struct Search {
  const std::function<double(const VectorXd&, VectorXd&)>& function;
  Minimum& best;
};

/// NLopt's callback: evaluates, and keeps the best point, since the last one need not be it.
double evaluate(unsigned int size, const double* x, double* gradient, void* data) {
  auto& search = *static_cast<Search*>(data);
  const auto n = static_cast<Eigen::Index>(size);
  const VectorXd point = Eigen::Map<const VectorXd>(x, n);
  VectorXd slope = VectorXd::Zero(n);
  double value = search.function(point, slope);
  if (!std::isfinite(value) || !slope.allFinite()) {
    value = HUGE_VAL;
    slope.setZero();
  }
  if (gradient != nullptr) Eigen::Map<VectorXd>(gradient, n) = slope;
  ++search.best.evaluations;
  if (search.best.evaluations == 1 || value < search.best.value) {
    search.best.value = value;
    search.best.x = point;
  }
  return value;
}

}  // namespace

Minimum minimise_bounded(const std::function<double(const VectorXd&, VectorXd&)>& function,
                         const VectorXd& start, const VectorXd& lower, const VectorXd& upper,
                         const MinimiseOptions& options) {
  Minimum result;
  result.x = start.cwiseMax(lower).cwiseMin(upper);
  const std::unique_ptr<nlopt_opt_s, decltype(&nlopt_destroy)> solver(
      nlopt_create(NLOPT_LD_SLSQP, static_cast<unsigned int>(start.size())), &nlopt_destroy);
  SPARFLOW_CHECK(solver != nullptr, "NLopt gave no solver");
  Search search{function, result};
  nlopt_set_min_objective(solver.get(), &evaluate, &search);
  nlopt_set_lower_bounds(solver.get(), lower.data());
  nlopt_set_upper_bounds(solver.get(), upper.data());
  nlopt_set_ftol_rel(solver.get(), options.value_tolerance);
  nlopt_set_xtol_rel(solver.get(), kSmallestStep);
  nlopt_set_maxeval(solver.get(), options.max_evaluations);
  VectorXd x = result.x;
  double value = 0.0;
  const nlopt_result status = nlopt_optimize(solver.get(), x.data(), &value);
  result.converged =
      status == NLOPT_FTOL_REACHED || status == NLOPT_XTOL_REACHED || status == NLOPT_SUCCESS;
  return result;
}

}  // namespace sparflow
