#include "optimizer/nlp/chain_ldl_order.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

namespace sparflow::detail {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// A front under construction: rows eliminated in it and rows only updated.
struct Growing {
  std::vector<int> own, updated;  // positions
  int own_rows = 0, updated_rows = 0;
  bool merged = false;  // into its parent
};

/// Estimated cost of a front in multiply-adds. The overhead of a front (index lists, assembly, loops too short to
/// vectorise) was tuned on the motions' KKT systems: with a larger or smaller value they become slower.
double front_cost(int own, int updated) {
  /// Overhead of a front.
  /// @threshold [multiply-adds] 0..1e5; tuned: on the motions' KKT systems
  constexpr double kFront = 300.0;
  /// Overhead of a row.
  /// @threshold [multiply-adds] 0..1000; tuned: on the motions' KKT systems
  constexpr double kRow = 12.0;
  /// Cost of an entry that is assembled.
  /// @threshold [multiply-adds] 0..100; tuned: on the motions' KKT systems
  constexpr double kAssembled = 2.0;
  double sum = kFront + kRow * (own + updated) + kAssembled * 0.5 * updated * (updated + 1);
  for (int k = 0; k < own; ++k) {
    const double below = own + updated - k;
    sum += 0.5 * below * (below + 1.0);
  }
  return sum;
}

}  // namespace

Graph graph_of(int size, const std::vector<int>& row, const std::vector<int>& column) {
  std::vector<int> count(at(size) + 1, 0);
  for (std::size_t e = 0; e < row.size(); ++e) {
    if (row[e] == column[e]) continue;
    ++count[at(row[e]) + 1];
    ++count[at(column[e]) + 1];
  }
  std::partial_sum(count.begin(), count.end(), count.begin());
  std::vector<int> all(at(count.back())), next(count.begin(), count.end() - 1);
  for (std::size_t e = 0; e < row.size(); ++e) {
    if (row[e] == column[e]) continue;
    all[at(next[at(row[e])]++)] = column[e];
    all[at(next[at(column[e])]++)] = row[e];
  }
  Graph graph;
  graph.first.assign(1, 0);
  graph.first.reserve(at(size) + 1);
  graph.neighbour.reserve(all.size());
  for (int i = 0; i < size; ++i) {
    const auto begin = all.begin() + count[at(i)], end = all.begin() + count[at(i) + 1];
    std::sort(begin, end);
    graph.neighbour.insert(graph.neighbour.end(), begin, std::unique(begin, end));
    graph.first.push_back(static_cast<int>(graph.neighbour.size()));
  }
  return graph;
}

Graph quotient(const Graph& graph, const std::vector<int>& group, int groups) {
  std::vector<int> row, column;
  row.reserve(graph.neighbour.size());
  column.reserve(graph.neighbour.size());
  for (int i = 0; i < graph.size(); ++i) {
    for (int e = graph.first[at(i)]; e < graph.first[at(i) + 1]; ++e) {
      const int j = graph.neighbour[at(e)];
      if (j > i) continue;
      row.push_back(group[at(i)]);
      column.push_back(group[at(j)]);
    }
  }
  return graph_of(groups, row, column);
}

