#include "optimizer/grid/energy_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <unordered_set>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/grid/energy_grid_graph.h"
#include "optimizer/grid/energy_grid_timing.h"
#include "optimizer/grid/simplify_path.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoPath = std::numeric_limits<double>::infinity();

double elapsed_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

class EnergyGrid::Search {
 public:
  Search(const CraneModel& model, const MotionProblem& problem, const EnergyGridOptions& options)
      : model_(model), problem_(problem), n_(model.machine.joint_count()) {
    const auto begin = std::chrono::steady_clock::now();
    if (n_ > options.most_joints) {
      trouble_ = fmt::format("a grid over {} joints has too many nodes (at most {} joints)", n_,
                             options.most_joints);
    } else if (problem.tip_line) {
      trouble_ = "a grid cannot follow a tip line";
    } else {
      graph_.emplace(model, problem, options.nodes);
      trouble_ = graph_->trouble();
      clear_.assign(static_cast<std::size_t>(nodes()), 0);
      if (!problem.obstacles.empty()) clearance_ = std::make_unique<ClearanceModel>(problem);
    }
    spent_ = elapsed_since(begin);
  }

  GridPath cheapest(double price) {
    const auto begin = std::chrono::steady_clock::now();
    GridPath path = trouble_.empty() ? search(price) : GridPath{};
    if (!trouble_.empty()) path.message = trouble_;
    spent_ += elapsed_since(begin);
    return path;
  }

  /// All distinct paths found while the price is bisected for `duration`, with their energies when timed to it.
  std::vector<std::pair<double, GridPath>> for_duration(double duration) {
    std::vector<std::pair<double, GridPath>> found;
    const auto offer = [&](double price) {
      GridPath path = cheapest(price);
      const bool fast = path.found && path.duration_s <= duration * (1.0 + 1e-9);
      if (!path.found) return std::pair{false, path.message};
      /// Distance up to which two paths have the same corners.
      /// @threshold [rad or m] 0..1e-3; numerical: rounding; corners are nodes
      constexpr double kSameCorners = 1e-6;
      const bool known = std::any_of(found.begin(), found.end(), [&](const auto& other) {
        return other.second.corners.rows() == path.corners.rows() &&
               (other.second.corners - path.corners).cwiseAbs().maxCoeff() < kSameCorners;
      });
      if (!known) {
        const auto begin = std::chrono::steady_clock::now();
        const double energy =
            fast ? exact_total_energy(model_, timed_grid_path(model_, problem_, path, duration),
                                      problem_.payload, 4)
                 : kNoPath;
        found.emplace_back(energy, std::move(path));
        spent_ += elapsed_since(begin);
      }
      return std::pair{fast, std::string()};
    };
    const auto [enough, trouble] = offer(0.0);
    if (!trouble.empty()) {
      GridPath none;
      none.message = trouble;
      found.emplace_back(kNoPath, none);
      return found;
    }
    // The bracket reaches from almost no price of time to far above the pumps' full power. Ramps and corners are only
    // approximately contained in the graph's times, so the path at the highest price need not be the fastest.
    double lo = 10.0, hi = 1e6;
    if (!enough) {
      /// Price of time below which no fast path is looked for any more.
      /// @threshold [W] 1..1e6; chosen: below 10 kW time is cheap beside the power of a pump
      constexpr double kLowestFirstPrice = 1e4;
      bool fast = false;
      for (; !fast && hi > kLowestFirstPrice; hi /= fast ? 1.0 : 3.0) fast = offer(hi).first;
      if (!fast) return found;
    }
    /// Halvings of the price's logarithm.
    /// @threshold [1] 3..30; derived: five decades in nine halvings: two per cent
    constexpr int kSteps = 9;
    for (int step = 0; step < kSteps; ++step) {
      const double middle = std::sqrt(lo * hi);
      (offer(middle).first ? hi : lo) = middle;
      /// Halvings before the search may end with enough paths.
      /// @threshold [1] 1..9; chosen: an eighth of the five decades
      constexpr int kLeastSteps = 3;
      if (enough && step >= kLeastSteps)
        break;  // the cheapest path is fast enough: a few alternatives suffice
    }
    return found;
  }

  long nodes() const { return graph_ ? graph_->lattice().nodes : 0; }
  double spent() const { return spent_; }

 private:
  bool node_clear(long node) {
    if (!clearance_) return true;
    char& state = clear_[static_cast<std::size_t>(node)];
    if (state == 0) state = clearance_->clear(graph_->lattice().posture(node).data()) ? 1 : 2;
    return state == 1 || node == start_node();
  }
  long start_node() const { return graph_->lattice().nearest_node(problem_.start); }

  struct RawPath {
    bool found = false;
    MatrixXd points;
    std::vector<std::uint64_t> edges;  // node * steps + step, of each grid move
    std::size_t end = 0;
    double cost = 0.0;
  };

