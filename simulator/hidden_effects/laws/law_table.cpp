#include <fmt/format.h>

#include <iterator>

#include "models/math/error.h"
#include "simulator/hidden_effects/hidden_law.h"

namespace sparflow::simulator {
namespace {

const char* place_name(HiddenPlace place) {
  switch (place) {
    case HiddenPlace::kJoint:
      return "joint";
    case HiddenPlace::kCylinder:
      return "cylinder";
    case HiddenPlace::kPump:
      return "pump";
    case HiddenPlace::kChannel:
      return "channel";
    case HiddenPlace::kMachine:
      break;
  }
  return "machine";
}

std::vector<std::string> ids(bool in_catalogue) {
  std::vector<std::string> result;
  for (const LawEntry& e : all_laws())
    if (e.in_catalogue == in_catalogue) result.push_back(e.id);
  return result;
}

}  // namespace

const std::vector<LawEntry>& all_laws() {
  static const std::vector<LawEntry> table = [] {
    std::vector<LawEntry> all;
    for (auto* part :
         {friction_laws, contact_laws, mass_laws, pressure_laws, valve_laws, volume_laws, pump_laws,
          sensor_laws, outside_hydraulic_laws, outside_mechanical_laws}) {
      std::vector<LawEntry> entries = part();
      std::move(entries.begin(), entries.end(), std::back_inserter(all));
    }
    return all;
  }();
  return table;
}

const LawEntry& law_entry(const std::string& id) {
  std::vector<std::string> known;
  for (const LawEntry& e : all_laws()) {
    if (e.id == id) return e;
    known.push_back(e.id);
  }
  const std::string near = nearest_word(id, known);
  throw InputError({}, "effects",
                   fmt::format("no hidden effect \"{}\"{}", id,
                               near.empty() ? "" : "; did you mean \"" + near + "\"?"));
}

const std::vector<EffectDescription>& effect_descriptions() {
  static const std::vector<EffectDescription> list = [] {
    std::vector<EffectDescription> all;
    for (const LawEntry& e : all_laws())
      all.push_back({e.id, place_name(e.place), e.in_catalogue, e.laws, e.parameters});
    return all;
  }();
  return list;
}

std::vector<std::string> catalogue_ids() { return ids(true); }
std::vector<std::string> outside_ids() { return ids(false); }

}  // namespace sparflow::simulator
