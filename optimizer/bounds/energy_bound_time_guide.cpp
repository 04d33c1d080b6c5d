#include "optimizer/bounds/energy_bound_time_guide.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "optimizer/bounds/energy_bound_goal.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

constexpr double kFar = std::numeric_limits<double>::infinity();

std::size_t place(long i) { return static_cast<std::size_t>(i); }

EnergyPotential empty_potential(const Machine& loaded, const MotionProblem& problem,
                                const TimedWeights& weights, const Lattice& lattice) {
  return {loaded, problem, weights, lattice, lattice_forces(loaded, lattice, problem.payload)};
}

/// Normal equations of a weighted linear fit of a logarithm over the posture.
struct LogFit {
  Eigen::MatrixXd square;
  VectorXd right;
  double weight = 0.0;
  explicit LogFit(Eigen::Index n)
      : square(Eigen::MatrixXd::Zero(n + 1, n + 1)), right(VectorXd::Zero(n + 1)) {}
  void add(const VectorXd& place, double log_share, double w) {
    VectorXd row(place.size() + 1);
    row << 1.0, place;
    square += w * row * row.transpose();
    right += w * log_share * row;
    weight += w;
  }
  /// Value in the middle of the ranges, then slopes; a ridge keeps slopes small that the way does not determine.
  VectorXd solved() const {
    /// Ridge on the slopes, relative to the weight, of a posture's share of its range squared.
    /// @threshold [1] 1e-6..0.1; chosen: slopes that the way does not determine stay small, others hardly change
    constexpr double kRidge = 3e-3;
    Eigen::MatrixXd a = square;
    a.diagonal().tail(a.rows() - 1).array() += kRidge * weight;
    return a.ldlt().solve(right);
  }
};

}  // namespace

TimeGuide::TimeGuide(const Machine& loaded, const MotionProblem& problem,
                     const TimedWeights& weights, const std::vector<int>& cells)
    : loaded_(loaded),
      problem_(problem),
      weights_(weights),
      lattice_(bound_lattice(problem, cells)),
      potential_(empty_potential(loaded, problem, weights, lattice_)) {
  const LatticeForces forces = lattice_forces(loaded, lattice_, problem.payload);
  std::vector<double> force(forces.length.size()), rate(forces.length.size());
  all_.reserve(place(2 * lattice_.nodes * lattice_.joints()));
  for (long node = 0; node < lattice_.nodes; ++node) {
    forces.at(loaded, lattice_, node, force.data(), rate.data());
    for (int j = 0; j < lattice_.joints(); ++j) {
      for (const int direction : {0, 1}) {
        all_.push_back(weights.move_of(j, direction, force.data(), rate.data()));
      }
    }
  }
}

TimeGuide::Upwind TimeGuide::upwind(long node, int joint) const {
  const VectorXd& lines = lattice_.lines[place(joint)];
  const long stride = lattice_.stride[place(joint)];
  const int line = lattice_.line(node, joint);
  Upwind best;
  best.value = kFar;
  for (const int direction : {0, 1}) {  // from the line below and from the line above
    const int from = direction == 0 ? line - 1 : line + 1;
    if (from < 0 || from >= lines.size()) continue;
    const long other = direction == 0 ? node - stride : node + stride;
    if (!(value_[place(other)] < best.value)) continue;
    best = {value_[place(other)], std::abs(lines[line] - lines[from]), other, direction};
  }
  return best;
}

void TimeGuide::set_moves(long node, double value) {
  moves_.clear();
  for (int j = 0; j < lattice_.joints(); ++j) {
    const Upwind up = upwind(node, j);
    if (!(up.value < value)) continue;
    TimedMove m = all_[place(2 * (node * lattice_.joints() + j) + up.direction)];
    if (!(m.top > 0.0)) continue;
    m.slope = (value - up.value) / up.width / m.area;
    moves_.push_back(m);
  }
}

double TimeGuide::update(long node) {
  double low = kFar, high = value_[place(node)];
  for (int j = 0; j < lattice_.joints(); ++j) {
    const Upwind up = upwind(node, j);
    if (up.node < 0) continue;
    const TimedMove& m = all_[place(2 * (node * lattice_.joints() + j) + up.direction)];
    low = std::min(low, up.value);
    if (m.top > 0.0) {
      high = std::min(high, up.value + up.width * m.area * m.least_slope(price_));  // j moves alone
    }
  }
  if (!(low < high)) return high;
  const auto over = [&](double value) {
    set_moves(node, value);
    return gain_.of(moves_, weights_.pump_flow()) - price_;
  };
  /// Excess over the price at which a node's value is accepted, relative to the price.
  /// @threshold [1] 1e-6..1e-2; chosen: the guide only proposes shares; whatever it proposes is a bound
  constexpr double kEnough = 1e-3;
  double left = -price_, right = over(high);
  if (right <= kEnough * price_) return high;
  int last = 0;  // false position (Illinois)
  /// Largest number of steps of false position.
  /// @threshold [1] 10..100; numerical: the Illinois method converges superlinearly; this ends it on rounding only
  constexpr int kMost = 30;
  for (int i = 0; i < kMost; ++i) {
    const double middle = (low * right - high * left) / (right - left);
    const double here = over(middle);
    if (std::abs(here) < kEnough * price_) return middle;
    if (here > 0.0) {
      high = middle;
      right = here;
      if (last > 0) left *= 0.5;
      last = 1;
    } else {
      low = middle;
      left = here;
      if (last < 0) right *= 0.5;
      last = -1;
    }
  }
  return high;
}

