#pragma once
/// The work of `audit`: the moves of recorded logs, each beside its energy-optimal motion.
#include <functional>
#include <optional>
#include <vector>

#include "apps/report/motion_pages/audit_page.h"
#include "apps/tasks/task.h"
#include "identification/log/log.h"
#include "identification/signals/moves.h"
#include "models/hydraulics/engine_map.h"

namespace sparflow {

struct AuditTask {
  double payload = -1.0;            ///< [kg] negative: that of the log
  double litres_per_kWh = 0.0;      ///< fuel for each kWh of hydraulic energy; 0: not told
  std::optional<EngineMap> engine;  ///< fuel of the engine over its power
  int most = 40;                    ///< moves examined at most: those with the longest way
  int processes = 0;  ///< starts solved in parallel; 0: as many as there are processors
  MoveOptions cutting;
  bool bound = true;                ///< also the lower bounds of the energy
  std::function<void()> searching;  ///< called when there is something that Ctrl-C would keep
};

/// @throws UsageError for a number outside its range (docs/commands.md)
void check_ranges(const AuditTask& task);

/// @param model with all pressures that a motion needs (require_pressures)  @param logs at least one; given back as soon
/// as their signals are made
/// @throws UsageError as check_ranges  @throws InputError when the logs have no move
AuditResult audit_task(const CraneModel& model, std::vector<Log>&& logs, const AuditTask& task,
                       const Listener& listener);

}  // namespace sparflow
