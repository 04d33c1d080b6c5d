#pragma once
/// Long work beside a living Python: it runs in a thread of its own without the interpreter's lock, while the calling thread
/// hands on progress and warnings, calls Python for it and notices Ctrl-C. The work itself never touches Python.
#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "apps/tasks/task.h"
#include "models/math/interruption.h"

namespace sparflow::python {

/// What the work and the calling thread tell each other: progress, warnings, whether to end, calls of Python.
struct Telling;
std::shared_ptr<Telling> new_telling();

/// Asked by the work: lets the calling thread call Python, and waits until it has.
/// @param call must not throw but what Python raised, which ends the whole call  @throws Interruption once the call is to end
void in_calling_thread(Telling& telling, const std::function<void()>& call);

enum class Ended { kWhole, kInterrupted, kLeft };

/// Runs the work. @param progress a Python callable (share, words), or None
/// @return how it ended; after kInterrupted what it has done so far is its result, if it has one, and after kLeft it still runs
/// @throws what the work threw, and what `progress` and other calls of Python raised
Ended run_beside_python(const pybind11::object& progress, const std::shared_ptr<Telling>& telling,
                        const std::function<void(const Listener&)>& work);

/// Work that was left behind after Ctrl-C. Its result, if it has one, comes when it has noticed that it shall end.
class LeftBehind {
 public:
  LeftBehind(std::shared_ptr<Telling> telling, std::function<pybind11::object()> result)
      : telling_(std::move(telling)), result_(std::move(result)) {}
  bool ended() const;
  /// Waits at most for a time [s] without the interpreter's lock; negative: as long as it takes. Ctrl-C ends the waiting.
  /// @throws what the work threw as it ended
  bool wait(double seconds) const;
  /// What it has done; None where it has no result, or is still at work.
  pybind11::object result() const;

 private:
  std::shared_ptr<Telling> telling_;
  std::function<pybind11::object()> result_;
};

/// Waits without the interpreter's lock for all work that was left behind; the module asks for it when Python ends.
void join_left_behind();

/// Raises sparflow.Interrupted with what was done, or with the work that will still give it. What the work threw as it ended is its
/// cause.
[[noreturn]] void raise_interrupted(const pybind11::object& result, const Telling& telling);
[[noreturn]] void raise_left_behind(LeftBehind work);

/// Progress that ends work which cannot be asked to stop in another way.
WorkProgress progress_or_stop(const Listener& listener);

/// The result of the work, which is kept by reference, as Python gets it.
/// @param work must own all that it uses: after Ctrl-C it may outlive the call by the time to its next question whether to stop
template <class T>
std::shared_ptr<T> long_call(const pybind11::object& progress,
                             std::function<std::shared_ptr<T>(const Listener&)> work,
                             const std::shared_ptr<Telling>& telling = new_telling()) {
  auto result = std::make_shared<std::shared_ptr<T>>();
  const auto as_object = [result]() -> pybind11::object {
    return *result ? pybind11::cast(*result) : pybind11::none();
  };
  const Ended ended = run_beside_python(
      progress, telling,
      [result, work = std::move(work)](const Listener& listener) { *result = work(listener); });
  if (ended == Ended::kLeft) raise_left_behind({telling, as_object});
  if (ended == Ended::kInterrupted) raise_interrupted(as_object(), *telling);
  return *result;
}

}  // namespace sparflow::python
