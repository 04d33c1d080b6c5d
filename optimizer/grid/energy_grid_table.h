#pragma once
/// What a cylinder asks of its pump, tabulated over (flow, force), and the least it can ask at any flow: a grid in joint
/// space looks these up millions of times.
#include <Eigen/Dense>
#include <array>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow {

/// Flows at which DemandTable::rising() is given, beside zero.
inline constexpr std::size_t kFlowKnots = 10;

/// Demand d = P(Q, F) + margin of one cylinder in one direction, without effects. Immutable.
class DemandTable {
 public:
  DemandTable() = default;
  /// @param process may be empty: its pressure then is 0, as in the exact law  @param margin [Pa]
  /// @param flow_max largest flow [m^3/s], > 0  @param force range to cover [N]
  DemandTable(const GaussianProcess& process, double margin, double flow_max, Range force);

  /// Bilinear between the table's points, held at its borders. [Pa]
  double demand(double flow, double force) const;
  /// Lower bound of min over 0 <= Q <= flow_max of d(Q, F), continuous and piecewise linear in F. [Pa]
  /// The table's points are closer than an eighth of the process' length scales; what d can fall below its linear
  /// interpolation between them, h^2/8 times the second derivative along each axis, is taken off with the largest
  /// second derivative met at the points and midway between them, times 1.5.
  double least(double force) const;
  /// Lower bound of the demand at that flow and every larger one, at kFlowKnots + 1 flows from 0 to flow_max. Straight lines
  /// between them are a lower bound, too; not falling. [Pa]
  using Rising = std::array<double, kFlowKnots + 1>;
  void rising(double force, Rising& demand) const;
  double flow_max() const { return flow_max_; }
  /// What was taken off in least(), at most. [Pa]
  double allowance() const { return allowance_; }

 private:
  void make_rising();
  double flow_max_ = 0.0, flow_step_ = 1.0, force_lo_ = 0.0, force_step_ = 1.0, allowance_ = 0.0;
  Eigen::MatrixXd demand_;  // [flows x forces]
  Eigen::VectorXd least_;   // [forces]
  Eigen::MatrixXd rising_;  // [kFlowKnots + 1 x forces]
};

/// Both directions of every hydraulic, fed cylinder, and what limits its flow.
struct CylinderDemand {
  int cylinder = 0, joint = 0, pump = -1;
  bool load_sensing = false;
  double area[2] = {0.0, 0.0};        ///< [m^2] extending, retracting
  double valve_flow[2] = {0.0, 0.0};  ///< [m^3/s], +infinity = not limited
  DemandTable table[2];
};

/// Largest flow of each pump [m^3/s], +infinity = not limited; limits of effects included.
std::vector<double> pump_flow_limits(const CraneModel& model, const MotionProblem& problem);

/// @param force_range [N] by cylinder that the tables shall cover
std::vector<CylinderDemand> cylinder_demands(const CraneModel& model, const MotionProblem& problem,
                                             const std::vector<Range>& force_range);

}  // namespace sparflow
