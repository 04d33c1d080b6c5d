#pragma once
/// Global search for cheap motions on a joint grid: which joints move when, in which order and to which goal
/// configuration. Its paths are starts for the optimiser; they give no lower bound (see optimizer/bounds/energy_bound.h).
///
/// Every node has 3^n - 1 neighbours, which differ by one line in any set of joints, so the graph contains sequential and
/// simultaneous motions. A move costs the quasi-static law's energy at one of three shares of its highest speed, plus the
/// price of time: E(s) + price * tau / s. Accelerations enter only as a price of each corner. Effects that change the
/// machine (masses, tilt) are included in the forces, other effects are not.
/// The cheapest path is found by Dijkstra's algorithm (1959); to meet a duration the price of time is bisected
/// (Lagrangian relaxation of the time limit).
#include <memory>
#include <string>
#include <vector>

#include "optimizer/grid/energy_grid_lattice.h"
#include "optimizer/grid/energy_grid_table.h"
#include "optimizer/phases/sequential_modes.h"
#include "problems/clearance.h"

namespace sparflow {

/// A path of straight legs from the start to the goal set; the set of moving joints is fixed along a leg.
struct GridPath {
  bool found = false;
  std::string message;  ///< why nothing was found
  Eigen::MatrixXd
      corners;  ///< [legs+1 x n] [rad] or [m], first row the start, last row at the goal exactly
  Eigen::VectorXd leg_durations;  ///< [legs] shortest durations [s], their sum is duration_s
  ModeTable modes;                ///< [legs x cylinders] kRest, kExtend, kRetract
  double energy_J = 0.0;          ///< exact energy of timed_grid_path() at duration_s
  double duration_s = 0.0;        ///< shortest duration of this path within all limits
  double slow_energy_J =
      0.0;  ///< energy of this path at unlimited time, quasi-static (slow moves, no ramps)
  double price_W = 0.0;  ///< price of time at which it is the cheapest path
};

struct EnergyGridOptions {
  /// Approximate number of nodes.
  /// @threshold [nodes] 100..1e8; chosen: the path becomes better and the time grows with it
  int nodes = 40000;
  /// With more joints no path is returned.
  /// @threshold [joints] 1..8; chosen: a grid has too many nodes then
  int most_joints = 4;
};

/// A mutable workspace that refers to model and problem; each thread needs its own.
class EnergyGrid {
 public:
  EnergyGrid(const CraneModel& model, const MotionProblem& problem,
             const EnergyGridOptions& options = {});
  ~EnergyGrid();

  /// Cheapest path when a second costs `price` [W]; 0 = unlimited time.
  GridPath cheapest_path(double price);
  /// The path with the least exact energy when timed to `duration` [s], among the cheapest paths at several prices of
  /// time. If none is fast enough, the fastest is returned; its duration_s is then longer.
  GridPath path_for_duration(double duration);
  /// Several such paths with different sequences of moves or goal configurations, cheapest first at `duration`.
  std::vector<GridPath> paths_for_duration(double duration, int most);

  long nodes() const;
  double seconds() const;  ///< wall time spent so far

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

/// The motion of `duration` [s] along the path, rest to rest. A joint comes to rest only where it stops moving or
/// reverses, and passes every corner exactly. A duration below path.duration_s violates limits. Legs whose joints have
/// equal ramps (one joint, or all from rest) are followed exactly, others approximately.
Trajectory timed_grid_path(const CraneModel& model, const MotionProblem& problem,
                           const GridPath& path, double duration);

/// The same motion with its modes, on a mesh of about `intervals` intervals with a knot at every corner: a start for
/// optimize_with_modes().
ModeCandidate grid_path_candidate(const CraneModel& model, const MotionProblem& problem,
                                  const GridPath& path, double duration, int intervals);

}  // namespace sparflow
