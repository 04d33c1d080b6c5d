#include "apps/python/long_call.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <iterator>
#include <mutex>
#include <thread>
#include <vector>

#include "apps/python/bindings.h"
#include "optimizer/solve/child_progress.h"

namespace sparflow::python {

namespace py = pybind11;

/// What both threads see.
struct Telling {
  std::mutex mutex;
  std::condition_variable changed;
  double share = 0.0;
  std::string words;
  bool new_progress = false;
  std::vector<std::string> warnings;
  std::exception_ptr thrown;
  const std::function<void()>* call = nullptr;  ///< that the work waits for
  bool interrupted = false;  ///< the work ended by Interruption, without a result
  bool done = false;
  ChildProgress shared{
      1};  ///< its step is not 0 when the work is to end, in child processes as well
  bool stopping() { return shared.step().load() != 0; }
};

std::shared_ptr<Telling> new_telling() { return std::make_shared<Telling>(); }

void in_calling_thread(Telling& telling, const std::function<void()>& call) {
  std::unique_lock lock(telling.mutex);
  telling.call = &call;
  telling.changed.notify_all();
  telling.changed.wait(lock, [&] { return telling.call == nullptr || telling.stopping(); });
  const bool served = telling.call == nullptr;
  telling.call = nullptr;
  if (!served) throw Interruption();
}

namespace {

/// Time between two looks at signals and progress.
/// @threshold [ms] 5..200; chosen: a tenth of the half second in which Ctrl-C is answered
constexpr std::chrono::milliseconds kLookEvery{40};
/// Time in which the work must end after Ctrl-C; then it is left to end by itself.
/// @threshold [ms] 0..1000; chosen: with the look it stays below half a second
constexpr std::chrono::milliseconds kPatience{420};

/// A thread whose work was left behind.
struct LeftThread {
  std::shared_ptr<Telling> telling;
  std::jthread thread;
  bool done() const {
    const std::lock_guard lock(telling->mutex);
    return telling->done;
  }
};

/// The threads left behind. The GIL, which is held, guards the list.
std::vector<LeftThread>& left_behind() {
  static std::vector<LeftThread> threads;
  return threads;
}

/// Keeps a thread for the end of Python, and forgets those whose work has ended since.
void leave_behind(std::shared_ptr<Telling> telling, std::jthread thread) {
  std::vector<LeftThread> ended;
  std::vector<LeftThread>& all = left_behind();
  const auto first =
      std::stable_partition(all.begin(), all.end(), [](const LeftThread& t) { return !t.done(); });
  ended.assign(std::make_move_iterator(first), std::make_move_iterator(all.end()));
  all.erase(first, all.end());
  all.push_back({std::move(telling), std::move(thread)});
  const py::gil_scoped_release release;
  ended.clear();  // joins them
}

/// Hands on what the work has told since the last time. The GIL is held; Python code may run and raise.
void hand_on(Telling& telling, const py::object& progress) {
  std::vector<std::string> warnings;
  double share = 0.0;
  std::string words;
  bool told = false;
  {
    const std::lock_guard lock(telling.mutex);
    warnings.swap(telling.warnings);
    told = std::exchange(telling.new_progress, false);
    share = telling.share;
    words = telling.words;
  }
  for (const std::string& w : warnings) warn(w);
  if (told && !progress.is_none()) progress(share, words);
}

Listener listener_of(const std::shared_ptr<Telling>& telling) {
  Listener listener;
  listener.warn = [telling](const std::string& sentence) {
    const std::lock_guard lock(telling->mutex);
    telling->warnings.push_back(sentence);
  };
  listener.note = listener.warn;
  listener.progress = [telling](double share, const std::string& words) {
    const std::lock_guard lock(telling->mutex);
    telling->share = std::max(telling->share, share);
    telling->words = words;
    telling->new_progress = true;
  };
  listener.interrupted = [telling] { return telling->stopping(); };
  return listener;
}

/// Waits until the work is done, at most for a time. The GIL is released.
bool done_within(Telling& telling, std::chrono::milliseconds time) {
  const py::gil_scoped_release release;
  std::unique_lock lock(telling.mutex);
  return telling.changed.wait_for(lock, time, [&] { return telling.done; });
}

/// Waits until the work is done or wants a call of Python, at most until the next look. The GIL is released.
bool done_or_wants_call(Telling& telling) {
  const py::gil_scoped_release release;
  std::unique_lock lock(telling.mutex);
  telling.changed.wait_for(lock, kLookEvery,
                           [&] { return telling.done || telling.call != nullptr; });
  return telling.done;
}

/// Calls Python for the work. The GIL is held.
void serve_call(Telling& telling) {
  const std::function<void()>* call = nullptr;
  {
    const std::lock_guard lock(telling.mutex);
    call = telling.call;
  }
  if (call == nullptr) return;
  (*call)();  // the work waits, so that it stays where it is
  const std::lock_guard lock(telling.mutex);
  telling.call = nullptr;
  telling.changed.notify_all();
}

/// Asks the work to end, and leaves it behind where it does not.
Ended end(const std::shared_ptr<Telling>& telling, std::jthread thread) {
  {
    const std::lock_guard lock(telling->mutex);
    telling->shared.step() = 1;
    telling->changed.notify_all();
  }
  if (done_within(*telling, kPatience)) {
    const py::gil_scoped_release release;
    thread.join();
    return Ended::kInterrupted;
  }
  leave_behind(telling, std::move(thread));
  return Ended::kLeft;
}

/// What was thrown, as the exception that Python would see. The GIL is held.
py::object as_python_error(const std::exception_ptr& thrown) {
  try {
    py::cpp_function([thrown] { std::rethrow_exception(thrown); })();
  } catch (py::error_already_set& e) {
    return e.value();
  }
  return py::none();
}

}  // namespace

WorkProgress progress_or_stop(const Listener& listener) {
  return [listener](double share, const std::string& words) {
    if (listener.progress) listener.progress(share, words);
    if (listener.stop()) throw Interruption();
  };
}

Ended run_beside_python(const py::object& progress, const std::shared_ptr<Telling>& telling,
                        const std::function<void(const Listener&)>& work) {
  std::jthread thread([telling, work] {
    std::exception_ptr thrown;
    bool interrupted = false;
    try {
      work(listener_of(telling));
    } catch (const Interruption&) {
      interrupted = true;
    } catch (...) {
      thrown = std::current_exception();
    }
    const std::lock_guard lock(telling->mutex);
    telling->thrown = thrown;
    telling->interrupted = interrupted;
    telling->done = true;
    telling->changed.notify_all();
  });
  while (!done_or_wants_call(*telling)) {
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      hand_on(*telling, progress);
      serve_call(*telling);
    } catch (py::error_already_set& e) {
      const Ended ended = end(telling, std::move(thread));
      if (e.matches(PyExc_KeyboardInterrupt)) return ended;
      throw;
    } catch (...) {  // the work waits for its call, and would wait for ever
      end(telling, std::move(thread));
      throw;
    }
  }
  {
    const py::gil_scoped_release release;
    thread.join();
  }
  if (telling->thrown) std::rethrow_exception(telling->thrown);
  hand_on(*telling, progress);
  return telling->interrupted ? Ended::kInterrupted : Ended::kWhole;
}

