#include "identification/learning/learn_valve.h"

#include <fmt/format.h>

#include <cmath>

#include "models/math/error.h"
#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct RobustFit {
  VectorXd coefficients;
  MatrixXd covariance;
  VectorXd residuals;
};

/// Iteratively reweighted least squares with Huber's weights. `features` must have full rank.
RobustFit robust_fit(const MatrixXd& features, const VectorXd& y) {
  RobustFit fit;
  VectorXd weight = VectorXd::Ones(y.size());
  double std = 0.0;
  MatrixXd normal;
  for (int i = 0; i < 50; ++i) {
    normal = weighted_gram(features, weight);
    const VectorXd before = fit.coefficients;
    fit.coefficients = solve_symmetric(normal, features.transpose() * weight.cwiseProduct(y));
    fit.residuals = y - features * fit.coefficients;
    // Residuals below a billionth of the signal are rounding errors and must not determine the weights.
    std = std::max(robust_std(fit.residuals), 1e-9 * y.cwiseAbs().maxCoeff());
    if (std <= 0.0) break;
    weight = fit.residuals.unaryExpr([&](double r) { return huber_weight(r, kHuberStds * std); });
    if (i > 0 && (fit.coefficients - before).norm() < 1e-10 * fit.coefficients.norm()) break;
  }
  fit.covariance = std * std * symmetric_inverse(normal);
  return fit;
}

double r_squared(const VectorXd& residuals, const VectorXd& y) {
  const double total = (y.array() - y.mean()).square().sum();
  return total > 0.0 ? 1.0 - residuals.squaredNorm() / total : 0.0;
}

}  // namespace

LearnedValve learn_valve(const Eigen::Ref<const VectorXd>& command,
                         const Eigen::Ref<const VectorXd>& flow, const LearnValveOptions& options) {
  SPARFLOW_CHECK(command.size() == flow.size(), "command and flow must be equally long");
  LearnedValve out;
  out.given = static_cast<int>(command.size());
  VectorXd u(command.size()), q(command.size());
  Index n = 0;
  for (Index i = 0; i < command.size(); ++i) {
    if (!std::isfinite(command[i]) || !std::isfinite(flow[i]) || command[i] == 0.0) continue;
    u[n] = std::abs(command[i]);
    q[n++] = flow[i];
  }
  u.conservativeResize(n);
  q.conservativeResize(n);
  out.used = static_cast<int>(n);
  if (n < options.fewest_samples) {
    throw InputError({}, "command",
                     fmt::format("got {} samples with a command and a flow ({} given), expected at "
                                 "least {}; log more motion in this direction",
                                 n, out.given, options.fewest_samples));
  }
  const RobustFit line = robust_fit(u, q);
  out.gain = line.coefficients[0];
  out.gain_standard_error = std::sqrt(line.covariance(0, 0));
  out.r2 = r_squared(line.residuals, q);
  out.rmse = std::sqrt(line.residuals.squaredNorm() / static_cast<double>(n));
  out.command_max = u.maxCoeff();
  if (out.gain <= 0.0) {
    out.warnings.push_back("The flow does not grow with the command: the gain is not positive.");
  }

  const double spread = std::sqrt((u.array() - u.mean()).square().mean());
  out.affine = spread > options.least_spread * out.command_max;
  if (!out.affine) return out;
  MatrixXd features(n, 2);
  features << u, VectorXd::Ones(n);
  const RobustFit affine = robust_fit(features, q);
  const double slope = affine.coefficients[0];
  out.affine_gain = slope;
  out.affine_r2 = r_squared(affine.residuals, q);
  constexpr double kNoSlope = 1e-6;  // of the gain; the dead band is divided by the slope
  if (std::abs(slope) <= kNoSlope * std::abs(out.gain)) {
    out.affine = false;
    return out;
  }
  out.dead_band = -affine.coefficients[1] / slope;
  // First-order error propagation of dead_band = -b/a.
  const Eigen::Vector2d jacobian(-out.dead_band / slope, -1.0 / slope);
  out.dead_band_standard_error = std::sqrt(jacobian.dot(affine.covariance * jacobian));
  if (out.dead_band > options.least_dead_band &&
      out.dead_band > options.dead_band_errors * out.dead_band_standard_error &&
      1.0 - out.affine_r2 < options.residual_ratio * (1.0 - out.r2)) {
    out.warnings.push_back(
        fmt::format("The residual suggests a dead band of {:.3f} of full command.", out.dead_band));
  }
  return out;
}

}  // namespace sparflow
