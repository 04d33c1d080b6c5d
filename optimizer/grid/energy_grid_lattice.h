#pragma once
/// A rectilinear grid in joint space: its nodes, and forces and rates of the machine at them.
#include <Eigen/Dense>
#include <vector>

#include "models/machine/machine.h"
#include "problems/problem.h"

namespace sparflow {

/// Node number = sum over axes of line * stride; the last joint runs fastest.
struct Lattice {
  std::vector<Eigen::VectorXd> lines;  ///< [rad] or [m] by joint, increasing, at least two
  std::vector<long> stride;            ///< by joint
  long nodes = 0;

  Lattice() = default;
  explicit Lattice(std::vector<Eigen::VectorXd> axis_lines);

  int joints() const { return static_cast<int>(lines.size()); }
  int line(long node, int joint) const {
    const auto j = static_cast<std::size_t>(joint);
    return static_cast<int>(node / stride[j] % lines[j].size());
  }
  Eigen::VectorXd posture(long node) const;
  /// Number of the line nearest to a coordinate.
  int nearest_line(int joint, double q) const;
  /// Node nearest to a posture, axis by axis.
  long nearest_node(const Eigen::VectorXd& q) const;
};

/// Lines of one axis over its range, in `cells` cells or a few more. Each coordinate of `on_line` (within the range) has
/// a line of its own; between them lines are equally spaced. Coordinates closer than 1e-9 of the range are merged.
Eigen::VectorXd axis_lines(const Range& range, const std::vector<double>& on_line, int cells);

/// Machine quantities at all nodes.
struct LatticeForces {
  Eigen::MatrixXf force;                ///< [cylinders x nodes] static force [N]
  std::vector<Eigen::VectorXd> length;  ///< by cylinder: x at the lines of the joint it drives [m]
  std::vector<Eigen::VectorXd> rate;    ///< by cylinder: dx/dq there
  std::vector<Range> range;  ///< [N] by cylinder, range of the forces at the nodes, widened by 2 %

  /// Forces [N] and rates dx/dq by cylinder at one node.
  void at(const Machine& machine, const Lattice& lattice, long node, double* force_there,
          double* rate_there) const;
};

/// @param machine with the masses of its effects (effective_machine())  @param payload [kg]
/// @throws std::domain_error when a four-bar cannot close at a node
LatticeForces lattice_forces(const Machine& machine, const Lattice& lattice, double payload);

}  // namespace sparflow
