#include "simulator/controllers/foreign_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "models/machine/linkage.h"
#include "simulator/controllers/goal_posture.h"

namespace sparflow::control {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

/// Longest line that is read.
/// @threshold [bytes] 1000..1e8; chosen: an answer has some numbers; a program that writes without end is stopped
constexpr std::size_t kLongestLine = 1 << 20;

/// Part of a wrong answer that the message quotes.
/// @threshold [bytes] 10..1000; chosen: enough to recognise it
constexpr std::size_t kQuoted = 60;

/// End of what a process writes to its standard error that is kept for the sentence on its failure.
/// @threshold [bytes] 100..1e6; chosen: an error message and its last line
constexpr std::size_t kLastErrors = 4096;

/// What is printable of a text; of a longer one its begin.
std::string quoted(const std::string& text, std::size_t longest) {
  std::string out;
  for (const char c : text.substr(0, longest)) out += c >= ' ' && c <= '~' ? c : '?';
  return out;
}

/// The standard error of a child process: what arrives goes on to that of this process, and its end is kept.
class ErrorPipe {
 public:
  ErrorPipe() {
    if (::pipe2(ends_, O_CLOEXEC | O_NONBLOCK) != 0)
      throw ControllerFailure("its process could not be started: no pipe");
    ::fcntl(ends_[1], F_SETFL, 0);  // a child does not expect that writing fails
  }
  ~ErrorPipe() {
    close(0);
    close(1);
  }
  ErrorPipe(const ErrorPipe&) = delete;
  ErrorPipe& operator=(const ErrorPipe&) = delete;

  void use_in_child() const { ::dup2(ends_[1], 2); }
  void started() { close(1); }
  int readable() const { return ends_[0]; }  ///< -1 once it has ended
  void drain() {
    char bytes[4096];
    while (ends_[0] >= 0) {
      const ssize_t n = ::read(ends_[0], bytes, sizeof bytes);
      if (n > 0) {
        const auto count = static_cast<std::size_t>(n);
        last_.append(bytes, count);
        last_.erase(0, last_.size() - std::min(last_.size(), kLastErrors));
        if (::write(2, bytes, count) < 0) continue;  // nobody listens
      } else if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) {
        close(0);
      } else if (errno != EINTR) {
        return;
      }
    }
  }
  /// "; its last message: ..." with the last line that is not empty; "" without one.
  std::string words() {
    drain();
    const std::size_t end = last_.find_last_not_of(" \t\r\n");
    if (end == std::string::npos) return "";
    const std::size_t before = last_.find_last_of('\n', end);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    return "; its last message: " + quoted(last_.substr(first, end + 1 - first), 3 * kQuoted);
  }

 private:
  void close(int end) {
    if (ends_[end] >= 0) ::close(ends_[end]);
    ends_[end] = -1;
  }
  int ends_[2] = {-1, -1};
  std::string last_;
};

