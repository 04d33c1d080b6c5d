#include "optimizer/bounds/energy_bound.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "models/effects/effective_machine.h"
#include "optimizer/bounds/energy_bound_goal.h"
#include "optimizer/bounds/energy_bound_potential.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Largest ratio of the potential's slope to the price it must not exceed, over random postures.
double largest_slope_ratio(const MotionProblem& problem, const EnergyPotential& potential,
                           MoveWeights& weights, int samples) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  VectorXd q(problem.start.size());
  Eigen::MatrixX2d price;
  double worst = 0.0;
  for (int i = 0; i < samples; ++i) {
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
      q[j] = r.lo + (r.hi - r.lo) * share(random);
    }
    const VectorXd slope = potential.gradient(q);
    weights.at(q, price);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const double most = slope[j] > 0.0 ? price(j, 0) : price(j, 1);
      const double rise = std::abs(slope[j]);
      /// Slope of the potential below which it counts as flat.
      /// @threshold [J/rad or J/m] 0..1e-3; numerical: rounding of values of some kJ
      constexpr double kFlat = 1e-9;
      if (rise > kFlat) worst = std::max(worst, rise / std::max(most, 1e-12));
    }
  }
  return worst;
}

std::string acting_effects(const CraneModel& model) {
  std::string names;
  for (const AppliedEffect& e : model.effects) {
    if (!acts_in_motion(*e.effect)) continue;
    names += (names.empty() ? "" : ", ") + e.key(model.machine);
  }
  return names;
}

}  // namespace

std::string no_bound_reason(const CraneModel& model, const MotionProblem& problem,
                            int most_joints) {
  const int n = model.machine.joint_count();
  if (n > most_joints) {
    return fmt::format("no bound: a grid over {} joints has too many nodes (at most {})", n,
                       most_joints);
  }
  if (const std::string names = acting_effects(model); !names.empty()) {
    return "no bound: its inequality does not cover effects along the chain (" + names + ")";
  }
  for (int j = 0; j < n; ++j) {
    const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
    if (problem.start[j] >= r.lo - 1e-9 && problem.start[j] <= r.hi + 1e-9) continue;
    return "no bound: the start is outside the position limits";
  }
  return {};
}

EnergyBound energy_bound(const CraneModel& model, const MotionProblem& problem,
                         const EnergyBoundOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  EnergyBound bound;
  bound.message = no_bound_reason(model, problem, options.most_joints);
  if (!bound.message.empty()) return bound;
  // Equal parts: each is told when it is done.
  const auto tell = [&](int done, const char* what) {
    /// Number of parts that are told.
    /// @threshold [1] 1..100; derived: the calls of `tell` below
    constexpr double kParts = 4.0;
    if (options.progress) options.progress(done / kParts, what);
  };
  const int n = model.machine.joint_count();
  const auto loaded = effective_machine(model.machine, model.effects);
  const int probe = n <= 3 ? 12 : 8;
  Lattice coarse = bound_lattice(problem, std::vector<int>(static_cast<std::size_t>(n), probe));
  MoveWeights weights(model, problem, *loaded,
                      lattice_forces(*loaded, coarse, problem.payload).range);
  const EnergyPotential rough(*loaded, problem, weights, coarse,
                              lattice_forces(*loaded, coarse, problem.payload));
  tell(1, "coarse grid");
  const std::vector<int> cells =
      balanced_cells(rough.losses(), coarse, static_cast<double>(options.nodes));
  const Lattice fine = bound_lattice(problem, cells);
  EnergyPotential potential(*loaded, problem, weights, fine,
                            lattice_forces(*loaded, fine, problem.payload));
  tell(2, "fine grid");
  for (const VectorXd& lines : potential.lattice().lines) {
    bound.lines.push_back(static_cast<int>(lines.size()));
  }
  // The allowances are estimated from the grid's own nodes, so the inequality is sampled away from the nodes.
  /// Random postures at which the inequality is checked between the nodes.
  /// @threshold [postures] 100..1e6; chosen: the scale is taken from the worst; the bound is called estimated for
  /// that reason
  constexpr int kSamples = 4000;
  const double ratio = largest_slope_ratio(problem, potential, weights, kSamples);
  if (ratio > 1.0) {
    bound.checked_scale = 1.0 / ratio;
    potential.scale(bound.checked_scale);
  }
  tell(3, "random postures");
  const LeastOnGoal least = least_on_goal(problem, *loaded, potential,
                                          {options.goal_accuracy, 2e-3, options.most_goal_cuts});
  tell(4, "goal set");
  bound.capped = least.capped;
  if (least.capped) {
    bound.message = fmt::format(
        "the search on the goal set ended at {} boxes: the bound is what was shown until then and "
        "may be low",
        options.most_goal_cuts);
  }
  bound.valid = least.reachable;
  if (!least.reachable) bound.message = "no posture within the limits puts the tip at its goal";
  bound.lower_bound_J = least.lower;
  bound.end = least.q;
  bound.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return bound;
}

}  // namespace sparflow
