#include "optimizer/solve/child_processes.h"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <new>

#include "models/math/error.h"
#include "optimizer/solve/kept_work.h"

namespace sparflow {
namespace {

struct Child {
  int index = -1;
  pid_t pid = -1;
  int pipe = -1;
  std::string received;
};

void write_all(int fd, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    done += static_cast<std::size_t>(n);
  }
}

/// First byte: 1 = a result follows, 0 = an exception's text follows.
std::string run_here(const std::function<std::string(int)>& work, int index) {
  try {
    return "\1" + work(index);
  } catch (const std::bad_alloc&) {
    return std::string(1, '\0') + "out of memory; solve fewer problems at once (--processes)";
  } catch (const std::exception& e) {
    return std::string(1, '\0') + e.what();
  }
}

ChildResult decode(const std::string& message, const std::string& if_empty) {
  ChildResult result;
  if (message.empty()) {
    result.error = if_empty;
  } else if (message[0] == '\1') {
    result.ok = true;
    result.bytes = message.substr(1);
  } else {
    result.error = message.substr(1);
  }
  return result;
}

Child start_child(const std::function<std::string(int)>& work, int index,
                  const std::vector<Child>& others) {
  int ends[2];
  SPARFLOW_CHECK(::pipe(ends) == 0, "no pipe for a child process");
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  SPARFLOW_CHECK(pid >= 0, "no child process");
  if (pid == 0) {
    // The child ends with its parent (killed or interrupted), since then nothing reads its result.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    ::close(ends[0]);
    for (const Child& other : others) ::close(other.pipe);
    write_all(ends[1], run_here(work, index));
    ::close(ends[1]);
    ::_exit(0);  // without destructors and without flushing the parent's streams
  }
  ::close(ends[1]);
  return {index, pid, ends[0], {}};
}

std::string fate(pid_t pid) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) return fmt::format("the solve was ended by signal {}", WTERMSIG(status));
  return "the solve ended without a result";
}

/// Takes what a child has sent. @return whether it has sent all; its pipe is closed then
bool has_ended(Child& child) {
  char buffer[65536];
  const ssize_t n = ::read(child.pipe, buffer, sizeof buffer);
  if (n < 0 && errno == EINTR) return false;
  if (n > 0) {
    child.received.append(buffer, static_cast<std::size_t>(n));
    return false;
  }
  ::close(child.pipe);
  return true;
}

}  // namespace

std::vector<ChildResult> run_in_children(int count, int at_once,
                                         const std::function<std::string(int)>& work,
                                         const OnDone& on_done) {
  std::vector<ChildResult> results(static_cast<std::size_t>(count));
  if (at_once <= 1 || count == 1) {
    for (int i = 0; i < count; ++i) {
      results[static_cast<std::size_t>(i)] = decode(run_here(work, i), "");
      if (on_done) on_done(i, i + 1, results[static_cast<std::size_t>(i)]);
    }
    return results;
  }
  std::vector<Child> children;
  int next = 0, finished = 0;
  while (finished < count) {
    while (next < count && static_cast<int>(children.size()) < at_once) {
      children.push_back(start_child(work, next++, children));
    }
    std::vector<pollfd> polls;
    polls.reserve(children.size());
    for (const Child& child : children) polls.push_back({child.pipe, POLLIN, 0});
    if (::poll(polls.data(), polls.size(), -1) < 0) continue;
    for (std::size_t i = polls.size(); i-- > 0;) {
      if (polls[i].revents == 0) continue;
      if (!has_ended(children[i])) continue;
      const std::string end = fate(children[i].pid);
      results[static_cast<std::size_t>(children[i].index)] = decode(children[i].received, end);
      const int index = children[i].index;
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
      ++finished;
      if (on_done) on_done(index, finished, results[static_cast<std::size_t>(index)]);
    }
  }
  return results;
}

