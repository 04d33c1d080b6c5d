#pragma once
/// How far work in child processes is, in memory that they share with the process that waits for them.
#include <atomic>

namespace sparflow {

class ChildProgress {
 public:
  /// @param parts number of parts of the work, at least one; each counts as much as the others
  explicit ChildProgress(int parts);
  ~ChildProgress();
  ChildProgress(const ChildProgress&) = delete;
  ChildProgress& operator=(const ChildProgress&) = delete;
  /// Sets how far a part is, from any process; less than before changes nothing. @param share 0..1
  void set(int part, double share);
  /// A number that means what its user wants, 0 at first: solves that are done, or the part at work.
  std::atomic<int>& step() { return *step_; }
  /// Share of the whole work that is done, which never falls. [1]
  double share() const;

 private:
  int parts_ = 1;
  void* memory_ = nullptr;
  std::atomic<int>* step_ = nullptr;
  std::atomic<double>* shares_ = nullptr;
};

}  // namespace sparflow
