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

PairSet greedy_pairs(const std::vector<std::vector<ColumnPair>>& groups) {
  PairSet set;
  set.pairs.resize(groups.size());
  std::set<int> used;
  std::vector<bool> done(groups.size(), false);
  for (std::size_t round = 0; round < groups.size(); ++round) {
    std::size_t at = groups.size();
    ColumnPair best;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (done[g]) continue;
      for (const ColumnPair& p : groups[g]) {
        if (used.count(p.first) > 0 || used.count(p.second) > 0) continue;
        if (at == groups.size() || p.score > best.score) at = g, best = p;
      }
    }
    if (at == groups.size()) break;
    done[at] = true;
    set.pairs[at] = best;
    set.total += best.score;
    if (best.first >= 0) used.insert(best.first);
    if (best.second >= 0) used.insert(best.second);
  }
  return set;
}

namespace {

class PairSearch {
 public:
  PairSearch(std::vector<std::vector<ColumnPair>> groups, std::size_t count, std::int64_t steps)
      : groups_(std::move(groups)), count_(count), steps_(steps), bound_(groups_.size() + 1, 0.0) {
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
    if (steps_ < 0) {
      // Of a search that was ended nothing says that its sets are good; the greedy one is a floor.
      PairSet greedy = greedy_pairs(groups_);
      if (best_.empty() || greedy.total > best_.front().total) keep(std::move(greedy));
    }
    return std::move(best_);
  }

 private:
  double least() const {
    return best_.size() < count_ ? -std::numeric_limits<double>::infinity() : best_.back().total;
  }

  void keep(PairSet set) {
    const auto place =
        std::upper_bound(best_.begin(), best_.end(), set,
                         [](const PairSet& a, const PairSet& b) { return a.total > b.total; });
    best_.insert(place, std::move(set));
    if (best_.size() > count_) best_.pop_back();
  }

  void descend(std::size_t g, double sum) {
    if (g == groups_.size()) {
      keep({chosen_, sum});
      return;
    }
    for (const ColumnPair& pair : groups_[g]) {
      if (--steps_ < 0) return;
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
  std::int64_t steps_;         ///< that are left; negative: the search was ended
  std::vector<double> bound_;  ///< best sum of the groups from here on, columns shared or not
  std::vector<ColumnPair> chosen_;
  std::set<int> used_;
  std::vector<PairSet> best_;
};

}  // namespace

std::vector<PairSet> best_pair_sets(std::vector<std::vector<ColumnPair>> groups, std::size_t count,
                                    const PairSearchOptions& options) {
  if (count == 0) return {};
  return PairSearch(std::move(groups), count, options.steps).run();
}

}  // namespace sparflow
