#pragma once
/// Path simplification: a grid's staircase path becomes one of few straight legs.
#include <functional>

#include "optimizer/grid/energy_grid_moves.h"

namespace sparflow {

struct LegSearch {
  double price = 0.0;        ///< of time [W]
  double leg_penalty = 0.0;  ///< energy that a further leg must save [J]
  Eigen::VectorXd part;      ///< step in which a leg's cost is summed, by joint [rad] or [m]
  /// Whether the straight line between two postures is clear of obstacles; empty = every line is.
  std::function<bool(const Eigen::VectorXd&, const Eigen::VectorXd&)> clear;
};

struct Legs {
  Eigen::MatrixXd corners;   ///< [legs+1 x n]
  MoveCost cost;             ///< sum over the legs, all at the same share of their highest speeds
  double slow_energy = 0.0;  ///< [J] each leg at its own cheapest speed
  /// Lines of the path that are not clear or exceed a pump's pressure, and that no other line could replace.
  int refused = 0;
};

/// Chooses among the path's corners by dynamic programming. Between two chosen corners the joints move together on a
/// straight line, or in sequence in the best order. A line of the path that is refused (by `clear` or by an infinite cost)
/// is avoided where possible and kept, and counted, where not.
/// @param path [points x n]
Legs simplify_path(MovePricer& pricer, const Eigen::MatrixXd& path, const LegSearch& search);

}  // namespace sparflow