std::vector<int> elimination_order(const Graph& graph) {
  const int size = graph.size();
  std::vector<int> position(at(size), -1);
  // Nodes of the border are ordered last at once, because otherwise their couplings would count in every degree. A posture
  // with very many rows of its own (clearances) does not belong to it: its share of all unknowns is that of one knot.
  /// Number of couplings from which a node belongs to the border.
  /// @threshold [couplings] 1..1000; chosen: unknowns of a knot couple with some twenty
  constexpr double kLeast = 48.0;
  /// The same as share of all unknowns.
  /// @threshold [1] 0..1; chosen: a posture with very many rows of its own (clearances) has the share of one knot
  constexpr double kShare = 0.05;
  const double many = std::max(kLeast, kShare * size);
  std::vector<int> border, inner(at(size), -1), node;
  for (int i = 0; i < size; ++i) {
    if (graph.degree(i) > many) {
      border.push_back(i);
    } else {
      inner[at(i)] = static_cast<int>(node.size());
      node.push_back(i);
    }
  }
  if (2 * border.size() > at(size)) {  // a dense matrix, not a chain
    std::iota(position.begin(), position.end(), 0);
    return position;
  }
  std::sort(border.begin(), border.end(), [&](int a, int b) {
    return std::make_pair(graph.degree(a), a) < std::make_pair(graph.degree(b), b);
  });
  using Triplet = Eigen::Triplet<double, int>;
  std::vector<Triplet> place;
  place.reserve(graph.neighbour.size() + node.size());
  for (std::size_t k = 0; k < node.size(); ++k) {
    place.emplace_back(static_cast<int>(k), static_cast<int>(k), 1.0);
    for (int e = graph.first[at(node[k])]; e < graph.first[at(node[k]) + 1]; ++e) {
      const int j = inner[at(graph.neighbour[at(e)])];
      if (j >= 0) place.emplace_back(j, static_cast<int>(k), 1.0);
    }
  }
  const int inside = static_cast<int>(node.size());
  Eigen::SparseMatrix<double> matrix(inside, inside);
  matrix.setFromTriplets(place.begin(), place.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(matrix.selfadjointView<Eigen::Lower>(), permutation);
  for (int k = 0; k < inside; ++k) position[at(node[at(permutation.indices()[k])])] = k;
  for (std::size_t b = 0; b < border.size(); ++b)
    position[at(border[b])] = inside + static_cast<int>(b);
  return position;
}

std::vector<FrontNodes> fronts_of(const Graph& graph, const std::vector<int>& position,
                                  const std::vector<int>& weight) {
  const int size = graph.size();
  std::vector<int> node(at(size));
  for (int i = 0; i < size; ++i) node[at(position[at(i)])] = i;
  std::vector<Growing> front(at(size));
  std::vector<int> parent(at(size), -1), mark(at(size), -1);
  std::vector<std::vector<int>> children(at(size));
  const auto rows = [&](int k) { return weight[at(node[at(k)])]; };
  for (int k = 0; k < size; ++k) {  // elimination tree, and the later nodes that each node updates
    Growing& f = front[at(k)];
    f.own = {k};
    f.own_rows = rows(k);
    mark[at(k)] = k;
    const auto reach = [&](int j) {
      if (j <= k || mark[at(j)] == k) return;
      mark[at(j)] = k;
      f.updated.push_back(j);
      f.updated_rows += rows(j);
    };
    for (int e = graph.first[at(node[at(k)])]; e < graph.first[at(node[at(k)]) + 1]; ++e)
      reach(position[at(graph.neighbour[at(e)])]);
    for (const int c : children[at(k)]) {
      for (const int j : front[at(c)].updated) reach(j);
    }
    std::sort(f.updated.begin(), f.updated.end());
    if (f.updated.empty()) continue;
    parent[at(k)] = f.updated.front();
    children[at(f.updated.front())].push_back(k);
  }
  for (int k = 0; k < size;
       ++k) {  // merging: children have smaller positions, so they are decided already
    Growing& f = front[at(k)];
    std::vector<int> kept;
    const std::vector<int> candidates = std::move(children[at(k)]);
    for (auto c = candidates.rbegin(); c != candidates.rend(); ++c) {
      Growing& child = front[at(*c)];
      const double apart =
          front_cost(child.own_rows, child.updated_rows) + front_cost(f.own_rows, f.updated_rows);
      if (front_cost(child.own_rows + f.own_rows, f.updated_rows) <= apart) {
        f.own.insert(f.own.end(), child.own.begin(), child.own.end());
        f.own_rows += child.own_rows;
        child.merged = true;
        kept.insert(kept.end(), children[at(*c)].begin(), children[at(*c)].end());
      } else {
        kept.push_back(*c);
      }
    }
    children[at(k)] = std::move(kept);
    std::sort(f.own.begin(), f.own.end());
  }
  std::vector<FrontNodes> result;
  result.reserve(at(size));
  std::vector<int> number(at(size), -1);
  std::vector<std::pair<int, std::size_t>> path;  // front and the next of its children, depth first
  for (int root = 0; root < size; ++root) {
    if (parent[at(root)] >= 0) continue;
    path.emplace_back(root, 0);
    while (!path.empty()) {
      auto& [k, next] = path.back();
      if (next < children[at(k)].size()) {
        const int child = children[at(k)][next++];
        path.emplace_back(child, 0);
        continue;
      }
      number[at(k)] = static_cast<int>(result.size());
      for (const int c : children[at(k)]) result[at(number[at(c)])].parent = number[at(k)];
      result.push_back({-1, std::move(front[at(k)].own), std::move(front[at(k)].updated)});
      path.pop_back();
    }
  }
  return result;
}

}  // namespace sparflow::detail
