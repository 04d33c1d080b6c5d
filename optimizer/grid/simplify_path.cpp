#include "optimizer/grid/simplify_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNever = std::numeric_limits<double>::infinity();
/// Largest number of corners skipped between two chosen ones.
/// @threshold [corners] 2..1e4; chosen: the time grows with it; a straight leg rarely replaces more
constexpr Eigen::Index kLongestJump = 60;

struct Jump {
  std::vector<VectorXd> corners;  // without the first
  double cost = kNever;
};

/// Best way from the path's first corner to another one: with the fewest lines of the path that the exact checks refuse,
/// and among these the cheapest.
struct Way {
  int refused = std::numeric_limits<int>::max();
  double cost = kNever;
  Eigen::Index before = 0;        // corner from which its last lines come
  std::vector<VectorXd> corners;  // of its last lines, without the first
};

class LegChooser {
 public:
  LegChooser(MovePricer& pricer, const LegSearch& search) : pricer_(pricer), search_(search) {}

  MoveCost line(const VectorXd& a, const VectorXd& b) {
    double parts = 1.0;
    for (Eigen::Index j = 0; j < a.size(); ++j) {
      parts = std::max(parts, std::ceil(std::abs(b[j] - a[j]) / search_.part[j] - 1e-6));
    }
    return pricer_.price_line(a, b, static_cast<int>(std::min(parts, 24.0)));
  }

  /// Cheapest way from a to b if it costs less than `bound`.
  Jump jump(const VectorXd& a, const VectorXd& b, double bound) {
    Jump best;
    best.cost = bound;
    offer(a, {b}, best);
    std::vector<Eigen::Index> moving;
    for (Eigen::Index j = 0; j < a.size(); ++j) {
      if (a[j] != b[j]) moving.push_back(j);
    }
    /// Largest number of joints that are moved one after another between two corners.
    /// @threshold [joints] 2..7; chosen: 24 orders of four joints, each checked for clearance; five would make 120 of them
    constexpr std::size_t kMostInTurn = 4;
    if (moving.size() < 2 || moving.size() > kMostInTurn) return best;
    do {
      std::vector<VectorXd> way;
      VectorXd q = a;
      for (const Eigen::Index j : moving) {
        q[j] = b[j];
        way.push_back(q);
      }
      offer(a, way, best);
    } while (std::next_permutation(moving.begin(), moving.end()));
    return best;
  }

 private:
  void offer(const VectorXd& a, const std::vector<VectorXd>& way, Jump& best) {
    double cost = 0.0;
    const VectorXd* from = &a;
    for (const VectorXd& to : way) {
      cost += search_.leg_penalty + line(*from, to).at_price(search_.price);
      if (!(cost < best.cost)) return;
      from = &to;
    }
    if (search_.clear) {
      from = &a;
      for (const VectorXd& to : way) {
        if (!search_.clear(*from, to)) return;
        from = &to;
      }
    }
    best.cost = cost;
    best.corners = way;
  }

  MovePricer& pricer_;
  const LegSearch& search_;
};

/// Direction of each joint's move: -1, 0 or 1.
std::vector<int> leg_signs(const VectorXd& step) {
  std::vector<int> s;
  for (const double d : step) s.push_back(d > 0.0 ? 1 : d < 0.0 ? -1 : 0);
  return s;
}

/// Joins consecutive legs of a single joint in the same direction.
void join_legs(std::vector<VectorXd>& corners) {
  for (std::size_t k = 1; k + 1 < corners.size();) {
    const std::vector<int> before = leg_signs(corners[k] - corners[k - 1]);
    const std::vector<int> after = leg_signs(corners[k + 1] - corners[k]);
    const auto moving = std::count_if(before.begin(), before.end(), [](int s) { return s != 0; });
    if (moving == 0 || (moving == 1 && before == after)) {
      corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(k));
    } else {
      ++k;
    }
  }
}

}  // namespace

Legs simplify_path(MovePricer& pricer, const MatrixXd& path, const LegSearch& search) {
  LegChooser chooser(pricer, search);
  const Eigen::Index count = path.rows();
  std::vector<Way> way(static_cast<std::size_t>(count));
  way[0].refused = 0;
  way[0].cost = 0.0;
  for (Eigen::Index to = 1; to < count; ++to) {
    Way& best = way[static_cast<std::size_t>(to)];
    // Adjacent corners come first: the path itself connects them, and their cost bounds the others.
    for (Eigen::Index from = to - 1; from >= std::max<Eigen::Index>(0, to - kLongestJump); --from) {
      const Way& until = way[static_cast<std::size_t>(from)];
      if (until.refused > best.refused) continue;
      const double bound = until.refused < best.refused ? kNever : best.cost - until.cost;
      if (!(bound > 0.0)) continue;
      Jump j = chooser.jump(path.row(from).transpose(), path.row(to).transpose(), bound);
      if (j.cost < bound) {
        best = {until.refused, until.cost + j.cost, from, std::move(j.corners)};
      } else if (from + 1 == to) {
        // The path's own line stays, at no cost, where no line between its ends can be driven.
        best = {until.refused + 1, until.cost, from, {path.row(to).transpose()}};
      }
    }
  }
  std::vector<Eigen::Index> chosen;
  for (Eigen::Index k = count - 1; k > 0; k = way[static_cast<std::size_t>(k)].before) {
    chosen.push_back(k);
  }
  std::vector<VectorXd> corners = {path.row(0).transpose()};
  for (std::size_t i = chosen.size(); i-- > 0;) {
    for (const VectorXd& q : way[static_cast<std::size_t>(chosen[i])].corners) {
      corners.push_back(q);
    }
  }
  join_legs(corners);
  Legs legs;
  legs.refused = way.back().refused;
  legs.corners.resize(static_cast<Eigen::Index>(corners.size()), path.cols());
  for (std::size_t k = 0; k < corners.size(); ++k) {
    legs.corners.row(static_cast<Eigen::Index>(k)) = corners[k].transpose();
    if (k == 0) continue;
    const MoveCost leg = chooser.line(corners[k - 1], corners[k]);
    legs.cost.add(leg);
    legs.slow_energy += leg.least_energy();
  }
  return legs;
}

}  // namespace sparflow
