#pragma once
/// The work of `machine --from-log`.
#include <string>
#include <vector>

#include "apps/tasks/task.h"
#include "identification/machine_from_log/machine_from_log.h"

namespace sparflow {

struct MachineFromLogTask {
  std::string sketch;              ///< machine file with open values
  std::vector<std::string> logs;   ///< to find them from
  std::vector<std::string> tests;  ///< to judge by; empty: parts of the logs are held out
  std::string mapping;             ///< mapping file, or ""
};

/// Reads sketch and logs, tells what is unusual in them, and finds what the logs tell.
/// @throws UsageError without a log, and for a log that is a test log too  @throws InputError
MachineFromLog machine_from_log_task(const MachineFromLogTask& task, const Listener& listener);

/// The sentence of an error for a machine that has questions left: all of them.
std::string questions_in_words(const MachineFromLog& found);

}  // namespace sparflow
