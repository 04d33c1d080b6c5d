#pragma once
/// Prices of the joints' moves for a bound at a given duration (optimizer/bounds/energy_bound_time.h), and the shares of
/// the joints in the price of time on which they depend.
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
/// @threshold [1] 1e-6..1e-2; chosen: the bound is lower by as much, and an equation at each node is solved with
/// fewer steps
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

}  // namespace sparflow
