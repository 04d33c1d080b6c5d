#include "optimizer/bounds/energy_bound_goal.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "models/machine/kinematics.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Distance from the goal within which a tip counts as there, as in the check of a motion's end. [m]
/// @threshold [m] 1e-9..1e-3; derived: the check of a motion's end accepts the same distance
constexpr double kAtGoal = 1e-5;

/// Decides whether the tip can be at the goal anywhere in a box.
class TipBoxes {
 public:
  TipBoxes(const MotionProblem& problem, const Machine& machine)
      : machine_(machine), goal_(std::get<TipGoal>(problem.goal).tip), chain_(machine) {
    const int n = machine.joint_count();
    // reach_ is the largest distance of the tip from each joint.
    reach_.setZero(n);
    double beyond = machine.tip.xyz.norm();
    for (int j = n - 1; j >= 0; --j) {
      const auto i = static_cast<std::size_t>(j);
      if (j > machine.tip.joint) continue;
      const Range& r = problem.limits.position[i];
      const bool prismatic = machine.joints[i].type == JointType::kPrismatic;
      if (prismatic) beyond += std::max(std::abs(r.lo), std::abs(r.hi));
      reach_[j] = prismatic ? 1.0 : beyond;
      beyond += machine.joints[i].origin.translation().norm();
    }
    directions_ = moving_tip_directions(machine);
  }

  bool possible(const VectorXd& lo, const VectorXd& hi) {
    const VectorXd middle = 0.5 * (lo + hi), half = 0.5 * (hi - lo);
    chain_.update(machine_, middle.data());
    const Eigen::Vector3d tip = chain_.point(machine_.tip.joint, machine_.tip.xyz);
    const Eigen::Index n = middle.size();
    Eigen::Matrix3Xd jacobian(3, n);
    // In the second-order remainder |d2p/dq_i dq_k| is at most the outer joint's reach, and zero when the inner joint is
    // prismatic.
    double rest = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      jacobian.col(k) = point_jacobian(chain_, machine_.tip.joint, tip, static_cast<int>(k));
      for (Eigen::Index i = 0; i <= k; ++i) {
        if (!chain_.revolute[static_cast<std::size_t>(i)]) continue;
        rest += (i == k ? 0.5 : 1.0) * reach_[k] * half[i] * half[k];
      }
    }
    const double slack = rest + kAtGoal;
    const VectorXd error = directions_.transpose() * (goal_ - tip);
    const Eigen::MatrixXd moves = directions_.transpose() * jacobian;
    const Eigen::MatrixXd scaled = moves * half.asDiagonal();
    if (((error.cwiseAbs() - scaled.cwiseAbs().rowwise().sum()).array() > slack).any())
      return false;
    // The same test in joint coordinates is sharper where the tip's directions are oblique to the box.
    const Eigen::MatrixXd gram = scaled * scaled.transpose();
    const double small = 1e-12 * gram.trace() + 1e-300;
    const Eigen::MatrixXd back =
        scaled.transpose() *
        symmetric_inverse(gram + small * Eigen::MatrixXd::Identity(gram.rows(), gram.cols()));
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::RowVectorXd row = back.row(i);
      const double most = (row * scaled).cwiseAbs().sum() + row.norm() * slack;
      if (std::abs(row.dot(error)) > most) return false;
    }
    return true;
  }

  /// Largest travel of the tip along one side of the box. [m]
  double side(int joint, double half) const { return 2.0 * reach_[joint] * half; }

 private:
  const Machine& machine_;
  Eigen::Vector3d goal_;
  ChainGeometry chain_;
  VectorXd reach_;
  Eigen::MatrixXd directions_;  // columns
};

struct PostureBox {
  double least = 0.0;
  VectorXd lo, hi;
  VectorXd variation;  // of the potential between corners, along each side
  bool operator>(const PostureBox& other) const { return least > other.least; }
};

/// Best-first branch and bound over boxes of postures that can hold the goal.
class GoalSearch {
 public:
  /// All must outlive this.
  GoalSearch(const MotionProblem& problem, const Machine& machine, const EnergyPotential& potential)
      : tips_(problem, machine),
        potential_(potential),
        lattice_(potential.lattice()),
        n_(lattice_.joints()),
        values_(1u << n_) {}

  /// Opens the cells that can hold the goal; they are found by halving ranges of grid lines.
  void open_cells();
  /// Cuts the box of the least potential until it is as accurate as wanted.
  void narrow(const GoalAccuracy& accuracy);
  const LeastOnGoal& result() const { return result_; }

 private:
  struct Block {  // of cells: indices of its outer grid lines, by joint
    std::vector<int> from, to;
  };
  PostureBox box_of(const Block& block) const;
  /// Joint along whose grid lines the block moves the tip most; -1 for a single cell.
  int longest_side(const Block& block, const PostureBox& box) const;
  /// Sets a box's least potential and, by joint, the variation along its sides from its corners; the box lies in one cell.
  void survey(PostureBox& box);
  /// Joint along which the box is the least accurate, and by how much it is beyond the accuracy wanted.
  std::pair<int, double> coarsest_side(const PostureBox& box, double accuracy,
                                       double tip_accuracy) const;
  /// Opens the halves of the box that can hold the goal.
  void cut(const PostureBox& box, int joint);

