#pragma once
/// Assignment problems: which channel takes which meaning so that the sum of scores is largest.
#include <Eigen/Dense>
#include <cstdint>
#include <vector>

namespace sparflow {

/// Solves the assignment problem exactly: each row takes one column of its own, or none.
/// Source: H. W. Kuhn, "The Hungarian method for the assignment problem", Naval Res. Logist. Q. 2 (1955) 83-97, in the form
/// with potentials and shortest augmenting paths (R. Jonker, A. Volgenant, Computing 38 (1987) 325-340). O(rows^2 columns).
/// @param score [rows x columns] finite; a pair of negative score is never taken
/// @param total gets the sum; may be null
/// @return [rows] column, or -1
std::vector<int> best_assignment(const Eigen::MatrixXd& score, double* total = nullptr);

/// A choice of two columns, either of which may be absent (-1).
struct ColumnPair {
  int first = -1, second = -1;
  double score = 0.0;
};

struct PairSet {
  std::vector<ColumnPair> pairs;  ///< one for each group
  double total = 0.0;
};

/// The best pair of each group in turn, the clearest group first.
PairSet greedy_pairs(const std::vector<std::vector<ColumnPair>>& groups);

struct PairSearchOptions {
  /// Pairs that are tried before the search ends with the best sets so far, or the greedy one.
  /// @threshold [1] 1e3..1e8; numerical: tens of milliseconds; the search grows exponentially where many channels are alike
  std::int64_t steps = 50'000;
};

/// The best sets of pairs, one pair from each group, in which no column occurs twice; by branch and bound.
/// @param groups candidates of each group, each of which should hold the empty pair
/// @param count at most so many sets, best first
std::vector<PairSet> best_pair_sets(std::vector<std::vector<ColumnPair>> groups, std::size_t count,
                                    const PairSearchOptions& options = {});

}  // namespace sparflow
