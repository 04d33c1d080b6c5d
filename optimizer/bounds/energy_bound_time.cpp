#include "optimizer/bounds/energy_bound_time.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "models/effects/effective_machine.h"
#include "models/math/linear_algebra.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_goal.h"
#include "optimizer/bounds/energy_bound_time_guide.h"
#include "optimizer/bounds/energy_bound_time_weights.h"
#include "optimizer/grid/energy_grid.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// A grid with its forces, on which the potentials for different shares are built.
struct TimedGrid {
  Lattice lattice;
  LatticeForces forces;
};

/// What is bounded from below: energy in a duration (energy_weight 1), the duration (energy_weight 0), or energy and a given
/// price of time (price_W > 0, no duration).
struct Wanted {
  double energy_weight = 1.0;
  double duration = 0.0;  // [s]
  double price_W = 0.0;   // 0: the best one is searched for
};

class TimedSearch {
 public:
  TimedSearch(const CraneModel& model, const MotionProblem& problem,
              const TimedBoundOptions& options, const Wanted& wanted)
      : problem_(problem),
        options_(options),
        energy_weight_(wanted.energy_weight),
        duration_(wanted.duration),
        price_given_(wanted.price_W > 0.0),
        loaded_(effective_machine(model.machine, model.effects)),
        n_(problem.start.size()) {
    const Lattice coarse = bound_lattice(problem, uniform(n_ <= 3 ? 12 : 8));
    weights_ = std::make_unique<TimedWeights>(
        model, problem, *loaded_, lattice_forces(*loaded_, coarse, problem.payload).range);
  }

  bool possible() const { return weights_->possible(); }

  /// @param moves net travel to the goal by joint [rad] or [m], from which the directions that need a share follow
  TimedBound run(const VectorXd& moves, double price) {
    shares_.energy_weight = energy_weight_;
    shares_.share = Eigen::MatrixX2d::Zero(n_, 2);
    active_ = Eigen::MatrixX2d::Zero(n_, 2);
    for (Eigen::Index j = 0; j < n_; ++j) {
      const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
      const double small = 0.02 * (r.hi - r.lo);
      active_(j, 0) = moves[j] > -small ? 1.0 : 0.0;
      active_(j, 1) = moves[j] < small ? 1.0 : 0.0;
    }
    base_ = active_;
    const TimedGrid rough = grid(uniform(n_ <= 3 ? 12 : 6));
    VectorXd x = VectorXd::Zero(n_ + 1);
    x[n_] = std::log(price);
    set(x);
    const EnergyPotential first(*loaded_, problem_, *weights_, rough.lattice, rough.forces);
    const std::vector<int> few =
        balanced_cells(first.losses(), rough.lattice, static_cast<double>(options_.search_nodes));
    const TimedGrid small = grid(few);
    x = climbed(small, x, options_.evaluations / 2, std::log(4.0));
    x = best_shares(small, x, options_.evaluations / 3, 0.5);
    const auto cells = [&](const Found& found, long nodes) {
      base_ = found.base;
      set(found.x);
      const EnergyPotential again(*loaded_, problem_, *weights_, rough.lattice, rough.forces);
      return balanced_cells(again.losses(), rough.lattice, static_cast<double>(nodes));
    };
    // Where time costs little, constant shares may do, and others need not be better on the fine grid.
    std::optional<TimedBound> simple;
    const double constant = objective(small, x), share = shares_.price * duration_ / constant;
    if (price_searched() && share < kShortTime) {
      simple = bound_on(grid(cells({base_, x}, options_.nodes)));
      const double reached = std::max(simple->value, options_.any_duration.value_or(0.0));
      if (share < kNoTime || (options_.known_energy &&
                              *options_.known_energy <= (1.0 + options_.near_enough) * reached)) {
        tell(1.0, "fine grid");
        return *simple;
      }
    }
    // The best shares on the small grid need not be the best on the fine one, so they are chosen on one between.
    const std::vector<Found> candidates = posture_shares(small, x, constant);
    const Found* best = &candidates.front();
    if (candidates.size() > 1) {
      double most = -std::numeric_limits<double>::infinity();
      for (const Found& found : candidates) {
        const double value = bound_on(grid(cells(found, options_.choice_nodes))).value;
        if (value > most) best = &found;
        most = std::max(most, value);
      }
    }
    TimedBound bound = bound_on(grid(cells(*best, options_.nodes)));
    tell(1.0, "fine grid");
    return simple && simple->value > bound.value ? *simple : bound;
  }

