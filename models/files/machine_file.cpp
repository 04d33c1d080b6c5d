#include "models/files/machine_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "models/files/cylinder_file.h"
#include "models/files/file_quantities.h"
#include "models/files/open_values.h"
#include "models/files/urdf_import.h"
#include "models/machine/machine_check.h"
#include "models/math/door.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

using namespace quantities;

const int kParts = DoorLimits{}.machine_parts;
constexpr Quantity kDirection{"component of the axis", ""};
constexpr Quantity kGravity{"component of gravity", "m/s^2"};
constexpr Quantity kInertia{"moment of inertia", "kg m^2", Sign::kNonNegative};
constexpr Quantity kFraction{"fraction of the extension", ""};
constexpr Quantity kStandby{"pressure", "bar", Sign::kNonNegative, units::kBar, 10000.0};

class MachineReader {
 public:
  MachineReader(const std::string& file, std::string folder)
      : folder_(std::move(folder)), places_{file, {}, {}, {}, {}, {}} {}

  Machine read(const std::string& text, std::vector<std::string>* warnings) {
    const YamlValue document = parse_yaml(text, places_.file);
    refuse_open_values(document, text);
    const YamlMap root = read_parts(document);
    const std::vector<std::string> found = check_machine(machine_, places_);
    warnings_.insert(warnings_.end(), found.begin(), found.end());
    if (warnings != nullptr) *warnings = warnings_;
    machine_.source_text = root.has("kinematics") ? write_machine(machine_) : text;
    return machine_;
  }

  Machine read_unchecked(const std::string& text, FileFrames* frames) {
    read_parts(parse_yaml(text, places_.file));
    if (frames != nullptr) *frames = frames_;
    return machine_;
  }

 private:
  YamlMap read_parts(const YamlValue& document) {
    const YamlMap root = document.map("a machine: name, joints, links, cylinders, pumps, valves",
                                      {"name", "gravity", "joints", "kinematics", "tip", "links",
                                       "cylinders", "pumps", "valves"});
    machine_.name = root.need("name", "the machine's name").text("the machine's name");
    if (const auto gravity = root.find("gravity")) machine_.gravity = gravity->vector3(kGravity);
    if (root.has("kinematics")) {
      read_urdf(root);
    } else {
      for (const YamlValue& v : root.need("joints", "the joints, base to tip (or kinematics)")
                                    .list("joints, base to tip", kParts)) {
        read_joint(v);
      }
      read_tip(root.need("tip", "the point that carries the payload {joint, xyz}"));
      if (const auto links = root.find("links")) {
        for (const YamlValue& v : links->list("links", kParts)) read_link(v);
      }
    }
    if (const auto cylinders = root.find("cylinders")) {
      for (const YamlValue& v : cylinders->list("cylinders", kParts)) {
        const Cylinder cylinder = read_cylinder(v, machine_.joints, frames_);
        must_be_new(v, cylinder.name, machine_.cylinders, places_.cylinders);
        machine_.cylinders.push_back(cylinder);
        places_.cylinders.push_back(v.place());
      }
    }
    if (const auto pumps = root.find("pumps")) {
      for (const YamlValue& v : pumps->list("pumps", kParts)) read_pump(v);
    }
    if (const auto valves = root.find("valves")) {
      for (const YamlValue& v : valves->list("valves", kParts)) read_valve(v);
    }
    return root;
  }

