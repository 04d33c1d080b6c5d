#include "optimizer/grid/energy_grid_graph.h"

#include <algorithm>
#include <cmath>

#include "models/effects/effective_machine.h"

namespace sparflow {

using Eigen::VectorXd;

MoveGraph::MoveGraph(const CraneModel& model, const MotionProblem& problem, int nodes)
    : problem_(problem),
      loaded_(effective_machine(model.machine, model.effects)),
      n_(model.machine.joint_count()) {
  const std::vector<VectorXd> ends = anchor_postures(problem_, *loaded_);
  if (ends.empty()) {
    trouble_ = "no posture within the limits puts the tip at its goal";
    return;
  }
  const std::vector<int> cells = cells_by_axis(nodes);
  std::vector<VectorXd> lines;
  for (int j = 0; j < n_; ++j) {
    std::vector<double> on_line = {problem_.start[j]};
    for (const VectorXd& end : ends) on_line.push_back(end[j]);
    lines.push_back(axis_lines(problem_.limits.position[static_cast<std::size_t>(j)], on_line,
                               cells[static_cast<std::size_t>(j)]));
  }
  lattice_ = Lattice(std::move(lines));
  forces_ = lattice_forces(*loaded_, lattice_, problem_.payload);
  pricer_ = std::make_unique<MovePricer>(model, problem_, *loaded_, forces_.range);
  make_steps();
  price_moves();
  price_ends();
}

/// Distributes the lines to the axes along which forces vary; the other axes get a few.
std::vector<int> MoveGraph::cells_by_axis(int wanted) const {
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
  const int each = many > 0 ? std::max(4, static_cast<int>(std::pow(left, 1.0 / many)) - 3) : kFew;
  std::vector<int> cells;
  cells.reserve(varies.size());
  for (int j = 0; j < n_; ++j) {
    cells.push_back(varies[static_cast<std::size_t>(j)] ? each : kFew);
  }
  return cells;
}

bool MoveGraph::force_varies(int joint, int probes) const {
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

void MoveGraph::make_steps() {
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

void MoveGraph::price_moves() {
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
      moves_[move_number(node, s)] = pricer_->price(dq.data(), dx.data(), force.data());
    }
  }
}

/// Prices the last moves, from nodes near the goal set onto it.
void MoveGraph::price_ends() {
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

}  // namespace sparflow
