#pragma once
/// The potential of optimizer/bounds/energy_bound.h on its grid. Its edges keep the inequality by construction; between
/// the nodes it rests on estimated allowances.
#include <array>
#include <memory>
#include <vector>

#include "models/machine/static_force.h"
#include "optimizer/grid/energy_grid_lattice.h"
#include "optimizer/grid/energy_grid_table.h"

namespace sparflow {

/// Least price of moving one joint alone, W_j+ and W_j-, at any posture. A mutable workspace.
class MoveWeights {
 public:
  virtual ~MoveWeights() = default;
  MoveWeights(const CraneModel& model, const MotionProblem& problem, const Machine& loaded,
              const std::vector<Range>& force_range);

  /// @param weight [n x 2] in + and - direction [J/rad] or [J/m]
  void at(const Eigen::VectorXd& q, Eigen::MatrixX2d& weight);
  /// The same from tabulated forces and rates dx/dq.
  /// @param q posture  @param force [N] by cylinder  @param rate [m/rad] or [-] by cylinder
  virtual void prices(const double* q, const double* force, const double* rate,
                      Eigen::MatrixX2d& price) const;
  const std::vector<CylinderDemand>& demands() const { return demands_; }

 protected:
  /// Computes forces and rates at q for force_data() and rate_data().
  void update(const Eigen::VectorXd& q);
  const double* force_data() const { return force_.data(); }
  const double* rate_data() const { return rate_.data(); }

 private:
  double payload_;
  std::vector<CylinderDemand> demands_;
  std::vector<double> standby_;
  StaticForce statics_;
  std::vector<double> force_, rate_;
};

/// Coordinate of one axis in which the potential is interpolated: du = m(x) dx between two lines with m linear in x, where
/// x is the length of the joint's only cylinder if that is monotone, else the joint coordinate. Along u the weights vary
/// least, and not at all at constant pressure.
struct AxisCoordinate {
  int cylinder = -1;  ///< -1 = x is the joint coordinate itself
  Eigen::VectorXd x;  ///< travel from the first line to each line, increasing [m] or [rad]
  Eigen::VectorXd m;  ///< [-] at the lines
  Eigen::VectorXd u;  ///< at the lines, increasing
};

/// Lattice over the position limits with the start on a line of each axis. @param cells by joint
Lattice bound_lattice(const MotionProblem& problem, const std::vector<int>& cells);

/// Number of cells by axis with which about `nodes` nodes give the least total loss.
/// @param losses EnergyPotential::losses() of the `coarse` lattice
std::vector<int> balanced_cells(const std::vector<Eigen::Vector2d>& losses, const Lattice& coarse,
                                double nodes);

class EnergyPotential {
 public:
  /// Computes edge costs and the shortest-path potential.
  /// @param lattice must have the start as a node  @param forces of that lattice
  EnergyPotential(const Machine& loaded, const MotionProblem& problem, const MoveWeights& weights,
                  Lattice lattice, const LatticeForces& forces);

  const Lattice& lattice() const { return lattice_; }
  double node_value(long node) const { return phi_[static_cast<std::size_t>(node)]; }
  /// Potential, interpolated multilinearly in the axes' coordinates u. [J]
  double value(const Eigen::VectorXd& q) const;
  /// Values at the corners of a box inside one cell [J]; corner k has hi[j] where bit j of k is set, else lo[j].
  void corner_values(const Eigen::VectorXd& lo, const Eigen::VectorXd& hi,
                     std::vector<double>& values) const;
  /// Gradient of value() inside a cell [J/rad] or [J/m].
  Eigen::VectorXd gradient(const Eigen::VectorXd& q) const;
  /// Nodes of the shortest path from the start to a node, both included.
  std::vector<long> path_to(long node) const;
  /// Weights of the nodes in value(q), by node; all are zero except at the corners of q's cell.
  std::vector<double> corner_weights(const Eigen::VectorXd& q) const;
  /// Puts other values at the nodes, so that value() and gradient() interpolate those.
  void replace(std::vector<double> values) { phi_ = std::move(values); }
  /// Multiplies the potential.
  void scale(double factor);
  /// Relative losses by axis, means over its edges, from which the numbers of lines are chosen: x is the change of the
  /// price along the axis itself, y the allowances for curvature of the prices and of the axis' coordinate.
  const std::vector<Eigen::Vector2d>& losses() const { return losses_; }

 private:
  void make_costs(const LatticeForces& forces, const MoveWeights& weights);
  void edge_costs(int joint, std::vector<float>& field);
  void solve(long start);
  bool sweep(unsigned order);
  double coordinate(int joint, int cell, double q) const;
  double coordinate_rate(int joint, int cell, double q) const;
  int cell_of(int joint, double q) const;
  /// Calls function(node, weight) for every corner of q's cell with a positive weight.
  template <class Function>
  void over_corners(const Eigen::VectorXd& q, const Function& function) const;

  const Machine* machine_;
  Lattice lattice_;
  std::vector<AxisCoordinate> axes_;
  std::vector<std::array<std::vector<float>, 2>>
      cost_;  // [joint][direction] of the edge from a node to the next line
  std::vector<double> phi_;
  std::vector<Eigen::Vector2d> losses_;
};

}  // namespace sparflow
