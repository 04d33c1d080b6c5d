#pragma once
/// What a verb tells while it works, on stderr: warnings, progress; and interruption by Ctrl-C.
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "apps/tasks/task.h"

namespace sparflow::cli {

/// Progress on stderr. On a terminal it rewrites one line, at least every second; elsewhere (a file, a job's log) it prints a
/// plain line at the beginning and one every ten seconds, also while nothing new is reported, to show that the work goes on.
/// The share never goes back; from some seconds on the time left is forecast from it. What was done in the first two seconds
/// does not count there, because a journal of an earlier run gives much at once.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void operator()(double share, const std::string& what);
  /// How far work is that is done elsewhere, and words for what is at work.
  struct Now {
    double share = 0.0;  ///< 0..1
    std::string doing;
  };
  /// Asks for that whenever a line is printed. @param work must not use this object
  void watch(std::function<Now()> work);

 private:
  void print_periodically(const std::stop_token& stop);
  void draw();
  void look();                             ///< asks what is watched
  double elapsed() const;                  ///< [s]
  std::string left(double seconds) const;  ///< ", about 12 s left", or ""

  std::string what_;
  bool terminal_ = false;
  std::size_t width_ = 0;
  double last_ = -1.0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< guards all but what_, terminal_ and begin_
  double share_ = 0.0;
  std::string doing_;
  double first_seconds_ = -1.0,
         first_share_ = 0.0;  ///< from which the rest is forecast; < 0: not yet
  std::function<Now()> watched_;
  bool begun_ = false;  ///< printer_ waits
  std::condition_variable_any ended_;
  std::jthread printer_;  ///< declared last, so that it ends before the members that it uses
};

/// Lets Ctrl-C (SIGINT), SIGTERM and SIGHUP end the program with exit code 130 from now on.
void catch_interrupts();
/// Lets the first Ctrl-C only set interrupted() from now on, so that the verb finishes with the best result so far;
/// the second ends the program at once, also while the first is still being answered.
void finish_on_interrupt();
/// True once Ctrl-C was pressed, in child processes too.
bool interrupted();

/// Opens /dev/null for reading in place of standard streams that are closed, so that no file of the program takes their
/// place and what is written to them fails instead; a reader that goes away ends no run.
void secure_standard_streams();
/// Writes text to stderr, harmless for a terminal. A full or closed stderr is no reason to end: then it is lost.
void complain(const std::string& text);
/// Writes a result to stdout, harmless for a terminal. @throws InputError when stdout takes it no more
void tell(const std::string& text);
/// Lets tell() write to stderr from now on, because standard output belongs to a file's content.
void texts_to_stderr();
/// Writes a file's content to stdout as it is. @throws InputError when stdout takes it no more
void put_out(const std::string& text);

/// Says what the program is at, for the case that memory ends. Progress says it too.
void begin_work(const std::string& what);
const std::string& current_work();
/// " (16 GB are free, of which a limit allows 2 GB)", or "" when that is not known
std::string memory_in_words();

/// Prints "warning: " and the sentence on stderr.
void warn(const std::string& sentence);
/// Prints the sentence on stderr.
void note(const std::string& sentence);
/// Lets a task warn and note on stderr and end by Ctrl-C.
Listener console_listener(WorkProgress progress = {});

}  // namespace sparflow::cli
