#pragma once
/// Decides from the pressures alone which of two laws sets the pressures of a moving cylinder.
///   return line:     the valve's return edge and the tank line set the return chamber,      p_return = f(Q_return)
///   counterbalance:  a counterbalance valve throttles the return and needs a supply pressure,  p_supply = g(Q, F)
/// The supply pressure is the larger of both demands, so p_return >= f and p_supply >= g, and one is an equality.
/// The equality that holds separates the laws, not the sign of the load: a valve with a high setting acts even when
/// the cylinder moves against a load. Both pressures are coupled by force and areas, so a return pressure beyond f
/// means that the counterbalance valve acts.
///
/// A mixture of both laws and of a small share of outliers (starts, stops) is fitted by expectation maximisation from
/// several initial guesses, and the most likely fit is kept. Source: R. E. Quandt, J. B. Ramsey, "Estimating mixtures
/// of normal distributions and switching regressions", J. Am. Stat. Assoc. 73 (1978) 730-738; A. P. Dempster,
/// N. M. Laird, D. B. Rubin, J. R. Stat. Soc. B 39 (1977) 1-38.
#include <vector>

#include "diagnosis/evidence/evidence_options.h"
#include "identification/signals/signals.h"

namespace sparflow {

/// Samples that follow one law with high posterior probability. Samples near the intersection of both laws, near a
/// change from one to the other, or that follow neither are in no mask.
struct BranchSplit {
  Mask return_line, counterbalance;
};

/// One cylinder moving in one direction, in one log; all vectors [samples].
struct BranchData {
  Eigen::VectorXd p_return, p_supply;  ///< [Pa] chamber pressures, filtered
  Eigen::VectorXd q_return, q_supply;  ///< [m^3/s] >= 0
  Eigen::VectorXd force;               ///< [N] measured, of either sign convention
  /// [m^3/s] return flow of all cylinders, because they share the tank line; may be empty.
  Eigen::VectorXd q_return_total;
  /// [degC] oil temperature, because the return line's law depends on it; may be empty.
  Eigen::VectorXd oil;
  Mask moving;  ///< samples to judge
};

/// Splits several logs of one machine together: the laws are common, the tank line's share is fitted for each log.
/// Logs with other loads determine the valve's law much better than one log alone.
/// @param first_machine number of leading logs of the machine in one state; the others (references) are of another
///        state, between which a valve may have been changed. Each state gets its own laws if these are clearly more
///        likely.
/// @return one split for each log; masks are empty where fewer than BranchOptions::fewest_samples are usable
std::vector<BranchSplit> split_branches(const std::vector<BranchData>& logs,
                                        std::size_t first_machine = 0,
                                        const BranchOptions& options = {});

}  // namespace sparflow
