#pragma once
/// How far long work is, told by whoever does it.
#include <functional>
#include <string>

namespace sparflow {

/// Called with the share of the work that is done, 0..1 and never less than before, and words for what was finished.
using WorkProgress = std::function<void(double share, const std::string& what)>;

/// Progress of a part that takes the whole from one share to another; empty where the whole's is empty.
/// @param whole copied  @param from share of the whole before the part [1]  @param to share after it [1]
inline WorkProgress part_of(const WorkProgress& whole, double from, double to) {
  if (!whole) return {};
  return [whole, from, to](double share, const std::string& what) {
    whole(from + (to - from) * share, what);
  };
}

}  // namespace sparflow
