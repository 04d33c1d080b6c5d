#include "models/effects/plausible.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// A value that the file does not give (0) limits nothing.
double known(double value) { return value > 0.0 ? value : kUnlimited; }

/// Largest pressure of the pump that feeds a cylinder. [Pa]
double pressure_at(const Machine& machine, int cylinder) {
  const int pump = machine.pump_of_cylinder(cylinder);
  return pump < 0 ? kUnlimited : known(machine.pumps[static_cast<std::size_t>(pump)].max_pressure);
}

/// Largest force of a cylinder. [N]
double force_at(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (!c.hydraulic()) return kUnlimited;
  return std::max(c.area_piston(), c.area_rod()) * pressure_at(machine, cylinder);
}

/// Mass of all links and cylinders. [kg]
double whole_mass(const Machine& machine) {
  double mass = 0.0;
  for (const Link& l : machine.links) mass += l.mass;
  for (const Cylinder& c : machine.cylinders) mass += c.barrel_mass + c.rod_mass;
  return known(mass);
}

/// Distance from a joint to the tip with everything beyond it stretched out. [m]
double reach_from(const Machine& machine, int joint) {
  double reach = machine.tip.xyz.norm();
  for (int j = std::max(0, joint); j < machine.joint_count(); ++j) {
    const Joint& one = machine.joints[static_cast<std::size_t>(j)];
    if (j > joint) reach += one.origin.translation().norm();
    if (one.type != JointType::kRevolute)
      reach += std::max(std::abs(one.position.lo), std::abs(one.position.hi));
  }
  return known(reach);
}

/// The largest over the cylinders or pumps where an effect acts: its own, or all.
template <class F>
double largest(int at, int count, const F& value) {
  if (at >= 0) return value(at);
  double most = 0.0;
  for (int i = 0; i < count; ++i) most = std::max(most, value(i));
  return count > 0 ? most : kUnlimited;
}

}  // namespace

double plausible_limit(const Machine& machine, const EffectInfo& effect, int at,
                       const EffectParameter& parameter) {
  const int cylinder = effect.place == EffectPlace::kCylinder ? at
                       : effect.place == EffectPlace::kJoint  ? machine.cylinder_of_joint(at)
                                                              : -1;
  const int pump = effect.place == EffectPlace::kPump ? at
                   : cylinder >= 0                    ? machine.pump_of_cylinder(cylinder)
                                                      : -1;
  if (parameter.unit == "N" || parameter.unit == "kN")
    return largest(cylinder, machine.cylinder_count(), [&](int i) { return force_at(machine, i); });
  if (parameter.unit == "kg" && effect.place == EffectPlace::kJoint) return whole_mass(machine);
  if (parameter.unit == "kg m" && effect.place == EffectPlace::kJoint)
    return whole_mass(machine) * reach_from(machine, at);
  if (parameter.unit == "bar")
    return largest(pump, machine.pump_count(), [&](int i) {
      return known(machine.pumps[static_cast<std::size_t>(i)].max_pressure);
    });
  return kUnlimited;
}

std::string beyond_plausible(const Machine& machine, const AppliedEffect& effect) {
  const EffectInfo& info = effect.effect->info();
  for (std::size_t p = 0; p < std::min(effect.values.size(), info.parameters.size()); ++p) {
    const EffectParameter& q = info.parameters[p];
    const double limit = plausible_limit(machine, info, effect.at, q);
    if (q.choice || !(std::abs(effect.values[p]) > limit)) continue;
    return fmt::format(
        "{}: {} of {:.5g} {} is more than masses and areas of the machine make plausible ({:.5g} "
        "{})",
        effect.key(machine), q.name, effect.values[p] / q.si, q.unit, limit / q.si, q.unit);
  }
  return "";
}

}  // namespace sparflow