  /// Names are looked up while reading, so that a second one of a kind is reported before anything else.
  template <class Part>
  static void must_be_new(const YamlValue& value, const std::string& name,
                          const std::vector<Part>& parts, const std::vector<FilePlace>& places) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].name != name) continue;
      value.fail(fmt::format("the name {} occurs twice (first on line {}); give each its own", name,
                             places[i].line));
    }
  }

  template <class Part>
  static std::string new_name(const YamlMap& map, const char* expected,
                              const std::vector<Part>& parts,
                              const std::vector<FilePlace>& places) {
    const YamlValue value = map.need("name", expected);
    const std::string name = value.name("a name");
    must_be_new(value, name, parts, places);
    return name;
  }

  void read_joint(const YamlValue& value) {
    const YamlMap map = value.map(
        "a joint {name, type, origin, axis, position, velocity, acceleration}",
        {"name", "type", "parent", "origin", "axis", "dh", "position", "velocity", "acceleration"});
    const std::size_t index = machine_.joints.size();
    Joint joint;
    joint.name = new_name(map, "the joint's name", machine_.joints, places_.joints);
    const YamlValue type = map.need("type", "revolute or prismatic");
    if (type.word() == "continuous") {
      type.fail(
          "got \"continuous\", expected revolute with a position range (as many turns as "
          "needed)");
    }
    const bool revolute = type.choice({"revolute", "prismatic"}) == 0;
    joint.type = revolute ? JointType::kRevolute : JointType::kPrismatic;
    if (const auto parent = map.find("parent")) {
      const std::string expected = index == 0 ? "base" : machine_.joints[index - 1].name;
      if (parent->word() != expected) {
        parent->fail(
            fmt::format("got \"{}\", expected {}: the joints stand base to tip in one "
                        "serial chain, each on the one before it",
                        parent->word(), expected));
      }
    }
    const Eigen::Isometry3d parent_frame =
        index == 0 ? Eigen::Isometry3d::Identity() : frames_.in_joint[index - 1];
    Eigen::Isometry3d own_frame = Eigen::Isometry3d::Identity();
    if (map.has("dh")) {
      for (const char* key : {"origin", "axis"}) {
        if (const auto both = map.find(key)) {
          both->fail(fmt::format("is given beside dh; give either dh or origin and axis"));
        }
      }
      own_frame = read_dh(*map.find("dh"));
      joint.origin = parent_frame;
      joint.axis = Eigen::Vector3d::UnitZ();
    } else {
      joint.origin = parent_frame * read_origin(map);
      const YamlValue axis =
          map.need("axis", "the direction [x, y, z] in the joint's frame (or dh)");
      joint.axis = axis.vector3(kDirection);
      /// Length of an axis up to which it is no direction.
      /// @threshold [1] 0..1e-3; numerical: rounding of the file's numbers
      constexpr double kNoDirection = 1e-9;
      if (joint.axis.norm() < kNoDirection) {
        axis.fail("got [0, 0, 0], expected a direction such as [0, -1, 0]");
      }
      joint.axis.normalize();
    }
    joint.position =
        map.need("position", "the range [lo, hi]").range(joint_quantity(joint.type, 0));
    joint.velocity = read_range_around_zero(map.need("velocity", "the range [lo, hi]"),
                                            joint_quantity(joint.type, 1));
    joint.acceleration = read_range_around_zero(map.need("acceleration", "the range [lo, hi]"),
                                                joint_quantity(joint.type, 2));
    machine_.joints.push_back(joint);
    frames_.names.push_back(joint.name);
    frames_.in_joint.push_back(own_frame);
    places_.joints.push_back(value.place());
  }

  static Eigen::Isometry3d read_origin(const YamlMap& joint) {
    const auto value = joint.find("origin");
    if (!value) return Eigen::Isometry3d::Identity();
    const YamlMap origin = value->map("an origin {xyz, rpy}", {"xyz", "rpy"});
    Eigen::Vector3d xyz = Eigen::Vector3d::Zero(), rpy = Eigen::Vector3d::Zero();
    if (const auto v = origin.find("xyz")) xyz = v->vector3(kCoordinate);
    if (const auto v = origin.find("rpy")) rpy = v->vector3(kAngle);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = xyz;
    pose.linear() = rotation_from_rpy(rpy);
    return pose;
  }

  /// Standard Denavit-Hartenberg: from the parent's frame Rz(theta + q) Tz(d) Tx(a) Rx(alpha), or
  /// Tz(d + q) if prismatic. The variable acts about (along) the parent's z before the constant part,
  /// so the frame at the joint is the parent's and the file's frame lies at the constant part in it.
  static Eigen::Isometry3d read_dh(const YamlValue& value) {
    const YamlMap dh = value.map("dh {a, alpha, d, theta}", {"a", "alpha", "d", "theta"});
    const double theta = dh.number_or("theta", kAngle, 0.0);
    const double alpha = dh.number_or("alpha", kAngle, 0.0);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.rotate(Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitZ()));
    pose.translate(Eigen::Vector3d(dh.number_or("a", kCoordinate, 0.0), 0.0,
                                   dh.number_or("d", kCoordinate, 0.0)));
    pose.rotate(Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitX()));
    return pose;
  }

  void read_tip(const YamlValue& value) {
    const YamlMap map = value.map("a tip {joint, xyz}", {"joint", "xyz"});
    machine_.tip.joint = frames_.index(map.need("joint", "the joint whose frame carries the tip"));
    machine_.tip.xyz = frames_.point(machine_.tip.joint,
                                     map.need("xyz", "the tip [x, y, z] [m]").vector3(kCoordinate));
  }

  void read_link(const YamlValue& value) {
    const YamlMap map =
        value.map("a link {name, joint, mass, cog, inertia}",
                  {"name", "joint", "mass", "cog", "inertia", "slides_with", "fraction"});
    Link link;
    link.name = map.need("name", "the link's name").text("the link's name");
    must_be_new(*map.find("name"), link.name, machine_.links, places_.links);
    link.joint = frames_.index(map.need("joint", "the joint whose frame it is fixed in"));
    link.mass = map.need_number("mass", kMass);
    link.cog = frames_.point(
        link.joint, map.need("cog", "the centre of mass [x, y, z] [m]").vector3(kCoordinate));
    link.inertia = map.number_or("inertia", kInertia, 0.0);
    if (const auto slides = map.find("slides_with")) {
      link.slides_with = frames_.index(*slides);
      check_slide(*slides, link);
      link.fraction = map.need_number("fraction", kFraction);
    } else if (const auto fraction = map.find("fraction")) {
      fraction->fail("is given without slides_with; name the prismatic joint it is a fraction of");
    }
    machine_.links.push_back(link);
    places_.links.push_back(value.place());
  }

  /// Checks that the direction of sliding does not rotate in the link's own frame.
  void check_slide(const YamlValue& value, const Link& link) const {
    const std::string& name = value.word();
    if (link.slides_with < 0 ||
        machine_.joints[static_cast<std::size_t>(link.slides_with)].type != JointType::kPrismatic) {
      value.fail(fmt::format("got \"{}\", expected a prismatic joint", name));
    }
    for (int j = link.joint + 1; j <= link.slides_with; ++j) {
      const Joint& between = machine_.joints[static_cast<std::size_t>(j)];
      if (between.type == JointType::kRevolute) {
        value.fail(
            fmt::format("joint {} turns between the link's frame and {}; fix the link in the "
                        "frame that carries {}",
                        between.name, name, name));
      }
    }
    if (link.slides_with <= link.joint) {
      value.fail(
          fmt::format("the link is fixed in a frame that {} moves already; fix it in the frame "
                      "that carries {}",
                      name, name));
    }
  }

  void read_urdf(const YamlMap& root) {
    for (const char* key : {"joints", "links"}) {
      if (const auto both = root.find(key)) {
        both->fail(
            fmt::format("is given beside kinematics, whose URDF defines the {}; remove one", key));
      }
    }
    const YamlValue kinematics = root.need("kinematics", "");
    const YamlMap map = kinematics.map("kinematics {urdf, limits}", {"urdf", "limits"});
    const YamlValue urdf = map.need("urdf", "the URDF file");
    const std::filesystem::path path = std::filesystem::path(folder_) / urdf.text("the URDF file");
    if (!is_file(path)) {
      urdf.fail(fmt::format("there is no file {}; the path is relative to the machine file",
                            path.string()));
    }
    std::map<std::string, JointLimitsOverride> limits;
    if (const auto given = map.find("limits")) limits = read_limits(*given);

    const auto tip = root.find("tip");
    std::string tip_link;
    Eigen::Vector3d tip_xyz = Eigen::Vector3d::Zero();
    if (tip) {
      const YamlMap tip_map = tip->map("a tip {link, xyz} of the URDF", {"link", "xyz"});
      tip_link = tip_map.need("link", "the URDF link that carries the payload").text("a URDF link");
      if (const auto xyz = tip_map.find("xyz")) tip_xyz = xyz->vector3(kCoordinate);
    }
    UrdfChain chain =
        import_urdf(path.string(), tip_link, limits, tip ? tip->place() : kinematics.place());
    machine_.joints = std::move(chain.joints);
    machine_.links = std::move(chain.links);
    machine_.tip = {chain.tip_joint, chain.tip_frame * tip_xyz};
    warnings_ = std::move(chain.warnings);
    for (const Joint& joint : machine_.joints) {
      frames_.names.push_back(joint.name);
      frames_.in_joint.push_back(Eigen::Isometry3d::Identity());
      places_.joints.push_back({path.string(), 0, 0});
    }
    places_.links.assign(machine_.links.size(), {path.string(), 0, 0});
  }

  static std::map<std::string, JointLimitsOverride> read_limits(const YamlValue& value) {
    std::map<std::string, JointLimitsOverride> limits;
    const std::string expected = "limits {JOINT: {position, velocity, acceleration}}";
    for (const auto& [name, entry] : value.map(expected, {}).entries()) {
      const YamlMap map = entry.map(expected, {"position", "velocity", "acceleration"});
      JointLimitsOverride& limit = limits[name];
      limit.place = entry.place();
      // The URDF gives the joint's type, so that the unit is not known here.
      if (const auto v = map.find("position")) limit.position = v->range({"position", "rad or m"});
      if (const auto v = map.find("velocity")) {
        limit.velocity = read_range_around_zero(*v, {"velocity", "rad/s or m/s"});
      }
      if (const auto v = map.find("acceleration")) {
        limit.acceleration = read_range_around_zero(*v, {"acceleration", "rad/s^2 or m/s^2"});
      }
    }
    return limits;
  }

  int cylinder(const YamlValue& value) const {
    const std::string name = value.text("a cylinder's name");
    const int index = machine_.cylinder_index(name);
    if (index >= 0) return index;
    std::vector<std::string> names;
    for (const Cylinder& c : machine_.cylinders) names.push_back(c.name);
    value.fail(fmt::format("got \"{}\", expected a cylinder of this machine ({}){}", name,
                           listed(names), suggestion(name, names)));
  }

  void read_pump(const YamlValue& value) {
    const YamlMap map =
        value.map("a pump {name, feeds, max_flow_lpm, max_pressure_bar, standby_bar}",
                  {"name", "type", "feeds", "max_flow_lpm", "max_pressure_bar", "standby_bar"});
    Pump pump;
    pump.name = new_name(map, "the pump's name", machine_.pumps, places_.pumps);
    if (const auto type = map.find("type")) {
      pump.type = type->choice({"load_sensing", "constant_pressure"}) == 0
                      ? PumpType::kLoadSensing
                      : PumpType::kConstantPressure;
    }
    for (const YamlValue& v :
         map.need("feeds", "a list of cylinders").list("the cylinders it feeds")) {
      pump.feeds.push_back(cylinder(v));
    }
    pump.max_flow = map.need_number("max_flow_lpm", kFlow);
    pump.max_pressure = map.need_number("max_pressure_bar", kPressure);
    if (map.has("standby_bar") || pump.type == PumpType::kLoadSensing) {
      pump.standby = map.need_number("standby_bar", kStandby);
      if (pump.standby >= pump.max_pressure) {
        map.need("standby_bar", "")
            .fail(fmt::format("got {:g}, expected less than max_pressure_bar, {:g}",
                              pump.standby / units::kBar, pump.max_pressure / units::kBar));
      }
    }
    machine_.pumps.push_back(pump);
    places_.pumps.push_back(value.place());
  }

  void read_valve(const YamlValue& value) {
    const YamlMap map = value.map("a valve {cylinder, max_flow_lpm: {extend, retract}}",
                                  {"cylinder", "max_flow_lpm"});
    Valve valve;
    valve.cylinder = cylinder(map.need("cylinder", "the cylinder it moves"));
    const std::string expected = "the flow at full command {extend, retract} [l/min]";
    const YamlValue flow = map.need("max_flow_lpm", expected);
    if (flow.is_map()) {
      const YamlMap sides = flow.map(expected, {"extend", "retract"});
      valve.max_flow_extend = sides.need_number("extend", kFlow);
      valve.max_flow_retract = sides.need_number("retract", kFlow);
    } else {
      valve.max_flow_extend = valve.max_flow_retract = flow.number(kFlow);
    }
    machine_.valves.push_back(valve);
    places_.valves.push_back(value.place());
  }

  std::string folder_;
  MachinePlaces places_;
  Machine machine_;
  FileFrames frames_;
  std::vector<std::string> warnings_;
};

}  // namespace

Machine parse_machine(const std::string& text, const std::string& name, const std::string& folder,
                      std::vector<std::string>* warnings) {
  return MachineReader(name, folder).read(text, warnings);
}

Machine parse_unchecked_machine(const std::string& text, const std::string& name,
                                const std::string& folder, FileFrames* frames) {
  return MachineReader(name, folder).read_unchecked(text, frames);
}

Machine load_machine(const std::string& path, std::vector<std::string>* warnings) {
  return parse_machine(read_file(path), path, std::filesystem::path(path).parent_path().string(),
                       warnings);
}

}  // namespace sparflow
