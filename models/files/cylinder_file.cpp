#include "models/files/cylinder_file.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "models/files/file_quantities.h"

namespace sparflow {
namespace {

using quantities::kCoordinate;
using quantities::kLength;
using quantities::kMass;
using quantities::Sign;

// Bores of 3 m do not exist; 180 is a bore in millimetres.
constexpr Quantity kDiameter{"diameter", "m", Sign::kPositive, 1.0, 3.0};
constexpr Quantity kCog{"distance", "m", Sign::kNonNegative, 1.0, 200.0};
constexpr Quantity kStroke{"stroke", "m", Sign::kPositive, 1.0, 200.0};
constexpr Quantity kRadius{"radius", "m", Sign::kAny, 1.0, 200.0};
constexpr Quantity kDrumRadius{"radius", "m", Sign::kPositive, 1.0, 200.0};
// A rod of diameter zero is a cylinder with equal areas.
constexpr Quantity kRodDiameter{"diameter", "m", Sign::kNonNegative, 1.0, 3.0};
// The largest radial piston motors take some 50 litres a turn.
constexpr Quantity kDisplacement{"displacement", "cm3", Sign::kPositive, 1e-6, 2e5};
constexpr Quantity kGearRatio{"gear ratio", "-", Sign::kAny, 1.0, 1e5};

/// Reads one linkage of the cylinder that drives `joint`.
class LinkageReader {
 public:
  LinkageReader(int joint, const std::vector<Joint>& joints, const FileFrames& frames)
      : joint_(joint), joints_(joints), frames_(frames) {}

  Linkage read(const YamlValue& value) const {
    const std::string expected = "a linkage {type: pins | four_bar | rack | direct, ...}";
    const std::vector<std::string> all = {"type",    "barrel", "rod",   "rocker",
                                          "coupler", "branch", "radius"};
    const YamlMap any = value.map(expected, all);
    switch (any.need("type", "one of pins, four_bar, rack, direct")
                .choice({"pins", "four_bar", "rack", "direct"})) {
      case 0:
        return pins(value.map(expected, {"type", "barrel", "rod"}));
      case 1:
        return four_bar(value.map(expected, {"type", "barrel", "rocker", "coupler", "branch"}));
      case 2:
        return rack(value.map(expected, {"type", "radius"}));
      default:
        value.map(expected, {"type"});
        return DirectLinkage{};
    }
  }

 private:
  struct Pin {
    Eigen::Vector3d xyz;
    bool on_parent;
  };

  std::string parent_name() const { return joint_ == 0 ? "base" : frames_.names[index() - 1]; }
  std::size_t index() const { return static_cast<std::size_t>(joint_); }
  const std::string& own_name() const { return frames_.names[index()]; }

  /// Reads a pin on one of the two links that the joint connects, so that the length depends on that joint alone.
  Pin pin(const YamlMap& map) const {
    const YamlValue frame =
        map.need("frame", fmt::format("the frame, {} or {}", parent_name(), own_name()));
    const int at = frames_.index(frame);
    if (at != joint_ && at != joint_ - 1) {
      frame.fail(fmt::format(
          "got \"{}\", expected {} or {}: a pin of the cylinder of joint {} sits on one of the two "
          "links which that joint connects",
          frame.word(), parent_name(), own_name(), own_name()));
    }
    const Eigen::Vector3d xyz = map.need("xyz", "the pin [x, y, z] [m]").vector3(kCoordinate);
    return {frames_.point(at, xyz), at != joint_};
  }

  Pin plain_pin(const YamlMap& linkage, const char* key) const {
    const std::string expected = fmt::format("the {} pin {{frame, xyz}}", key);
    return pin(linkage.need(key, expected).map(expected, {"frame", "xyz"}));
  }

  PinsLinkage pins(const YamlMap& map) const {
    const Pin barrel = plain_pin(map, "barrel");
    const Pin rod = plain_pin(map, "rod");
    if (barrel.on_parent == rod.on_parent) {
      map.fail(
          fmt::format("barrel and rod pin both sit on {}, so the cylinder moves nothing; expected "
                      "one on {} and "
                      "one on {}",
                      barrel.on_parent ? parent_name() : own_name(), parent_name(), own_name()));
    }
    return {barrel.on_parent ? barrel.xyz : rod.xyz, barrel.on_parent ? rod.xyz : barrel.xyz,
            barrel.on_parent};
  }

