#include "identification/machine_from_log/model_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Speeds, as shares of the largest, at which friction beyond Coulomb's has fallen to 1/e.
/// @threshold [-] 0.01..1; cited: Stribeck speeds of seals are 5 to 20 mm/s, rods move at 50 to 300 mm/s
constexpr double kFallingShares[] = {0.08, 0.2, 0.5};
/// Share of the rows' speeds that count for the largest.
/// @threshold [-] 0.8..1; chosen: single samples do not set a scale
constexpr double kFastest = 0.98;
constexpr int kOthers = 5;  // no threshold: columns beside those that fall with speed

double rms(const VectorXd& v) {
  return v.size() > 0 ? v.norm() / std::sqrt(static_cast<double>(v.size())) : 0.0;
}

}  // namespace

ErrorScale error_scale(const LoadRows& rows, double piston, const VectorXd& load) {
  ErrorScale scale;
  scale.load = rms(load);
  scale.pressure_force = rows.load_cell
                             ? rms(rows.force)
                             : piston * std::max(rms(rows.pressure_a), rms(rows.pressure_b));
  std::vector<double> speed(static_cast<std::size_t>(rows.rows()));
  for (Index k = 0; k < rows.rows(); ++k)
    speed[static_cast<std::size_t>(k)] = std::abs(rows.speed[k]);
  if (!speed.empty()) {
    const auto at = speed.begin() +
                    static_cast<std::ptrdiff_t>(kFastest * static_cast<double>(speed.size() - 1));
    std::nth_element(speed.begin(), at, speed.end());
    scale.speed = *at;
  }
  scale.speed = std::max(scale.speed, 1e-6);
  return scale;
}

int error_count() { return kOthers + static_cast<int>(std::size(kFallingShares)); }

Eigen::MatrixXd error_columns(const LoadRows& rows, const VectorXd& load, const ErrorScale& scale,
                              const MachineFromLogOptions& options) {
  Eigen::MatrixXd out(rows.rows(), error_count());
  const double force = options.model_error * scale.pressure_force;
  const VectorXd speed = rows.speed / scale.speed;
  Index at = 0;
  out.col(at++).setConstant(force);
  out.col(at++) = options.model_error * load.cwiseAbs().cwiseProduct(rows.direction);
  out.col(at++) = force * speed.cwiseAbs();
  out.col(at++) = force * speed.cwiseAbs().cwiseProduct(speed);
  out.col(at++) = options.inertia_error * rows.inertia;
  for (const double share : kFallingShares)
    out.col(at++) =
        force * ((-speed.cwiseAbs() / share).array().exp() * rows.direction.array()).matrix();
  return out;
}

}  // namespace sparflow::from_log
