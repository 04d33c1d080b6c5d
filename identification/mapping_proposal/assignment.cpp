#include "identification/mapping_proposal/assignment.h"

#include <algorithm>
#include <limits>
#include <set>

namespace sparflow {

std::vector<int> best_assignment(const Eigen::MatrixXd& score, double* total) {
  const auto rows = static_cast<std::size_t>(score.rows());
  const auto real = static_cast<std::size_t>(score.cols());
  // A column of score zero for each row stands for "none", so that every row finds one.
  const std::size_t columns = real + rows;
  const auto cost = [&](std::size_t r, std::size_t c) {
    return c < real ? -score(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) : 0.0;
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  // Index 0 is the free row or column of the method; rows and columns are counted from 1.
  std::vector<double> row_potential(rows + 1, 0.0), column_potential(columns + 1, 0.0);
  std::vector<std::size_t> row_of(columns + 1, 0), way(columns + 1, 0);
  for (std::size_t r = 1; r <= rows; ++r) {
    row_of[0] = r;
    std::size_t at = 0;
    std::vector<double> least(columns + 1, kInfinity);
    std::vector<bool> used(columns + 1, false);
    do {
      used[at] = true;
      const std::size_t row = row_of[at];
      double delta = kInfinity;
      std::size_t next = 0;
      for (std::size_t c = 1; c <= columns; ++c) {
        if (used[c]) continue;
        const double reduced = cost(row - 1, c - 1) - row_potential[row] - column_potential[c];
        if (reduced < least[c]) least[c] = reduced, way[c] = at;
        if (least[c] < delta) delta = least[c], next = c;
      }
      for (std::size_t c = 0; c <= columns; ++c) {
        if (used[c]) {
          row_potential[row_of[c]] += delta;
          column_potential[c] -= delta;
        } else {
          least[c] -= delta;
        }
      }
      at = next;
    } while (row_of[at] != 0);
    do {
      const std::size_t before = way[at];
      row_of[at] = row_of[before];
      at = before;
    } while (at != 0);
  }
  std::vector<int> taken(rows, -1);
  double sum = 0.0;
  for (std::size_t c = 1; c <= real; ++c) {
    if (row_of[c] == 0 || cost(row_of[c] - 1, c - 1) >= 0.0) continue;
    taken[row_of[c] - 1] = static_cast<int>(c) - 1;
    sum -= cost(row_of[c] - 1, c - 1);
  }
  if (total != nullptr) *total = sum;
  return taken;
}

namespace {

class PairSearch {
 public:
  PairSearch(std::vector<std::vector<ColumnPair>> groups, std::size_t count)
      : groups_(std::move(groups)), count_(count), bound_(groups_.size() + 1, 0.0) {
    for (auto& group : groups_) {
      std::stable_sort(group.begin(), group.end(),
                       [](const ColumnPair& a, const ColumnPair& b) { return a.score > b.score; });
    }
    for (std::size_t g = groups_.size(); g-- > 0;) {
      bound_[g] = bound_[g + 1] + (groups_[g].empty() ? 0.0 : groups_[g].front().score);
    }
  }

  std::vector<PairSet> run() {
    descend(0, 0.0);
    return std::move(best_);
  }

 private:
  double least() const {
    return best_.size() < count_ ? -std::numeric_limits<double>::infinity() : best_.back().total;
  }

  void descend(std::size_t g, double sum) {
    if (g == groups_.size()) {
      PairSet set{chosen_, sum};
      const auto place =
          std::upper_bound(best_.begin(), best_.end(), set,
                           [](const PairSet& a, const PairSet& b) { return a.total > b.total; });
      best_.insert(place, std::move(set));
      if (best_.size() > count_) best_.pop_back();
      return;
    }
    for (const ColumnPair& pair : groups_[g]) {
      if (sum + pair.score + bound_[g + 1] <= least()) break;
      if ((pair.first >= 0 && used_.count(pair.first) > 0) ||
          (pair.second >= 0 && used_.count(pair.second) > 0)) {
        continue;
      }
      chosen_.push_back(pair);
      if (pair.first >= 0) used_.insert(pair.first);
      if (pair.second >= 0) used_.insert(pair.second);
      descend(g + 1, sum + pair.score);
      used_.erase(pair.first);
      used_.erase(pair.second);
      chosen_.pop_back();
    }
  }

  std::vector<std::vector<ColumnPair>> groups_;
  std::size_t count_;
  std::vector<double> bound_;  ///< best sum of the groups from here on, columns shared or not
  std::vector<ColumnPair> chosen_;
  std::set<int> used_;
  std::vector<PairSet> best_;
};

}  // namespace

std::vector<PairSet> best_pair_sets(std::vector<std::vector<ColumnPair>> groups,
                                    std::size_t count) {
  if (count == 0) return {};
  return PairSearch(std::move(groups), count).run();
}

}  // namespace sparflow
