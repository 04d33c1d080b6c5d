#include "apps/cli/console.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>

#include "apps/cli/verbs.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow::cli {
namespace {

/// A line on a terminal is drawn at each look, elsewhere at each fiftieth.
constexpr std::chrono::milliseconds kLookPeriod{200};
constexpr int kLooksAPrint = 50;
/// Longest line of progress.
/// @threshold [byte] 40..200; chosen: fits most terminals
constexpr std::size_t kLine = 107;

/// Carriage returns of the program's own pass; the rest of the line is printable already.
void rewrite_line(const std::string& line) {
  if (::write(STDERR_FILENO, line.data(), line.size()) < 0) return;
}
/// In memory shared with the child processes. A Ctrl-C at a terminal reaches all of them, one sent by another program
/// reaches this process only; therefore only this process counts, and the children read the count.
std::atomic<int>* interrupt_count = nullptr;
static_assert(std::atomic<int>::is_always_lock_free, "used in a signal handler");
volatile std::sig_atomic_t finish_first = 0;
pid_t main_process = 0;
bool stdout_is_taken = false;

/// May interrupt itself: the second Ctrl-C ends the program also while the first one's text waits for a reader.
void on_interrupt(int) {
  if (::getpid() != main_process) return;
  const int before = interrupt_count->fetch_add(1);
  if (before > 0 || finish_first == 0) ::_exit(kInterrupted);
  const int error = errno;
  constexpr char kText[] =
      "\ninterrupted: finishing with the best so far; Ctrl-C again ends at once\n";
  // A reader that has stopped to read (Ctrl-S, a full pipe) must not hold up the answer.
  pollfd out{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&out, 1, 0) > 0 && (out.revents & POLLOUT) != 0 &&
      ::write(STDERR_FILENO, kText, sizeof kText - 1) < 0) {
    errno = error;
    return;
  }
  errno = error;
}

std::string& work() {
  static std::string what = "this command";
  return what;
}

}  // namespace

void catch_interrupts() {
  main_process = ::getpid();
  void* shared = ::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  SPARFLOW_CHECK(shared != MAP_FAILED, "mmap found no memory for the count of interrupts");
  interrupt_count = new (shared) std::atomic<int>(0);
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART | SA_NODEFER;
  ::sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (signal == SIGHUP && before.sa_handler == SIG_IGN) continue;  // nohup
    ::sigaction(signal, &action, nullptr);
  }
}
void finish_on_interrupt() { finish_first = 1; }
bool interrupted() { return interrupt_count->load() > 0; }

void secure_standard_streams() {
  std::signal(SIGPIPE, SIG_IGN);
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // A call that opens gives the lowest free number, which is that of the closed stream.
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", O_RDONLY) < 0) ::_exit(kInternal);
  }
}

void complain(const std::string& text) {
  const std::string safe = harmless(text);
  std::size_t done = 0;
  while (done < safe.size()) {
    const ssize_t n = ::write(STDERR_FILENO, safe.data() + done, safe.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    done += static_cast<std::size_t>(n);
  }
}

void texts_to_stderr() { stdout_is_taken = true; }

void tell(const std::string& text) {
  if (stdout_is_taken) {
    complain(text);
  } else {
    put_out(harmless(text));
  }
}

void put_out(const std::string& text) {
  const bool taken = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (taken && std::fflush(stdout) == 0) return;
  const int reason = errno;
  throw InputError({"standard output", 0, 0}, "",
                   fmt::format("cannot write: {}", std::strerror(reason)));
}

void begin_work(const std::string& what) { work() = what; }
const std::string& current_work() { return work(); }

std::string memory_in_words() {
  struct rlimit limit {};
  const bool limited = ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  if (limited) {
    return fmt::format(" (its limit, ulimit -v, is {:.2g} GB)",
                       static_cast<double>(limit.rlim_cur) / 1e9);
  }
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || size <= 0) return "";
  return fmt::format(" (the machine has {:.2g} GB)",
                     static_cast<double>(pages) * static_cast<double>(size) / 1e9);
}

void warn(const std::string& sentence) {
  complain(fmt::format("warning: {}\n", harmless(sentence, QuoteOptions{}.sentence)));
}
void note(const std::string& sentence) {
  complain(harmless(sentence, QuoteOptions{}.sentence) + "\n");
}

