#pragma once
/// A staircase from a grid made a path of few straight legs.
#include <functional>

#include "optimizer/grid/energy_grid_moves.h"

namespace sparflow {

struct LegSearch {
  double price = 0.0;        ///< of time [W]
  double leg_penalty = 0.0;  ///< what a further leg must save [J]
  Eigen::VectorXd part;      ///< by joint: way per part when a leg's cost is summed up [rad] or [m]
  std::function<bool(const Eigen::VectorXd&, const Eigen::VectorXd&)> clear;  ///< empty: all is
};

struct Legs {
  Eigen::MatrixXd corners;   ///< [legs+1 x n]
  MoveCost cost;             ///< of all legs; energies at one speed share everywhere
  double slow_energy = 0.0;  ///< [J] each leg at its own cheapest speed
};

/// Chooses among the path's corners by dynamic programming: between two chosen ones the joints move together on a straight
/// line, or one after another in the best order.
/// @param path [points x n]
Legs few_legs(MovePricer& pricer, const Eigen::MatrixXd& path, const LegSearch& search);

}  // namespace sparflow
