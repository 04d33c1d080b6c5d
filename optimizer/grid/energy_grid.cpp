#include "optimizer/grid/energy_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>
#include <unordered_set>

#include "models/effects/effective_machine.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/grid/energy_grid_goal.h"
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
      : model_(model),
        problem_(problem),
        loaded_(effective_machine(model.machine, model.effects)),
        n_(model.machine.joint_count()) {
    const auto begin = std::chrono::steady_clock::now();
    if (n_ > options.most_joints) {
      trouble_ = fmt::format("a grid over {} joints has too many nodes (at most {} joints)", n_,
                             options.most_joints);
    } else if (problem.tip_line) {
      trouble_ = "a grid cannot follow a tip line";
    } else {
      build(options.nodes);
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

  long nodes() const { return lattice_.nodes; }
  double spent() const { return spent_; }

 private:
  struct Step {
    std::vector<int> by;  // number of lines by joint, signed
    long delta = 0;
  };

  void build(int wanted) {
    const std::vector<VectorXd> ends = anchor_postures(problem_, *loaded_);
    if (ends.empty()) {
      trouble_ = "no posture within the limits puts the tip at its goal";
      return;
    }
    const std::vector<int> cells = cells_by_axis(wanted);
    std::vector<VectorXd> lines;
    for (int j = 0; j < n_; ++j) {
      std::vector<double> on_line = {problem_.start[j]};
      for (const VectorXd& end : ends) on_line.push_back(end[j]);
      lines.push_back(axis_lines(problem_.limits.position[static_cast<std::size_t>(j)], on_line,
                                 cells[static_cast<std::size_t>(j)]));
    }
    lattice_ = Lattice(std::move(lines));
    forces_ = lattice_forces(*loaded_, lattice_, problem_.payload);
    pricer_ = std::make_unique<MovePricer>(model_, problem_, *loaded_, forces_.range);
    if (!problem_.obstacles.empty()) clearance_ = std::make_unique<ClearanceModel>(problem_);
    clear_.assign(static_cast<std::size_t>(lattice_.nodes), 0);
    make_steps();
    price_moves();
    price_ends();
  }

  /// Distributes the lines to the axes along which forces vary; the other axes get a few.
  std::vector<int> cells_by_axis(int wanted) const {
    /// Positions of each axis at which forces are compared.
    /// @threshold [1] 3..50; chosen: a force that varies does so over the whole range
    constexpr int kProbe = 5;
    /// Cells of an axis along which no force varies.
    /// @threshold [cells] 1..20; chosen: collisions and corners still need some
    constexpr int kFew = 4;
    std::vector<bool> varies(static_cast<std::size_t>(n_), false);
    int many = 0;
    for (int j = 0; j < n_; ++j) {
      varies[static_cast<std::size_t>(j)] = force_varies(j, kProbe);
      if (varies[static_cast<std::size_t>(j)]) ++many;
    }
    double left = wanted;
    for (int j = many; j < n_; ++j) left /= kFew + 2;
    const int each =
        many > 0 ? std::max(4, static_cast<int>(std::pow(left, 1.0 / many)) - 3) : kFew;
    std::vector<int> cells;
    cells.reserve(varies.size());
    for (int j = 0; j < n_; ++j) {
      cells.push_back(varies[static_cast<std::size_t>(j)] ? each : kFew);
    }
    return cells;
  }

  bool force_varies(int joint, int probes) const {
    StaticForce statics(*loaded_);
    VectorXd q = problem_.start;
    VectorXd lo, hi, all;
    for (int shift = 0; shift < probes; ++shift) {
      for (int j = 0; j < n_; ++j) {
        const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
        q[j] = r.lo + (r.hi - r.lo) * ((shift * (j + 2)) % probes + 0.5) / probes;
      }
      for (int k = 0; k < probes; ++k) {
        const Range& r = problem_.limits.position[static_cast<std::size_t>(joint)];
        q[joint] = r.lo + (r.hi - r.lo) * k / (probes - 1);
        statics.update(q.data(), problem_.payload, 0);
        const VectorXd& f = statics.force();
        lo = k == 0 ? f : lo.cwiseMin(f).eval();
        hi = k == 0 ? f : hi.cwiseMax(f).eval();
        all = all.size() == 0 ? f.cwiseAbs().eval() : all.cwiseMax(f.cwiseAbs()).eval();
      }
      for (int c = 0; c < lo.size(); ++c) {
        // A cylinder's own force also varies with its linkage.
        /// Variation of a force, as share of the largest, from which it varies along an axis.
        /// @threshold [1] 0..0.1; chosen: a smaller one changes no energy visibly
        constexpr double kForceVaries = 1e-3;
        if (hi[c] - lo[c] > kForceVaries * all[c] + 1.0) return true;
      }
    }
    return false;
  }

  void make_steps() {
    int count = 1;
    for (int j = 0; j < n_; ++j) count *= 3;
    for (int code = 0; code < count; ++code) {
      Step step;
      int rest = code;
      bool moves = false;
      for (int j = 0; j < n_; ++j) {
        step.by.push_back(rest % 3 - 1);
        rest /= 3;
        moves = moves || step.by.back() != 0;
        step.delta += step.by.back() * lattice_.stride[static_cast<std::size_t>(j)];
      }
      if (moves) steps_.push_back(std::move(step));
    }
  }

  bool inside(const std::vector<int>& line, const Step& step) const {
    for (int j = 0; j < n_; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const int to = line[i] + step.by[i];
      if (to < 0 || to >= lattice_.lines[i].size()) return false;
    }
    return true;
  }

  void lines_of(long node, std::vector<int>& line) const {
    for (int j = 0; j < n_; ++j) line[static_cast<std::size_t>(j)] = lattice_.line(node, j);
  }

  void price_moves() {
    const std::vector<CylinderDemand>& demands = pricer_->demands();
    moves_.assign(static_cast<std::size_t>(lattice_.nodes) * steps_.size(), MoveCost());
    std::vector<int> line(static_cast<std::size_t>(n_));
    std::vector<double> dq(static_cast<std::size_t>(n_)), dx(demands.size()), force(demands.size());
    for (long node = 0; node < lattice_.nodes; ++node) {
      lines_of(node, line);
      for (std::size_t s = 0; s < steps_.size(); ++s) {
        if (!inside(line, steps_[s])) continue;
        const long to = node + steps_[s].delta;
        for (std::size_t j = 0; j < dq.size(); ++j) {
          const VectorXd& axis = lattice_.lines[j];
          dq[j] = axis[line[j] + steps_[s].by[j]] - axis[line[j]];
        }
        for (std::size_t i = 0; i < demands.size(); ++i) {
          const auto c = static_cast<std::size_t>(demands[i].cylinder);
          const auto j = static_cast<std::size_t>(demands[i].joint);
          const VectorXd& x = forces_.length[c];
          dx[i] = x[line[j] + steps_[s].by[j]] - x[line[j]];
          force[i] = 0.5 * (static_cast<double>(forces_.force(demands[i].cylinder, node)) +
                            static_cast<double>(forces_.force(demands[i].cylinder, to)));
        }
        moves_[static_cast<std::size_t>(node) * steps_.size() + s] =
            pricer_->price(dq.data(), dx.data(), force.data());
      }
    }
  }

  /// Prices the last moves, from nodes near the goal set onto it.
  void price_ends() {
    for (GoalEnd& end : goal_ends(problem_, *loaded_, lattice_)) {
      const VectorXd from = lattice_.posture(end.node);
      MoveCost together = pricer_->price_line(from, end.q, 1);
      // The joints move in sequence in their own order, which hardly matters within a cell.
      MoveCost each;
      VectorXd q = from;
      for (int j = 0; j < n_; ++j) {
        if (q[j] == end.q[j]) continue;
        VectorXd next = q;
        next[j] = end.q[j];
        each.add(pricer_->price_line(q, next, 1));
        q = next;
      }
      ends_.push_back({std::move(end), together, each});
    }
    ends_at_.clear();
    for (std::size_t e = 0; e < ends_.size(); ++e) ends_at_[ends_[e].end.node].push_back(e);
    if (ends_.empty()) trouble_ = "no posture within the limits puts the tip at its goal";
  }

  bool node_clear(long node) {
    if (!clearance_) return true;
    char& state = clear_[static_cast<std::size_t>(node)];
    if (state == 0) state = clearance_->clear(lattice_.posture(node).data()) ? 1 : 2;
    return state == 1 || node == start_node();
  }
  long start_node() const { return lattice_.nearest_node(problem_.start); }

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
      checked_.assign(static_cast<std::size_t>(lattice_.nodes) * steps_.size(), 0);
    char& state = checked_[move];
    if (state == 0) {
      const VectorXd a = lattice_.posture(from), b = lattice_.posture(to);
      state = clearance_->motion_clear(a.data(), b.data()) ? 1 : 2;
    }
    return state == 1;
  }

  /// Whether the line of a last move is clear; one that is not is blocked.
  bool end_clear(std::size_t e) {
    const VectorXd from = lattice_.posture(ends_[e].end.node);
    const bool clear = clearance_->motion_clear(from.data(), ends_[e].end.q.data());
    if (!clear) blocked_ends_.insert(e);
    return clear;
  }

  /// @param check_moves whether every move is checked for clearance before it is used
  RawPath dijkstra(double price, bool check_moves) {
    const std::size_t count = steps_.size();
    std::vector<double> cost(static_cast<std::size_t>(lattice_.nodes), kNoPath);
    std::vector<std::uint64_t> came(static_cast<std::size_t>(lattice_.nodes), 0);
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
      if (const auto ends = ends_at_.find(node); ends != ends_at_.end()) {
        for (const std::size_t e : ends->second) {
          if (blocked_ends_.contains(e)) continue;
          const double total =
              so_far + std::min(ends_[e].together.at_price(price), ends_[e].each.at_price(price));
          if (!(total < best)) continue;
          if (clearance_ && check_moves && !end_clear(e)) continue;
          best = total;
          best_end = e;
        }
      }
      lines_of(node, line);
      for (std::size_t s = 0; s < count; ++s) {
        if (!inside(line, steps_[s])) continue;
        const long next = node + steps_[s].delta;
        const auto to = static_cast<std::size_t>(next);
        const double through = so_far + moves_[from * count + s].at_price(price);
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
    long node = ends_[best_end].end.node;
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
      raw.points.row(static_cast<Eigen::Index>(k)) = lattice_.posture(nodes[k]).transpose();
    }
    raw.points.row(0) = problem_.start.transpose();
    raw.points.bottomRows(1) = ends_[best_end].end.q.transpose();
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
    Legs chosen = simplify_path(*pricer_, straight_runs(raw.points), legs);
    // A long straight run is tested at other postures than its moves were.
    if (chosen.refused > 0 && clearance_) chosen = simplify_path(*pricer_, raw.points, legs);
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

  struct PricedEnd {
    GoalEnd end;
    MoveCost together, each;
  };

  const CraneModel& model_;
  const MotionProblem& problem_;
  std::shared_ptr<const Machine> loaded_;
  int n_;
  std::string trouble_;
  double spent_ = 0.0;
  Lattice lattice_;
  LatticeForces forces_;
  std::unique_ptr<MovePricer> pricer_;
  std::unique_ptr<ClearanceModel> clearance_;
  std::vector<char> clear_;    // by node: 0 not checked, 1 clear, 2 in collision
  std::vector<char> checked_;  // by move, the same
  std::vector<Step> steps_;
  std::vector<MoveCost> moves_;  // [nodes x steps]
  std::vector<PricedEnd> ends_;
  std::unordered_map<long, std::vector<std::size_t>> ends_at_;
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
