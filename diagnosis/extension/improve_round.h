#pragma once
/// A round of `improve` as it stands in a journal: what was decided, from which the rest is computed again in a fraction of
/// the time, because neither a diagnosis nor the test of what stayed is repeated. Used by improve.cpp only.
#include <optional>
#include <string>
#include <vector>

#include "models/math/journal.h"

namespace sparflow {

struct ImproveRound {
  std::vector<std::string> wanted;   ///< keys of the effects that were estimated together
  std::vector<std::string> removed;  ///< keys of those that were not kept, in that order
  std::vector<std::string> notes;    ///< whole sentences on those that were
};

/// The round of this number, from one on, that an earlier run has made; empty where the journal has none or is null.
std::optional<ImproveRound> round_of(const Journal* journal, int number);

/// Writes a round to the journal; null: nothing is kept.
void keep_round(Journal* journal, int number, const ImproveRound& round);

}  // namespace sparflow