std::vector<ChildResult> run_until_stopped(const KeptWork& parts, const OnDone& on_done) {
  using Clock = std::chrono::steady_clock;
  std::vector<ChildResult> results(static_cast<std::size_t>(parts.count));
  for (ChildResult& r : results) r.error = "interrupted before it began";
  std::vector<Child> children;
  int next = 0, finished = 0;
  bool stopping = false;
  Clock::time_point patient_until{};
  for (;;) {
    if (!stopping && parts.stop()) {
      stopping = true;
      patient_until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                         std::chrono::duration<double>(parts.patience_s));
    }
    const bool out_of_patience = stopping && Clock::now() >= patient_until;
    if (out_of_patience) {
      for (const Child& child : children) ::kill(child.pid, SIGKILL);
    }
    while (!stopping && next < parts.count &&
           static_cast<int>(children.size()) < std::max(1, parts.at_once)) {
      children.push_back(start_child(parts.work, next++, children));
    }
    if (children.empty()) break;
    std::vector<pollfd> polls;
    polls.reserve(children.size());
    for (const Child& child : children) polls.push_back({child.pipe, POLLIN, 0});
    /// Time between two questions whether to stop.
    /// @threshold [ms] 1..100; chosen: a tenth of the patience at most, and costs nothing
    constexpr int kAskEvery = 20;
    if (::poll(polls.data(), polls.size(), kAskEvery) <= 0) continue;
    for (std::size_t i = polls.size(); i-- > 0;) {
      if (polls[i].revents == 0) continue;
      if (!has_ended(children[i])) continue;
      const std::string end = fate(children[i].pid);
      const int index = children[i].index;
      ChildResult& result = results[static_cast<std::size_t>(index)];
      // What a child had sent when it was ended is torn.
      result = decode(out_of_patience ? std::string() : children[i].received,
                      stopping ? "interrupted" : end);
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
      ++finished;
      if (on_done) on_done(index, finished, result);
    }
  }
  return results;
}

ChildResult run_in_child(const std::function<std::string()>& work,
                         const std::function<bool()>& stop) {
  Child child = start_child([&](int) { return work(); }, 0, {});
  /// Time between two questions whether to stop.
  /// @threshold [ms] 1..1000; chosen: answers within a second, and costs nothing
  constexpr int kAskEvery = 100;
  bool stopped = false;
  for (;;) {
    stopped = stopped || stop();
    if (stopped) ::kill(child.pid, SIGKILL);
    pollfd poll{child.pipe, POLLIN, 0};
    if (::poll(&poll, 1, stopped ? -1 : kAskEvery) <= 0) continue;
    char buffer[65536];
    const ssize_t n = ::read(child.pipe, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    child.received.append(buffer, static_cast<std::size_t>(n));
  }
  ::close(child.pipe);
  const std::string end = fate(child.pid);
  return decode(stopped ? std::string() : child.received, stopped ? "interrupted" : end);
}

int usable_processors() {
  cpu_set_t set;
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

Packer& Packer::number(double value) {
  bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  return *this;
}

Packer& Packer::text(const std::string& value) {
  number(static_cast<double>(value.size()));
  bytes_ += value;
  return *this;
}

Packer& Packer::numbers(const double* values, std::size_t count) {
  number(static_cast<double>(count));
  bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(double));
  return *this;
}

void Unpacker::take(void* out, std::size_t size) {
  SPARFLOW_CHECK(at_ + size <= bytes_->size(), "a child process sent an incomplete result");
  if (size > 0) std::memcpy(out, bytes_->data() + at_, size);
  at_ += size;
}

double Unpacker::number() {
  double value = 0.0;
  take(&value, sizeof value);
  return value;
}

std::string Unpacker::text() {
  std::string value(static_cast<std::size_t>(number()), '\0');
  take(value.data(), value.size());
  return value;
}

std::vector<double> Unpacker::numbers() {
  std::vector<double> values(static_cast<std::size_t>(number()));
  take(values.data(), values.size() * sizeof(double));
  return values;
}

Packer& Packer::matrix(const Eigen::MatrixXd& value) {
  number(static_cast<double>(value.rows())).number(static_cast<double>(value.cols()));
  return numbers(value.data(), static_cast<std::size_t>(value.size()));
}

Eigen::MatrixXd Unpacker::matrix() {
  const auto rows = static_cast<Eigen::Index>(number());
  const auto cols = static_cast<Eigen::Index>(number());
  const std::vector<double> values = numbers();
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows, cols);
}

}  // namespace sparflow
