#pragma once
/// Estimated lower bounds when time is short: of the energy at a given duration, and of the duration itself. By
/// Lagrangian duality
///   E(T) >= V(lambda) - lambda T,   V = least of E + lambda T over all motions >= potential(end) - potential(start)
/// for every potential whose slopes p satisfy max over admissible speeds v of p.v - power(q, v) <= lambda at every
/// posture. Speeds are admissible within the limits of joint speed, valve flow and pump flow; accelerations are limited
/// at a motion's two ends only, and obstacles are left out. Only slopes in a box |p_j| <= B_j(q) are used, so that the
/// grid of optimizer/bounds/energy_bound.h can represent them; the box is searched for. docs/energy_bound.md has the
/// derivation.
///
/// The inequality is enforced at the grid's nodes and tested at random postures; between them it is estimated. So these
/// are estimated bounds, not proven ones.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/math/work_progress.h"
#include "problems/problem.h"

namespace sparflow {

struct TimedBoundOptions {
  /// Number of nodes of the final grid.
  /// @threshold [nodes] 1000..1e8; chosen: the bound rises and the time grows with it
  long nodes = 120000;
  /// Number of nodes of the grids on which the shares are searched.
  /// @threshold [nodes] 100..1e6; chosen: shares found on it differ little from those of the final grid
  long search_nodes = 2500;
  /// Number of nodes of the grid on which the best of the shares found is chosen.
  /// @threshold [nodes] 100..1e7; chosen: shares that are better there mostly are on the final grid, at a sixth of its cost
  long choice_nodes = 20000;
  /// Evaluations of that search.
  /// @threshold [1] 1..10000; chosen: ends the search; any shares give a bound
  int evaluations = 90;
  /// A machine with more joints gets no bound.
  /// @threshold [joints] 1..8; chosen: the nodes of a grid grow with the power of the joints
  int most_joints = 4;
  /// Bound of motions of any duration where it is known [J]; energy_bound_at() computes it otherwise.
  std::optional<double> any_duration;
  /// Energy of a motion of this duration, where one is known [J]. Where time costs little, the search for shares that change
  /// with the posture is left out if the bound without it is near enough.
  std::optional<double> known_energy;
  /// What the known energy may be above the bound for that, relative to the bound.
  /// @threshold [1] 0..0.1; chosen: a quarter of the two per cent within which a motion is to be shown good
  double near_enough = 5e-3;
  WorkProgress progress = {};  ///< called after each evaluation
};

struct TimedBound {
  bool valid = false;
  std::string message;         ///< why there is no bound
  double value = 0.0;          ///< [J] or [s]
  double price_W = 0.0;        ///< lambda of the bound; 0 = the bound of unlimited time is larger
  Eigen::VectorXd shares;      ///< by joint, the largest 1
  std::vector<int> lines;      ///< number of lines of the final grid by joint
  double checked_scale = 1.0;  ///< price / largest Hamiltonian sampled, <= 1
  bool capped = false;         ///< whether the search on the goal set ended at its most boxes
  double seconds = 0.0;        ///< wall time
};

/// Estimated lower bound of the energy [J] of motions that take at most `duration` [s], idle power not included.
TimedBound energy_bound_at(const CraneModel& model, const MotionProblem& problem, double duration,
                           const TimedBoundOptions& options = {});

/// Estimated lower bound of energy + price x duration [J] of motions of any duration, as idle power asks for it.
/// @param price_W of time, positive
TimedBound cost_bound(const CraneModel& model, const MotionProblem& problem, double price_W,
                      const TimedBoundOptions& options = {});

/// Estimated lower bound of the duration of a motion [s].
TimedBound least_duration(const CraneModel& model, const MotionProblem& problem,
                          const TimedBoundOptions& options = {});

}  // namespace sparflow
