#pragma once
/// Which channels may measure the position of a joint, or the stroke of its cylinder: range and rate against the machine's.
#include <vector>

#include "identification/mapping_proposal/evidence/proposal_data.h"

namespace sparflow {

struct PositionOptions {
  /// Log-odds of values that are smooth, in range, and as fast as the joint can be.
  /// @threshold [nat] 0..4; tuned: seeds 1..4 of docs/mapping_proposal.md
  double fits = 1.0;
  /// Largest loss by values outside the range.
  /// @threshold [nat] 2..20; chosen: as WordOptions::own_name, so that no name outweighs impossible values
  double outside = 8.0;
  /// Share of the range by which values outside it count fully.
  /// @threshold [1] 0.02..0.5; chosen: zero points of sensors are a few percent off
  double outside_share = 0.15;
  /// Rate of a working log as a share of the joint's limit.
  /// @threshold [1] 0.1..1; chosen: operators use most of it
  double usual_rate = 0.6;
  /// Spread of its logarithm.
  /// @threshold [1] 0.3..2; chosen: a factor of two is common, ten is another unit
  double rate_spread = 0.8;
  /// Roughness from which a channel is no motion.
  /// @threshold [1] 0.03..0.5; chosen: between two instants a machine covers a small part of its range
  double rough = 0.12;
  /// Loss of a rack's stroke against the angle.
  /// @threshold [nat] 0..4; chosen: below a clear word
  double rare = 0.7;
  /// Loss of a joint without a channel.
  /// @threshold [nat] 0..6; chosen: a log cannot be read without its positions
  double missing = 1.5;
  /// Share of the range that a rough channel covers where its roughness counts fully.
  /// @threshold [1] 0.02..1; chosen: noise of a resting sensor covers a hundredth
  double rough_span = 0.2;
  /// Rate, as a share of the joint's limit, below which a joint rests throughout.
  /// @threshold [1] 0.005..0.2; chosen: noise of position sensors stays below it
  double resting = 0.05;
  /// Candidates of a joint that the search considers.
  /// @threshold [1] 2..20; chosen: as many as joints of a machine with a few distractors
  int candidates = 9;
};

/// A channel read as the position of a joint.
struct PositionCandidate {
  int joint = -1;
  ChannelReading reading;
  Eigen::VectorXd position;  ///< [instants] joint coordinate [rad] or [m]
  bool moves = false;        ///< it does not rest throughout
  Eigen::VectorXd speed;  ///< [instants] dx/dt of its cylinder [m/s], of a joint without one dq/dt
};

/// @return best first; empty when none has a score above that of no channel
std::vector<PositionCandidate> position_candidates(const ProposalData& data, int joint,
                                                   const PositionOptions& options = {});

/// [m/s] rod speed (or joint speed) from joint positions.
Eigen::VectorXd speed_of(const ProposalData& data, int joint, const Eigen::VectorXd& position);

}  // namespace sparflow
