#pragma once
/// What every task is given by whoever started it: where warnings and progress go, and whether to stop.
#include <functional>
#include <string>

#include "models/math/work_progress.h"

namespace sparflow {

struct Listener {
  std::function<void(const std::string&)> warn;  ///< whole sentences
  std::function<void(const std::string&)> note;  ///< whole sentences that are no warnings
  WorkProgress progress;                         ///< may be empty
  std::function<bool()> interrupted;             ///< whether to end with what is done; may be empty

  void say_warning(const std::string& sentence) const {
    if (warn) warn(sentence);
  }
  void say_note(const std::string& sentence) const {
    if (note) note(sentence);
  }
  bool stop() const { return interrupted && interrupted(); }
};

}  // namespace sparflow