bool LeftBehind::ended() const {
  const std::lock_guard lock(telling_->mutex);
  return telling_->done;
}

bool LeftBehind::wait(double seconds) const {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  while (!done_within(*telling_, kLookEvery)) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (seconds >= 0.0 && std::chrono::duration<double>(Clock::now() - begin).count() >= seconds)
      return false;
  }
  const std::lock_guard lock(telling_->mutex);
  if (telling_->thrown) std::rethrow_exception(telling_->thrown);
  return true;
}

py::object LeftBehind::result() const { return ended() ? result_() : py::none(); }

void join_left_behind() {
  std::vector<LeftThread> all = std::move(left_behind());
  left_behind().clear();
  const py::gil_scoped_release release;
  all.clear();  // joins them
}

void raise_interrupted(const py::object& result, const Telling& telling) {
  const py::object type = py::module_::import("sparflow._errors").attr("Interrupted");
  py::object error =
      type(result.is_none() ? "interrupted: nothing was found yet that could be kept"
                            : "interrupted: what was done is kept in `result` of this exception");
  error.attr("_result") = result;
  if (telling.thrown) error.attr("__cause__") = as_python_error(telling.thrown);
  PyErr_SetObject(type.ptr(), error.ptr());
  throw py::error_already_set();
}

void raise_left_behind(LeftBehind work) {
  const py::object type = py::module_::import("sparflow._errors").attr("Interrupted");
  py::object error = type(
      "interrupted: the work is at a part that it ends first; `wait()` of this exception gives "
      "what was done");
  error.attr("_left_behind") = py::cast(std::move(work));
  PyErr_SetObject(type.ptr(), error.ptr());
  throw py::error_already_set();
}

}  // namespace sparflow::python
