#include "optimizer/nlp/chain_ldl.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "models/math/error.h"
#include "optimizer/nlp/chain_ldl_kernel.h"

namespace sparflow {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// A scaled column below this consists of rounding errors, since its terms were near one before they cancelled.
/// @threshold [1] 1e-16..1e-10; numerical: some fifty units in the last place
constexpr double kVanished = 1e-14;
/// A pivot of at least this share of its column is taken at once, a smaller one only if there is no better one.
/// @threshold [1] 0.001..0.5; chosen: entries of L stay below ten; the growth is that of a threshold pivoting usual
/// in sparse codes
constexpr double kGoodPivot = 0.1;

/// 2^-k with k half the exponent of `largest`; scaling by it causes no rounding.
double half_power(double largest) {
  const auto bits = std::bit_cast<std::uint64_t>(largest);
  const int exponent = static_cast<int>((bits >> 52) & 0x7ff) - 1023;
  const int half = std::clamp(exponent, -400, 400) / 2;
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 - half) << 52);
}

/// Quality of a pivot of two rows (a, b; b, d), given the largest other entries of its rows: the inverse of their possible
/// growth, as own / beside for a pivot of one row. 0 = the block is singular.
double pair_quality(double a, double b, double d, double beside_a, double beside_d) {
  const double det = std::abs(a * d - b * b);
  if (std::abs(b) <= kVanished || det <= kVanished * std::max(std::abs(a * d), b * b)) return 0.0;
  const double growth = std::max(std::abs(d) * beside_a + std::abs(b) * beside_d,
                                 std::abs(b) * beside_a + std::abs(a) * beside_d);
  return growth > kGoodPivot * det ? det / growth : 1.0 / kGoodPivot;
}

}  // namespace

/// Two sweeps of symmetric equilibration in the largest entry (Ruiz 2001), rounded to powers of two.
void ChainLdl::scale(const double* value) {
  std::fill(scale_.begin(), scale_.end(), 1.0);
  for (int sweep = 0; sweep < 2; ++sweep) {
    std::fill(largest_.begin(), largest_.end(), 0.0);
    for (std::size_t e = 0; e < row_.size(); ++e) {
      const std::size_t i = at(row_[e]), j = at(column_[e]);
      const double size = std::abs(value[e]) * scale_[i] * scale_[j];
      largest_[i] = std::max(largest_[i], size);
      largest_[j] = std::max(largest_[j], size);
    }
    for (int i = 0; i < order_; ++i) {
      if (largest_[at(i)] > 0.0) scale_[at(i)] *= half_power(largest_[at(i)]);
    }
  }
}

LdlOutcome ChainLdl::factorise(const double* value, double threshold) {
  double finite = 0.0;
  for (std::size_t e = 0; e < row_.size(); ++e) finite += 0.0 * value[e];
  if (finite != 0.0) return LdlOutcome::kSingular;
  scale(value);
  statistics_.delayed = statistics_.pairs = statistics_.negative = 0;
  eliminated_ = 0;
  waiting_.clear();
  factor_used_ = index_used_ = 0;
  for (int f = 0; f < statistics_.fronts; ++f) {
    Front& front = fronts_[at(f)];
    const int delayed = take_contributions(front);
    assemble(f, delayed, value);
    front.size = delayed + front.rows;
    front.first_pivot = eliminated_;
    const int candidates = delayed + front.own;
    if (!eliminate(candidates, front.size, threshold, front.parent < 0))
      return LdlOutcome::kSingular;
    front.eliminated = eliminated_ - front.first_pivot;
    statistics_.delayed += candidates - front.eliminated;
    keep_panel(front);
    if (front.parent >= 0) push_contribution(f, candidates - front.eliminated);
  }
  return LdlOutcome::kRegular;
}

