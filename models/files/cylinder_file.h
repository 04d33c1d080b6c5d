#pragma once
/// The `cylinders` section of a machine file and the frames its pins are given in.
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {

/// Names of frames in the file, and where the file's frame of a joint lies in the frame at the joint:
/// the same for URDF-style joints, the far end of the link for a joint given by `dh`.
struct FileFrames {
  std::vector<std::string> names;           ///< joint names, base to tip
  std::vector<Eigen::Isometry3d> in_joint;  ///< per joint

  /// Joint index of the frame a value names, -1 for `base`. @throws InputError for any other word
  int index(const YamlValue& value) const;
  /// A point of the file in the frame at the joint [m].
  Eigen::Vector3d point(int joint, const Eigen::Vector3d& in_file) const;
};

/// @throws InputError for anything a single cylinder's text shows; check_machine() judges the geometry
Cylinder read_cylinder(const YamlValue& value, const std::vector<Joint>& joints,
                       const FileFrames& frames);

}  // namespace sparflow
