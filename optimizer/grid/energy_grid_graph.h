#pragma once
/// The graph in which energy_grid.h searches: a lattice of joint positions, straight moves between neighbouring nodes and from
/// nodes onto the goal set, and what each costs. Obstacles are left to the search.
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "models/chain/crane_model.h"
#include "optimizer/grid/energy_grid_goal.h"
#include "optimizer/grid/energy_grid_lattice.h"
#include "optimizer/grid/energy_grid_moves.h"

namespace sparflow {

/// Refers to model and problem.
class MoveGraph {
 public:
  /// The move from a node to one of its neighbours.
  struct Step {
    std::vector<int> by;  ///< number of lines by joint, signed
    long delta = 0;       ///< difference of the nodes' numbers
  };
  /// The last move, from a node near the goal set onto it, with all joints together or in sequence.
  struct PricedEnd {
    GoalEnd end;
    MoveCost together, each;
  };

  /// @param nodes approximate number of them
  MoveGraph(const CraneModel& model, const MotionProblem& problem, int nodes);

  /// Why there is no graph; empty: there is one.
  const std::string& trouble() const { return trouble_; }

  const Lattice& lattice() const { return lattice_; }
  /// To all neighbours of a node in the middle of the lattice.
  const std::vector<Step>& steps() const { return steps_; }
  /// Number of a move among all nodes' moves.
  std::uint64_t move_number(long node, std::size_t step) const {
    return static_cast<std::uint64_t>(node) * steps_.size() + step;
  }
  /// @param number move_number()
  const MoveCost& move(std::uint64_t number) const { return moves_[number]; }
  const std::vector<PricedEnd>& ends() const { return ends_; }
  /// Indices into ends() of those that begin at a node; null when there is none.
  const std::vector<std::size_t>* ends_at(long node) const {
    const auto found = ends_at_.find(node);
    return found == ends_at_.end() ? nullptr : &found->second;
  }
  MovePricer& pricer() { return *pricer_; }

  /// Whether a step leads from these lines to a node of the lattice.
  bool inside(const std::vector<int>& line, const Step& step) const {
    for (std::size_t j = 0; j < line.size(); ++j) {
      const int to = line[j] + step.by[j];
      if (to < 0 || to >= lattice_.lines[j].size()) return false;
    }
    return true;
  }
  /// Sets the numbers of a node's lines. @param line one for each joint
  void lines_of(long node, std::vector<int>& line) const {
    for (int j = 0; j < n_; ++j) line[static_cast<std::size_t>(j)] = lattice_.line(node, j);
  }

 private:
  std::vector<int> cells_by_axis(int wanted) const;
  bool force_varies(int joint, int probes) const;
  void make_steps();
  void price_moves();
  void price_ends();

  const MotionProblem& problem_;
  std::shared_ptr<const Machine> loaded_;  // with the masses of the model's effects
  int n_;
  std::string trouble_;
  Lattice lattice_;
  LatticeForces forces_;
  std::unique_ptr<MovePricer> pricer_;
  std::vector<Step> steps_;
  std::vector<MoveCost> moves_;  // [nodes x steps]
  std::vector<PricedEnd> ends_;
  std::unordered_map<long, std::vector<std::size_t>> ends_at_;
};

}  // namespace sparflow
