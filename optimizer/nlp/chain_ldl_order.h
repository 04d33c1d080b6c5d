#pragma once
/// Order of elimination of a sparse symmetric matrix and the fronts that follow from it. Private to ChainLdl.
#include <vector>

namespace sparflow::detail {

/// An undirected graph without loops; neighbours of i are neighbour[first[i] .. first[i + 1]), sorted.
struct Graph {
  std::vector<int> first, neighbour;
  int size() const { return static_cast<int>(first.size()) - 1; }
  int degree(int i) const {
    return first[static_cast<std::size_t>(i) + 1] - first[static_cast<std::size_t>(i)];
  }
};

Graph graph_of(int size, const std::vector<int>& row, const std::vector<int>& column);

/// Quotient graph of groups. @param group number of every node's group, 0 .. groups-1
Graph quotient(const Graph& graph, const std::vector<int>& group, int groups);

/// Position of every node: nodes coupled to a large part of all come last, the others by approximate minimum degree.
std::vector<int> elimination_order(const Graph& graph);

/// One front: nodes eliminated together, and the later ones they reach.
struct FrontNodes {
  int parent = -1;
  std::vector<int> own, updated;  ///< positions in the order, rising
};

/// Fronts in postorder (every front directly follows its children), small ones merged with their parent where that is
/// estimated to be faster. @param position of every node in the elimination order  @param weight rows of every node
std::vector<FrontNodes> fronts_of(const Graph& graph, const std::vector<int>& position,
                                  const std::vector<int>& weight);

}  // namespace sparflow::detail
