#pragma once
/// Independent pieces of work on all processors.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace sparflow {

/// work(0) ... work(count - 1), each once, in no order; returns when all are done. Where one throws, no further piece is
/// begun, and the exception leaves this function.
/// @param threads at most; 0: one for each processor, eight at most
template <class F>
void parallel(std::size_t count, const F& work, int threads = 0) {
  const unsigned int wanted = threads > 0 ? static_cast<unsigned int>(threads)
                                          : std::clamp(std::thread::hardware_concurrency(), 1U, 8U);
  std::atomic<std::size_t> next = 0;
  std::exception_ptr thrown;
  std::mutex mutex;
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!thrown) thrown = std::current_exception();
        next = count;
      }
    }
  };
  {
    std::vector<std::jthread> pool;
    pool.reserve(wanted);
    for (unsigned int t = 0; t < std::min<std::size_t>(count, wanted); ++t) pool.emplace_back(run);
  }  // joins
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace sparflow
