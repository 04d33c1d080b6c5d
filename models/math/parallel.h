#pragma once
/// Runs independent tasks on several processors.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace sparflow {

/// Calls work(0) ... work(count - 1), each once and in no fixed order, and returns when all are done. `work` must not
/// throw.
template <class F>
void parallel(std::size_t count, const F& work) {
  std::atomic<std::size_t> next = 0;
  const auto threads =
      std::min<std::size_t>(count, std::clamp(std::thread::hardware_concurrency(), 1U, 8U));
  std::vector<std::jthread> pool;
  pool.reserve(threads);
  for (std::size_t t = 0; t < threads; ++t) {
    pool.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    });
  }
}

}  // namespace sparflow
