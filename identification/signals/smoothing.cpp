#include "identification/signals/smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "identification/log/log_time.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

constexpr int kMaxOrder = 4;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// @param nodes, at sample positions and point of evaluation, both scaled to about -1..1
/// @return [3 x window] weights of value, first and second derivative at `at` of the fitted polynomial
Eigen::MatrixXd fit_weights(const Eigen::VectorXd& nodes, double at, int order) {
  Eigen::MatrixXd basis(nodes.size(), order + 1);
  basis.col(0).setOnes();
  for (int k = 1; k <= order; ++k) basis.col(k) = basis.col(k - 1).cwiseProduct(nodes);
  Eigen::MatrixXd evaluate = Eigen::MatrixXd::Zero(3, order + 1);
  for (int k = 0; k <= order; ++k) {
    evaluate(0, k) = std::pow(at, k);
    if (k >= 1) evaluate(1, k) = k * std::pow(at, k - 1);
    if (k >= 2) evaluate(2, k) = k * (k - 1) * std::pow(at, k - 2);
  }
  return least_norm_columns(basis, evaluate.transpose()).transpose();
}

/// @return number of samples on either side of the middle in a window of `window_s`
int half_width(double window_s, double step, int order) {
  const int from_time = step > 0.0 ? static_cast<int>(std::floor(0.5 * window_s / step + 1e-6)) : 0;
  return std::max(from_time, (order + 2) / 2);
}

bool is_even(const Eigen::VectorXd& time, SampleRange run, double step) {
  const double count = static_cast<double>(run.size() - 1);
  if (run.size() < 2) return true;
  const double mean = (time[run.end - 1] - time[run.begin]) / count;
  if (std::abs(mean - step) > 1e-3 * step) return false;
  for (Eigen::Index i = run.begin; i < run.end; ++i) {
    const double expected = time[run.begin] + mean * static_cast<double>(i - run.begin);
    if (std::abs(time[i] - expected) > 1e-3 * step) return false;
  }
  return true;
}

}  // namespace

SavitzkyGolay::SavitzkyGolay(Eigen::VectorXd time, std::vector<SampleRange> runs, double window_s,
                             int order)
    : time_(std::move(time)),
      runs_(std::move(runs)),
      window_s_(window_s),
      order_(order),
      step_(median_step(time_)) {
  SPARFLOW_CHECK(order >= 1 && order <= kMaxOrder, "order of the smoothing polynomial is 1 to 4");
  SPARFLOW_CHECK(window_s > 0.0 && std::isfinite(window_s), "smoothing window must be positive");
  half_ = half_width(window_s_, step_, order_);
  for (const SampleRange& run : runs_) even_.push_back(is_even(time_, run, step_));
  const int width = 2 * half_ + 1;
  const double scale = 1.0 / half_;
  const Eigen::VectorXd nodes = Eigen::VectorXd::LinSpaced(width, -1.0, 1.0);
  for (Eigen::MatrixXd& weights : weights_) weights.resize(width, width);
  for (int i = 0; i < width; ++i) {
    const Eigen::MatrixXd all = fit_weights(nodes, nodes[i], order_);
    weights_[0].col(i) = all.row(0).transpose();
    weights_[1].col(i) = all.row(1).transpose() * scale;
    weights_[2].col(i) = all.row(2).transpose() * scale * scale;
  }
}

double SavitzkyGolay::noise_gain(int derivative) const {
  SPARFLOW_CHECK(derivative >= 0 && derivative <= 2, "derivative is 0, 1 or 2");
  return weights_[derivative].col(half_).norm() / std::pow(step_, derivative);
}

Eigen::VectorXd SavitzkyGolay::apply(const Eigen::Ref<const Eigen::VectorXd>& values,
                                     int derivative) const {
  SPARFLOW_CHECK(derivative >= 0 && derivative <= 2, "derivative is 0, 1 or 2");
  Smoothed all = smooth(values);
  return derivative == 0 ? all.value : derivative == 1 ? all.first : all.second;
}

Smoothed SavitzkyGolay::smooth(const Eigen::Ref<const Eigen::VectorXd>& values) const {
  SPARFLOW_CHECK(values.size() == time_.size(), "channel and time differ in length");
  Smoothed out;
  for (Eigen::VectorXd* v : {&out.value, &out.first, &out.second})
    v->setConstant(values.size(), kNone);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    Eigen::Index begin = runs_[r].begin;
    for (Eigen::Index i = runs_[r].begin; i <= runs_[r].end; ++i) {
      if (i < runs_[r].end && std::isfinite(values[i])) continue;
      smooth_stretch(values, {begin, i}, even_[r], &out);
      begin = i + 1;
    }
  }
  return out;
}