  TipBoxes tips_;
  const EnergyPotential& potential_;
  const Lattice& lattice_;
  int n_;
  std::vector<double> values_;
  std::priority_queue<PostureBox, std::vector<PostureBox>, std::greater<>> open_;
  LeastOnGoal result_;
};

void GoalSearch::survey(PostureBox& box) {
  potential_.corner_values(box.lo, box.hi, values_);
  box.least = *std::min_element(values_.begin(), values_.end());
  box.variation.setZero(n_);
  for (int j = 0; j < n_; ++j) {
    for (unsigned k = 0; k < values_.size(); ++k) {
      if ((k >> j & 1u) == 0)
        box.variation[j] = std::max(box.variation[j], std::abs(values_[k | 1u << j] - values_[k]));
    }
  }
}

PostureBox GoalSearch::box_of(const Block& block) const {
  PostureBox box;
  box.lo.resize(n_);
  box.hi.resize(n_);
  for (int j = 0; j < n_; ++j) {
    const auto i = static_cast<std::size_t>(j);
    box.lo[j] = lattice_.lines[i][block.from[i]];
    box.hi[j] = lattice_.lines[i][block.to[i]];
  }
  return box;
}

int GoalSearch::longest_side(const Block& block, const PostureBox& box) const {
  int longest = -1;
  double way = 0.0;
  for (int j = 0; j < n_; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double side = tips_.side(j, 0.5 * (box.hi[j] - box.lo[j])) + 1e-9;
    if (block.to[i] - block.from[i] > 1 && side > way) {
      way = side;
      longest = j;
    }
  }
  return longest;
}

void GoalSearch::open_cells() {
  std::vector<Block> blocks(1);
  for (const VectorXd& lines : lattice_.lines) {
    blocks[0].from.push_back(0);
    blocks[0].to.push_back(static_cast<int>(lines.size()) - 1);
  }
  while (!blocks.empty()) {
    Block block = std::move(blocks.back());
    blocks.pop_back();
    PostureBox box = box_of(block);
    ++result_.boxes;
    if (!tips_.possible(box.lo, box.hi)) continue;
    const int longest = longest_side(block, box);
    if (longest < 0) {
      survey(box);
      open_.push(std::move(box));
      continue;
    }
    const auto i = static_cast<std::size_t>(longest);
    Block upper = block;
    const int middle = (block.from[i] + block.to[i]) / 2;
    block.to[i] = upper.from[i] = middle;
    blocks.push_back(std::move(block));
    blocks.push_back(std::move(upper));
  }
  result_.reachable = !open_.empty();
}

std::pair<int, double> GoalSearch::coarsest_side(const PostureBox& box, double accuracy,
                                                 double tip_accuracy) const {
  std::pair<int, double> coarsest{0, -1.0};
  const double scale = std::max(box.least, 1e-9);
  for (int j = 0; j < n_; ++j) {
    const double want = std::max(box.variation[j] / (accuracy * scale),
                                 tips_.side(j, 0.5 * (box.hi[j] - box.lo[j])) / tip_accuracy);
    if (want > coarsest.second) coarsest = {j, want};
  }
  return coarsest;
}

void GoalSearch::cut(const PostureBox& box, int joint) {
  for (const bool up : {false, true}) {
    PostureBox part = box;
    (up ? part.lo : part.hi)[joint] = 0.5 * (box.lo[joint] + box.hi[joint]);
    if (!tips_.possible(part.lo, part.hi)) continue;
    survey(part);
    open_.push(std::move(part));
  }
}

void GoalSearch::narrow(const GoalAccuracy& accuracy) {
  long cuts = 0;
  while (!open_.empty()) {
    PostureBox box = open_.top();
    // The least box of all comes first, and cutting raises it: what was shown once stays.
    result_.lower = std::max(result_.lower, box.least);
    result_.q = 0.5 * (box.lo + box.hi);
    const auto [joint, beyond] = coarsest_side(box, accuracy.value, accuracy.tip);
    if (beyond <= 1.0) return;
    result_.capped = ++cuts > accuracy.most_cuts;
    if (result_.capped) return;
    ++result_.boxes;
    open_.pop();
    cut(box, joint);
  }
  result_.reachable = false;  // there was no box, or the last one passed its test by rounding alone
}

}  // namespace

LeastOnGoal least_on_goal(const MotionProblem& problem, const Machine& machine,
                          const EnergyPotential& potential, const GoalAccuracy& accuracy) {
  if (const auto* goal = std::get_if<JointGoal>(&problem.goal)) {
    LeastOnGoal known;
    known.reachable = true;
    known.lower = potential.value(goal->q);
    known.q = goal->q;
    return known;
  }
  GoalSearch search(problem, machine, potential);
  search.open_cells();
  search.narrow(accuracy);
  return search.result();
}

}  // namespace sparflow
