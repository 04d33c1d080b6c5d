#pragma once
/// Where a bound at a given time should look: the shares of the price of time along the way, as dynamic programming on a
/// coarse grid finds them. Nothing here is certified or needs to be: any shares give a bound.
#include "optimizer/bounds/energy_bound_time.h"

namespace sparflow {

/// Least cost V of E + price * time from the start to every node: upwind differences p_j = (V - V_upwind) / h_j with
/// H(q, p) = price at every node (Godunov's scheme; H rises with every |p_j|), solved by sweeps in all orders (Zhao, "A fast
/// sweeping method for Eikonal equations", Math. Comp. 74, 2005). A workspace; references must outlive it.
class TimeGuide {
 public:
  /// @param weights its energy weight and demands are read, its shares not
  TimeGuide(const Machine& loaded, const MotionProblem& problem, const TimedWeights& weights,
            const std::vector<int>& cells);

  /// Solves. @param price of time [W]  @return about the least cost to the goal set [J]
  double solve(double price);
  /// Shares along the cheapest way of the last solve(): logarithms straight in the posture, least squares weighted with the
  /// time spent. Directions not taken have share 0; price, energy weight and kind are those of `like`.
  TimeShares shares(const TimeShares& like);

 private:
  struct Upwind {
    double value = 0.0, width = 0.0;
    long node = -1;
    int direction = 0;
  };
  Upwind upwind(long node, int joint) const;
  /// Moves towards the node that have a slope at this value there; their slopes set.
  void set_moves(long node, double value);
  double update(long node);
  bool sweep(unsigned order);

  const Machine& loaded_;
  const MotionProblem& problem_;
  const TimedWeights& weights_;
  Lattice lattice_;
  EnergyPotential potential_;   // for its interpolation
  std::vector<TimedMove> all_;  // [node][joint][direction]
  std::vector<double> value_;
  std::vector<TimedMove> moves_;
  Eigen::VectorXd end_;
  LargestGain gain_;
  double price_ = 0.0;
};

}  // namespace sparflow
