#pragma once
/// The work of `benchmark`: energy-optimal motions of all scenarios, then every controller in every scenario, in processes of
/// their own but for controllers of the caller's own.
#include "apps/tasks/benchmark/benchmark_text.h"
#include "apps/tasks/benchmark/benchmark_work.h"
#include "models/math/journal.h"

namespace sparflow {

/// Runs what the journal lacks. Progress goes to whom `task.begin` names, else to the listener.
BenchmarkResult benchmark_task(const BenchmarkWork& work, const BenchmarkTask& task,
                               Journal& journal, const Listener& listener);

}  // namespace sparflow