/// A child process with one socket for its input and output, and a pipe for its messages.
class Child {
 public:
  explicit Child(const std::string& command) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw ControllerFailure("its process could not be started: no socket");
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ == 0) {
      ::setpgid(0, 0);
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (::getppid() != parent) ::_exit(127);
      ::dup2(ends[1], 0);
      ::dup2(ends[1], 1);
      errors_.use_in_child();
      ::signal(SIGPIPE, SIG_DFL);
      ::signal(SIGINT, SIG_IGN);
      ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      ::_exit(127);
    }
    ::close(ends[1]);
    errors_.started();
    socket_ = ends[0];
    if (pid_ < 0) {
      ::close(socket_);
      throw ControllerFailure("its process could not be started");
    }
    ::setpgid(pid_, pid_);  // here too, as it is not known which of the two comes first
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  }
  ~Child() {
    ::close(socket_);
    ::kill(-pid_, SIGKILL);
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Writes a line and reads one, within a time [s].
  std::string ask(const std::string& line, double budget, double t) {
    const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                     std::chrono::duration<double>(budget));
    const std::string text = line + "\n";
    for (std::size_t sent = 0; sent < text.size();) {
      const ssize_t n = ::send(socket_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
      if (n > 0) {
        sent += static_cast<std::size_t>(n);
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        wait(POLLOUT, end, budget, t);
      } else if (errno != EINTR) {
        break;  // it has ended; what it wrote before tells more than that
      }
    }
    while (true) {
      const std::size_t stop = buffer_.find('\n');
      if (stop != std::string::npos) {
        std::string answer = buffer_.substr(0, stop);
        buffer_.erase(0, stop + 1);
        return answer;
      }
      if (buffer_.size() > kLongestLine)
        throw ControllerFailure(fmt::format(
            "its process wrote a line of more than {} bytes at t = {:.2f} s", kLongestLine, t));
      char bytes[4096];
      const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
      if (n > 0) {
        buffer_.append(bytes, static_cast<std::size_t>(n));
      } else if (n == 0 || errno == ECONNRESET) {
        throw ControllerFailure(gone(t));
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        wait(POLLIN, end, budget, t);
      } else if (errno != EINTR) {
        throw ControllerFailure(gone(t));
      }
    }
  }

 private:
  void wait(short what, Clock::time_point end, double budget, double t) {
    while (true) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
      pollfd p[] = {{socket_, what, 0}, {errors_.readable(), POLLIN, 0}};
      if (left.count() <= 0 || ::poll(p, 2, static_cast<int>(left.count()) + 1) == 0)
        throw ControllerFailure(
            fmt::format("its process gave no answer within {:g} s at t = {:.2f} s{}", budget, t,
                        errors_.words()));
      if (p[1].revents != 0) errors_.drain();
      if (p[0].revents != 0) return;
    }
  }

  std::string gone(double t) {
    const std::string how = end_of_process(t);
    return how + errors_.words();
  }

  /// How it ended; a moment is given to a process that is just ending.
  std::string end_of_process(double t) const {
    int status = 0;
    for (int k = 0; k < 50; ++k) {  // no threshold: half a second in all
      siginfo_t info{};
      if (::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
          info.si_pid == pid_) {
        status = info.si_status;
        return info.si_code == CLD_EXITED
                   ? fmt::format("its process ended with code {} at t = {:.2f} s", status, t)
                   : fmt::format("its process was ended by signal {} at t = {:.2f} s", status, t);
      }
      ::usleep(10000);
    }
    return fmt::format("its process closed its output at t = {:.2f} s", t);
  }

  ErrorPipe errors_;
  pid_t pid_ = -1;
  int socket_ = -1;
  std::string buffer_;
};

class Asked : public Controller {
 public:
  Asked(const Knowledge& knowledge, std::string who, Ask ask)
      : know_(knowledge), who_(std::move(who)), ask_(std::move(ask)) {}

  void begin(const Task& task, const Measurement& now) override {
    const Machine& m = *know_.machine;
    json j;
    j["type"] = "task";
    j["t_s"] = now.t;
    j["goal"] = {{"tip_m", {task.tip.x(), task.tip.y(), task.tip.z()}}};
    const Eigen::VectorXd goal = goal_posture(m, task, now.q);
    for (std::size_t k = 0; k < m.joints.size(); ++k)
      j["goal"]["q"][m.joints[k].name] = goal[static_cast<Eigen::Index>(k)];
    for (int c = 0; c < m.cylinder_count(); ++c) {
      const Cylinder& drive = m.cylinders[static_cast<std::size_t>(c)];
      j["goal"]["length_m"][drive.name] = cylinder_length(m, c, goal[drive.joint]);
      json& valve = j["valves"][drive.name];
      for (const bool extend : {true, false}) {
        const double full = know_.valves->full_speed(c, extend);
        valve[extend ? "extend_m_s" : "retract_m_s"] = full;
        // the lever at a hundredth of the full speed is the dead band and a hundredth of the rest
        const double lever = std::abs(know_.valves->lever(c, extend ? 0.01 * full : -0.01 * full));
        valve[extend ? "dead_extend" : "dead_retract"] = std::max(0.0, (lever - 0.01) / 0.99);
      }
    }
    j["duration_s"] = task.duration;
    j["tolerance_m"] = task.tolerance;
    j["sample_time_s"] = know_.sample_time;
    j["machine"] = m.source_text;
    const json answer = ask(j, now.t);
    if (answer.value("type", "") != "ready")
      fail("answered a task with something else than {\"type\": \"ready\"}", answer.dump(), now.t);
  }