/// Clears the dense front and adds the contributions of its children. @return number of unknowns they delayed
int ChainLdl::take_contributions(const Front& front) {
  int delayed = 0;
  const std::size_t first = waiting_.size() - at(front.children);
  for (std::size_t w = first; w < waiting_.size(); ++w) delayed += waiting_[w].delayed;
  const int size = delayed + front.rows;
  stride_ = detail::ldl_stride(size);
  const std::size_t room = at(stride_) * at(size) + at(detail::kLdlPadding);
  if (work_.size() < room) {
    work_.resize(2 * room);
    product_.resize(2 * room);
  }
  if (unknown_.size() < at(stride_)) {
    unknown_.resize(2 * at(stride_));
    local_.resize(2 * at(stride_));
  }
  std::fill_n(work_.begin(), room, 0.0);
  std::copy_n(rows_.begin() + front.first_row, front.rows, unknown_.begin() + delayed);
  int next = 0;
  for (std::size_t w = first; w < waiting_.size(); ++w) {
    const Waiting& from = waiting_[w];
    const int* place = place_.data() + first_place_[at(from.front)];
    std::copy_n(waiting_index_.begin() + static_cast<long>(from.index), from.delayed,
                unknown_.begin() + next);
    const double* value = waiting_value_.data() + from.value;
    for (int c = 0; c < from.size; ++c, value += from.size) {
      const int column = c < from.delayed ? next + c : delayed + place[c - from.delayed];
      double* to = work_.data() + at(column) * at(stride_);
      for (int r = c; r < from.delayed; ++r) to[next + r] += value[r];
      const int rows = from.size - from.delayed;
      for (int r = std::max(0, c - from.delayed); r < rows; ++r)
        to[delayed + place[r]] += value[from.delayed + r];
    }
    next += from.delayed;
  }
  waiting_.resize(first);
  return delayed;
}

/// Adds the matrix' own values to a front with `delayed` unknowns of its children.
void ChainLdl::assemble(int number, int delayed, const double* value) {
  const int end = number + 1 < statistics_.fronts ? fronts_[at(number + 1)].first_entry
                                                  : static_cast<int>(entry_.size());
  double* to = work_.data() + at(delayed) * at(stride_) + delayed;
  for (int k = fronts_[at(number)].first_entry; k < end; ++k) {
    const std::size_t e = at(entry_[at(k)]);
    to[at(entry_column_[at(k)]) * at(stride_) + at(entry_row_[at(k)])] +=
        value[e] * scale_[at(row_[e])] * scale_[at(column_[e])];
  }
}

/// Eliminates as many as possible of the first `candidates` unknowns of the front and updates the others.
/// @param last true for a front without parent, where no pivot can be delayed
/// @return false when the matrix is singular
bool ChainLdl::eliminate(int candidates, int size, double threshold, bool last) {
  const detail::LdlKernel& kernel = detail::ldl_kernel();
  double* f = work_.data();
  const long stride = stride_;
  int k = 0;
  while (k < candidates) {
    const Pivot pivot = choose_pivot(k, candidates, size, last ? 0.0 : threshold);
    if (pivot == Pivot::kVanished || (pivot == Pivot::kNone && last)) return false;
    if (pivot == Pivot::kNone) break;
    const int width = pivot == Pivot::kPair ? 2 : 1;
    double* l1 = f + k * stride;
    double* w1 = product_.data() + k * stride;
    std::copy(l1 + k, l1 + size + detail::kLdlPadding, w1 + k);
    double* inverse = pivot_.data() + 2 * at(eliminated_);
    if (width == 1) {
      const double d = l1[k];
      statistics_.negative += d < 0.0 ? 1 : 0;
      inverse[0] = 1.0 / d;
      inverse[1] = 0.0;
      for (int i = k + 1; i < size; ++i) l1[i] *= inverse[0];
      kernel.update(f, stride_, k + 1, candidates, size, l1, w1, nullptr, nullptr);
    } else {
      double* l2 = l1 + stride;
      double* w2 = w1 + stride;
      std::copy(l2 + k + 1, l2 + size + detail::kLdlPadding, w2 + k + 1);
      const double a = l1[k], b = l1[k + 1], c = l2[k + 1], det = a * c - b * b;
      statistics_.negative += det < 0.0 ? 1 : (a + c < 0.0 ? 2 : 0);
      ++statistics_.pairs;
      inverse[0] = c / det;
      inverse[1] = -b / det;
      inverse[2] = a / det;
      inverse[3] = 0.0;
      l1[k + 1] = 0.0;
      for (int i = k + 2; i < size; ++i) {
        const double x = l1[i], y = l2[i];
        l1[i] = inverse[0] * x + inverse[1] * y;
        l2[i] = inverse[1] * x + inverse[2] * y;
      }
      width_[at(eliminated_) + 1] = 0;
      kernel.update(f, stride_, k + 2, candidates, size, l1, w1, l2, w2);
    }
    width_[at(eliminated_)] = width;
    eliminated_ += width;
    k += width;
  }
  kernel.product(f, stride_, candidates, size, f, product_.data(), k);
  return true;
}