 private:
  /// Cost of the time, as share of the constant shares' bound, below which they may do.
  /// @threshold [1] 0..0.1; chosen: below a per cent the search is as often for nothing as it raises the bound by half of that
  static constexpr double kShortTime = 0.01;
  /// Cost of the time below which nothing else is tried.
  /// @threshold [1] 0..0.01; chosen: the bound of unlimited time is as good
  static constexpr double kNoTime = 1e-3;

  /// Share of the time that the search takes, of which only the progress that is told depends.
  /// @threshold [1] 0.1..0.95; chosen: it evaluates a hundred bounds on a small grid; the fine grid has one or two
  static constexpr double kSearchShare = 0.8;

  void tell(double share, const char* what) const {
    if (options_.progress) options_.progress(std::min(1.0, share), what);
  }
  /// Tells how much of the search is done; it may end before all evaluations are used.
  void count_evaluation() {
    // Constant shares first, then one and a half as many for each of one or two bases.
    const double most = 2.5 * options_.evaluations;
    tell(kSearchShare * std::min(1.0, ++evaluated_ / most), "prices of time");
  }
  std::vector<int> uniform(int cells) const {
    return std::vector<int>(static_cast<std::size_t>(n_), cells);
  }
  TimedGrid grid(const std::vector<int>& cells) const {
    TimedGrid g;
    g.lattice = bound_lattice(problem_, cells);
    g.forces = lattice_forces(*loaded_, g.lattice, problem_.payload);
    return g;
  }

  struct Found {
    Eigen::MatrixX2d base;  ///< shares that those of x multiply
    VectorXd x;
  };

  /// Shares that change with the posture, found by a search from those of dynamic programming and, where those do not
  /// begin better, from constant ones too. @param x constant shares and the price  @param constant objective of these
  std::vector<Found> posture_shares(const TimedGrid& g, const VectorXd& x, double constant) {
    set(x);
    const double price = shares_.price;
    TimeGuide guide(*loaded_, problem_, *weights_, uniform(guide_cells()));
    double guide_price = price;
    if (price_searched()) {  // the price at which the guide's own bound is the largest
      double best = guide.solve(price) - price * duration_;
      for (const double factor : {1.6, 1.0 / 1.6}) {
        const double before = best;
        /// Steps in the price of time in either direction.
        /// @threshold [1] 1..20; chosen: the guide's shortest time may exceed the duration: no price is best then
        constexpr int kMost = 4;
        for (int k = 0; k < kMost; ++k) {
          const double next = guide_price * factor, value = guide.solve(next) - next * duration_;
          if (!(value > best)) break;
          best = value;
          guide_price = next;
        }
        if (best > before) break;
      }
    }
    guide.solve(guide_price);
    const TimeShares found = guide.shares(shares_);
    const Eigen::MatrixX2d constant_base = base_;
    /// First step of the search in the logarithms of the shares.
    /// @threshold [1] 0.1..2; chosen: a factor of two in a share; the climb then adapts its steps itself. It
    /// decides how soon the search ends, not whether the bound holds
    constexpr double kStep = 0.7;
    const auto searched = [&](const Eigen::MatrixX2d& base, const VectorXd& from) -> Found {
      base_ = base;
      const VectorXd top = climbed(g, from, options_.evaluations, kStep);
      return {base, best_shares(g, top, options_.evaluations / 2, 0.5 * kStep)};
    };
    std::vector<Found> all;
    bool better = false;
    VectorXd y(n_ + 1 + 2 * n_ * n_);
    if (found.share.maxCoeff() > 0.0) {
      y << VectorXd::Zero(n_), std::log(guide_price), found.tilt.reshaped();
      base_ = found.share;
      better = objective(g, y) > constant;
      all.push_back(searched(found.share, y));
    }
    y << x, VectorXd::Zero(2 * n_ * n_);
    if (!better) all.push_back(searched(constant_base, y));
    return all;
  }

