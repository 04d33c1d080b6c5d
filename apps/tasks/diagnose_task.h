#pragma once
/// The work of `diagnose` besides the diagnosis itself: its effects judged on test logs.
#include <optional>
#include <string>

#include "apps/tasks/task.h"
#include "diagnosis/extension/extend.h"

namespace sparflow {

/// Adds the effects found to the model, one after the other, and judges each step on the test logs.
/// @return nothing when there are no test logs or no effect is probable enough
std::optional<ExtendResult> judge_on_tests(const CraneModel& model, const ExtendLogs& logs,
                                           const Diagnosis& diagnosis,
                                           const WorkProgress& progress);

/// The diagnosis as JSON, with `test` where it was judged on test logs (keys: docs/commands.md).
std::string diagnosis_json(const Diagnosis& diagnosis, const ExtendResult* tested);

/// The same as text of one screen.
std::string diagnosis_table(const Diagnosis& diagnosis, const ExtendResult* tested);

}  // namespace sparflow
