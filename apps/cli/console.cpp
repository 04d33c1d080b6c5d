#include "apps/cli/console.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <new>

#include "apps/cli/verbs.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

constexpr std::chrono::seconds kPrintPeriod{10};
/// In memory shared with the child processes. A Ctrl-C at a terminal reaches all of them, one sent by another program
/// reaches this process only; therefore only this process counts, and the children read the count.
std::atomic<int>* interrupt_count = nullptr;
static_assert(std::atomic<int>::is_always_lock_free, "used in a signal handler");
volatile std::sig_atomic_t finish_first = 0;
pid_t main_process = 0;

void on_interrupt(int) {
  if (::getpid() != main_process) return;
  const int before = interrupt_count->fetch_add(1);
  if (before > 0 || finish_first == 0) ::_exit(kInterrupted);
  constexpr char kText[] =
      "\ninterrupted: finishing with the best so far; Ctrl-C again ends at once\n";
  if (::write(2, kText, sizeof kText - 1) < 0) return;
}

}  // namespace

void catch_interrupts() {
  main_process = ::getpid();
  void* shared = ::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  SPARFLOW_CHECK(shared != MAP_FAILED, "mmap found no memory for the count of interrupts");
  interrupt_count = new (shared) std::atomic<int>(0);
  std::signal(SIGINT, on_interrupt);
}
void finish_on_interrupt() { finish_first = 1; }
bool interrupted() { return interrupt_count->load() > 0; }

void warn(const std::string& sentence) { fmt::print(stderr, "warning: {}\n", sentence); }
void note(const std::string& sentence) { fmt::print(stderr, "{}\n", sentence); }

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(::isatty(2) == 1) {
  if (terminal_) return;
  fmt::print(stderr, "{} ...\n", what_);
  printer_ = std::jthread([this](const std::stop_token& stop) { print_periodically(stop); });
}

void Progress::print_periodically(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, stop, kPrintPeriod, [&] { return stop.stop_requested(); })) {
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    fmt::print(stderr, "{}: {:.0f} s, {:.0f} %{}{}\n", what_, seconds, 100.0 * share_,
               doing_.empty() ? "" : ", ", doing_);
  }
}

Progress::~Progress() {
  if (terminal_ && width_ > 0) fmt::print(stderr, "\r{:{}}\r", "", width_);
}

void Progress::operator()(double share, const std::string& what) {
  if (!terminal_) {
    const std::lock_guard lock(mutex_);
    share_ = share;
    doing_ = what;
    return;
  }
  if (share < 1.0 && std::abs(share - last_) < 0.005) return;
  last_ = share;
  const std::string line =
      fmt::format("{} {:3.0f} %  {}", what_, 100.0 * share, what).substr(0, 110);
  fmt::print(stderr, "\r{:{}}", line, std::max(width_, line.size()));
  std::fflush(stderr);
  width_ = line.size();
}

}  // namespace sparflow::cli
