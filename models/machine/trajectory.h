#pragma once
/// A motion in joint space; planners, optimiser, simulator and pages exchange this type.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

/// Rows are instants, columns are the machine's joints in order. SI.
/// Between instants the acceleration is constant (row k holds over [t_k, t_k+1]), so qd is piecewise
/// linear and q piecewise quadratic; the last row of qdd repeats the one before it.
struct Trajectory {
  Eigen::VectorXd t;    ///< [s]
  Eigen::MatrixXd q;    ///< [rad] or [m]
  Eigen::MatrixXd qd;   ///< [rad/s] or [m/s]
  Eigen::MatrixXd qdd;  ///< [rad/s^2] or [m/s^2]
  /// Instants at which the stops of a cycle are reached, in order; empty = the motion has none. [s]
  std::vector<double> stops = {};

  Eigen::Index size() const { return t.size(); }
  double duration() const { return t.size() == 0 ? 0.0 : t[t.size() - 1] - t[0]; }
  /// The same motion with every interval cut into `factor` equal parts (exact, not a fit).
  Trajectory refined(int factor) const;
};

}  // namespace sparflow