  /// Whether the price of time is one of the variables.
  bool price_searched() const { return energy_weight_ > 0.0 && !price_given_; }

  int guide_cells() const { return n_ == 1 ? 60 : n_ == 2 ? 40 : n_ == 3 ? 10 : 5; }

  /// Sets the shares from x: logarithms of the factors on base_ and of the price, then the tilts column by column, if any.
  void set(const VectorXd& x) {
    shares_.price = energy_weight_ > 0.0 ? std::exp(x[n_]) : 1.0;
    const double top = x.head(n_).maxCoeff();
    /// Logarithm of a share over the largest, below which it stays.
    /// @threshold [1] -20..-2; chosen: a share of 0.25 per cent has no influence
    constexpr double kLeastLog = -6.0;
    shares_.share =
        (x.head(n_).array() - top).cwiseMax(kLeastLog).exp().matrix().asDiagonal() * base_;
    shares_.tilt.resize(0, 0);
    if (x.size() > n_ + 1) shares_.tilt = x.tail(2 * n_ * n_).reshaped(2 * n_, n_);
    weights_->set_shares(shares_);
  }

  /// Entries of x that the bound depends on.
  std::vector<Eigen::Index> free_entries(const VectorXd& x) const {
    std::vector<Eigen::Index> free;
    free.reserve(static_cast<std::size_t>(x.size()));
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const Eigen::Index row = (i - n_ - 1) % (2 * n_);  // of a tilt: 2 j + direction
      if (i == n_ ? price_searched() : i < n_ || base_(row / 2, row % 2) > 0.0) free.push_back(i);
    }
    return free;
  }

  double objective(const TimedGrid& g, const VectorXd& x) {
    count_evaluation();
    set(x);
    const EnergyPotential potential(*loaded_, problem_, *weights_, g.lattice, g.forces);
    /// Relative accuracy of the least potential at the goal while shares are searched.
    /// @threshold [1] 1e-4..0.1; chosen: the final bound is computed with the finer one
    constexpr double kRough = 5e-3;
    /// Resolution of the goal set while shares are searched.
    /// @threshold [m] 1e-3..0.2; chosen: a tenth of a cell; the final bound is computed with the finer one
    constexpr double kRoughTip = 0.02;
    const LeastOnGoal least = least_on_goal(problem_, *loaded_, potential, {kRough, kRoughTip});
    path_.clear();
    if (least.reachable && path_wanted_) path_ = potential.path_to(g.lattice.nearest_node(least.q));
    ramp_ = weights_->ramp_gain();
    return value_of(least.lower, shares_.price);
  }

  /// Cost of moving along the nodes of path_ with the shares of x. [J]
  double cost_of_path(const TimedGrid& g, const VectorXd& x) {
    set(x);
    Eigen::MatrixX2d price;
    double cost = 0.0;
    for (std::size_t k = 0; k + 1 < path_.size(); ++k) {
      const VectorXd a = g.lattice.posture(path_[k]), b = g.lattice.posture(path_[k + 1]);
      Eigen::Index joint = 0;
      const double way = (b - a).cwiseAbs().maxCoeff(&joint);
      weights_->at(0.5 * (a + b), price);
      cost += price(joint, b[joint] > a[joint] ? 0 : 1) * way;
    }
    return cost;
  }

  /// Gradient of the objective at x, for which it was evaluated last: the least potential is the length of a shortest path,
  /// so it changes as the costs along that path do; the ramps' gain is held.
  VectorXd gradient(const TimedGrid& g, const VectorXd& x, const std::vector<Eigen::Index>& free) {
    /// Step of the differences, in logarithms.
    /// @threshold [1] 1e-6..1e-2; numerical: costs are smooth in it, and accurate to kPriceTolerance
    constexpr double kStep = 5e-3;
    VectorXd slope(static_cast<Eigen::Index>(free.size()));
    for (std::size_t k = 0; k < free.size(); ++k) {
      VectorXd y = x;
      y[free[k]] += kStep;
      const double ahead = cost_of_path(g, y);
      y[free[k]] -= 2.0 * kStep;
      const auto i = static_cast<Eigen::Index>(k);
      slope[i] = (ahead - cost_of_path(g, y)) / (2.0 * kStep);
      if (free[k] == n_) {
        const double price = std::exp(x[n_]), time = ramp_ > 0.0 ? price / ramp_ : 0.0;
        const bool short_ramps = duration_ - time > 0.5 * duration_;
        slope[i] -= price * (short_ramps ? duration_ - 2.0 * time : 0.5 * duration_);
      }
    }
    set(x);
    return slope;
  }

  /// Ascent along the gradient, with part of the last direction kept where steps succeed, and shorter steps where not.
  VectorXd climbed(const TimedGrid& g, VectorXd x, int evaluations, double step) {
    const std::vector<Eigen::Index> free = free_entries(x);
    path_wanted_ = true;
    double best = objective(g, x);
    VectorXd last = VectorXd::Zero(static_cast<Eigen::Index>(free.size()));
    VectorXd slope = gradient(g, x, free);
    int used = 2;
    /// Step at which the climb ends.
    /// @threshold [1] 1e-3..0.1; chosen: two per cent of a share changes the bound by less than the grid does
    constexpr double kLeastStep = 0.02;
    while (used < evaluations && step > kLeastStep && slope.norm() > 0.0) {
      /// Share of the last direction in the next one.
      /// @threshold [1] 0..0.95; chosen: along a ridge the components across it cancel
      constexpr double kKept = 0.5;
      const VectorXd direction = (slope.normalized() + kKept * last).normalized();
      VectorXd y = x;
      y(free) += step * direction;
      const double value = objective(g, y);
      ++used;
      if (value > best) {
        best = value;
        x = y;
        last = direction;
        slope = gradient(g, x, free);
        ++used;
        step *= 1.5;
        continue;
      }
      last.setZero();
      step *= 0.5;
    }
    path_wanted_ = false;
    return x;
  }

  /// The bound from the least potential over the goal when the maximised Hamiltonian nowhere exceeds `price`. Near the
  /// ends of a motion speeds are small, and the Hamiltonian is at most ramp_gain t; the part of the constant price above
  /// that is subtracted from what the price of time costs.
  double value_of(double least, double price) const {
    /// Factor on the ramp's gain for postures between the nodes.
    /// @threshold [1] 1..1.2; chosen: two per cent for what lies between
    constexpr double kBetweenNodes = 1.02;
    if (price_given_)
      return least;  // the Hamiltonian is below the price given: see bound_with_time()
    price *= 1.0 + kPriceTolerance;
    const double ramp = kBetweenNodes * weights_->ramp_gain();
    const double time =
        ramp > 0.0 ? price / ramp : 0.0;  // [s] until the Hamiltonian can reach the price
    if (energy_weight_ > 0.0) {
      return least - price * std::max(duration_ - time, 0.5 * duration_);
    }
    // A short motion may consist of ramps alone: then least <= ramp T^2 / 4.
    const double cruise = least / price;
    return time <= cruise ? cruise + time : 2.0 * std::sqrt(cruise * time);
  }

  /// Compass search, alternately along the coordinates and along random orthonormal axes, since the objective has ridges
  /// oblique to the coordinates. The step is halved when neither improves the bound.
  VectorXd best_shares(const TimedGrid& g, VectorXd x, int evaluations, double step) {
    const std::vector<Eigen::Index> free = free_entries(x);
    const auto count = static_cast<Eigen::Index>(free.size());
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    double best = objective(g, x);
    int used = 1, idle = 0;
    for (int round = 0; used < evaluations && step > std::log(1.02); ++round) {
      Eigen::MatrixXd axes = Eigen::MatrixXd::Identity(count, count);
      if (round % 2 == 1) {
        for (double& entry : axes.reshaped()) entry = normal(random);
        axes = span_of(axes);  // orthonormalised
      }
      bool any = false;
      for (Eigen::Index k = count; k-- > 0;) {
        for (const double sign : {1.0, -1.0}) {
          bool better = false;
          while (used < evaluations) {
            VectorXd y = x;
            y(free) += sign * step * axes.col(k);
            const double value = objective(g, y);
            ++used;
            if (!(value > best)) break;
            best = value;
            x = y;
            any = better = true;
          }
          if (better) break;
        }
      }
      idle = any ? 0 : idle + 1;
      if (idle < 2) continue;
      step *= 0.5;
      idle = 0;
    }
    return x;
  }

  /// The bound of the current shares on a grid, with its inequality tested at random postures.
  TimedBound bound_on(const TimedGrid& g) {
    TimedBound bound;
    EnergyPotential potential(*loaded_, problem_, *weights_, g.lattice, g.forces);
    for (const VectorXd& lines : g.lattice.lines) {
      bound.lines.push_back(static_cast<int>(lines.size()));
    }
    /// Relative accuracy of the least potential at the goal for the bound that is reported.
    /// @threshold [1] 1e-6..1e-2; chosen: as EnergyBoundOptions::goal_accuracy
    constexpr double kAccuracy = 2e-4;
    const LeastOnGoal least = least_on_goal(problem_, *loaded_, potential, {kAccuracy});
    bound.capped = least.capped;
    bound.valid = least.reachable;
    if (!least.reachable) bound.message = "no posture within the limits puts the tip at its goal";
    // The inequality is sampled away from the nodes. Where it fails, either the price is raised to the largest value met
    // or the potential is scaled down (the Hamiltonian is convex in the slopes and zero at zero), whichever costs less.
    const double price = shares_.price, gain = std::max(price, largest_gain(potential));
    bound.checked_scale = price / gain;
    const double charged = value_of(least.lower, gain);
    const double scaled = value_of(least.lower * bound.checked_scale, price);
    bound.value = price_given_           ? std::max(0.0, scaled)
                  : energy_weight_ > 0.0 ? std::max({0.0, charged, scaled})
                                         : charged;
    bound.price_W = energy_weight_ > 0.0 ? price : 0.0;
    bound.shares = shares_.share.rowwise().maxCoeff();
    return bound;
  }

  double largest_gain(const EnergyPotential& potential) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    VectorXd q(n_);
    Eigen::MatrixX2d price;
    double worst = 0.0;
    /// Random postures at which the Hamiltonian is checked between the nodes.
    /// @threshold [postures] 100..1e6; chosen: the scale is taken from the worst; the bound is called estimated for
    /// that reason
    constexpr int kSamples = 4000;
    for (int i = 0; i < kSamples; ++i) {
      for (Eigen::Index j = 0; j < n_; ++j) {
        const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
        q[j] = r.lo + (r.hi - r.lo) * share(random);
      }
      worst = std::max(worst, weights_->largest_gain(q, potential.gradient(q)));
      weights_->at(q, price);  // so that ramp_gain() includes this posture
    }
    return worst;
  }

  const MotionProblem& problem_;
  const TimedBoundOptions& options_;
  double energy_weight_, duration_;
  bool price_given_;
  std::shared_ptr<const Machine> loaded_;
  Eigen::Index n_;
  std::unique_ptr<TimedWeights> weights_;
  TimeShares shares_;
  Eigen::MatrixX2d active_, base_;
  bool path_wanted_ = false;  // whether objective() keeps the shortest path
  std::vector<long> path_;    // nodes of that path, when it was evaluated last
  double ramp_ = 0.0;         // ramps' gain then
  int evaluated_ = 0;         // bounds of the search
};

