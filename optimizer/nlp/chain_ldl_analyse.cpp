// Analysis of a pattern: elimination order, fronts and storage.
#include <algorithm>
#include <cmath>

#include "models/math/error.h"
#include "optimizer/nlp/chain_ldl.h"
#include "optimizer/nlp/chain_ldl_kernel.h"
#include "optimizer/nlp/chain_ldl_order.h"

namespace sparflow {
namespace {

std::size_t place_at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

struct ChainLdl::Tree {
  std::vector<detail::FrontNodes> fronts;
  std::vector<std::vector<int>> member;  ///< unknowns of every position
};

ChainLdl::ChainLdl(int order, const std::vector<int>& row, const std::vector<int>& column,
                   const double* value)
    : order_(order), row_(row), column_(column) {
  SPARFLOW_CHECK(order > 0 && row.size() == column.size(), "a place has a row and a column");
  const detail::Graph graph = detail::graph_of(order, row, column);
  std::vector<int> group = pair_up(value);
  const int groups = 1 + *std::max_element(group.begin(), group.end());
  const detail::Graph coarse = detail::quotient(graph, group, groups);
  const std::vector<int> position = detail::elimination_order(coarse);
  std::vector<int> weight(place_at(groups), 0);
  Tree tree;
  tree.member.resize(place_at(groups));
  for (int i = 0; i < order; ++i) {
    ++weight[place_at(group[place_at(i)])];
    tree.member[place_at(position[place_at(group[place_at(i)])])].push_back(i);
  }
  tree.fronts = detail::fronts_of(coarse, position, weight);
  make_fronts(tree);
}

bool ChainLdl::same_pattern(int order, int entries, const int* row, const int* column,
                            int base) const {
  if (order != order_ || place_at(entries) != row_.size()) return false;
  for (std::size_t e = 0; e < row_.size(); ++e) {
    if (row[e] - base != row_[e] || column[e] - base != column_[e]) return false;
  }
  return true;
}

/// Pairs each row with zero diagonal (a constraint), which cannot be a pivot on its own, with the free neighbour that has
/// the fewest couplings (a slack for its row, an acceleration for its defect).
/// @return group of every unknown
std::vector<int> ChainLdl::pair_up(const double* value) const {
  struct Coupling {
    int other;
    double value;
  };
  std::vector<double> diagonal(place_at(order_), 0.0), largest(place_at(order_), 0.0);
  std::vector<int> degree(place_at(order_), 0);
  for (std::size_t e = 0; e < row_.size(); ++e) {
    const int i = row_[e], j = column_[e];
    const double size = std::abs(value[e]);
    largest[place_at(i)] = std::max(largest[place_at(i)], size);
    largest[place_at(j)] = std::max(largest[place_at(j)], size);
    if (i == j) {
      diagonal[place_at(i)] += value[e];
    } else {
      ++degree[place_at(i)];
      ++degree[place_at(j)];
    }
  }
  /// Diagonal entry below which a row is a constraint.
  /// @threshold [1] 1e-12..1e-2; numerical: Ipopt's regularisation of constraints is 1e-8
  constexpr double kNoDiagonal = 1e-6;
  /// Coupling, as share of the largest of its row, below which it is no partner of a pivot.
  /// @threshold [1] 1e-6..0.1; chosen: such a pair would be a bad pivot
  constexpr double kWeak = 1e-3;
  std::vector<std::vector<Coupling>> couplings(place_at(order_));
  std::vector<int> constraints;
  for (int i = 0; i < order_; ++i) {
    if (std::abs(diagonal[place_at(i)]) > kNoDiagonal * largest[place_at(i)]) continue;
    constraints.push_back(i);
    couplings[place_at(i)].reserve(place_at(degree[place_at(i)]));
  }
  for (std::size_t e = 0; e < row_.size(); ++e) {
    const int i = row_[e], j = column_[e];
    if (i == j) continue;
    if (couplings[place_at(i)].capacity() > 0)
      couplings[place_at(i)].push_back({j, std::abs(value[e])});
    if (couplings[place_at(j)].capacity() > 0)
      couplings[place_at(j)].push_back({i, std::abs(value[e])});
  }
  std::stable_sort(constraints.begin(), constraints.end(),
                   [&](int a, int b) { return degree[place_at(a)] < degree[place_at(b)]; });
  std::vector<int> partner(place_at(order_), -1);
  for (const int i : constraints) {
    if (partner[place_at(i)] >= 0) continue;
    const Coupling* best = nullptr;
    for (const Coupling& c : couplings[place_at(i)]) {
      if (partner[place_at(c.other)] >= 0 || c.value < kWeak * largest[place_at(i)] ||
          c.value == 0.0)
        continue;
      if (best == nullptr || degree[place_at(c.other)] < degree[place_at(best->other)] ||
          (degree[place_at(c.other)] == degree[place_at(best->other)] && c.value > best->value)) {
        best = &c;
      }
    }
    if (best == nullptr) continue;
    partner[place_at(i)] = best->other;
    partner[place_at(best->other)] = i;
  }
  std::vector<int> group(place_at(order_), -1);
  int groups = 0;
  for (int i = 0; i < order_; ++i) {
    if (group[place_at(i)] >= 0) continue;
    group[place_at(i)] = groups;
    if (partner[place_at(i)] >= 0) group[place_at(partner[place_at(i)])] = groups;
    ++groups;
  }
  return group;
}

/// Storage that a factorisation needs if no pivot is delayed.
struct ChainLdl::Storage {
  long factor = 0;        ///< entries of the panels of L
  long most_waiting = 0;  ///< entries of the contributions that wait at the same time
  int most_rows = 0;      ///< rows of the largest front
};

/// Sets the fronts, the indices at which contributions and values are added, and the storage needed.
void ChainLdl::make_fronts(const Tree& tree) {
  fronts_.resize(tree.fronts.size());
  place_unknowns(tree);
  place_entries();
  place_contributions();
  reserve(predicted_storage());
}

/// Sets every front's parent and its unknowns, own first.
void ChainLdl::place_unknowns(const Tree& tree) {
  rows_.reserve(4 * place_at(order_));
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    front.first_row = static_cast<int>(rows_.size());
    front.parent = tree.fronts[f].parent;
    if (front.parent >= 0) ++fronts_[place_at(front.parent)].children;
    for (const int position : tree.fronts[f].own) {
      const std::vector<int>& member = tree.member[place_at(position)];
      rows_.insert(rows_.end(), member.begin(), member.end());
      front.own += static_cast<int>(member.size());
    }
    for (const int position : tree.fronts[f].updated) {
      const std::vector<int>& member = tree.member[place_at(position)];
      rows_.insert(rows_.end(), member.begin(), member.end());
    }
    front.rows = static_cast<int>(rows_.size()) - front.first_row;
  }
}

/// Places of a front's unknowns in it; those of other unknowns keep the former front's.
void ChainLdl::set_places(const Front& front, std::vector<int>& place) const {
  for (int k = 0; k < front.rows; ++k) place[place_at(rows_[place_at(front.first_row + k)])] = k;
}

/// Each value is assembled in the front in which the first of its two unknowns is eliminated.
void ChainLdl::place_entries() {
  std::vector<int> front_of(place_at(order_)), place(place_at(order_), -1);
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    for (int k = 0; k < fronts_[f].own; ++k)
      front_of[place_at(rows_[place_at(fronts_[f].first_row + k)])] = static_cast<int>(f);
  }
  std::vector<std::vector<int>> entries(fronts_.size());
  for (std::size_t e = 0; e < row_.size(); ++e) {
    const int f = std::min(front_of[place_at(row_[e])], front_of[place_at(column_[e])]);
    entries[place_at(f)].push_back(static_cast<int>(e));
  }
  entry_.reserve(row_.size());
  entry_row_.reserve(row_.size());
  entry_column_.reserve(row_.size());
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    set_places(fronts_[f], place);
    fronts_[f].first_entry = static_cast<int>(entry_.size());
    for (const int e : entries[f]) {
      const int r = place[place_at(row_[place_at(e)])], c = place[place_at(column_[place_at(e)])];
      entry_.push_back(e);
      entry_row_.push_back(std::max(r, c));
      entry_column_.push_back(std::min(r, c));
    }
  }
}

