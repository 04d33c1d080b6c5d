#pragma once
/// Which of two laws sets a moving cylinder's pressures, told from the pressures alone.
///   return line:     the valve's return edge and the tank line set the return chamber,   p_return = f(Q_return)
///   counterbalance:  a counterbalance valve throttles the return and asks for a supply,  p_supply = g(Q, F)
/// The supply holds whichever asks for more, so p_return >= f and p_supply >= g, and one of the two is an equality.
/// That, and not the sign of the load, tells them apart: with a high setting the valve rules far into opposing
/// loads. Force and areas tie the pressures together, so a return chamber that carries force is the valve's.
///
/// A mixture of both laws and a small share of strays (starts, stops), fitted by expectation maximisation from
/// several starts, the most likely kept: R. E. Quandt, J. B. Ramsey, "Estimating mixtures of normal distributions
/// and switching regressions", J. Am. Stat. Assoc. 73 (1978) 730-738; A. P. Dempster, N. M. Laird, D. B. Rubin,
/// J. R. Stat. Soc. B 39 (1977) 1-38.
#include <vector>

#include "identification/signals/signals.h"

namespace sparflow {

/// Samples that are surely of one branch; those near the kink, near a switch or of neither are in none.
struct BranchSplit {
  Mask return_line, counterbalance;
};

/// One cylinder moving to one side, in one log; all vectors [samples].
struct BranchData {
  Eigen::VectorXd p_return, p_supply;  ///< [Pa] chambers, filtered
  Eigen::VectorXd q_return, q_supply;  ///< [m^3/s] >= 0
  Eigen::VectorXd force;               ///< [N] measured, of either sign convention
  /// Return flow of all cylinders [m^3/s], so that a shared tank line does not blur the return law; may be empty.
  Eigen::VectorXd q_return_total;
  /// [degC] the return line's law follows it, so that oil that warms is not taken for a valve; may be empty.
  Eigen::VectorXd oil;
  Mask moving;  ///< samples to judge
};

/// Several logs of one machine together: the laws are common, the tank line's share is each log's own. Logs
/// with other loads show the valve's law far better than one log alone.
/// @param first_machine so many of the logs are of the machine in one state, the rest (a reference) in another. A
///        valve may have come in between: each state gets laws of its own where that explains clearly more.
/// @return one split a log; empty masks where fewer than 60 samples can be judged
std::vector<BranchSplit> split_branches(const std::vector<BranchData>& logs,
                                        std::size_t first_machine = 0);

/// One log alone.
BranchSplit split_branches(const Eigen::VectorXd& p_return, const Eigen::VectorXd& p_supply,
                           const Eigen::VectorXd& q_return, const Eigen::VectorXd& q_supply,
                           const Eigen::VectorXd& force, const Mask& moving);

}  // namespace sparflow
