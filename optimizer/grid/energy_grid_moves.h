#pragma once
/// Costs of straight moves in joint space under the quasi-static law.
#include <vector>

#include "models/machine/static_force.h"
#include "optimizer/grid/energy_grid_table.h"

namespace sparflow {

/// Shares of a move's highest speed at which its energy is tabulated.
/// @threshold [1] 0.05..1; chosen: full speed, about half and crawling; the law is convex in the speed between them
inline constexpr double kMoveSpeeds[3] = {1.0, 0.45, 0.12};

/// Energies are +infinity where a pump would exceed its pressure.
struct MoveCost {
  float seconds = 0.0F;                  ///< at full speed
  float energy[3] = {0.0F, 0.0F, 0.0F};  ///< [J] at kMoveSpeeds

  /// Least E + price * time over the speeds.
  double at_price(double price) const;
  double least_energy() const;
  void add(const MoveCost& other);
};

/// A mutable workspace that refers to model and problem.
class MovePricer {
 public:
  MovePricer(const CraneModel& model, const MotionProblem& problem, const Machine& loaded,
             const std::vector<Range>& force_range);

  const std::vector<CylinderDemand>& demands() const { return demands_; }

  /// Cost of a short move. @param dq [rad] or [m] by joint  @param dx [m] and force [N] by entry of demands()
  MoveCost price(const double* dq, const double* dx, const double* force);
  /// Cost of a straight line of any length, cut into `parts`.
  MoveCost price_line(const Eigen::VectorXd& from, const Eigen::VectorXd& to, int parts);

 private:
  const MotionProblem* problem_;
  const Machine* machine_;
  std::vector<CylinderDemand> demands_;
  std::vector<double> pump_flow_limit_, pump_volume_;
  std::vector<double> standby_, pump_pressure_limit_;
  StaticForce statics_;
  std::vector<double> dx_, force_, length_before_, force_before_;
};

}  // namespace sparflow
