#include "simulator/hidden_effects/random_machine.h"

#include <fmt/format.h>

#include <algorithm>

#include "models/files/machine_file.h"
#include "models/machine/machine_check.h"
#include "models/math/error.h"
#include "simulator/random/random.h"

namespace sparflow::simulator {
namespace {

void drop_telescope(Machine& machine) {
  const int last = machine.joint_count() - 1;
  if (last < 1 || machine.joints.back().type != JointType::kPrismatic) return;
  const Joint gone = machine.joints.back();
  const double out = 0.5 * (gone.position.lo + gone.position.hi);
  const Eigen::Vector3d slide = gone.origin.linear() * gone.axis;
  for (Link& link : machine.links) {
    if (link.joint == last) {
      link.joint = last - 1;
      link.cog = gone.origin * (gone.axis * out + link.cog);
    }
    if (link.slides_with == last) {
      link.cog += slide * (link.fraction * out);
      link.slides_with = -1;
      link.fraction = 0.0;
    }
  }
  if (machine.tip.joint == last) {
    machine.tip.joint = last - 1;
    machine.tip.xyz = gone.origin * (gone.axis * out + machine.tip.xyz);
  }
  machine.joints.pop_back();
  const int drive = [&] {
    for (int i = 0; i < machine.cylinder_count(); ++i)
      if (machine.cylinders[static_cast<std::size_t>(i)].joint == last) return i;
    return -1;
  }();
  if (drive < 0) return;
  machine.cylinders.erase(machine.cylinders.begin() + drive);
  for (Pump& pump : machine.pumps) {
    std::erase(pump.feeds, drive);
    for (int& i : pump.feeds)
      if (i > drive) --i;
  }
  std::erase_if(machine.valves, [&](const Valve& v) { return v.cylinder == drive; });
  for (Valve& v : machine.valves)
    if (v.cylinder > drive) --v.cylinder;
}

void add_slewing(Machine& machine, Random& random) {
  if (machine.joints.empty() || machine.pumps.empty()) return;
  const Joint& first = machine.joints.front();
  // A machine whose column slews already gets no second slewing joint.
  if ((first.origin.linear() * first.axis).cross(Eigen::Vector3d::UnitZ()).norm() < 0.1) return;
  Joint slew;
  slew.name = "slew";
  slew.axis = Eigen::Vector3d::UnitZ();
  slew.position = {-2.5, 2.5};
  slew.velocity = {-0.35, 0.35};
  slew.acceleration = {-0.4, 0.4};
  machine.joints.insert(machine.joints.begin(), slew);
  for (Link& link : machine.links) {
    ++link.joint;  // A link that was fixed to the base now turns with the column.
    if (link.slides_with >= 0) ++link.slides_with;
  }
  ++machine.tip.joint;
  for (Cylinder& c : machine.cylinders) ++c.joint;
  Cylinder rack;
  rack.name = "slew";
  rack.joint = 0;
  rack.bore = random.uniform(0.08, 0.11);
  rack.rod = 0.4 * rack.bore;
  rack.parallel = 2;
  rack.linkage = RackLinkage{random.uniform(0.1, 0.14)};
  machine.cylinders.push_back(rack);
  const int index = machine.cylinder_count() - 1;
  machine.pumps.front().feeds.push_back(index);
  const double flow = 1.2 * rack.area_piston() * std::get<RackLinkage>(rack.linkage).radius * 0.35;
  machine.valves.push_back({index, flow, flow});
}

void add_pump(Machine& machine, Random& random) {
  if (machine.pumps.size() != 1 || machine.pumps.front().feeds.size() < 2) return;
  Pump& first = machine.pumps.front();
  Pump second = first;
  second.name = first.name == "auxiliary" ? "second" : "auxiliary";
  second.max_flow *= random.uniform(0.6, 0.9);
  second.standby *= random.uniform(0.85, 1.15);
  second.feeds = {first.feeds.back()};
  first.feeds.pop_back();
  machine.pumps.push_back(second);
}

void scale(Machine& machine, double spread, Random& random) {
  const auto factor = [&] { return random.uniform(1.0 - spread, 1.0 + spread); };
  // One factor scales all pins, so that linkages keep their shape; link lengths vary in addition.
  const double size = factor();
  for (Joint& joint : machine.joints) {
    joint.origin.translation() *= size;
    if (joint.type == JointType::kPrismatic) {
      joint.position.lo *= size;
      joint.position.hi *= size;
    }
  }
  machine.tip.xyz *= size;
  for (Link& link : machine.links) {
    const double mass = factor();
    link.mass *= mass * size;
    link.cog *= size;
    link.inertia *= mass * size * size * size;
  }
  for (Cylinder& c : machine.cylinders) {
    const double bore = random.uniform(1.0 - 0.6 * spread, 1.0 + 0.6 * spread);
    c.bore *= bore;
    c.rod *= bore;
    if (c.length_at_zero_stroke) *c.length_at_zero_stroke *= size;
    if (c.stroke) *c.stroke *= size;
    c.barrel_mass *= size;
    c.rod_mass *= size;
    c.barrel_cog *= size;
    c.rod_cog *= size;
    if (auto* p = std::get_if<PinsLinkage>(&c.linkage)) {
      p->parent_pin *= size;
      p->child_pin *= size;
    } else if (auto* f = std::get_if<FourBarLinkage>(&c.linkage)) {
      for (auto* pin : {&f->barrel, &f->rocker, &f->coupler}) *pin *= size;
      for (double* length :
           {&f->rocker_length, &f->coupler_length, &f->rocker_cog, &f->coupler_cog})
        *length *= size;
    } else if (auto* r = std::get_if<RackLinkage>(&c.linkage)) {
      r->radius *= size;
    }
  }
  for (Valve& v : machine.valves) {
    const double flow = factor();
    v.max_flow_extend *= flow;
    v.max_flow_retract *= flow;
  }
  // The outer boom has a length of its own, which moves the last joint's origin and the tip.
  if (machine.joints.size() > 1 && machine.joints.back().type == JointType::kPrismatic)
    machine.joints.back().origin.translation() *=
        random.uniform(1.0 - 0.5 * spread, 1.0 + 0.5 * spread);
  else
    machine.tip.xyz *= random.uniform(1.0 - 0.5 * spread, 1.0 + 0.5 * spread);
}

}  // namespace

Machine vary_machine(const Machine& drawing, const MachineVariation& variation,
                     std::uint64_t seed) {
  Random random(seed, "machine");
  for (int attempt = 0; attempt < 40; ++attempt) {
    Machine machine = drawing;
    machine.source_text.clear();
    scale(machine, variation.spread, random);
    if (variation.drop_telescope) drop_telescope(machine);
    if (variation.two_pumps) add_pump(machine, random);
    if (variation.add_slewing) add_slewing(machine, random);
    machine.name = fmt::format("{}-{}", drawing.name, seed);
    try {
      check_machine(machine);
      // The machine is written to text and read back, so that it equals what a reader of its file gets.
      return parse_machine(write_machine(machine), machine.name + ".yaml", ".");
    } catch (const InputError&) {
      continue;  // A linkage passes its dead centre, so another machine is drawn.
    }
  }
  throw InputError({}, "machine", "no variation of " + drawing.name + " passes check_machine()");
}

Machine random_machine(const std::vector<Machine>& drawings, std::uint64_t seed) {
  SPARFLOW_CHECK(!drawings.empty(), "random_machine needs at least one machine to vary");
  Random random(seed, "choice");
  const Machine& drawing =
      drawings[static_cast<std::size_t>(random.below(static_cast<int>(drawings.size())))];
  MachineVariation variation;
  variation.drop_telescope = random.chance(0.25);
  variation.add_slewing = random.chance(0.3);
  variation.two_pumps = random.chance(0.3);
  return vary_machine(drawing, variation, seed);
}

}  // namespace sparflow::simulator