bool TimeGuide::sweep(unsigned order) {
  /// Relative change of a node's value from which a sweep has changed something.
  /// @threshold [1] 1e-9..1e-2; chosen: far below the accuracy of the guide's grid
  constexpr double kNews = 1e-5;
  bool any = false;
  for (long count = 0; count < lattice_.nodes; ++count) {
    long node = 0;
    for (int j = 0; j < lattice_.joints(); ++j) {
      const long lines = lattice_.lines[place(j)].size();
      const long line = lattice_.line(count, j);
      node += ((order >> j & 1u) != 0 ? lines - 1 - line : line) * lattice_.stride[place(j)];
    }
    const double value = update(node);
    if (!(value < value_[place(node)] * (1.0 - kNews))) continue;
    value_[place(node)] = value;
    any = true;
  }
  return any;
}

double TimeGuide::solve(double price) {
  price_ = price;
  value_.assign(place(lattice_.nodes), kFar);
  value_[place(lattice_.nearest_node(problem_.start))] = 0.0;
  const unsigned orders = 1u << lattice_.joints();
  /// Largest number of sweeps.
  /// @threshold [sweeps] 10..1e4; numerical: ends sweeps that only rounding keeps going
  constexpr unsigned kMost = 200;
  for (unsigned quiet = 0, k = 0; quiet < orders && k < kMost; ++k) {
    quiet = sweep(k % orders) ? 0 : quiet + 1;
  }
  // Nodes that cannot be reached get a value so large that no motion ends there.
  const double top = std::transform_reduce(
      value_.begin(), value_.end(), 0.0, [](double a, double b) { return std::max(a, b); },
      [](double v) { return std::isfinite(v) ? v : 0.0; });
  std::vector<double> values = value_;
  for (double& v : values) v = std::isfinite(v) ? v : 10.0 * top;
  potential_.replace(std::move(values));
  /// Relative accuracy of the least time at the goal.
  /// @threshold [1] 1e-5..1e-2; chosen: the guide only proposes shares
  constexpr double kRough = 1e-3;
  /// Resolution of the goal set.
  /// @threshold [m] 1e-4..0.1; chosen: the guide only proposes shares
  constexpr double kRoughTip = 0.01;
  const LeastOnGoal least = least_on_goal(problem_, loaded_, potential_, {kRough, kRoughTip});
  end_ = least.q;
  return least.reachable ? least.lower : kFar;
}

TimeShares TimeGuide::shares(const TimeShares& like) {
  const int n = lattice_.joints();
  // Share of the way that leads through each node, propagated from the end back to the start.
  std::vector<double> flow = potential_.corner_weights(end_);
  std::vector<long> order(place(lattice_.nodes));
  std::iota(order.begin(), order.end(), 0L);
  std::sort(order.begin(), order.end(),
            [&](long a, long b) { return value_[place(a)] > value_[place(b)]; });
  std::vector<LogFit> fits(place(2 * n), LogFit(n));
  std::vector<TimedMove> alone(1);
  double total = 0.0;
  for (const long node : order) {
    const double through = flow[place(node)];
    /// Share of the way that passes through a node, up to which it is left out.
    /// @threshold [1] 0..1e-3; numerical: rounding of shares of one
    constexpr double kNoFlow = 1e-9;
    if (!(through > kNoFlow) || !std::isfinite(value_[place(node)])) continue;
    set_moves(node, value_[place(node)]);
    if (moves_.empty()) continue;
    const double gain = gain_.of(moves_, weights_.pump_flow());
    // The best speeds are the Hamiltonian's derivatives with respect to the slopes.
    std::vector<double> rate(moves_.size());
    double rates = 0.0;
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      /// Relative step of the difference quotient by a slope.
      /// @threshold [1] 1e-6..0.1; numerical: the gain is piecewise smooth, so one side suffices, and rounding stays
      /// below 1e-10
      constexpr double kStep = 1e-3;
      const double slope = moves_[i].slope;
      moves_[i].slope *= 1.0 - kStep;
      rate[i] = std::max(0.0, gain - gain_.of(moves_, weights_.pump_flow())) /
                (kStep * slope * moves_[i].area) / upwind(node, moves_[i].joint).width;
      moves_[i].slope = slope;
      rates += rate[i];
    }
    if (!(rates > 0.0)) continue;
    const VectorXd q = lattice_.posture(node);
    const VectorXd at = weights_.place_of(q.data());
    const double time = through / rates;
    total += time;
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      flow[place(upwind(node, moves_[i].joint).node)] += through * rate[i] / rates;
      alone[0] = moves_[i];
      /// Least share of the price that a joint is fitted with.
      /// @threshold [1] 0..0.5; chosen: the logarithm of a smaller one has no influence
      constexpr double kLeastShare = 0.02;
      const double share = gain_.of(alone, weights_.pump_flow()) / price_;
      fits[place(2 * moves_[i].joint + moves_[i].direction)].add(
          at, std::log(std::max(share, kLeastShare)), time);
    }
  }
  TimeShares shares = like;
  shares.share = Eigen::MatrixX2d::Zero(n, 2);
  shares.tilt = Eigen::MatrixXd::Zero(2 * n, n);
  /// Share of the time below which a joint's moves give no share of their own.
  /// @threshold [1] 0..0.5; chosen: too few postures for a fit
  constexpr double kSeldom = 0.01;
  for (int j = 0; j < n; ++j) {
    for (const int direction : {0, 1}) {
      const int row = 2 * j + direction;
      const LogFit& fit = fits[place(row)];
      if (!(fit.weight > kSeldom * total)) continue;
      const VectorXd found = fit.solved();
      shares.share(j, direction) = std::exp(found[0]);
      shares.tilt.row(row) = found.tail(n).transpose();
    }
  }
  return shares;
}

}  // namespace sparflow
