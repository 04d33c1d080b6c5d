#pragma once
/// Joints and links of a machine from a URDF file (`kinematics: {urdf: FILE}`), by liburdfdom.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/error.h"

namespace sparflow {

/// Limits that the machine file gives for a URDF joint; they replace the URDF's own.
struct JointLimitsOverride {
  FilePlace place;
  std::optional<Range> position;      ///< [rad] or [m]
  std::optional<Range> velocity;      ///< [rad/s] or [m/s]
  std::optional<Range> acceleration;  ///< [rad/s^2] or [m/s^2]; URDF has none, so always needed
};

struct UrdfChain {
  std::vector<Joint> joints;
  std::vector<Link> links;
  /// Origin of the tip link in the frame of the last moving joint.
  int tip_joint = -1;
  Eigen::Isometry3d tip_frame = Eigen::Isometry3d::Identity();
  std::vector<std::string> warnings;
};

/// The serial chain from the root to `tip_link` (empty: to the only leaf). Fixed joints are folded into
/// the link that carries them, with their masses; a moving joint outside the chain is held at zero,
/// with a warning. A link on a prismatic joint behind a revolute one becomes a mass that slides
/// (`slides_with`, fraction 1), so that its inertia keeps a revolute axis to refer to.
/// @param place where the machine file names the URDF, for messages about the whole
/// @throws InputError for unreadable files, unsupported joints and missing limits
UrdfChain import_urdf(const std::string& path, const std::string& tip_link,
                      const std::map<std::string, JointLimitsOverride>& limits,
                      const FilePlace& place);

}  // namespace sparflow
