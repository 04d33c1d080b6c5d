#include "models/machine/machine.h"

#include <algorithm>
#include <numbers>

namespace sparflow {
namespace {

template <class List>
int index_by_name(const List& list, const std::string& name) {
  const auto it =
      std::find_if(list.begin(), list.end(), [&](const auto& e) { return e.name == name; });
  return it == list.end() ? -1 : static_cast<int>(it - list.begin());
}

}  // namespace

double Cylinder::area_piston() const { return parallel * std::numbers::pi / 4.0 * bore * bore; }

double Cylinder::area_rod() const {
  return parallel * std::numbers::pi / 4.0 * (bore * bore - rod * rod);
}

int Machine::joint_index(const std::string& joint_name) const {
  return index_by_name(joints, joint_name);
}

int Machine::cylinder_index(const std::string& cylinder_name) const {
  return index_by_name(cylinders, cylinder_name);
}

int Machine::pump_index(const std::string& pump_name) const {
  return index_by_name(pumps, pump_name);
}

int Machine::cylinder_of_joint(int joint) const {
  for (int i = 0; i < cylinder_count(); ++i) {
    if (cylinders[static_cast<std::size_t>(i)].joint == joint) return i;
  }
  return -1;
}

int Machine::pump_of_cylinder(int cylinder) const {
  for (int i = 0; i < pump_count(); ++i) {
    const std::vector<int>& feeds = pumps[static_cast<std::size_t>(i)].feeds;
    if (std::find(feeds.begin(), feeds.end(), cylinder) != feeds.end()) return i;
  }
  return -1;
}

const Valve* Machine::valve_of_cylinder(int cylinder) const {
  for (const Valve& valve : valves) {
    if (valve.cylinder == cylinder) return &valve;
  }
  return nullptr;
}

Machine::Machine() = default;
Machine::Machine(const Machine&) = default;
Machine::Machine(Machine&&) noexcept = default;
Machine& Machine::operator=(const Machine&) = default;
Machine& Machine::operator=(Machine&&) noexcept = default;
Machine::~Machine() = default;

}  // namespace sparflow