  void must_sit(const Pin& pin, bool on_parent, const YamlMap& map, const char* which) const {
    if (pin.on_parent == on_parent) return;
    map.fail(fmt::format("the {} pin sits on {}, expected it on {}", which,
                         on_parent ? own_name() : parent_name(),
                         on_parent ? parent_name() : own_name()));
  }

  FourBarLinkage four_bar(const YamlMap& map) const {
    const std::vector<std::string> bar_keys = {"frame", "xyz", "length", "mass", "cog"};
    const std::string expected = "a bar {frame, xyz, length}";
    FourBarLinkage bar;
    if (joints_[index()].type != JointType::kRevolute) {
      map.fail(
          fmt::format("joint {} is prismatic, and a four_bar turns a revolute joint; use pins "
                      "or direct",
                      own_name()));
    }
    const YamlMap barrel = map.need("barrel", "the barrel pin {frame, xyz}")
                               .map("the barrel pin {frame, xyz}", {"frame", "xyz"});
    const YamlMap rocker = map.need("rocker", expected).map(expected, bar_keys);
    const YamlMap coupler = map.need("coupler", expected).map(expected, bar_keys);
    const Pin barrel_pin = pin(barrel), rocker_pin = pin(rocker), coupler_pin = pin(coupler);
    must_sit(barrel_pin, true, barrel, "barrel");
    must_sit(rocker_pin, true, rocker, "rocker");
    must_sit(coupler_pin, false, coupler, "coupler");
    bar.barrel = barrel_pin.xyz;
    bar.rocker = rocker_pin.xyz;
    bar.coupler = coupler_pin.xyz;
    bar.rocker_length = rocker.need_number("length", kLength);
    bar.coupler_length = coupler.need_number("length", kLength);
    read_mass(rocker, "mass", "cog", bar.rocker_mass, bar.rocker_cog);
    read_mass(coupler, "mass", "cog", bar.coupler_mass, bar.coupler_cog);
    bar.branch = map.need("branch", "1 or -1").choice({"-1", "1", "+1"}) == 0 ? -1 : 1;
    return bar;
  }

  RackLinkage rack(const YamlMap& map) const {
    if (joints_[index()].type != JointType::kRevolute) {
      map.fail(fmt::format("joint {} is prismatic, and a rack turns a revolute joint; use direct",
                           own_name()));
    }
    const double radius = map.need_number("radius", kRadius);
    if (radius == 0.0) {
      map.need("radius", "")
          .fail(
              "got 0, expected the pinion's radius [m]; negative if the cylinder extends while q "
              "falls");
    }
    return {radius};
  }

 public:
  static void read_mass(const YamlMap& map, const char* mass_key, const char* cog_key, double& mass,
                        double& cog) {
    mass = map.number_or(mass_key, kMass, 0.0);
    if (mass > 0.0) {
      cog = map.need_number(cog_key, kCog);
    } else if (map.has(cog_key)) {
      map.need(mass_key, fmt::format("the mass [kg] that belongs to {}", cog_key));
      cog = map.need_number(cog_key, kCog);
    }
  }

 private:
  int joint_;
  const std::vector<Joint>& joints_;
  const FileFrames& frames_;
};

/// A hydraulic motor is the cylinder with equal areas that takes the same oil for the same motion and gives the same
/// torque at the same pressures: V_g/(2 pi) |i| = A r with displacement V_g for each turn, gear ratio i = turns of the
/// motor for each turn of the joint, and x = r q. A revolute joint gets r = 1 m, so that its force [N] is the torque
/// [Nm] by its number; on a prismatic joint r is the radius of the drum or pinion and x = q.
void read_motor(const YamlMap& motor, const Joint& joint, Cylinder& cylinder) {
  const double displacement = motor.need_number("displacement_cm3", kDisplacement);
  const double ratio = motor.number_or("gear_ratio", kGearRatio, 1.0);
  if (ratio == 0.0) {
    motor.need("gear_ratio", "")
        .fail("got 0, expected turns of the motor for each turn of the joint or drum");
  }
  double radius = 1.0;
  if (joint.type == JointType::kRevolute) {
    if (const auto given = motor.find("radius")) {
      given->fail(fmt::format(
          "joint {} is revolute, so the motor turns it through gear_ratio alone; radius is for a "
          "drum or pinion that moves a prismatic joint",
          joint.name));
    }
    cylinder.linkage = RackLinkage{ratio > 0.0 ? radius : -radius};
  } else {
    radius = motor.need_number("radius", kDrumRadius);
    if (ratio < 0.0) {
      motor.need("gear_ratio", "")
          .fail(fmt::format(
              "got {}, expected more than zero: joint {} is prismatic, turn its axis round instead",
              ratio, joint.name));
    }
    cylinder.linkage = DirectLinkage{};
  }
  const double area = displacement * std::abs(ratio) / (2.0 * std::numbers::pi * radius);
  cylinder.bore = std::sqrt(4.0 * area / std::numbers::pi);
  cylinder.rod = 0.0;
}

}  // namespace

int FileFrames::index(const YamlValue& value) const {
  const std::string word = value.text("a frame: base or a joint's name");
  if (word == "base") return -1;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == word) return static_cast<int>(i);
  }
  std::vector<std::string> all = {"base"};
  all.insert(all.end(), names.begin(), names.end());
  const std::string hint = suggestion(word, all);
  value.fail(
      fmt::format("got \"{}\", expected a frame of this machine ({}){}", word, listed(all), hint));
}

