#pragma once
/// Independent parts of a long run in child processes, each of which stands in a journal as soon as it is complete, so
/// that a run that was ended can be resumed.
#include <functional>
#include <string>
#include <vector>

#include "models/math/journal.h"
#include "optimizer/solve/child_processes.h"

namespace sparflow {

struct KeptWork {
  int count = 0;    ///< of the parts
  int at_once = 1;  ///< as in run_in_children
  /// Name of a part in the journal, whose run fixes their order.
  std::function<std::string(int index)> name;
  std::function<std::string(int index)> work;
  /// Whether a result is complete and may be kept; empty: each is.
  std::function<bool(const std::string& bytes)> complete = {};
  /// Whether to end early; empty: never. Children notice it themselves and give what they have.
  std::function<bool()> stop = {};
  /// Time in which children must have answered after that; those that have not are ended.
  /// @threshold [s] 0..60; chosen: a user who presses Ctrl-C sees an answer at once; most solves end in a tenth of it
  double patience_s = 0.5;
};

/// Number of parts that the journal has.
int finished_before(const KeptWork& parts, const Journal& journal);

/// As run_in_children, but each part in a child, and ended early as the options say. A part that gave nothing has an error.
std::vector<ChildResult> run_until_stopped(const KeptWork& parts, const OnDone& on_done);

/// Takes the parts that the journal has, computes the others in child processes, and keeps them.
/// @param on_done as in run_in_children; the parts of the journal come first, in their order
/// @return the results in the order of the parts
std::vector<ChildResult> run_kept(const KeptWork& parts, Journal& journal,
                                  const OnDone& on_done = {});

}  // namespace sparflow
