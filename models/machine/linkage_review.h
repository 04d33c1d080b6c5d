#pragma once
/// What a cylinder's linkage does over its joint's range, for people to look at: stroke, length, lever arm and static force;
/// and doubts about it that are no errors.
#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow {

/// One joint position; the other joints stand still.
struct LinkageSample {
  double q = 0.0;       ///< [rad] or [m]
  double stroke = 0.0;  ///< [m]
  double length = 0.0;  ///< [m] pin to pin; of rack and direct drives x
  double rate = 0.0;    ///< [m/rad] or [-], dx/dq: the lever arm
  double force_empty =
      0.0;  ///< [N] static force without payload, positive if the load pushes the rod in
  double force_loaded = 0.0;  ///< [N] with payload
};

/// Samples evenly spaced over the joint's range, both ends included.
/// @param posture of all joints; that of the cylinder's own is replaced  @param payload [kg]  @param count at least 2
std::vector<LinkageSample> linkage_samples(const Machine& machine, int cylinder,
                                           const Eigen::VectorXd& posture, double payload,
                                           int count);

/// The middle of every joint's range.
Eigen::VectorXd middle_posture(const Machine& machine);

/// A four-bar on one of its two branches, over the joint's range.
struct FourBarBranch {
  bool closes = false;        ///< and dx/dq keeps its sign
  double shortest = 0.0;      ///< [m] pin-to-pin length
  double longest = 0.0;       ///< [m]
  double least_rate = 0.0;    ///< [m/rad] of |dx/dq|
  double largest_rate = 0.0;  ///< [m/rad]
};

/// @return nothing when the cylinder's linkage is no four-bar
std::optional<FourBarBranch> four_bar_branch(const Machine& machine, int cylinder, int branch);

/// Doubts about a linkage that its file does not rule out, one sentence each: a four-bar whose other branch fits better (it
/// may be drawn on the wrong side), and a length that no cylinder of that number of stages can change so much.
std::vector<std::string> linkage_doubts(const Machine& machine, int cylinder);

}  // namespace sparflow