Eigen::Vector3d FileFrames::point(int joint, const Eigen::Vector3d& in_file) const {
  return joint < 0 ? in_file : in_joint[static_cast<std::size_t>(joint)] * in_file;
}

Cylinder read_cylinder(const YamlValue& value, const std::vector<Joint>& joints,
                       const FileFrames& frames) {
  const YamlMap map =
      value.map("a cylinder {name, joint, bore, rod, linkage} or a motor {name, joint, motor}",
                {"name", "joint", "bore", "rod", "stages", "parallel", "length_at_zero_stroke",
                 "stroke", "barrel_mass", "barrel_cog", "rod_mass", "rod_cog", "linkage", "motor"});
  Cylinder cylinder;
  cylinder.name = map.need("name", "the cylinder's name").name("a name");
  const YamlValue joint = map.need("joint", "the name of the joint it drives");
  cylinder.joint = frames.index(joint);
  if (cylinder.joint < 0) joint.fail("got \"base\", expected the joint this cylinder drives");
  if (const auto beside = map.find("parallel")) {
    cylinder.parallel = beside->integer("cylinders or motors side by side", 1);
  }
  if (const auto motor = map.find("motor")) {
    value.map(
        "a motor {name, joint, motor, parallel}; bore, rod, linkage and masses belong to a "
        "cylinder",
        {"name", "joint", "motor", "parallel"});
    read_motor(motor->map("a motor {displacement_cm3, gear_ratio}",
                          {"displacement_cm3", "gear_ratio", "radius"}),
               joints[static_cast<std::size_t>(cylinder.joint)], cylinder);
    return cylinder;
  }
  if (map.has("bore")) {
    cylinder.bore = map.need_number("bore", kDiameter);
    cylinder.rod = map.need_number("rod", kRodDiameter);
    if (cylinder.rod >= cylinder.bore) {
      map.need("rod", "").fail(
          fmt::format("got {}, expected less than the bore, {}; rod and bore are diameters",
                      cylinder.rod, cylinder.bore));
    }
  } else if (map.has("rod")) {
    map.need("bore", "the bore [m] beside the rod (leave both out for a drive without hydraulics)");
  }
  if (const auto stages = map.find("stages")) cylinder.stages = stages->integer("stages", 1);
  if (const auto length = map.find("length_at_zero_stroke")) {
    cylinder.length_at_zero_stroke = length->number(kCoordinate);
  }
  if (const auto stroke = map.find("stroke")) cylinder.stroke = stroke->number(kStroke);
  LinkageReader::read_mass(map, "barrel_mass", "barrel_cog", cylinder.barrel_mass,
                           cylinder.barrel_cog);
  LinkageReader::read_mass(map, "rod_mass", "rod_cog", cylinder.rod_mass, cylinder.rod_cog);
  cylinder.linkage = LinkageReader(cylinder.joint, joints, frames)
                         .read(map.need("linkage", "how it drives the joint, {type: ...}"));
  if (std::holds_alternative<RackLinkage>(cylinder.linkage) &&
      cylinder.barrel_mass + cylinder.rod_mass > 0.0) {
    map.fail("a rack's barrel and rod do not move with the joint; give their mass in links");
  }
  return cylinder;
}

}  // namespace sparflow
