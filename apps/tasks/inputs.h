#pragma once
/// Machines, models and logs, read with their warnings; and what a diagnosis asks of its logs.
#include <string>
#include <vector>

#include "apps/tasks/task.h"
#include "diagnosis/extension/extend.h"
#include "identification/log/log.h"
#include "models/chain/crane_model.h"

namespace sparflow {

/// Reads a machine file and tells what is unusual in it. @throws InputError
Machine read_machine(const std::string& path, const Listener& listener);
/// Reads a model file and tells what is unusual in its machine. @throws InputError
CraneModel read_model(const std::string& path, const Listener& listener);

/// Adds the user's own effects to a model, whose file then stores them, and tells which have no place on its machine.
void add_own_effects(const std::vector<const Effect*>& effects, const Listener& listener,
                     CraneModel& model);

/// Candidates of a search by their keys: without ":at" an effect at all its places. @throws InputError
std::vector<EffectAt> candidates_of(const std::vector<std::string>& keys, const Machine& machine);

/// Checks that each log is diagnosed, a reference or a test log, and only one of these, and tells of sensors that seem to be
/// connected or named wrongly, which a diagnosis would take for missing physics. @throws UsageError
void check_diagnosis_logs(const std::string& verb, const Machine& machine, const ExtendLogs& logs,
                          const Listener& listener);

/// Tells, when there is no reference log and the model was not fitted on one of the logs, that the model then serves as
/// reference for forces only.
void tell_what_is_reference(const CraneModel& model, const ExtendLogs& logs,
                            const Listener& listener);

/// The error of a model that lacks the working pressure of a movement, which every motion needs.
/// @param where file of the problem or the model  @param key in it
void require_pressures(const CraneModel& model, const std::string& where, const std::string& key);

/// Today's date (UTC) as "2025-03-14", for the history in the model file.
std::string today();

}  // namespace sparflow
