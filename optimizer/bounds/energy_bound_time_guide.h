#pragma once
/// First guess of the shares for a bound at a given duration, from dynamic programming on a coarse grid. Its accuracy
/// does not matter for the bound's validity: any shares give a bound.
#include "optimizer/bounds/energy_bound_time_weights.h"

namespace sparflow {

/// Least cost V of E + price * time from the start to every node: upwind differences p_j = (V - V_upwind) / h_j with
/// H(q, p) = price at every node (Godunov's scheme; H rises with every |p_j|), solved by sweeps in all orders (Zhao, "A fast
/// sweeping method for Eikonal equations", Math. Comp. 74, 2005). A mutable workspace; references must outlive it.
class TimeGuide {
 public:
  /// @param weights supplies energy weight and demands; its shares are not used
  TimeGuide(const Machine& loaded, const MotionProblem& problem, const TimedWeights& weights,
            const std::vector<int>& cells);

  /// Computes V at all nodes. @param price of time [W]  @return approximate least cost to the goal set [J]
  double solve(double price);
  /// Shares along the cheapest way of the last solve(): their logarithms are linear in the posture, fitted by least squares
  /// weighted with the time spent. Directions that are not taken have share 0; price and energy weight are those of `like`.
  TimeShares shares(const TimeShares& like);

 private:
  struct Upwind {
    double value = 0.0, width = 0.0;
    long node = -1;
    int direction = 0;
  };
  Upwind upwind(long node, int joint) const;
  /// Sets moves_ to the moves towards the node with a positive upwind slope when the node has this value.
  void set_moves(long node, double value);
  double update(long node);
  bool sweep(unsigned order);

  const Machine& loaded_;
  const MotionProblem& problem_;
  const TimedWeights& weights_;
  Lattice lattice_;
  EnergyPotential potential_;   // used for its interpolation only
  std::vector<TimedMove> all_;  // [node][joint][direction]
  std::vector<double> value_;
  std::vector<TimedMove> moves_;
  Eigen::VectorXd end_;
  MaximisedHamiltonian gain_;
  double price_ = 0.0;
};

}  // namespace sparflow
