#include "apps/report/charts/decimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_set>
#include <utility>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Index = Eigen::Index;

std::vector<Index> finite_points(const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  SPARFLOW_CHECK(x.size() == y.size(), "a cloud needs as many x as y");
  std::vector<Index> points;
  for (Index i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i])) points.push_back(i);
  }
  return points;
}

}  // namespace

std::vector<Index> decimate_rows(const std::vector<const Eigen::VectorXd*>& columns, Index most) {
  const Index rows = columns.empty() ? 0 : columns.front()->size();
  std::vector<Index> kept;
  if (rows <= most) {
    for (Index i = 0; i < rows; ++i) kept.push_back(i);
    return kept;
  }
  const Index buckets = std::max<Index>(1, most / (2 * static_cast<Index>(columns.size())));
  std::set<Index> chosen = {0, rows - 1};
  for (Index bucket = 0; bucket < buckets; ++bucket) {
    const Index begin = bucket * rows / buckets;
    const Index end = (bucket + 1) * rows / buckets;
    for (const Eigen::VectorXd* column : columns) {
      SPARFLOW_CHECK(column->size() == rows, "curves of one chart need one length");
      Index smallest = -1, largest = -1, gap = -1;
      for (Index i = begin; i < end; ++i) {
        const double value = (*column)[i];
        if (!std::isfinite(value)) {
          if (gap < 0) gap = i;
          continue;
        }
        if (smallest < 0 || value < (*column)[smallest]) smallest = i;
        if (largest < 0 || value > (*column)[largest]) largest = i;
      }
      for (const Index i : {smallest, largest, gap}) {
        if (i >= 0) chosen.insert(i);
      }
    }
  }
  return {chosen.begin(), chosen.end()};
}

std::vector<Index> decimate_cloud(const Eigen::VectorXd& x, const Eigen::VectorXd& y, Index most) {
  const std::vector<Index> points = finite_points(x, y);
  if (static_cast<Index>(points.size()) <= most) return points;
  double x_lo = x[points[0]], x_hi = x_lo, y_lo = y[points[0]], y_hi = y_lo;
  for (const Index i : points) {
    x_lo = std::min(x_lo, x[i]);
    x_hi = std::max(x_hi, x[i]);
    y_lo = std::min(y_lo, y[i]);
    y_hi = std::max(y_hi, y[i]);
  }
  std::vector<Index> kept;
  // 640 x 320 cells are about what a chart can show; the grid is coarser only when that leaves too many points.
  for (double cells = 640.0; cells >= 2.0; cells *= 0.8) {
    kept.clear();
    std::unordered_set<long> taken;
    const double x_scale = x_hi > x_lo ? cells / (x_hi - x_lo) : 0.0;
    const double y_scale = y_hi > y_lo ? 0.5 * cells / (y_hi - y_lo) : 0.0;
    for (const Index i : points) {
      const long column = std::lround((x[i] - x_lo) * x_scale);
      const long row = std::lround((y[i] - y_lo) * y_scale);
      if (taken.insert(row * 1000 + column).second) kept.push_back(i);
    }
    if (static_cast<Index>(kept.size()) <= most) break;
  }
  return kept;
}

/// [-] A gap of this share of the points' range interrupts the line of medians: a line across it would show friction that
/// changes sign with the direction as if it grew with the speed.
constexpr double kGapShare = 0.05;

BinnedMedian binned_median(const Eigen::VectorXd& x, const Eigen::VectorXd& y, int bins) {
  std::vector<Index> points = finite_points(x, y);
  const auto count = static_cast<Index>(points.size());
  const Index used = std::min<Index>(bins, count / 20);
  if (used < 2) return {};
  std::stable_sort(points.begin(), points.end(), [&](Index a, Index b) { return x[a] < x[b]; });
  const auto at = [&](Index i) { return x[points[static_cast<std::size_t>(i)]]; };
  const double gap = kGapShare * (at(count - 1) - at(0));
  std::vector<double> middle_x, middle_y;
  for (Index first = 0, last = 0; first < count; first = last) {
    // A stretch without a gap is cut into bins with equally many points.
    for (last = first + 1; last < count && at(last) - at(last - 1) <= gap;) ++last;
    const Index n = last - first;
    const Index own = std::max<Index>(1, (used * n + count / 2) / count);
    if (!middle_x.empty()) {
      middle_x.push_back(0.5 * (at(first) + at(first - 1)));
      middle_y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    for (Index bin = 0; bin < own; ++bin) {
      const auto begin = points.begin() + first + bin * n / own;
      const auto end = points.begin() + first + (bin + 1) * n / own;
      middle_x.push_back(x[*(begin + (end - begin) / 2)]);
      std::vector<double> values;
      for (auto i = begin; i != end; ++i) values.push_back(y[*i]);
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      middle_y.push_back(*middle);
    }
  }
  const auto n = static_cast<Index>(middle_x.size());
  return {Eigen::Map<const Eigen::VectorXd>(middle_x.data(), n),
          Eigen::Map<const Eigen::VectorXd>(middle_y.data(), n)};
}

}  // namespace sparflow
