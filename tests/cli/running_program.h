#pragma once
/// The program at work in the background, for tests that interrupt it or watch what it tells.
#include <signal.h>

#include <chrono>
#include <cstdio>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "tests/cli/cli_fixture.h"

namespace sparflow::test {

/// The program in the background, in a process group of its own like that of a shell.
class Running {
 public:
  /// @param err file for its messages; or, with `err_fd`, an open file descriptor
  Running(const std::vector<std::string>& arguments, const std::string& out, const std::string& err,
          int err_fd = -1)
      : pid_(::fork()) {
    if (pid_ != 0) return;
    ::setpgid(0, 0);
    if (std::freopen(out.c_str(), "w", stdout) == nullptr) ::_exit(99);
    if (err_fd >= 0) {
      if (::dup2(err_fd, STDERR_FILENO) < 0) ::_exit(99);
    } else if (std::freopen(err.c_str(), "w", stderr) == nullptr) {
      ::_exit(99);
    }
    std::vector<char*> argv;
    std::vector<std::string> words = arguments;
    words.insert(words.begin(), kProgram);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    ::execv(kProgram.c_str(), argv.data());
    ::_exit(99);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (pid_ > 0 && !ended_) {
      ::kill(-pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
  }
  pid_t pid() const { return pid_; }
  /// Waits at most this many seconds. @return the exit code, -1 when the program has not ended
  int wait(double seconds) {
    for (int k = 0; k < 20.0 * seconds && !ended_; ++k) {
      int status = 0;
      if (::waitpid(pid_, &status, WNOHANG) == pid_) {
        ended_ = true;
        code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    return ended_ ? code_ : -1;
  }
  /// Counts the processes of its group that still run (zombies do not count).
  int alive() const {
    int count = 0;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      const std::string stat = slurp(entry.path() / "stat");
      const std::size_t behind_name = stat.rfind(')');
      if (behind_name == std::string::npos) continue;
      std::istringstream fields(stat.substr(behind_name + 1));
      char state = ' ';
      int parent = 0, group = 0;
      fields >> state >> parent >> group;
      count += group == pid_ && state != 'Z' && state != 'X';
    }
    return count;
  }

 private:
  pid_t pid_ = -1;
  bool ended_ = false;
  int code_ = -1;
};

/// Waits until a file contains a match. @return whether it did in time
inline bool comes(const std::string& path, const std::regex& pattern, double seconds) {
  for (int k = 0; k < 10.0 * seconds; ++k) {
    if (std::regex_search(slurp(path), pattern)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

/// Waits until a file contains this text. @return whether it did in time
inline bool comes(const std::string& path, const std::string& text, double seconds) {
  for (int k = 0; k < 10.0 * seconds; ++k) {
    if (slurp(path).find(text) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

}  // namespace sparflow::test
