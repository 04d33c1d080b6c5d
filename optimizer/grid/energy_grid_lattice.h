#pragma once
/// A rectilinear grid in joint space: places of its nodes and what the machine is there.
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

/// Lines of one axis over its range in `cells` cells or a few more, all of `on_line` (coordinates in the range) exactly
/// on one; in between equally spaced. Coordinates closer than 1e-9 of the range are one.
Eigen::VectorXd axis_lines(const Range& range, const std::vector<double>& on_line, int cells);

/// Machine quantities at all nodes.
struct LatticeForces {
  Eigen::MatrixXf force;                ///< [cylinders x nodes] static force [N]
  std::vector<Eigen::VectorXd> length;  ///< by cylinder: x at the lines of the joint it drives [m]
  std::vector<Eigen::VectorXd> rate;    ///< by cylinder: dx/dq there
  std::vector<Range> range;             ///< [N] by cylinder, of the forces, widened by 2 %

  /// Of one node. @param force [N] and rate by cylinder, filled
  void at(const Machine& machine, const Lattice& lattice, long node, double* force_there,
          double* rate_there) const;
};

/// @param machine that carries the loads (effective_machine())
/// @throws std::domain_error when a four-bar cannot close at a node
LatticeForces lattice_forces(const Machine& machine, const Lattice& lattice, double payload);

}  // namespace sparflow
