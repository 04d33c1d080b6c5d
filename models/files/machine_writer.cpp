#include <fmt/format.h>

#include "models/files/machine_file.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

// fmt's "{}" prints the shortest text that reads back as the same double.
std::string number(double value) { return fmt::format("{}", value); }

std::string vector(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);  // no -0
}

std::string range(const Range& r) { return fmt::format("[{}, {}]", r.lo, r.hi); }

/// Text in double quotes, with escapes for characters that YAML would misread.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result + "\"";
}

/// Roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Vector3d rpy(const Eigen::Matrix3d& r) {
  const double pitch = std::atan2(-r(2, 0), std::hypot(r(2, 1), r(2, 2)));
  /// Cosine of the pitch up to which roll and yaw have the same axis.
  /// @threshold [1] 1e-16..1e-6; numerical: rounding of a rotation's entries
  constexpr double kGimbalLock = 1e-12;
  if (std::hypot(r(2, 1), r(2, 2)) < kGimbalLock) {  // gimbal lock: roll and yaw have the same axis
    return {std::atan2(-r(1, 2), r(1, 1)), pitch, 0.0};
  }
  return {std::atan2(r(2, 1), r(2, 2)), pitch, std::atan2(r(1, 0), r(0, 0))};
}

std::string frame(const Machine& machine, int joint) {
  return joint < 0 ? "base" : machine.joints[static_cast<std::size_t>(joint)].name;
}

std::string mass(const char* prefix, double value, double cog) {
  if (value == 0.0) return "";
  return fmt::format(", {0}mass: {1}, {0}cog: {2}", prefix, value, cog);
}

std::string linkage(const Machine& machine, const Cylinder& cylinder) {
  const std::string own = frame(machine, cylinder.joint);
  const std::string parent = frame(machine, cylinder.joint - 1);
  const auto pin = [](const std::string& at, const Eigen::Vector3d& xyz) {
    return fmt::format("frame: {}, xyz: {}", at, vector(xyz));
  };
  if (const auto* p = std::get_if<PinsLinkage>(&cylinder.linkage)) {
    const std::string on_parent = pin(parent, p->parent_pin), on_child = pin(own, p->child_pin);
    return fmt::format("{{type: pins, barrel: {{{}}}, rod: {{{}}}}}",
                       p->barrel_on_parent ? on_parent : on_child,
                       p->barrel_on_parent ? on_child : on_parent);
  }
  if (const auto* f = std::get_if<FourBarLinkage>(&cylinder.linkage)) {
    return fmt::format(
        "{{type: four_bar, barrel: {{{}}}, rocker: {{{}, length: {}{}}}, coupler: {{{}, length: "
        "{}{}}}, branch: {}}}",
        pin(parent, f->barrel), pin(parent, f->rocker), f->rocker_length,
        mass("", f->rocker_mass, f->rocker_cog), pin(own, f->coupler), f->coupler_length,
        mass("", f->coupler_mass, f->coupler_cog), f->branch);
  }
  if (const auto* rack = std::get_if<RackLinkage>(&cylinder.linkage)) {
    return fmt::format("{{type: rack, radius: {}}}", rack->radius);
  }
  return "{type: direct}";
}

std::string cylinder_line(const Machine& machine, const Cylinder& c) {
  std::string line = fmt::format("  - {{name: {}, joint: {}", c.name, frame(machine, c.joint));
  if (c.hydraulic()) line += fmt::format(", bore: {}, rod: {}", c.bore, c.rod);
  if (c.stages != 1) line += fmt::format(", stages: {}", c.stages);
  if (c.parallel != 1) line += fmt::format(", parallel: {}", c.parallel);
  if (c.length_at_zero_stroke) {
    line += fmt::format(", length_at_zero_stroke: {}", *c.length_at_zero_stroke);
  }
  if (c.stroke) line += fmt::format(", stroke: {}", *c.stroke);
  line += mass("barrel_", c.barrel_mass, c.barrel_cog) + mass("rod_", c.rod_mass, c.rod_cog);
  return line + fmt::format(", linkage: {}}}\n", linkage(machine, c));
}

std::string pump_line(const Machine& machine, const Pump& pump) {
  std::string feeds;
  for (const int i : pump.feeds) {
    if (!feeds.empty()) feeds += ", ";
    feeds += machine.cylinders[static_cast<std::size_t>(i)].name;
  }
  return fmt::format(
      "  - {{name: {}, type: {}, feeds: [{}], max_flow_lpm: {}, max_pressure_bar: {}, standby_bar: "
      "{}}}\n",
      pump.name, pump.type == PumpType::kLoadSensing ? "load_sensing" : "constant_pressure", feeds,
      pump.max_flow / units::kLitrePerMinute, pump.max_pressure / units::kBar,
      pump.standby / units::kBar);
}

}  // namespace

std::string write_machine(const Machine& machine) {
  std::string text = fmt::format("name: {}\ngravity: {}\njoints:{}\n", quoted(machine.name),
                                 vector(machine.gravity), machine.joints.empty() ? " []" : "");
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const Joint& j = machine.joints[i];
    text += fmt::format(
        "  - {{name: {}, type: {}, parent: {}, origin: {{xyz: {}, rpy: {}}}, axis: {}, position: "
        "{}, "
        "velocity: {}, acceleration: {}}}\n",
        j.name, j.type == JointType::kRevolute ? "revolute" : "prismatic",
        frame(machine, static_cast<int>(i) - 1), vector(j.origin.translation()),
        vector(rpy(j.origin.linear())), vector(j.axis), range(j.position), range(j.velocity),
        range(j.acceleration));
  }
  text += fmt::format("tip: {{joint: {}, xyz: {}}}\nlinks:{}\n", frame(machine, machine.tip.joint),
                      vector(machine.tip.xyz), machine.links.empty() ? " []" : "");
  for (const Link& l : machine.links) {
    text += fmt::format("  - {{name: {}, joint: {}", quoted(l.name), frame(machine, l.joint));
    if (l.slides_with >= 0) {
      text +=
          fmt::format(", slides_with: {}, fraction: {}", frame(machine, l.slides_with), l.fraction);
    }
    text += fmt::format(", mass: {}, cog: {}, inertia: {}}}\n", number(l.mass), vector(l.cog),
                        number(l.inertia));
  }
  text += fmt::format("cylinders:{}\n", machine.cylinders.empty() ? " []" : "");
  for (const Cylinder& c : machine.cylinders) text += cylinder_line(machine, c);
  text += fmt::format("pumps:{}\n", machine.pumps.empty() ? " []" : "");
  for (const Pump& p : machine.pumps) text += pump_line(machine, p);
  text += fmt::format("valves:{}\n", machine.valves.empty() ? " []" : "");
  for (const Valve& v : machine.valves) {
    text += fmt::format("  - {{cylinder: {}, max_flow_lpm: {{extend: {}, retract: {}}}}}\n",
                        machine.cylinders[static_cast<std::size_t>(v.cylinder)].name,
                        v.max_flow_extend / units::kLitrePerMinute,
                        v.max_flow_retract / units::kLitrePerMinute);
  }
  return text;
}

}  // namespace sparflow