TimedBound bound_with_time(const CraneModel& model, const MotionProblem& problem,
                           const TimedBoundOptions& options, const Wanted& wanted) {
  const auto begin = std::chrono::steady_clock::now();
  TimedBound bound;
  bound.message = no_bound_reason(model, problem, options.most_joints);
  if (!bound.message.empty()) return bound;
  TimedSearch search(model, problem, options, wanted);
  if (!search.possible()) {
    bound.message = "no bound: a joint's cylinders are fed by different pumps";
    return bound;
  }
  // A cheap motion of this duration gives the directions of the joints and the magnitude of the price.
  MotionProblem open = problem;
  open.tip_line.reset();
  EnergyGrid grid(model, open, {8000, options.most_joints});
  const GridPath path = wanted.price_W > 0.0         ? grid.cheapest_path(wanted.price_W)
                        : wanted.energy_weight > 0.0 ? grid.path_for_duration(wanted.duration)
                                                     : grid.cheapest_path(1e6);
  VectorXd moves = VectorXd::Zero(problem.start.size());
  double price = 1e3;
  if (path.found) {
    moves = (path.corners.bottomRows(1) - path.corners.topRows(1)).transpose();
    if (wanted.duration > 0.0)
      price = std::max({price, path.price_W, 0.1 * path.energy_J / wanted.duration});
  }
  // The Hamiltonian may exceed the price by its tolerance, so a price given is lowered by as much.
  if (wanted.price_W > 0.0) price = wanted.price_W / (1.0 + kPriceTolerance);
  bound = search.run(moves, price);
  bound.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return bound;
}

}  // namespace