Listener console_listener(WorkProgress progress) {
  return {warn, note, std::move(progress), interrupted};
}

namespace {

/// The mutex of the progress that prints; a process that is forked meanwhile would inherit the allocator's locks as the printing
/// thread holds them, and some allocators (that of AddressSanitizer) do not release them there.
std::atomic<std::mutex*>& printing() {
  static std::atomic<std::mutex*> mutex = nullptr;
  return mutex;
}
thread_local std::mutex* held_by_fork = nullptr;

void hold_printing() {
  held_by_fork = printing();
  if (held_by_fork != nullptr) held_by_fork->lock();
}
void release_printing() {
  if (held_by_fork != nullptr) held_by_fork->unlock();
  held_by_fork = nullptr;
}

}  // namespace

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(::isatty(2) == 1) {
  static const int registered = ::pthread_atfork(hold_printing, release_printing, release_printing);
  if (registered == 0) printing() = &mutex_;
  begin_work(what_);
  if (!terminal_) complain(what_ + " ...\n");
  printer_ = std::jthread([this](const std::stop_token& stop) { print_periodically(stop); });
  // A thread that begins allocates as well: a process is forked only once it waits.
  std::unique_lock lock(mutex_);
  ended_.wait(lock, [this] { return begun_; });
}

void Progress::watch(std::function<Now()> work) {
  const std::lock_guard lock(mutex_);
  watched_ = std::move(work);
}

void Progress::look() {
  if (watched_) {
    Now now = watched_();
    share_ = std::max(share_, now.share);
    doing_ = std::move(now.doing);
  }
  /// Time from which on what is done counts for the forecast.
  /// @threshold [s] 0..10; chosen: parts of a journal are read in it
  constexpr double kCountFrom = 2.0;
  if (first_seconds_ >= 0.0 || elapsed() < kCountFrom) return;
  first_seconds_ = elapsed();
  first_share_ = share_;
}

std::string Progress::left(double seconds) const {
  /// Time and share of the work from which on the rest is forecast.
  /// @threshold [s] 1..60; chosen: earlier forecasts jump
  constexpr double kForecastFrom = 5.0;
  /// @threshold [1] 0.01..0.5; chosen: less says nothing about the rest
  constexpr double kForecastShare = 0.05;
  const double gained = share_ - first_share_;
  if (first_seconds_ < 0.0 || seconds < kForecastFrom || gained < kForecastShare || share_ >= 1.0)
    return "";
  return fmt::format(", about {:.0f} s left", (seconds - first_seconds_) * (1.0 - share_) / gained);
}

void Progress::print_periodically(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  begun_ = true;
  ended_.notify_all();
  int looks = 0;
  while (!ended_.wait_for(lock, stop, kLookPeriod, [&] { return stop.stop_requested(); })) {
    look();
    if (terminal_) {
      draw();
      continue;
    }
    if (++looks % kLooksAPrint != 0) continue;
    const double seconds = elapsed();
    complain(fmt::format("{}: {:.0f} s, {:.0f} %{}{}{}\n", what_, seconds, 100.0 * share_,
                         left(seconds), doing_.empty() ? "" : ", ", doing_));
  }
}

double Progress::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

Progress::~Progress() {
  printing() = nullptr;
  printer_.request_stop();
  printer_.join();
  if (terminal_ && width_ > 0) rewrite_line(fmt::format("\r{:{}}\r", "", width_));
}

void Progress::draw() {
  const double seconds = elapsed();
  const std::string line = printable(fmt::format("{} {:3.0f} %  {:.0f} s{}  {}", what_,
                                                 100.0 * share_, seconds, left(seconds), doing_),
                                     kLine);
  rewrite_line(fmt::format("\r{:{}}", line, std::max(width_, line.size())));
  width_ = line.size();
}

void Progress::operator()(double share, const std::string& what) {
  const std::lock_guard lock(mutex_);
  share_ = std::max(share_, share);  // work that is found on the way is no step back
  doing_ = what;
  if (!terminal_ || (share < 1.0 && std::abs(share_ - last_) < 0.005)) return;
  last_ = share_;
  draw();
}

}  // namespace sparflow::cli
