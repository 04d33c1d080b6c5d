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
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_potential.h"
#include "optimizer/bounds/maximised_hamiltonian.h"

namespace sparflow {

/// Shares of the joints in the price of time.
struct TimeShares {
  double price = 0.0;          ///< lambda [W]; 1 [-] for the least duration
  double energy_weight = 1.0;  ///< 1, or 0 for the least duration, where energy is free
  Eigen::MatrixX2d
      share;  ///< [n x 2] >= 0, of each joint moving in + and - direction [-]; only ratios matter
  /// [2n x n] or empty: entry (2j + d, k) is the growth of the logarithm of joint j's share in direction d from one end of
  /// joint k's range to the other; `share` holds the shares in the middle of all ranges.
  Eigen::MatrixXd tilt;
};

/// Relative tolerance with which the slopes use up the price of time. They may exceed it by this much, so the bound is
/// computed with the price raised by it.
inline constexpr double kPriceTolerance = 4e-4;

/// Largest slopes B_j+-: the cost of moving j alone when the time it takes has the price alpha(q) share_j, at the flow
/// where that is least, with the largest alpha that keeps the inequality above. A mutable workspace.
class TimedWeights final : public MoveWeights {
 public:
  TimedWeights(const CraneModel& model, const MotionProblem& problem, const Machine& loaded,
               const std::vector<Range>& force_range);

  void set_shares(const TimeShares& shares) {
    shares_ = shares;
    ramp_gain_ = 0.0;
  }
  /// Rate r with which the maximised Hamiltonian can grow from rest, where |v_j| <= a_j t with a_j the acceleration limit:
  /// the largest sum over cylinders of (B_j - P A_j) a_j, over all cylinders that demand at most P. It is the maximum over
  /// the postures at which prices() was called since set_shares(). [W/s]; [1/s] for the least duration
  double ramp_gain() const { return ramp_gain_; }
  /// False when a joint's cylinders are fed by different pumps: the inequality then is not covered.
  bool possible() const { return possible_; }

  void prices(const double* q, const double* force, const double* rate,
              Eigen::MatrixX2d& price) const override;
  /// Maximised Hamiltonian, max over v of p.v - power(q, v), with each v_j of the sign of p_j [W]. @param slope p by joint
  double largest_gain(const Eigen::VectorXd& q, const Eigen::VectorXd& slope);

  /// Volume, largest flow and demand of a joint that moves in one direction. @param direction 0 is +, 1 is -
  TimedMove move_of(int joint, int direction, const double* force, const double* rate) const;
  const std::vector<double>& pump_flow() const { return pump_flow_; }
  /// Posture as shares of the joints' ranges from their middle, -0.5 to 0.5, in which TimeShares::tilt is linear.
  Eigen::VectorXd place_of(const double* q) const;

 private:
  /// Sets moves_ to all moves with a positive share, and move_share_ to their shares at q.
  void make_moves(const double* q, const double* force, const double* rate) const;
  double gain_from_rest() const;

  std::vector<Range> position_, speed_, acceleration_;
  std::vector<double> pump_flow_, pump_standby_;
  TimeShares shares_;
  bool possible_ = true;
  mutable double ramp_gain_ = 0.0;
  mutable double alpha_ratio_ = 0.5;  // last root, where the next search begins
  mutable std::vector<TimedMove> moves_;
  mutable std::vector<double> move_share_;
  mutable MaximisedHamiltonian gain_;
};

struct TimedBoundOptions {
  long nodes = 120000;       ///< of the final grid
  long search_nodes = 2500;  ///< of the grids on which the shares are searched
  int evaluations = 90;      ///< of that search
  int most_joints = 4;       ///< a machine with more joints gets no bound
};

struct TimedBound {
  bool valid = false;
  std::string message;         ///< why there is no bound
  double value = 0.0;          ///< [J] or [s]
  double price_W = 0.0;        ///< lambda of the bound; 0 = the bound of unlimited time is larger
  Eigen::VectorXd shares;      ///< by joint, the largest 1
  std::vector<int> lines;      ///< number of lines of the final grid by joint
  double checked_scale = 1.0;  ///< price / largest Hamiltonian sampled, <= 1
  double seconds = 0.0;        ///< wall time
};

/// Estimated lower bound of the energy [J] of motions that take at most `duration` [s], idle power not included.
TimedBound energy_bound_at(const CraneModel& model, const MotionProblem& problem, double duration,
                           const TimedBoundOptions& options = {});

/// Estimated lower bound of the duration of a motion [s].
TimedBound least_duration(const CraneModel& model, const MotionProblem& problem,
                          const TimedBoundOptions& options = {});

}  // namespace sparflow