void SavitzkyGolay::smooth_stretch(const Eigen::Ref<const Eigen::VectorXd>& values,
                                   SampleRange stretch, bool even, Smoothed* out) const {
  if (stretch.size() < order_ + 1) return;
  if (even && stretch.size() >= 2 * half_ + 1) {
    smooth_even(values, stretch, out);
  } else {
    smooth_uneven(values, stretch, out);
  }
}

void SavitzkyGolay::smooth_even(const Eigen::Ref<const Eigen::VectorXd>& values,
                                SampleRange stretch, Smoothed* out) const {
  const Eigen::Index width = 2 * half_ + 1;
  const double rate = 1.0 / step_;
  Eigen::VectorXd window(width);
  for (Eigen::Index i = stretch.begin; i < stretch.end; ++i) {
    const Eigen::Index first = std::clamp(i - half_, stretch.begin, stretch.end - width);
    const Eigen::Index at = i - first;
    // Subtracting a constant first avoids rounding errors with large offsets (pressures in Pa).
    const double level = values[i];
    window = values.segment(first, width).array() - level;
    out->value[i] = level + weights_[0].col(at).dot(window);
    out->first[i] = weights_[1].col(at).dot(window) * rate;
    out->second[i] = weights_[2].col(at).dot(window) * rate * rate;
  }
}

void SavitzkyGolay::smooth_uneven(const Eigen::Ref<const Eigen::VectorXd>& values,
                                  SampleRange stretch, Smoothed* out) const {
  const double half = std::max(0.5 * window_s_, half_ * step_) * (1.0 + 1e-9);
  const double start = time_[stretch.begin], stop = time_[stretch.end - 1];
  const Eigen::Index fewest = std::min<Eigen::Index>(order_ + 2, stretch.size());
  const int n = order_ + 1;
  using Square =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxOrder + 1, kMaxOrder + 1>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxOrder + 1, 1>;
  Eigen::Index lo = stretch.begin, hi = stretch.begin;  // the window is lo .. hi-1
  for (Eigen::Index i = stretch.begin; i < stretch.end; ++i) {
    // At the ends the window keeps its width and becomes one-sided.
    const double middle = std::max(std::min(time_[i], stop - half), std::min(start + half, stop));
    const double centre = stop - start <= 2.0 * half ? 0.5 * (start + stop) : middle;
    while (lo < i && time_[lo] < centre - half) ++lo;
    hi = std::max(hi, i + 1);
    while (hi < stretch.end && time_[hi] <= centre + half) ++hi;
    Eigen::Index first = lo, last = hi;
    while (last - first < fewest) {  // coarse sampling: the nearest neighbours are added
      const bool right =
          first == stretch.begin ||
          (last < stretch.end && time_[last] - time_[i] < time_[i] - time_[first - 1]);
      right ? ++last : --first;
    }
    const double origin = 0.5 * (time_[first] + time_[last - 1]);
    const double reach = 0.5 * (time_[last - 1] - time_[first]);
    const double level = values[i];
    std::array<double, 2 * kMaxOrder + 1> moments{};
    Vector right_side = Vector::Zero(n);
    for (Eigen::Index k = first; k < last; ++k) {
      const double s = (time_[k] - origin) / reach;
      double power = 1.0;
      for (int m = 0; m <= 2 * order_; ++m, power *= s) {
        moments[static_cast<std::size_t>(m)] += power;
        if (m <= order_) right_side[m] += power * (values[k] - level);
      }
    }
    Square normal(n, n);
    for (int a = 0; a < n; ++a) {
      for (int b = 0; b < n; ++b) normal(a, b) = moments[static_cast<std::size_t>(a + b)];
    }
    const Vector c = normal.ldlt().solve(right_side);
    const double s = (time_[i] - origin) / reach;
    double value = 0.0, slope = 0.0, curvature = 0.0;  // Horner's scheme with both derivatives
    for (int k = order_; k >= 0; --k) {
      curvature = curvature * s + 2.0 * slope;
      slope = slope * s + value;
      value = value * s + c[k];
    }
    out->value[i] = level + value;
    out->first[i] = slope / reach;
    out->second[i] = curvature / (reach * reach);
  }
}

}  // namespace sparflow