/// Finds the next pivot and moves it to position k.
ChainLdl::Pivot ChainLdl::choose_pivot(int k, int candidates, int size, double threshold) {
  const double* f = work_.data();
  const long stride = stride_;
  const auto entry = [&](int i, int j) { return i >= j ? f[j * stride + i] : f[i * stride + j]; };
  // Largest off-diagonal entry of column c, and the candidate `partner` whose row has it, if one does.
  const auto largest = [&](int c, int without, int& partner) {
    double most = 0.0;
    partner = -1;
    for (int j = k; j < c; ++j) {
      const double value = std::abs(f[j * stride + c]);
      if (value > most && j != without) {
        most = value;
        partner = j;
      }
    }
    const double* column = f + c * stride;
    for (int i = c + 1; i < candidates; ++i) {
      const double value = std::abs(column[i]);
      if (value > most && i != without) {
        most = value;
        partner = i;
      }
    }
    double below = 0.0;
    for (int i = candidates; i < size; ++i) below = std::max(below, std::abs(column[i]));
    return std::max(most, below);
  };
  // Mostly the first candidate is good enough.
  const double first = std::abs(f[k * stride + k]);
  if (first > kVanished &&
      first >= kGoodPivot * detail::ldl_kernel().largest(size - k - 1, f + k * stride + k + 1)) {
    return Pivot::kOne;
  }
  // Otherwise the pair that pair_up() formed is tried, if it is still adjacent.
  if (k + 1 < candidates) {
    const double* l1 = f + k * stride;
    const double* l2 = l1 + stride;
    const int below = size - k - 2;
    const double quality =
        pair_quality(l1[k], l1[k + 1], l2[k + 1], detail::ldl_kernel().largest(below, l1 + k + 2),
                     detail::ldl_kernel().largest(below, l2 + k + 2));
    if (quality >= kGoodPivot) {
      return Pivot::kPair;
    }
  }
  double best = 0.0;
  int best_first = -1, best_second = -1;
  for (int c = k; c < candidates && best < kGoodPivot; ++c) {
    int partner = -1, ignored = -1;
    const double own = std::abs(f[c * stride + c]), beside = largest(c, -1, partner);
    if (std::max(own, beside) <= kVanished) {
      return Pivot::kVanished;
    }
    if (own > kVanished && own > best * beside) {
      best = beside > 0.0 ? own / beside : 1.0 / kGoodPivot;
      best_first = c;
      best_second = -1;
    }
    if (best >= kGoodPivot || partner < 0) continue;
    const double beside_c = largest(c, partner, ignored);
    const double beside_p = largest(partner, c, ignored);
    const double quality =
        pair_quality(entry(c, c), entry(c, partner), entry(partner, partner), beside_c, beside_p);
    if (quality > best) {
      best = quality;
      best_first = c;
      best_second = partner;
    }
  }
  if (best_first < 0 || best < threshold) return Pivot::kNone;
  swap(k, best_first, size);
  if (best_second < 0) return Pivot::kOne;
  swap(k + 1, best_second == k ? best_first : best_second, size);
  return Pivot::kPair;
}

/// Exchanges unknowns a < b of the front, also in the rows of columns already eliminated.
void ChainLdl::swap(int a, int b, int size) {
  if (a == b) return;
  double* f = work_.data();
  const long stride = stride_;
  for (int j = 0; j < a; ++j) std::swap(f[j * stride + a], f[j * stride + b]);
  for (int j = a + 1; j < b; ++j) std::swap(f[a * stride + j], f[j * stride + b]);
  for (int i = b + 1; i < size; ++i) std::swap(f[a * stride + i], f[b * stride + i]);
  std::swap(f[a * stride + a], f[b * stride + b]);
  std::swap(unknown_[at(a)], unknown_[at(b)]);
}

