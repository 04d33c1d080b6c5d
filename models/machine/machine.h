#pragma once
/// The machine: joints, masses, cylinders with their linkages, pumps and valves. SI throughout.
/// Plain data that models/files/machine_file.h reads from YAML.
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace sparflow {

struct Range {
  double lo = 0.0;
  double hi = 0.0;
};

enum class JointType { kRevolute, kPrismatic };

/// Joint i of a serial chain; its parent is joint i-1 (the base for i = 0). The link frame is at the
/// joint as in URDF: child point = origin * Rot(axis, q) * p, or origin * (p + axis q) if prismatic.
struct Joint {
  std::string name;
  JointType type = JointType::kRevolute;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< in the parent link's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();           ///< unit, in the joint's frame
  Range position;                                            ///< [rad] or [m]
  Range velocity;                                            ///< [rad/s] or [m/s]
  Range acceleration;                                        ///< [rad/s^2] or [m/s^2]
};

/// A rigid mass on a link. With `slides_with` >= 0 it also moves by `fraction` of that (prismatic)
/// joint's travel along that joint's axis, as a telescope stage does.
struct Link {
  std::string name;
  int joint = -1;                                 ///< link frame it is fixed in; -1 = base
  double mass = 0.0;                              ///< [kg]
  Eigen::Vector3d cog = Eigen::Vector3d::Zero();  ///< [m], in the frame of `joint`
  double inertia = 0.0;   ///< [kg m^2] about the joint's axis through the cog
  int slides_with = -1;   ///< joint index, -1 = none
  double fraction = 0.0;  ///< [-]
};

/// length = distance between barrel pin and rod pin; one pin on the parent link, one on the joint's link.
struct PinsLinkage {
  Eigen::Vector3d parent_pin;    ///< [m], in the parent link's frame
  Eigen::Vector3d child_pin;     ///< [m], in the joint's link frame
  bool barrel_on_parent = true;  ///< false: the barrel is pinned to the moving link
};

/// Knuckle: barrel pin and rocker pin on the parent link, coupler pin on the joint's link; the rod pin
/// is where rocker and coupler meet: a e + branch h (axis x e) from the rocker pin.
struct FourBarLinkage {
  Eigen::Vector3d barrel;       ///< [m], in the parent link's frame
  Eigen::Vector3d rocker;       ///< [m], in the parent link's frame
  Eigen::Vector3d coupler;      ///< [m], in the joint's link frame
  double rocker_length = 0.0;   ///< [m]
  double coupler_length = 0.0;  ///< [m]
  double rocker_mass = 0.0;     ///< [kg]
  double rocker_cog = 0.0;      ///< [m] from the rocker pin towards the rod pin
  double coupler_mass = 0.0;    ///< [kg]
  double coupler_cog = 0.0;     ///< [m] from the coupler pin towards the rod pin
  int branch = 1;               ///< +1 or -1
};

/// x = radius q (rack and pinion slewing); a negative radius is a drive mounted the other way round.
struct RackLinkage {
  double radius = 0.0;  ///< [m]
};

/// x = q
struct DirectLinkage {};

using Linkage = std::variant<PinsLinkage, FourBarLinkage, RackLinkage, DirectLinkage>;

/// A hydraulic cylinder, or (bore = 0) a drive of which only the force is known.
/// A = bore side, B = rod side; x grows as the cylinder extends. A rod of diameter zero makes equal areas; a hydraulic
/// motor is such a cylinder too (docs/machine_file.md, `motor`).
struct Cylinder {
  std::string name;
  int joint = 0;      ///< the joint it drives
  double bore = 0.0;  ///< [m], 0 = no hydraulics
  double rod = 0.0;   ///< [m] rod diameter
  int stages = 1;     ///< equal cylinders in series: strokes add up, areas do not
  int parallel = 1;   ///< equal cylinders side by side: areas add up
  std::optional<double> length_at_zero_stroke;  ///< [m] pin to pin; absent = 0
  std::optional<double> stroke;                 ///< [m]
  double barrel_mass = 0.0;                     ///< [kg]
  double barrel_cog = 0.0;                      ///< [m] from the barrel pin towards the rod pin
  double rod_mass = 0.0;                        ///< [kg]
  double rod_cog = 0.0;                         ///< [m] from the rod pin towards the barrel pin
  Linkage linkage = DirectLinkage{};

  bool hydraulic() const { return bore > 0.0; }
  double area_piston() const;  ///< [m^2], all parallel cylinders
  double area_rod() const;     ///< [m^2], annulus, all parallel cylinders
};

enum class PumpType { kLoadSensing, kConstantPressure };

struct Pump {
  std::string name;
  PumpType type = PumpType::kLoadSensing;
  std::vector<int> feeds;     ///< cylinder indices
  double max_flow = 0.0;      ///< [m^3/s]
  double max_pressure = 0.0;  ///< [Pa]
  double standby = 0.0;       ///< [Pa] from the data sheet; identification learns the real one
};

/// Flow of a spool section at full command.
struct Valve {
  int cylinder = -1;
  double max_flow_extend = 0.0;   ///< [m^3/s]
  double max_flow_retract = 0.0;  ///< [m^3/s]
};

struct Tip {
  int joint = -1;  ///< -1 = base
  Eigen::Vector3d xyz =
      Eigen::Vector3d::Zero();  ///< [m] in the frame of `joint`; the payload hangs here
  double payload_scale = 1.0;   ///< [-] true payload / given payload; crane scales have an error
};

struct Machine {
  std::string name;
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< [m/s^2] in the base frame
  std::vector<Joint> joints;                    ///< base to tip
  std::vector<Link> links;
  std::vector<Cylinder> cylinders;
  std::vector<Pump> pumps;
  std::vector<Valve> valves;  ///< at most one for each cylinder
  Tip tip;
  std::string source_text;  ///< the file as read, so that a fitted model can contain its machine

  int joint_count() const { return static_cast<int>(joints.size()); }
  int cylinder_count() const { return static_cast<int>(cylinders.size()); }
  int pump_count() const { return static_cast<int>(pumps.size()); }
  int joint_index(const std::string& joint_name) const;        ///< -1 when there is none
  int cylinder_index(const std::string& cylinder_name) const;  ///< -1 when there is none
  int pump_index(const std::string& pump_name) const;          ///< -1 when there is none
  int cylinder_of_joint(int joint) const;              ///< -1 when the joint has no cylinder
  int pump_of_cylinder(int cylinder) const;            ///< -1 when none feeds it
  const Valve* valve_of_cylinder(int cylinder) const;  ///< nullptr when there is none

  // Defaulted in the source file, so that they are compiled once and not in every file that copies a machine.
  Machine();
  Machine(const Machine&);
  Machine(Machine&&) noexcept;
  Machine& operator=(const Machine&);
  Machine& operator=(Machine&&) noexcept;
  ~Machine();
};

}  // namespace sparflow
