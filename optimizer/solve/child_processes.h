#pragma once
/// Independent solves in child processes, because the linear solver is not thread-safe (MUMPS keeps module variables).
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace sparflow {

struct ChildResult {
  bool ok = false;
  std::string bytes;  ///< return value of the work
  std::string
      error;  ///< why there is no result: an exception's text, or the signal that ended the child
};

using OnDone = std::function<void(int index, int finished, const ChildResult& result)>;

/// Runs work(0) .. work(count-1), at most `at_once` at a time, each in a forked child that returns its result through a
/// pipe. No child outlives this process. With at_once <= 1 or count == 1 everything runs in this process.
/// @param on_done called in this process as results arrive, with (index, number finished so far, result); must not throw
std::vector<ChildResult> run_in_children(int count, int at_once,
                                         const std::function<std::string(int)>& work,
                                         const OnDone& on_done = {});

/// Runs `work` in a forked child until it is done or `stop` says so (asked ten times a second), which ends the child.
ChildResult run_in_child(const std::function<std::string()>& work,
                         const std::function<bool()>& stop);

/// Number of processors this process may use.
int usable_processors();

/// Binary packing of results for the pipe; the same program must read it.
class Packer {
 public:
  Packer& number(double value);
  Packer& text(const std::string& value);
  Packer& numbers(const double* values, std::size_t count);
  Packer& matrix(const Eigen::MatrixXd& value);
  std::string bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes) : bytes_(&bytes) {}
  double number();
  std::string text();
  std::vector<double> numbers();
  Eigen::MatrixXd matrix();

 private:
  void take(void* out, std::size_t size);
  const std::string* bytes_;
  std::size_t at_ = 0;
};

}  // namespace sparflow
