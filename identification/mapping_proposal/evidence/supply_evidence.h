#pragma once
/// Pump and return pressure against the working pressures of proposed pairs; payload against the force that the machine's own masses
/// leave; oil temperature by its slowness.
#include <string>
#include <vector>

#include "identification/mapping_proposal/evidence/force_evidence.h"

namespace sparflow {

/// A cylinder of a proposal: where it is known, rod speed and its columns in the pressure set.
struct ProposedCylinder {
  const Eigen::VectorXd* speed = nullptr;
  int a = -1, b = -1;
};

/// Largest working pressure of the pump's cylinders that move, NaN where none does. [instants] [Pa]
Eigen::VectorXd largest_working_pressure(const ProposalData& data, const PressureSet& pressures,
                                         const std::vector<ProposedCylinder>& cylinders, int pump);

struct PumpFit {
  double above = 0.0;   ///< share of the moving instants at which the pump is at least as high
  double margin = 0.0;  ///< [Pa] median distance
  double spread =
      0.0;  ///< [Pa] robust standard deviation of the distance (of the pressure, for a constant pressure supply)
  double log_odds = 0.0;
};
/// @param working of largest_working_pressure
PumpFit fit_pump(const ProposalData& data, const Eigen::VectorXd& pressure, int pump,
                 const Eigen::VectorXd& working);

/// A low pressure that rises with the flow of the return lines. @param cylinders their speeds give that flow
double return_log_odds(const ProposalData& data, const Eigen::VectorXd& pressure,
                       const std::vector<ProposedCylinder>& cylinders);

/// What static force, dry and viscous friction and acceleration leave of a measured force, as a share of it; 1 where the cylinder's
/// speed is not known.
double force_misfit(const ProposalData& data, int channel, int cylinder,
                    const std::vector<ProposedCylinder>& cylinders, const StaticForces& forces);

struct PayloadFit {
  double share = 0.0;  ///< of the left force that it explains
  ChannelUnit unit;
  double log_odds = 0.0;
};
PayloadFit fit_payload(const ProposalData& data, const PressureSet& pressures, int channel,
                       const std::vector<ProposedCylinder>& cylinders, const StaticForces& forces);

/// Slow, between freezing and the limit of hydraulic oil.
struct OilFit {
  ChannelUnit unit;
  double log_odds = 0.0;
  bool slow = false;
  bool within = false;  ///< all values lie among temperatures of oil
};
OilFit fit_oil(const ProposalData& data, int channel);

}  // namespace sparflow
