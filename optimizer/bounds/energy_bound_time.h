#pragma once
/// Lower bounds when time is short: of the energy at a given duration, and of the duration itself. By Lagrangian duality
///   E(T) >= V(lambda) - lambda T,   V = least of E + lambda T over all motions >= potential(end) - potential(start)
/// for every potential whose slopes p satisfy max over admissible speeds v of p.v - power(q, v) <= lambda at every
/// posture. Admissible: joint speeds, valve flows, pump flow; accelerations count at a motion's two ends
/// alone, obstacles not at all. Only slopes in
/// a box |p_j| <= B_j(q) are used, so that the grid of optimizer/bounds/energy_bound.h serves; which box, is searched for.
/// docs/energy_bound.md has the proof.
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_potential.h"
#include "optimizer/bounds/energy_bound_time_gain.h"

namespace sparflow {

/// One way to share the price of time among the joints.
struct TimeShares {
  double price = 0.0;          ///< lambda [W]; [-] 1 for the least duration
  double energy_weight = 1.0;  ///< 1, or 0: energy is free, for the least duration
  Eigen::MatrixX2d
      share;  ///< [n x 2] >= 0, of each joint moving in + and - direction [-]; only ratios count
  /// [2n x n] or empty: the logarithm of joint j's share in direction d (row 2j + d) grows by so much from one end of joint
  /// k's range to the other; `share` is that in the middle of all ranges.
  Eigen::MatrixXd tilt;
};

/// The price is met, and may be exceeded, by this share of it at the most: what stands for it is charged.
inline constexpr double kPriceTolerance = 4e-4;

/// Largest slopes B_j+-: what moving j alone costs when the time it takes has the price alpha(q) share_j, at the flow where
/// that is least, with the largest alpha that keeps the inequality above. A workspace.
class TimedWeights final : public MoveWeights {
 public:
  TimedWeights(const CraneModel& model, const MotionProblem& problem, const Machine& loaded,
               const std::vector<Range>& force_range);

  void set_shares(const TimeShares& shares) {
    shares_ = shares;
    ramp_gain_ = 0.0;
  }
  /// Near its ends, where |v_j| <= a_j t with a_j the acceleration limit, a motion gains at most this times t: the largest sum
  /// over cylinders of (B_j - P A_j) a_j, each moving one asking for at most P, met by prices() since set_shares(). [W/s]; [1/s]
  /// for the least duration
  double ramp_gain() const { return ramp_gain_; }
  /// False when a joint's cylinders are fed by different pumps: the inequality then is not covered.
  bool possible() const { return possible_; }

  void prices(const double* q, const double* force, const double* rate,
              Eigen::MatrixX2d& price) const override;
  /// max over v of p.v - power(q, v) [W] of slopes within the signs of p. @param slope by joint
  double largest_gain(const Eigen::VectorXd& q, const Eigen::VectorXd& slope);

  /// What a joint asks for when it moves that way. @param direction 0 is +, 1 is -
  TimedMove move_of(int joint, int direction, const double* force, const double* rate) const;
  const std::vector<double>& pump_flow() const { return pump_flow_; }
  /// Posture as shares of the ranges from their middle, -0.5 to 0.5: what TimeShares::tilt counts in.
  Eigen::VectorXd place_of(const double* q) const;

 private:
  /// Moves that have a share, and those shares.
  void make_moves(const double* q, const double* force, const double* rate) const;
  double gain_from_rest() const;

  std::vector<Range> position_, speed_, acceleration_;
  std::vector<double> pump_flow_, pump_standby_;
  TimeShares shares_;
  bool possible_ = true;
  mutable double ramp_gain_ = 0.0;
  mutable double alpha_ratio_ = 0.5;  // where the last root was found
  mutable std::vector<TimedMove> moves_;
  mutable std::vector<double> move_share_;
  mutable LargestGain gain_;
};

struct TimedBoundOptions {
  long nodes = 120000;       ///< of the last grid
  long search_nodes = 2500;  ///< of the grids on which the shares are searched
  int evaluations = 90;      ///< of that search
  int most_joints = 4;
};

struct TimedBound {
  bool valid = false;
  std::string message;     ///< why not
  double value = 0.0;      ///< [J] or [s]
  double price_W = 0.0;    ///< lambda it was found at
  Eigen::VectorXd shares;  ///< by joint, the largest 1
  std::vector<int> lines;  ///< of the last grid
  double checked_scale = 1.0;
  double seconds = 0.0;
};

/// No motion that takes at most `duration` [s] needs less energy [J], idle power not included.
TimedBound energy_bound_at(const CraneModel& model, const MotionProblem& problem, double duration,
                           const TimedBoundOptions& options = {});

/// No motion is shorter [s].
TimedBound least_duration(const CraneModel& model, const MotionProblem& problem,
                          const TimedBoundOptions& options = {});

}  // namespace sparflow
