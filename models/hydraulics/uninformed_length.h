#pragma once
/// Length-scales of a Gaussian process over a coordinate that its data do not vary.
#include "models/hydraulics/gaussian_process.h"

namespace sparflow {

/// Replaces a length-scale by a long one where all centres and data have (nearly) the same value of that coordinate, as
/// the force of a slewing drive. Such a length was learned from nothing. A short one would make the pressure drop to the
/// mean's plane within that length of the only value, which no data shows, and curve without limit there; with a long one
/// the process continues as learned, and the pressures at the data are the same.
/// @return whether a length was replaced
inline bool replace_uninformed_lengths(GpParameters& p) {
  /// Spread of the forces that a length-scale can be learned from.
  /// @threshold [N] 1e-6..100; numerical: a newton is a hundred pascals on a small piston, below what sensors resolve
  constexpr double kLeastForceSpread = 1.0;
  /// Spread of the flows that a length-scale can be learned from.
  /// @threshold [m^3/s] 1e-12..1e-6; numerical: a thousandth of a litre per minute, below what valves resolve
  constexpr double kLeastFlowSpread = 1e-8;
  /// Length over the force where all forces are equal.
  /// @threshold [N] 1e4..1e7; chosen: of the order of the forces cylinders carry, over which nothing is known to change
  constexpr double kLengthOfConstantForce = 1e5;
  /// Length over the flow where all flows are equal.
  /// @threshold [m^3/s] 1e-4..1e-1; chosen: of the order of the flows cylinders get
  constexpr double kLengthOfConstantFlow = 1e-2;
  const auto informed = [](const Eigen::ArrayXd& centres, double lo, double hi, double least) {
    return hi - lo > least ||
           (centres.size() > 0 && centres.maxCoeff() - centres.minCoeff() > least);
  };
  bool replaced = false;
  if (!informed(p.force, p.force_min, p.force_max, kLeastForceSpread) &&
      p.length_force < kLengthOfConstantForce) {
    p.length_force = kLengthOfConstantForce;
    replaced = true;
  }
  if (!informed(p.flow, p.flow_min, p.flow_max, kLeastFlowSpread) &&
      p.length_flow < kLengthOfConstantFlow) {
    p.length_flow = kLengthOfConstantFlow;
    replaced = true;
  }
  return replaced;
}

}  // namespace sparflow
