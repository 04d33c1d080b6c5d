#include "apps/tasks/compare_task.h"

#include <fmt/format.h>

#include <cmath>

namespace sparflow {
namespace {

/// Notes energies whose relative error is undefined, because the pump delivered nothing.
void note_undefined_energies(CompareResult& result) {
  for (const EnergyScore& e : result.energy) {
    if (std::isfinite(e.relative_error)) continue;
    result.notes.push_back(fmt::format(
        "energy of pump {}: \u2013 %, the pump delivered nothing in the {:.1f} s compared, "
        "because no cylinder is driven in them",
        e.pump, e.duration));
  }
}

}  // namespace

CompareResult compare_task(const CraneModel& model, std::vector<Log>&& logs, bool learned,
                           const CompareOptions& options) {
  CompareResult result = compare(model, std::move(logs), options);
  if (!learned) keep_stages(model.machine, {"force", "flow_sensor"}, result);
  note_undefined_energies(result);
  return result;
}

}  // namespace sparflow
