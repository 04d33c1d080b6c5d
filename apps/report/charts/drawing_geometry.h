#pragma once
/// The machine as lines for drawings: links, telescope stages, cylinders, rockers and couplers at one configuration,
/// in the base frame and projected onto the vertical plane of the arm.
#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/machine/trajectory.h"

namespace sparflow {

/// kMark is no part of the machine; it shows where one is (MarkedPlace).
enum class PartKind { kLink, kTelescope, kBarrel, kRod, kRocker, kCoupler, kPin, kMark };

/// One polyline (a single point for kPin) in the base frame. It has no points where it cannot be drawn at this
/// configuration, e.g. a four-bar that does not close.
struct MachinePart {
  PartKind kind = PartKind::kLink;
  std::vector<Eigen::Vector3d> points;  ///< [m]
};

/// One polyline in the plane of the drawing.
struct DrawingPart {
  PartKind kind = PartKind::kLink;
  std::vector<Eigen::Vector2d> points;  ///< [m] (horizontal, up)
};

/// The machine at one instant.
struct DrawingFrame {
  double time = 0.0;               ///< [s]
  std::vector<DrawingPart> parts;  ///< the same kinds in the same order at every configuration
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();  ///< [m]
};

/// What a drawing points at: a cylinder, or the centre of mass of a link. The other number is -1.
struct MarkedPlace {
  int cylinder = -1;  ///< from pin to pin; over the joint's travel where a cylinder has no pins
  int link = -1;      ///< index in Machine::links
};

/// A plane of the base frame: vertical, or horizontal for the view from above.
struct DrawingPlane {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();       ///< [m]
  Eigen::Vector3d horizontal = Eigen::Vector3d::UnitX();  ///< unit vector
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();          ///< unit vector, against gravity
  bool turns = false;                 ///< whether a swing joint turns the plane with the arm
  std::string horizontal_name = "x";  ///< "radius" when it turns, else the base axis it lies along
  std::string vertical_name = "z";    ///< "height" when gravity is not along -z

  Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    return {horizontal.dot(p - origin), up.dot(p - origin)};
  }
  Eigen::Vector3d normal() const { return horizontal.cross(up); }
};

/// Returns the plane of the arm: across the first revolute axis that is not vertical. Without a swing joint below
/// that axis its coordinates are those of the base frame (x and z for most cranes) at every
/// configuration; with one they are radius from the swing axis and height, positive towards the tip at mid-range.
/// @param q joint coordinates [rad] or [m]
DrawingPlane drawing_plane(const Machine& machine, const Eigen::VectorXd& q);

/// Returns all lines of the machine in the base frame, those further back first. Rack and direct drives have none.
/// Barrels are drawn a little shorter than the cylinder's shortest length.
std::vector<MachinePart> machine_parts(const Machine& machine, const Eigen::VectorXd& q);

/// The horizontal plane seen from above, in the base frame's coordinates where gravity is along -z.
DrawingPlane top_plane(const Machine& machine);

/// Projects machine_parts() onto drawing_plane() at the same configuration.
DrawingFrame drawing_frame(const Machine& machine, const Eigen::VectorXd& q, double time = 0.0);
/// Projects machine_parts() onto a given plane.
DrawingFrame drawing_frame(const Machine& machine, const Eigen::VectorXd& q, double time,
                           const DrawingPlane& plane);

/// Returns `count` frames evenly spaced in time over a motion, with joint coordinates interpolated linearly between its
/// instants; one frame when the motion has a single instant, none when it has none.
/// @param fixed plane of all frames; absent: that of the arm at each instant
/// @param marks places that get one more part each (kMark) behind those of the machine, in this order
std::vector<DrawingFrame> drawing_frames(const Machine& machine, const Trajectory& motion,
                                         int count, const std::optional<DrawingPlane>& fixed = {},
                                         const std::vector<MarkedPlace>& marks = {});

/// Every joint over its whole range in turn while the others stand at the posture, which is also the last instant; one second
/// for each leg, at rest at its ends.
Trajectory joint_sweep(const Machine& machine, const Eigen::VectorXd& posture);
/// Drawings of a sweep that make a smooth motion.
int joint_sweep_frames(const Trajectory& sweep);

}  // namespace sparflow
