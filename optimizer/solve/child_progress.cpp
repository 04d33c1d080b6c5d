#include "optimizer/solve/child_progress.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <new>

#include "models/math/error.h"

namespace sparflow {
namespace {

static_assert(std::atomic<double>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a lock would be of one process only");

/// Size of the step, with the room that the shares' alignment asks for. [bytes]
constexpr std::size_t kHead = alignof(std::max_align_t);

std::size_t size_of(int parts) {
  return kHead + static_cast<std::size_t>(parts) * sizeof(std::atomic<double>);
}

}  // namespace

ChildProgress::ChildProgress(int parts) : parts_(std::max(1, parts)) {
  memory_ =
      ::mmap(nullptr, size_of(parts_), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  SPARFLOW_CHECK(memory_ != MAP_FAILED, "mmap found no memory for the progress of child processes");
  step_ = new (memory_) std::atomic<int>(0);
  shares_ = reinterpret_cast<std::atomic<double>*>(static_cast<std::byte*>(memory_) + kHead);
  for (int i = 0; i < parts_; ++i) new (shares_ + i) std::atomic<double>(0.0);
}

ChildProgress::~ChildProgress() { ::munmap(memory_, size_of(parts_)); }

void ChildProgress::set(int part, double share) {
  SPARFLOW_CHECK(part >= 0 && part < parts_, "no such part");
  std::atomic<double>& known = shares_[part];
  const double now = std::clamp(share, 0.0, 1.0);
  double before = known.load();
  while (now > before && !known.compare_exchange_weak(before, now)) {
  }
}

double ChildProgress::share() const {
  double sum = 0.0;
  for (int i = 0; i < parts_; ++i) sum += shares_[i].load();
  return sum / parts_;
}

}  // namespace sparflow
