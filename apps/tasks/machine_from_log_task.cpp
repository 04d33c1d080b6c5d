#include "apps/tasks/machine_from_log_task.h"

#include <fmt/format.h>

namespace sparflow {
namespace {

std::vector<Log> read_logs(const std::vector<std::string>& paths, const MachineSketch& sketch,
                           const std::string& mapping, const Listener& listener) {
  LogOptions options;
  options.mapping_file = mapping;
  std::vector<Log> logs;
  logs.reserve(paths.size());
  for (const std::string& path : paths) {
    logs.push_back(load_log(path, sketch.machine, options));
    for (const std::string& w : logs.back().warnings)
      listener.say_warning(fmt::format("{}: {}", logs.back().file, w));
  }
  return logs;
}

}  // namespace

MachineFromLog machine_from_log_task(const MachineFromLogTask& task, const Listener& listener) {
  if (task.logs.empty())
    throw UsageError("machine: expected at least one log to find open values from");
  const MachineSketch sketch = load_sketch(task.sketch);
  const std::vector<Log> logs = read_logs(task.logs, sketch, task.mapping, listener);
  const std::vector<Log> tests = read_logs(task.tests, sketch, task.mapping, listener);
  for (const Log& test : tests) {
    for (const Log& log : logs) {
      if (test.sha256 != log.sha256) continue;
      throw UsageError(
          fmt::format("machine: {} is given as log and as test; a machine is judged on "
                      "data that it was not found from, so give it once",
                      test.path));
    }
  }
  MachineFromLog found = machine_from_logs(sketch, logs, tests);
  for (const std::string& w : found.warnings) listener.say_warning(w);
  return found;
}

std::string questions_in_words(const MachineFromLog& found) {
  std::string text = fmt::format("the logs do not tell {} value{}", found.questions.size(),
                                 found.questions.size() == 1 ? "" : "s");
  for (const MachineQuestion& q : found.questions)
    text += fmt::format("; {}: {}", q.path, q.sentence);
  return text;
}

}  // namespace sparflow
