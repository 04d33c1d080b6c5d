#include "optimizer/nlp/derivative_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Eigen::VectorXi;

struct SparseEntries {
  const VectorXi &row, &column;
  const VectorXd& value;
};

/// Dense matrix of sparse values; values with equal indices are added.
MatrixXd dense(int rows, int columns, const SparseEntries& entries, bool symmetric) {
  const auto& [row, column, value] = entries;
  MatrixXd matrix = MatrixXd::Zero(rows, columns);
  for (int i = 0; i < value.size(); ++i) {
    matrix(row[i], column[i]) += value[i];
    if (symmetric && row[i] != column[i]) matrix(column[i], row[i]) += value[i];
  }
  return matrix;
}

/// f, g and the gradient of the Lagrangian in one vector, so that one difference gives all derivatives.
struct Everything {
  NlpProblem& problem;
  NlpSize size;
  VectorXi jacobian_row, jacobian_column;
  VectorXd jacobian_value, multiplier;
  double factor;

  VectorXd at(const VectorXd& x) {
    VectorXd all(1 + size.constraints + size.variables);
    all[0] = problem.objective(x);
    problem.constraints(x, all.segment(1, size.constraints));
    auto slope = all.tail(size.variables);
    problem.gradient(x, slope);
    slope *= factor;
    problem.jacobian(x, jacobian_value);
    for (int i = 0; i < jacobian_value.size(); ++i) {
      slope[jacobian_column[i]] += multiplier[jacobian_row[i]] * jacobian_value[i];
    }
    return all;
  }
};

struct WorstDerivative {
  double& error;
  std::string& where;
};
struct DerivativeName {
  const std::string &row, &column;
};

void compare(double exact, double numeric, double scale, const WorstDerivative& worst,
             const DerivativeName& name) {
  const double error = std::abs(exact - numeric) / scale;
  if (error <= worst.error) return;  // false for a NaN, which is recorded below
  worst.error = std::isnan(error) ? kNoBound : error;
  worst.where = fmt::format("d {} / d {}: {:.12g}, differences give {:.12g}", name.row, name.column,
                            exact, numeric);
}

}  // namespace

double DerivativeCheck::worst() const {
  return std::max({gradient_error, jacobian_error, hessian_error});
}

DerivativeCheck check_derivatives(NlpProblem& problem, const VectorXd& x, double step) {
  const NlpSize size = problem.size();
  const int n = size.variables, m = size.constraints;
  Everything all{problem,
                 size,
                 VectorXi(size.jacobian_nonzeros),
                 VectorXi(size.jacobian_nonzeros),
                 VectorXd(size.jacobian_nonzeros),
                 VectorXd(m),
                 0.75};
  problem.jacobian_structure(all.jacobian_row, all.jacobian_column);
  for (int i = 0; i < m; ++i) all.multiplier[i] = (i % 2 ? -0.1 : 0.1) * (1 + i % 7);

  VectorXd gradient(n), hessian_value(size.hessian_nonzeros);
  problem.gradient(x, gradient);
  problem.jacobian(x, all.jacobian_value);
  const MatrixXd jacobian =
      dense(m, n, {all.jacobian_row, all.jacobian_column, all.jacobian_value}, false);
  VectorXi hessian_row(size.hessian_nonzeros), hessian_column(size.hessian_nonzeros);
  problem.hessian_structure(hessian_row, hessian_column);
  problem.hessian(x, all.factor, all.multiplier, hessian_value);
  const MatrixXd hessian = dense(n, n, {hessian_row, hessian_column, hessian_value}, true);

  DerivativeCheck result;
  VectorXd moved = x;
  for (int j = 0; j < n; ++j) {
    auto central = [&](double h) -> VectorXd {
      moved[j] = x[j] + h;
      const double up = moved[j];
      VectorXd difference = all.at(moved);
      moved[j] = x[j] - h;
      difference -= all.at(moved);
      difference /= up - moved[j];  // the step as rounded, not 2 h
      moved[j] = x[j];
      return difference;
    };
    const double h = step * std::max(1.0, std::abs(x[j]));
    const VectorXd numeric = (4.0 * central(0.5 * h) - central(h)) / 3.0;
    const std::string name = problem.variable_name(j);
    const auto scale_of = [](const auto& column) {
      return column.size() == 0 ? 1.0 : std::max(1.0, column.cwiseAbs().maxCoeff());
    };
    compare(gradient[j], numeric[0], std::max(1.0, std::abs(numeric[0])),
            {result.gradient_error, result.worst_gradient}, {"objective", name});
    const double jacobian_scale = scale_of(numeric.segment(1, m));
    for (int i = 0; i < m; ++i) {
      compare(jacobian(i, j), numeric[1 + i], jacobian_scale,
              {result.jacobian_error, result.worst_jacobian}, {problem.constraint_name(i), name});
    }
    const double hessian_scale = scale_of(numeric.tail(n));
    for (int i = 0; i < n; ++i) {
      compare(hessian(i, j), numeric[1 + m + i], hessian_scale,
              {result.hessian_error, result.worst_hessian},
              {"L_" + problem.variable_name(i), name});
    }
  }
  return result;
}

}  // namespace sparflow
