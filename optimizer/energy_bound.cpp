#include "optimizer/energy_bound.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "models/effects/effective_machine.h"
#include "optimizer/energy_bound_goal.h"
#include "optimizer/energy_bound_potential.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Number of cells of each axis that loses least in all for about `nodes` nodes, from what a coarse grid lost.
std::vector<int> balanced_cells(const std::vector<Eigen::Vector2d>& losses, const Lattice& coarse,
                                double nodes) {
  const std::size_t n = losses.size();
  std::vector<double> lines(n);
  for (std::size_t j = 0; j < n; ++j) {
    const bool varies = losses[j][0] > 1e-9 || losses[j][1] > 1e-9;
    // two cells suffice along an axis that changes no price; else curvature must be seen
    lines[j] = varies ? 7.0 : 3.0;
  }
  const auto gain = [&](std::size_t j) {  // what 1 % more lines saves
    const double ratio = static_cast<double>(coarse.lines[j].size() - 1) / (lines[j] - 1.0);
    return losses[j][0] * ratio + 2.0 * losses[j][1] * ratio * ratio;
  };
  double count = 1.0;
  for (const double l : lines) count *= l;
  constexpr double kGrowth = 1.02;
  while (count < nodes) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < n; ++j) {
      if (gain(j) > gain(best)) best = j;
    }
    if (!(gain(best) > 1e-7)) break;
    lines[best] *= kGrowth;
    count *= kGrowth;
  }
  std::vector<int> cells;
  for (const double l : lines) cells.push_back(static_cast<int>(std::lround(l)) - 1);
  return cells;
}

Lattice lattice_of(const MotionProblem& problem, const std::vector<int>& cells) {
  std::vector<VectorXd> lines;
  for (std::size_t j = 0; j < cells.size(); ++j) {
    const double start = problem.start[static_cast<Eigen::Index>(j)];
    lines.push_back(axis_lines(problem.limits.position[j], {start}, cells[j]));
  }
  return Lattice(std::move(lines));
}

/// Largest ratio of the potential's slope to the price it must not exceed, at random postures.
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
      if (rise > 1e-9) worst = std::max(worst, rise / std::max(most, 1e-12));
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

EnergyBound energy_bound(const CraneModel& model, const MotionProblem& problem,
                         const EnergyBoundOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  EnergyBound bound;
  const int n = model.machine.joint_count();
  if (n > options.most_joints) {
    bound.message = fmt::format("no bound: a grid over {} joints has too many nodes (at most {})",
                                n, options.most_joints);
    return bound;
  }
  if (const std::string names = acting_effects(model); !names.empty()) {
    bound.message = "no bound: not proven with effects along the chain (" + names + ")";
    return bound;
  }
  for (int j = 0; j < n; ++j) {
    const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
    if (problem.start[j] >= r.lo - 1e-9 && problem.start[j] <= r.hi + 1e-9) continue;
    bound.message = "no bound: the start is outside the position limits";
    return bound;
  }
  const auto loaded = effective_machine(model.machine, model.effects);
  const int probe = n <= 3 ? 12 : 8;
  Lattice coarse = lattice_of(problem, std::vector<int>(static_cast<std::size_t>(n), probe));
  MoveWeights weights(model, problem, *loaded,
                      lattice_forces(*loaded, coarse, problem.payload).range);
  const EnergyPotential rough(*loaded, problem, weights, coarse);
  const std::vector<int> cells =
      balanced_cells(rough.losses(), coarse, static_cast<double>(options.nodes));
  EnergyPotential potential(*loaded, problem, weights, lattice_of(problem, cells));
  for (const VectorXd& lines : potential.lattice().lines) {
    bound.lines.push_back(static_cast<int>(lines.size()));
  }
  // The allowances are estimates from the grid itself; here their effect is tested where the grid did not look.
  constexpr int kSamples = 4000;
  const double ratio = largest_slope_ratio(problem, potential, weights, kSamples);
  if (ratio > 1.0) {
    bound.checked_scale = 1.0 / ratio;
    potential.scale(bound.checked_scale);
  }
  const LeastOnGoal least = least_on_goal(problem, *loaded, potential, options.goal_accuracy);
  bound.valid = least.reachable;
  if (!least.reachable) bound.message = "no posture within the limits puts the tip at its goal";
  bound.lower_bound_J = least.lower;
  bound.end = least.q;
  bound.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return bound;
}

}  // namespace sparflow
