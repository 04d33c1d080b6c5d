#pragma once
/// What moves with a cylinder: its command, its measured speed and its flow, against the rod speed by a position.
#include <string>

#include "identification/mapping_proposal/evidence/position_evidence.h"

namespace sparflow {

/// A channel as the command of a cylinder: u = sign (value - neutral) / scale.
struct CommandFit {
  double misfit =
      1.0;      ///< 0..1, root of the share of the rod speed's square that the two slopes leave
  int lag = 0;  ///< [instants]
  double neutral = 0.0;  ///< value at rest, in the channel's unit
  double sign = 1.0;
  double slope[2] = {0.0, 0.0};  ///< [m/s] of one unit, extending and retracting
  double log_odds = 0.0;
};
CommandFit fit_command(const ProposalData& data, int channel, const PositionCandidate& position);

/// Loss by slopes that are not those of the valve's flows in the machine file. [nat]
double slope_loss(const ProposalData& data, int channel, int joint, const CommandFit& fit);

/// Fraction of a squared signal that a measured copy of it leaves.
struct CopyFit {
  double misfit = 1.0;
  double factor = 1.0;  ///< SI of one unit of the channel
  ChannelUnit unit;
  double log_odds = 0.0;
};
/// The channel as a measured speed, of the joint or of the rod. @param rate [instants] expected, SI
CopyFit fit_speed(const ProposalData& data, int channel, const Meaning& meaning,
                  const Eigen::VectorXd& rate);
/// The channel as the flow to the cylinder, A v extending and B |v| retracting, of either sign.
CopyFit fit_flow(const ProposalData& data, int channel, int cylinder,
                 const Eigen::VectorXd& rod_speed);

/// The channel as a second sensor of a position or stroke. @param expected [instants] SI
CopyFit fit_copy(const ProposalData& data, int channel, const Meaning& meaning,
                 const Eigen::VectorXd& expected);

/// @return expression of the command over the channel's column ("(`Joy [mA]` - 12) / 8")
std::string command_expression(const ProposalData& data, int channel, int cylinder,
                               const CommandFit& fit, std::string* scale_words);

}  // namespace sparflow
