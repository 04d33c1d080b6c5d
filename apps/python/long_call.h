#pragma once
/// Long work beside a living Python: it runs in a thread of its own without the interpreter's lock, while the calling thread
/// hands on progress and warnings and notices Ctrl-C. The work never touches Python.
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "apps/tasks/task.h"
#include "models/math/interruption.h"

namespace sparflow::python {

/// The side of the work: what it tells, and whether it shall end.
struct Telling;

enum class Ended { kWhole, kInterrupted, kLeft };

/// Runs the work. @param progress a Python callable (share, words), or None
/// @return how it ended; after kInterrupted what it has done so far is its result, if it has one, and after kLeft it still runs
/// @throws what the work threw, and what `progress` raised
Ended run_beside_python(const pybind11::object& progress,
                        const std::function<void(const Listener&)>& work);

/// Raises sparflow.Interrupted with what was done.
[[noreturn]] void raise_interrupted(const pybind11::object& result);

/// Progress that ends work which cannot be asked to stop in another way.
WorkProgress progress_or_stop(const Listener& listener);

/// The result of the work, which is kept by reference, as Python gets it.
/// @param work must own all that it uses: after Ctrl-C it may outlive the call by the time to its next question whether to stop
template <class T>
std::shared_ptr<T> long_call(const pybind11::object& progress,
                             std::function<std::shared_ptr<T>(const Listener&)> work) {
  auto result = std::make_shared<std::shared_ptr<T>>();
  const Ended ended = run_beside_python(
      progress,
      [result, work = std::move(work)](const Listener& listener) { *result = work(listener); });
  if (ended == Ended::kLeft) raise_interrupted(pybind11::none());
  if (ended == Ended::kInterrupted)
    raise_interrupted(*result ? pybind11::cast(*result) : pybind11::none());
  return *result;
}

}  // namespace sparflow::python
