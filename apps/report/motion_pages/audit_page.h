#pragma once
/// What `audit` found in recorded logs, as JSON, text and page.
#include <limits>
#include <string>
#include <vector>

#include "apps/report/page/page.h"
#include "optimizer/baselines/move_audit.h"

namespace sparflow {

struct AuditedMove {
  std::string log;
  double from = 0.0, to = 0.0;  ///< [s] of the log
  double payload = 0.0;         ///< [kg]
  /// [J] the pumps' logged pressures times the flows of the measured speeds; not a number without logged pressures
  double measured = std::numeric_limits<double>::quiet_NaN();
  double bound = std::numeric_limits<double>::quiet_NaN();  ///< [J] estimated lower bound
  Trajectory recorded;
  MoveAudit audit;
  /// Fuel by the map of engine and pump, of the recorded motion by the model and of the optimum. [m^3]
  double fuel_recorded = 0.0, fuel_optimum = 0.0;

  /// Model over measured energy of the recorded motion, less one.
  double model_error() const { return audit.recorded.total / measured - 1.0; }
};

struct AuditResult {
  std::vector<AuditedMove> moves;  ///< in order of time
  double seconds = 0.0;            ///< [s] of all logs, gaps left out
  double at_rest = 0.0;            ///< [s] of these, no cylinder moves
  int not_examined = 0;            ///< further moves, beyond the largest number asked for
  double litres_per_kWh = 0.0;     ///< fuel for each kWh of hydraulic energy; 0 = not told
  bool engine_map = false;         ///< whether the fuels below and of the moves are known
  double fuel = 0.0;  ///< [m^3] of all logs, gaps left out; not a number without logged pressures
  double fuel_at_rest = 0.0;       ///< [m^3] of these, while no cylinder moves
  std::vector<std::string> notes;  ///< whole sentences
  bool interrupted = false;

  /// Judged moves, largest saving first, as indices.
  std::vector<std::size_t> by_saving() const;
};

/// Sums over the judged moves. [J]
struct AuditSums {
  int judged = 0;
  double recorded = 0.0, optimum = 0.0, variance = 0.0;  ///< variance [J^2] of the saving
  double by_pace = 0.0, by_way = 0.0;
  double by_posture = 0.0, by_posture_potential = 0.0;  ///< besides the saving
  double measured = 0.0;                                ///< not a number where a move has none
  double fuel_recorded = 0.0, fuel_optimum = 0.0;       ///< [m^3]
  std::vector<double> throttling;                       ///< recorded less optimum, by cylinder
  std::vector<double> useful;                           ///< the same of the work on the cylinders
  double saving() const { return recorded - optimum; }
};
AuditSums sums_of(const Machine& machine, const AuditResult& result);

std::string audit_json(const CraneModel& model, const AuditResult& result);
std::string audit_table(const CraneModel& model, const AuditResult& result);
Page audit_page(const CraneModel& model, const AuditResult& result);

}  // namespace sparflow
