#pragma once
/// Global search for cheap motions on a grid in joint space: what moves when, in which order and to which end posture.
/// Its paths are starts for the optimiser; no bound is claimed (that is optimizer/bounds/energy_bound.h).
///
/// Every node has the 3^n - 1 neighbours that move any set of joints by one line each, so one by one and all at once are
/// both in the graph. A move costs the quasi-static law's energy at one of three shares of its highest speed, plus the
/// price of time: E(s) + price * tau / s. Accelerations count only as a price per corner. Effects that change the
/// machine (masses, tilt) are in the forces, other effects are not.
/// Cheapest path: Dijkstra (1959); to meet a duration the price is bisected (Lagrangian relaxation of the time limit).
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
  Eigen::VectorXd leg_durations;  ///< [legs] shortest [s]: their sum is duration_s
  ModeTable modes;                ///< [legs x cylinders] kRest, kExtend, kRetract
  double energy_J = 0.0;          ///< exact energy of timed_grid_path() at duration_s
  double duration_s = 0.0;        ///< shortest duration of this path within all limits
  double slow_energy_J =
      0.0;  ///< energy of this path at unlimited time, quasi-static (moves slow, no ramps)
  double price_W = 0.0;  ///< price of time at which it is the cheapest path
};

struct EnergyGridOptions {
  int nodes = 40000;    ///< about how many
  int most_joints = 4;  ///< beyond, a grid is hopeless and no path is returned
};

/// A workspace that refers to model and problem; one a thread.
class EnergyGrid {
 public:
  EnergyGrid(const CraneModel& model, const MotionProblem& problem,
             const EnergyGridOptions& options = {});
  ~EnergyGrid();

  /// Cheapest path when a second costs `price` [W]; 0 = unlimited time.
  GridPath cheapest_path(double price);
  /// The path that is cheapest by its exact energy when timed to `duration` [s], among those cheapest at some price
  /// of time. When none is fast enough, the fastest (its duration_s is then longer).
  GridPath path_for_duration(double duration);
  /// The same, several: different sequences of moves or end postures, cheapest first at `duration`.
  std::vector<GridPath> paths_for_duration(double duration, int most);

  long nodes() const;
  double seconds() const;  ///< spent so far

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

/// The motion of `duration` [s] along the path, rest to rest; a joint comes to rest only where it stops moving or
/// turns round, and passes every corner exactly. Shorter than path.duration_s breaks limits. Legs with equal ramps
/// (one by one, or all from rest) are followed exactly, others nearly.
Trajectory timed_grid_path(const CraneModel& model, const MotionProblem& problem,
                           const GridPath& path, double duration);

/// The same with its modes on a mesh of about `intervals` intervals whose knots hold every corner: a start for
/// optimize_with_modes().
ModeCandidate grid_path_candidate(const CraneModel& model, const MotionProblem& problem,
                                  const GridPath& path, double duration, int intervals);

}  // namespace sparflow
