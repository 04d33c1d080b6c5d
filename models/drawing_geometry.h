#pragma once
/// The crane as plain lines, for pictures: links, telescope stages, cylinders, rockers and couplers at one
/// configuration, projected onto the plane the arm works in.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

enum class PartKind { kLink, kTelescope, kBarrel, kRod, kRocker, kCoupler, kPin };

/// One polyline (a single point for kPin) in the plane of the drawing.
struct DrawingPart {
  PartKind kind = PartKind::kLink;
  std::vector<Eigen::Vector2d> points;  ///< [m] (horizontal, up)
};

/// The crane at one instant.
struct DrawingFrame {
  double time = 0.0;               ///< [s]
  std::vector<DrawingPart> parts;  ///< the same parts in the same order at every instant
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();  ///< [m]
};

}  // namespace sparflow