/// Indices of a front's updated rows in its parent.
void ChainLdl::place_contributions() {
  std::vector<int> place(place_at(order_), -1);
  place_.reserve(rows_.size());
  first_place_.resize(fronts_.size());
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    first_place_[f] = static_cast<int>(place_.size());
    const Front& front = fronts_[f];
    if (front.parent < 0) continue;
    set_places(fronts_[place_at(front.parent)], place);
    for (int k = front.own; k < front.rows; ++k)
      place_.push_back(place[place_at(rows_[place_at(front.first_row + k)])]);
  }
}

/// Also counts the operations and sets the statistics.
ChainLdl::Storage ChainLdl::predicted_storage() {
  Storage storage;
  long waiting = 0;
  // Storage of the contributions that a front takes from the stack.
  std::vector<long> from_below(fronts_.size(), 0);
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    const long below = front.rows - front.own;
    waiting += below * below - from_below[f];
    storage.most_waiting = std::max(storage.most_waiting, waiting);
    if (front.parent >= 0) from_below[place_at(front.parent)] += below * below;
    storage.factor += static_cast<long>(detail::ldl_padded(front.rows)) * front.own;
    storage.most_rows = std::max(storage.most_rows, front.rows);
    for (int k = 0; k < front.own; ++k) {
      const double rest = front.rows - k;
      statistics_.multiply_adds += 0.5 * rest * (rest + 1.0);
      statistics_.factor_entries += front.rows - k - 1;
    }
  }
  statistics_.order = order_;
  statistics_.fronts = static_cast<int>(fronts_.size());
  statistics_.largest_front = storage.most_rows;
  return storage;
}

/// Half of the predicted storage is reserved in addition, for delayed pivots.
void ChainLdl::reserve(const Storage& storage) {
  /// Entries reserved for delayed pivots in any case.
  /// @threshold [entries] 0..1e6; chosen: half of a tiny matrix is less than one front
  constexpr std::size_t kSpare = 4096;
  factor_.resize(place_at(static_cast<int>(storage.factor)) * 3 / 2 + kSpare);
  index_.resize(rows_.size() * 3 / 2 + kSpare);
  waiting_value_.resize(static_cast<std::size_t>(storage.most_waiting) * 3 / 2 + kSpare);
  waiting_index_.resize(kSpare);
  waiting_.reserve(fronts_.size());
  const int stride = detail::ldl_stride(storage.most_rows + storage.most_rows / 2);
  work_.resize(place_at(stride) * place_at(stride));
  product_.resize(place_at(stride) * place_at(stride));
  unknown_.resize(place_at(stride));
  local_.resize(place_at(stride));
  scale_.resize(place_at(order_));
  largest_.resize(place_at(order_));
  pivot_.resize(2 * place_at(order_));
  width_.resize(place_at(order_));
}

}  // namespace sparflow
