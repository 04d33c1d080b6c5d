#pragma once
/// Which pair of pressures belongs to a cylinder: A pA - B pB against the static force by virtual work along proposed positions, with
/// dry and viscous friction and an unknown payload.
#include <vector>

#include "identification/mapping_proposal/assignment.h"
#include "identification/mapping_proposal/evidence/position_evidence.h"

namespace sparflow {

struct PressureOptions {
  /// Loss of a channel that is negative, or far above the pumps' largest pressure.
  /// @threshold [nat] 2..20; chosen: as PositionOptions::outside
  double outside = 8.0;
  /// Lowest value in question, of the pumps' largest pressure.
  /// @threshold [1] 0..0.2; chosen: zero errors of sensors of a few bar, cavitation
  double lowest = 0.02;
  /// Highest value in question, of the same.
  /// @threshold [1] 1..4; chosen: a rod side at rest, loaded by the bore side, holds more than the pump gives
  double highest = 1.8;
  /// Highest value that is still no pressure of a chamber in use.
  /// @threshold [1] 0.005..0.1; chosen: a return line
  double idle = 0.03;
  /// Weight of pressure changes that coincide with the cylinder's own motion.
  /// @threshold [nat] 0..3; tuned: seeds 1..4 of docs/mapping_proposal.md
  double activity = 0.8;
  /// Loss of a friction that would drive the cylinder, or a payload below zero.
  /// @threshold [nat] 0..10; chosen: as a clear word
  double impossible = 3.0;
  /// Pressure channels among which pairs are sought; those in the program's own names are all kept.
  /// @threshold [1] 4..200; chosen: two for each cylinder of a large machine and its ports
  int channels = 40;
  /// Channels of few levels that are tried as payload.
  /// @threshold [1] 0..5; chosen: a log has one
  int payloads = 2;
};

/// Pressure channels in SI by one reading of the units that the file leaves open.
struct PressureSet {
  std::vector<int> channels;        ///< [n]
  std::vector<ChannelUnit> units;   ///< [n]
  Eigen::MatrixXd values;           ///< [instants x n] [Pa]
  Eigen::MatrixXd inner;            ///< [n x n] values' values
  std::vector<double> range_score;  ///< [n] [nat]
  Eigen::MatrixXd said_a, said_b;   ///< [n x cylinders] names and units [nat]
  std::string open_unit;            ///< the unit taken where none is given, "" when all are
};

/// Readings of the pressure units that are possible, the plausible ones only.
std::vector<PressureSet> pressure_sets(const ProposalData& data,
                                       const PressureOptions& options = {});

/// Channels of few levels that may be payloads, best first.
std::vector<int> payload_channels(const ProposalData& data, const PressureOptions& options = {});

/// Static force [N] of each cylinder along positions, and its change by a payload of 1 kg. [instants x cylinders]
struct StaticForces {
  Eigen::MatrixXd empty, by_mass;
};
StaticForces forces_along(const Machine& machine, const Eigen::MatrixXd& position);

/// Changes of pressure while the cylinder moves against those while it rests. [n] [nat]
Eigen::VectorXd activity_scores(const ProposalData& data, const PressureSet& pressures,
                                const Eigen::VectorXd& speed, const PressureOptions& options = {});

/// A pair's agreement with the static force.
struct ForceFit {
  double misfit = 1.0;    ///< rms of what is left over the cylinder's scale
  double rms = 0.0;       ///< [N]
  double friction = 0.0;  ///< [N] with the sign of the rod speed
  double log_odds = 0.0;
};

/// What the pairs of a cylinder are judged with, at one proposal of positions.
struct ForceQuestion {
  const PressureSet& pressures;
  int cylinder = 0;
  const StaticForces& forces;
  const Eigen::VectorXd& speed;     ///< [instants] rod speed [m/s]
  const Eigen::MatrixXd& payloads;  ///< [instants x k] values that may be payloads
};

/// Everything about the pairs of one cylinder at one proposal of positions.
class CylinderForces {
 public:
  CylinderForces(const ProposalData& data, const ForceQuestion& question,
                 const PressureOptions& options = {});
  /// @param a, b columns of the pressure set; b may be -1
  ForceFit fit(int a, int b) const;

 private:
  const ProposalData* data_;
  double piston_ = 0.0, rod_ = 0.0, scale_ = 1.0, mass_scale_ = 1.0;
  Eigen::Index count_ = 0;
  Eigen::MatrixXd coefficients_;  ///< [regressors x (n + 1)], the last of the static force
  Eigen::MatrixXd left_;  ///< [(n + 1) x (n + 1)] inner products of what the regressors leave
  PressureOptions options_;
};

}  // namespace sparflow