void ChainLdl::keep_panel(Front& front) {
  const int size = front.size, count = front.eliminated, stride = detail::ldl_padded(size);
  front.factor = factor_used_;
  front.index = index_used_;
  factor_used_ += at(stride) * at(count);
  index_used_ += at(size);
  if (factor_used_ > factor_.size()) factor_.resize(2 * factor_used_);
  if (index_used_ > index_.size()) index_.resize(2 * index_used_);
  double* to = factor_.data() + front.factor;
  for (int k = 0; k < count; ++k, to += stride) {
    const double* from = work_.data() + at(k) * at(stride_);
    std::fill(to, to + k + 1, 0.0);
    std::copy(from + k + 1, from + size, to + k + 1);
    std::fill(to + size, to + stride, 0.0);
  }
  std::copy_n(unknown_.begin(), size, index_.begin() + static_cast<long>(front.index));
}

/// Pushes a front's contribution to its parent on the stack, `delayed` unknowns first.
void ChainLdl::push_contribution(int number, int delayed) {
  const Front& front = fronts_[at(number)];
  Waiting to;
  to.front = number;
  to.size = front.size - front.eliminated;
  to.delayed = delayed;
  if (!waiting_.empty()) {
    const Waiting& below = waiting_.back();
    to.value = below.value + at(below.size) * at(below.size);
    to.index = below.index + at(below.delayed);
  }
  const std::size_t values = to.value + at(to.size) * at(to.size);
  if (values > waiting_value_.size()) waiting_value_.resize(2 * values);
  if (to.index + at(delayed) > waiting_index_.size())
    waiting_index_.resize(2 * (to.index + at(delayed)));
  double* value = waiting_value_.data() + to.value;
  for (int c = 0; c < to.size; ++c, value += to.size) {
    const double* from =
        work_.data() + at(front.eliminated + c) * at(stride_) + at(front.eliminated);
    std::copy(from + c, from + to.size, value + c);
  }
  std::copy_n(unknown_.begin() + front.eliminated, delayed,
              waiting_index_.begin() + static_cast<long>(to.index));
  waiting_.push_back(to);
}

void ChainLdl::solve(double* x) {
  const detail::LdlKernel& kernel = detail::ldl_kernel();
  for (int i = 0; i < order_; ++i) x[i] *= scale_[at(i)];
  for (const Front& front : fronts_) {
    const int* index = index_.data() + front.index;
    const int stride = detail::ldl_padded(front.size);
    for (int i = 0; i < front.size; ++i) local_[at(i)] = x[index[i]];
    std::fill(local_.begin() + front.size, local_.begin() + stride, 0.0);
    kernel.forward(stride, front.eliminated, factor_.data() + front.factor, local_.data());
    for (int k = 0; k < front.eliminated; ++k) {
      const double* inverse = pivot_.data() + 2 * at(front.first_pivot + k);
      if (width_[at(front.first_pivot + k)] == 1) {
        x[index[k]] = local_[at(k)] * inverse[0];
      } else {
        const double a = local_[at(k)], b = local_[at(k) + 1];
        x[index[k]] = inverse[0] * a + inverse[1] * b;
        x[index[k + 1]] = inverse[1] * a + inverse[2] * b;
        ++k;
      }
    }
    for (int i = front.eliminated; i < front.size; ++i) x[index[i]] = local_[at(i)];
  }
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    if (front->eliminated == 0) continue;
    const int* index = index_.data() + front->index;
    const int stride = detail::ldl_padded(front->size);
    for (int i = 0; i < front->size; ++i) local_[at(i)] = x[index[i]];
    std::fill(local_.begin() + front->size, local_.begin() + stride, 0.0);
    kernel.backward(stride, front->eliminated, factor_.data() + front->factor, local_.data());
    for (int k = 0; k < front->eliminated; ++k) x[index[k]] = local_[at(k)];
  }
  for (int i = 0; i < order_; ++i) x[i] *= scale_[at(i)];
}

}  // namespace sparflow
