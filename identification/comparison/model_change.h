#pragma once
/// What a change of the model did to each quantity on one set of logs, for headline, colours, terminal and JSON alike.
/// error_change.h decides whether a change is kept; this says to a reader what became better and what became worse.
#include <string>
#include <vector>

#include "identification/comparison/error_ranking.h"

namespace sparflow {

struct CompareResult;
struct Machine;

struct ModelChangeOptions {
  /// Factor by which an RMS error must move to count as changed.
  /// @threshold [1] 1..1.2; chosen: learning a pressure model anew moves its centres and length scales, and errors by that much
  double moves = 1.02;
  /// Growth of the unexplained share (error_ranking.h) from which a larger error is worse, and likewise for better.
  /// @threshold [1] 0..0.1; chosen: for an energy this is ErrorChangeOptions::energy_moves, two in a thousand of it; the
  /// change of a pressure that is as good as its sensor before and after stays below
  double share_moves = 0.02;
  /// Number of quantities that a sentence names; the others are counted.
  /// @threshold [quantities] 1..20; chosen: a headline that can be read at once
  std::size_t most_named = 3;
};

enum class ChangeKind { kWorse, kSame, kBetter };
const char* change_word(ChangeKind kind);  ///< "worse", "unchanged", "better"

/// One quantity, or the energy of a pump, before and after.
struct QuantityChange {
  RankedError before, after;
  ChangeKind kind = ChangeKind::kSame;
  /// "working pressure of main retracting 3.19 -> 12.1 bar"
  std::string text;
};

struct ModelChange {
  std::vector<QuantityChange> quantities;  ///< largest growth of the unexplained share first
  double overall = 1.0;                    ///< RMS error after / before, as ErrorChange::overall
  bool energy_compared = false;
  std::size_t most_named = 3;  ///< that of the options

  std::vector<const QuantityChange*> of(ChangeKind kind) const;
  /// Good only when forces, pressures and energies are all better, or good already, and nothing is worse. Poor when the
  /// errors are larger overall, or when nothing is better and something worse.
  Grade grade() const;
  /// "-42.0 % overall; worse: energy of pump main -9.00 -> -27.00 %, ...": the change, and every time what became worse.
  std::string sentence() const;
};

/// @param before, after on the same samples
ModelChange model_change(const Machine& machine, const CompareResult& before,
                         const CompareResult& after, const ModelChangeOptions& options = {});

}  // namespace sparflow
