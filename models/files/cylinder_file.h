#pragma once
/// The `cylinders` section of a machine file, and the frames in which its pins are given.
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {

/// Names of frames in the file, and the pose of the file's frame of a joint in the frame at the joint: identity for
/// URDF-style joints, the far end of the link for a joint given by `dh`.
struct FileFrames {
  std::vector<std::string> names;           ///< joint names, base to tip
  std::vector<Eigen::Isometry3d> in_joint;  ///< by joint

  /// Joint index of the frame a value names, -1 for `base`. @throws InputError for any other word
  int index(const YamlValue& value) const;
  /// A point of the file in the frame at the joint [m].
  Eigen::Vector3d point(int joint, const Eigen::Vector3d& in_file) const;
};

/// @throws InputError for errors in the cylinder's own text; check_machine() checks the geometry
Cylinder read_cylinder(const YamlValue& value, const std::vector<Joint>& joints,
                       const FileFrames& frames);

}  // namespace sparflow
