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
  bool operator>(const PostureBox& other) const { return least > other.least; }
};

}  // namespace

LeastOnGoal least_on_goal(const MotionProblem& problem, const Machine& machine,
                          const EnergyPotential& potential, double accuracy, double tip_accuracy) {
  LeastOnGoal result;
  if (const auto* goal = std::get_if<JointGoal>(&problem.goal)) {
    result.reachable = true;
    result.q = goal->q;
    result.lower = potential.value(goal->q);
    return result;
  }
  TipBoxes tips(problem, machine);
  const Lattice& lattice = potential.lattice();
  const int n = lattice.joints();
  std::priority_queue<PostureBox, std::vector<PostureBox>, std::greater<>> open;
  /// Sets a box's least potential and, by joint, the variation along its sides from its corners; the box lies in one cell.
  VectorXd variation(n), corner(n);
  std::vector<double> values(1u << n);
  const auto survey = [&](PostureBox& box) {
    for (unsigned k = 0; k < values.size(); ++k) {
      for (int j = 0; j < n; ++j) corner[j] = (k >> j & 1u) != 0 ? box.hi[j] : box.lo[j];
      values[k] = potential.value(corner);
    }
    box.least = *std::min_element(values.begin(), values.end());
    for (int j = 0; j < n; ++j) {
      variation[j] = 0.0;
      for (unsigned k = 0; k < values.size(); ++k) {
        if ((k >> j & 1u) == 0) {
          variation[j] = std::max(variation[j], std::abs(values[k | 1u << j] - values[k]));
        }
      }
    }
  };
  // Cells that can hold the goal are found by halving ranges of grid lines.
  struct Block {
    std::vector<int> from, to;
  };
  std::vector<Block> blocks(1);
  for (const VectorXd& lines : lattice.lines) {
    blocks[0].from.push_back(0);
    blocks[0].to.push_back(static_cast<int>(lines.size()) - 1);
  }
  while (!blocks.empty()) {
    Block block = std::move(blocks.back());
    blocks.pop_back();
    PostureBox box;
    box.lo.resize(n);
    box.hi.resize(n);
    int longest = -1;
    double way = 0.0;
    for (int j = 0; j < n; ++j) {
      const auto i = static_cast<std::size_t>(j);
      box.lo[j] = lattice.lines[i][block.from[i]];
      box.hi[j] = lattice.lines[i][block.to[i]];
      const double side = tips.side(j, 0.5 * (box.hi[j] - box.lo[j])) + 1e-9;
      if (block.to[i] - block.from[i] > 1 && side > way) {
        way = side;
        longest = j;
      }
    }
    ++result.boxes;
    if (!tips.possible(box.lo, box.hi)) continue;
    if (longest < 0) {
      survey(box);
      open.push(std::move(box));
      continue;
    }
    const auto i = static_cast<std::size_t>(longest);
    Block upper = block;
    const int middle = (block.from[i] + block.to[i]) / 2;
    block.to[i] = upper.from[i] = middle;
    blocks.push_back(std::move(block));
    blocks.push_back(std::move(upper));
  }
  if (open.empty()) return result;
  result.reachable = true;
  /// Boxes after which the search ends.
  /// @threshold [boxes] 1000..1e8; chosen: ends a search that no longer narrows; the least value of the open boxes is
  /// a bound at any time
  constexpr long kMostBoxes = 400000;
  while (true) {
    PostureBox box = open.top();
    result.lower = box.least;
    result.q = 0.5 * (box.lo + box.hi);
    survey(box);
    int cut = 0;
    double most = -1.0;
    const double scale = std::max(box.least, 1e-9);
    for (int j = 0; j < n; ++j) {
      const double want = std::max(variation[j] / (accuracy * scale),
                                   tips.side(j, 0.5 * (box.hi[j] - box.lo[j])) / tip_accuracy);
      if (want > most) {
        most = want;
        cut = j;
      }
    }
    if (most <= 1.0 || ++result.boxes > kMostBoxes) return result;
    open.pop();
    for (const bool up : {false, true}) {
      PostureBox part = box;
      (up ? part.lo : part.hi)[cut] = 0.5 * (box.lo[cut] + box.hi[cut]);
      if (!tips.possible(part.lo, part.hi)) continue;
      survey(part);
      open.push(std::move(part));
    }
    if (open.empty()) {  // the last box passed its test by rounding alone
      result.reachable = false;
      return result;
    }
  }
}

}  // namespace sparflow