TimedBound energy_bound_at(const CraneModel& model, const MotionProblem& problem, double duration,
                           const TimedBoundOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  /// Share of the time that the bound of this duration takes, of which only the progress that is told depends.
  /// @threshold [1] 0.1..0.99; chosen: the other is one grid of many
  constexpr double kTimed = 0.9;
  TimedBoundOptions timed = options;
  timed.progress = part_of(options.progress, 0.0, kTimed);
  TimedBound bound = bound_with_time(model, problem, timed, {1.0, duration, 0.0});
  if (!bound.valid) return bound;
  EnergyBound slow;
  if (options.any_duration) {
    slow.valid = true;
    slow.lower_bound_J = *options.any_duration;
  } else {
    EnergyBoundOptions unlimited;
    unlimited.progress = part_of(options.progress, kTimed, 1.0);
    unlimited.nodes = options.nodes;
    unlimited.most_joints = options.most_joints;
    slow = energy_bound(model, problem, unlimited);
  }
  if (slow.valid && slow.lower_bound_J > bound.value) {  // this duration raises no motion's energy
    bound.value = slow.lower_bound_J;
    bound.price_W = 0.0;
    bound.shares.setZero();
    bound.lines = slow.lines;
    bound.checked_scale = slow.checked_scale;
  }
  bound.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return bound;
}

TimedBound cost_bound(const CraneModel& model, const MotionProblem& problem, double price_W,
                      const TimedBoundOptions& options) {
  return bound_with_time(model, problem, options, {1.0, 0.0, price_W});
}

TimedBound least_duration(const CraneModel& model, const MotionProblem& problem,
                          const TimedBoundOptions& options) {
  return bound_with_time(model, problem, options, {0.0, 1.0, 0.0});
}

}  // namespace sparflow