  std::vector<double> step(const Measurement& now) override {
    const Machine& m = *know_.machine;
    json j;
    j["type"] = "state";
    j["t_s"] = now.t;
    for (std::size_t k = 0; k < m.joints.size(); ++k) {
      j["q"][m.joints[k].name] = now.q[static_cast<Eigen::Index>(k)];
      j["qd"][m.joints[k].name] = now.qd[static_cast<Eigen::Index>(k)];
    }
    for (int c = 0; c < m.cylinder_count(); ++c) {
      const auto k = static_cast<std::size_t>(c);
      const Cylinder& drive = m.cylinders[k];
      j["length_m"][drive.name] = cylinder_length(m, c, now.q[drive.joint]);
      if (!drive.hydraulic()) continue;
      j["pA_bar"][drive.name] = now.pressure_bore[k] / 1e5;
      j["pB_bar"][drive.name] = now.pressure_rod[k] / 1e5;
    }
    for (std::size_t p = 0; p < m.pumps.size(); ++p)
      j["p_bar"][m.pumps[p].name] = now.pump_pressure[p] / 1e5;
    j["payload_kg"] = now.payload;
    j["oil_C"] = now.oil;
    const json answer = ask(j, now.t);
    std::vector<double> u(m.cylinders.size(), 0.0);
    const auto commands = answer.find("u");
    if (commands == answer.end() || !commands->is_object())
      fail("gave no commands {\"u\": {CYLINDER: lever}}", answer.dump(), now.t);
    for (const auto& [name, value] : commands->items()) {
      const int c = m.cylinder_index(name);
      if (c < 0) fail("named a cylinder that the machine does not have", name, now.t);
      if (!value.is_number()) fail("gave a command that is no number", value.dump(), now.t);
      u[static_cast<std::size_t>(c)] = value.get<double>();
    }
    return u;
  }

 private:
  [[noreturn]] void fail(const std::string& what, const std::string& found, double t) const {
    throw ControllerFailure(
        fmt::format("{} {} at t = {:.2f} s: {}", who_, what, t, quoted(found, kQuoted)));
  }

  json ask(const json& message, double t) const {
    const std::string line = ask_(message.dump(-1, ' ', false, json::error_handler_t::replace), t);
    json answer = json::parse(line, nullptr, false);
    if (!answer.is_object()) fail("printed a line that is no JSON object", line, t);
    return answer;
  }

  Knowledge know_;
  std::string who_;
  Ask ask_;
};

}  // namespace

std::unique_ptr<Controller> asked_controller(const Knowledge& knowledge, const std::string& who,
                                             const Ask& ask) {
  return std::make_unique<Asked>(knowledge, who, ask);
}

std::unique_ptr<Controller> foreign_controller(const Knowledge& knowledge,
                                               const std::string& command,
                                               const ForeignOptions& options) {
  const auto child = std::make_shared<Child>(command);
  return asked_controller(
      knowledge, "its process",
      [child, options, started = false](const std::string& line, double t) mutable {
        std::string answer =
            child->ask(line, started ? options.step_budget : options.start_budget, t);
        started = true;
        return answer;
      });
}

}  // namespace sparflow::control
