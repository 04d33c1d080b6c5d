#pragma once
/// Demand of a cylinder on its pump, tabulated over (flow, force), and its least value over the flows. Tables are used
/// because a joint grid needs these values millions of times.
#include <Eigen/Dense>
#include <array>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow {

/// Number of flows besides zero at which DemandTable::rising() is given.
/// @threshold [1] 2..100; chosen: demands rise smoothly with the flow
inline constexpr std::size_t kFlowKnots = 10;

/// Demand d = P(Q, F) + margin of one cylinder in one direction, without effects. Immutable.
class DemandTable {
 public:
  DemandTable() = default;
  /// @param process pressure model; if empty, its pressure is 0 as in the exact law  @param margin [Pa]
  /// @param flow_max largest flow [m^3/s], > 0  @param force range to cover [N]
  DemandTable(const GaussianProcess& process, double margin, double flow_max, Range force);

  /// Bilinear between the table's points, held at its borders. [Pa]
  double demand(double flow, double force) const;
  /// Estimated lower bound of min over 0 <= Q <= flow_max of d(Q, F), continuous and piecewise linear in F. [Pa]
  /// The table's points are closer than an eighth of the pressure model's length scales. Between them d can lie below its
  /// linear interpolation by h^2/8 times the second derivative along each axis. This allowance is subtracted, with the
  /// largest second derivative at the points and midway between them times 1.5; it is estimated, not proven.
  double least(double force) const;
  /// Estimated lower bound of the demand at a flow and every larger one, at kFlowKnots + 1 flows from 0 to flow_max. It
  /// does not fall with the flow, and straight lines between these flows are a lower bound, too. [Pa]
  using Rising = std::array<double, kFlowKnots + 1>;
  void rising(double force, Rising& demand) const;
  double flow_max() const { return flow_max_; }
  /// Allowance subtracted in least(). [Pa]
  double allowance() const { return allowance_; }

 private:
  void make_rising();
  double flow_max_ = 0.0, flow_step_ = 1.0, force_lo_ = 0.0, force_step_ = 1.0, allowance_ = 0.0;
  Eigen::MatrixXd demand_;  // [flows x forces]
  Eigen::VectorXd least_;   // [forces]
  Eigen::MatrixXd rising_;  // [kFlowKnots + 1 x forces]
};

/// Demand of a hydraulic cylinder that a pump feeds, in both directions, with the limits of its flow.
struct CylinderDemand {
  int cylinder = 0, joint = 0, pump = -1;
  bool load_sensing = false;
  double area[2] = {0.0, 0.0};        ///< [m^2] of the supply chamber, extending and retracting
  double valve_flow[2] = {0.0, 0.0};  ///< [m^3/s], +infinity = not limited
  DemandTable table[2];
};

/// Largest flow of each pump [m^3/s] with the limits of effects; +infinity = not limited.
std::vector<double> pump_flow_limits(const CraneModel& model, const MotionProblem& problem);

/// Demands of all such cylinders. @param force_range [N] by cylinder, covered by the tables
std::vector<CylinderDemand> cylinder_demands(const CraneModel& model, const MotionProblem& problem,
                                             const std::vector<Range>& force_range);

}  // namespace sparflow