  /// Whether the line of a move is clear. @param move node * steps + step
  bool move_clear(std::uint64_t move, long from, long to) {
    if (checked_.empty())
      checked_.assign(static_cast<std::size_t>(nodes()) * graph_->steps().size(), 0);
    char& state = checked_[move];
    if (state == 0) {
      const VectorXd a = graph_->lattice().posture(from), b = graph_->lattice().posture(to);
      state = clearance_->motion_clear(a.data(), b.data()) ? 1 : 2;
    }
    return state == 1;
  }

  /// Whether the line of a last move is clear; one that is not is blocked.
  bool end_clear(std::size_t e) {
    const VectorXd from = graph_->lattice().posture(graph_->ends()[e].end.node);
    const bool clear = clearance_->motion_clear(from.data(), graph_->ends()[e].end.q.data());
    if (!clear) blocked_ends_.insert(e);
    return clear;
  }

  /// @param check_moves whether every move is checked for clearance before it is used
  RawPath dijkstra(double price, bool check_moves) {
    const std::vector<MoveGraph::Step>& steps = graph_->steps();
    const std::size_t count = steps.size();
    std::vector<double> cost(static_cast<std::size_t>(nodes()), kNoPath);
    std::vector<std::uint64_t> came(static_cast<std::size_t>(nodes()), 0);
    using Entry = std::pair<double, long>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    const long start = start_node();
    cost[static_cast<std::size_t>(start)] = 0.0;
    open.emplace(0.0, start);
    double best = kNoPath;
    std::size_t best_end = 0;
    std::vector<int> line(static_cast<std::size_t>(n_));
    while (!open.empty()) {
      const auto [so_far, node] = open.top();
      open.pop();
      const auto from = static_cast<std::size_t>(node);
      if (so_far > cost[from]) continue;
      if (so_far >= best) break;
      if (const std::vector<std::size_t>* ends = graph_->ends_at(node); ends != nullptr) {
        for (const std::size_t e : *ends) {
          if (blocked_ends_.contains(e)) continue;
          const double total = so_far + std::min(graph_->ends()[e].together.at_price(price),
                                                 graph_->ends()[e].each.at_price(price));
          if (!(total < best)) continue;
          if (clearance_ && check_moves && !end_clear(e)) continue;
          best = total;
          best_end = e;
        }
      }
      graph_->lines_of(node, line);
      for (std::size_t s = 0; s < count; ++s) {
        if (!graph_->inside(line, steps[s])) continue;
        const long next = node + steps[s].delta;
        const auto to = static_cast<std::size_t>(next);
        const double through = so_far + graph_->move(from * count + s).at_price(price);
        if (!(through < cost[to])) continue;
        if (clearance_ && (blocked_.contains(from * count + s) || !node_clear(next))) continue;
        if (clearance_ && check_moves && !move_clear(from * count + s, node, next)) continue;
        cost[to] = through;
        came[to] = from * count + s;
        open.emplace(through, next);
      }
    }
    RawPath raw;
    if (!std::isfinite(best)) return raw;
    raw.found = true;
    raw.cost = best;
    raw.end = best_end;
    long node = graph_->ends()[best_end].end.node;
    std::vector<long> nodes = {node};
    while (node != start) {
      const std::uint64_t edge = came[static_cast<std::size_t>(node)];
      raw.edges.push_back(edge);
      node = static_cast<long>(edge / count);
      nodes.push_back(node);
    }
    std::reverse(nodes.begin(), nodes.end());
    std::reverse(raw.edges.begin(), raw.edges.end());
    raw.points.resize(static_cast<Eigen::Index>(nodes.size()) + 1, n_);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      raw.points.row(static_cast<Eigen::Index>(k)) =
          graph_->lattice().posture(nodes[k]).transpose();
    }
    raw.points.row(0) = problem_.start.transpose();
    raw.points.bottomRows(1) = graph_->ends()[best_end].end.q.transpose();
    return raw;
  }

  /// Blocks the moves of a path that meet an obstacle. @return whether there are any
  bool block(const RawPath& raw) {
    if (!clearance_) return false;
    bool any = false;
    const auto meets = [&](Eigen::Index k) {
      const VectorXd a = raw.points.row(k), b = raw.points.row(k + 1);
      return !clearance_->motion_clear(a.data(), b.data());
    };
    for (std::size_t k = 0; k < raw.edges.size(); ++k) {
      if (!meets(static_cast<Eigen::Index>(k))) continue;
      blocked_.insert(raw.edges[k]);
      any = true;
    }
    if (meets(raw.points.rows() - 2)) {
      blocked_ends_.insert(raw.end);
      any = true;
    }
    return any;
  }

  GridPath search(double price) {
    GridPath path;
    path.price_W = price;
    /// Searches in which only the moves of the path found are checked; afterwards every move is before it is used.
    /// @threshold [1] 0..1e4; chosen: few collisions are found faster by checking paths alone, many by checking moves,
    /// each of which is checked once
    constexpr int kChecksOfPaths = 20;
    RawPath raw;
    for (int tries = 0; tries == 0 || (raw.found && block(raw)); ++tries) {
      raw = dijkstra(price, tries >= kChecksOfPaths);
    }
    if (!raw.found) {
      path.message = "no path of the grid reaches the goal clear of the obstacles";
      return path;
    }
    finish(raw, price, path);
    return path;
  }

  void finish(const RawPath& raw, double price, GridPath& path) {
    LegSearch legs;
    legs.price = price;
    legs.part.resize(n_);
    double ramp = 0.0;
    for (int j = 0; j < n_; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const Range& q = problem_.limits.position[i];
      legs.part[j] = std::max((q.hi - q.lo) / 24.0, 1e-9);
      const Range& a = problem_.limits.acceleration[i];
      ramp = std::max(ramp, problem_.limits.velocity[i].hi / std::min(a.hi, -a.lo));
    }
    // A corner costs a ramp's time, and at least the error of the energy on so coarse a grid.
    /// Cost of a corner as share of the path's energy.
    /// @threshold [1] 0..0.1; chosen: at least the error of the energy on so coarse a grid
    constexpr double kCoarseness = 1e-3;
    legs.leg_penalty = kCoarseness * raw.cost + price * std::min(ramp, 2.0);
    if (clearance_) {
      legs.clear = [this](const VectorXd& a, const VectorXd& b) {
        return clearance_->motion_clear(a.data(), b.data());
      };
    }
    Legs chosen = simplify_path(graph_->pricer(), straight_runs(raw.points), legs);
    // A long straight run is tested at other postures than its moves were.
    if (chosen.refused > 0 && clearance_)
      chosen = simplify_path(graph_->pricer(), raw.points, legs);
    path.found = true;
    path.corners = chosen.corners;
    path.slow_energy_J = chosen.slow_energy;
    path.modes = leg_modes(model_.machine, path.corners);
    path.leg_durations = shortest_leg_durations(model_, problem_, path.corners);
    path.duration_s = path.leg_durations.sum();
    if (path.leg_durations.size() > 0) {
      path.energy_J = exact_total_energy(
          model_, timed_grid_path(model_, problem_, path, path.duration_s), problem_.payload, 4);
    }
  }

  /// Removes points that lie on a straight line between their neighbours.
  static MatrixXd straight_runs(const MatrixXd& points) {
    std::vector<Eigen::Index> kept = {0};
    /// Difference of two unit directions up to which there is no corner.
    /// @threshold [1] 0..1e-6; numerical: rounding
    constexpr double kStraightOn = 1e-9;
    for (Eigen::Index k = 1; k + 1 < points.rows(); ++k) {
      const VectorXd a = (points.row(k) - points.row(k - 1)).transpose();
      const VectorXd b = (points.row(k + 1) - points.row(k)).transpose();
      if (b.norm() == 0.0 || a.norm() == 0.0 ||
          (a.normalized() - b.normalized()).norm() > kStraightOn) {
        kept.push_back(k);
      }
    }
    kept.push_back(points.rows() - 1);
    MatrixXd out(static_cast<Eigen::Index>(kept.size()), points.cols());
    for (std::size_t k = 0; k < kept.size(); ++k) {
      out.row(static_cast<Eigen::Index>(k)) = points.row(kept[k]);
    }
    return out;
  }

  const CraneModel& model_;
  const MotionProblem& problem_;
  int n_;
  std::string trouble_;
  double spent_ = 0.0;
  std::optional<MoveGraph> graph_;  // none: trouble_ says why
  std::unique_ptr<ClearanceModel> clearance_;
  std::vector<char> clear_;    // by node: 0 not checked, 1 clear, 2 in collision
  std::vector<char> checked_;  // by move, the same
  std::unordered_set<std::uint64_t> blocked_;
  std::unordered_set<std::size_t> blocked_ends_;
};

EnergyGrid::EnergyGrid(const CraneModel& model, const MotionProblem& problem,
                       const EnergyGridOptions& options)
    : search_(std::make_unique<Search>(model, problem, options)) {}
EnergyGrid::~EnergyGrid() = default;

GridPath EnergyGrid::cheapest_path(double price) { return search_->cheapest(price); }

GridPath EnergyGrid::path_for_duration(double duration) {
  return paths_for_duration(duration, 1).front();
}

std::vector<GridPath> EnergyGrid::paths_for_duration(double duration, int most) {
  std::vector<std::pair<double, GridPath>> found = search_->for_duration(duration);
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    if (std::isinf(a.first) && std::isinf(b.first))
      return a.second.duration_s < b.second.duration_s;
    return a.first < b.first;
  });
  std::vector<GridPath> paths;
  for (auto& [energy, path] : found) {
    if (static_cast<int>(paths.size()) >= std::max(most, 1)) break;
    if (!paths.empty() && std::isinf(energy)) break;
    paths.push_back(std::move(path));
  }
  return paths;
}

long EnergyGrid::nodes() const { return search_->nodes(); }
double EnergyGrid::seconds() const { return search_->spent(); }

}  // namespace sparflow
