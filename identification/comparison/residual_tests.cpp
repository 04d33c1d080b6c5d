#include "identification/comparison/residual_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "identification/comparison/report_numbers.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd block_sums(const VectorXd& values, const std::vector<int>& block, int blocks) {
  VectorXd out = VectorXd::Zero(blocks);
  for (Index k = 0; k < values.size(); ++k) out[block[static_cast<std::size_t>(k)]] += values[k];
  return out;
}

/// @return [samples x 0..2] the signal and its square, centred, orthogonal and of unit variance; 0 where the signal is
///   missing. A constant signal gives no column, one with two values a single one.
MatrixXd features(const VectorXd& signal) {
  const auto known = signal.array().isFinite();
  const double n = known.cast<double>().sum();
  if (n < 2.0) return MatrixXd(signal.size(), 0);
  const auto centred = [&](const VectorXd& x) {
    const double mean = known.select(x.array(), 0.0).sum() / n;
    return VectorXd(known.select(x.array() - mean, 0.0));
  };
  MatrixXd out(signal.size(), 2);
  Index columns = 0;
  const VectorXd linear = centred(signal);
  const double size = std::sqrt(linear.squaredNorm() / n);
  constexpr double kConstant = 1e-9;  // of the signal's size
  if (!(size > kConstant * (known.select(signal.array().abs(), 0.0).maxCoeff() + 1e-300)))
    return MatrixXd(signal.size(), 0);
  out.col(columns++) = linear / size;
  VectorXd square = centred(out.col(0).cwiseAbs2());
  square -= out.col(0) * (out.col(0).dot(square) / n);
  const double left = std::sqrt(square.squaredNorm() / n);
  constexpr double kNoSquare = 1e-3;  // of the square; a signal with two values has none of its own
  if (left > kNoSquare) out.col(columns++) = square / left;
  return out.leftCols(columns);
}

std::string three_digits(double value) { return plain_number(value, 3); }

/// @return R^2: share of the squared error (mean removed) in the span of orthogonal features
double explained(const MatrixXd& f, const VectorXd& error) {
  double sum = 0.0;
  for (Index c = 0; c < f.cols(); ++c) {
    const double norm = f.col(c).squaredNorm();
    if (norm > 0.0) sum += std::pow(f.col(c).dot(error), 2) / norm;
  }
  const double total = error.squaredNorm();
  return total > 0.0 ? std::min(1.0, sum / total) : 0.0;
}

std::string sentence_of(const ResidualTest& t, const ComparedPart& part,
                        const std::string& signal) {
  if (t.depends_on.empty()) {
    const std::string interval = std::isfinite(t.ci95.lo)
                                     ? fmt::format(", 95 % interval {} .. {}",
                                                   three_digits(t.ci95.lo), three_digits(t.ci95.hi))
                                     : std::string();
    return fmt::format("the {} is predicted {} {} too {} on average (p {:.2g}{})", part.words,
                       three_digits(std::abs(t.size)), t.unit, t.size > 0.0 ? "high" : "low",
                       t.p_value, interval);
  }
  return fmt::format(
      "the error of the {} depends on {}, by {} {} RMS ({:.0f} % of its square, p {:.2g})",
      part.words, signal, three_digits(t.size), t.unit, 100.0 * t.share_explained, t.p_value);
}

/// A tested hypothesis with its columns in the matrix of block sums.
struct Hypothesis {
  ResidualTest test;
  const ComparedPart* part;
  std::string signal;
  Index first = 0, columns = 0;
};

}  // namespace

MatrixXd max_t_sign_flip(const MatrixXd& sums, int flips, unsigned seed) {
  const Index tests = sums.cols();
  MatrixXd out = MatrixXd::Zero(tests, 3);
  Eigen::RowVectorXd scale = sums.colwise().norm();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
  const MatrixXd scaled = sums * scale.asDiagonal();
  out.col(0) = scaled.colwise().sum().cwiseAbs().transpose();
  std::mt19937 random(seed);
  MatrixXd sign(flips, sums.rows());
  for (Index i = 0; i < sign.size(); ++i) sign.data()[i] = (random() >> 16) & 1u ? 1.0 : -1.0;
  const VectorXd largest = (sign * scaled).cwiseAbs().rowwise().maxCoeff();
  const auto p_of = [&](double statistic) {
    constexpr double kRounding = 1e-9;  // the sums are formed in another order
    return (1.0 + (largest.array() >= statistic - kRounding).cast<double>().sum()) / (1.0 + flips);
  };
  for (Index t = 0; t < tests; ++t) {
    out(t, 1) = scale[t] > 0.0 ? p_of(out(t, 0)) : 1.0;
    out(t, 2) = p_of(scaled.col(t).cwiseAbs().sum());
  }
  return out;
}

std::vector<std::string> ResidualTests::undecided() const {
  std::vector<const ResidualTest*> largest;  // by quantity
  for (const ResidualTest& t : tests) {
    if (t.least_p <= alarm || t.share_explained < large_share) continue;
    const auto same = std::find_if(largest.begin(), largest.end(), [&](const ResidualTest* o) {
      return o->stage == t.stage && o->at == t.at && o->regime == t.regime;
    });
    if (same == largest.end()) {
      largest.push_back(&t);
    } else if (t.share_explained > (*same)->share_explained) {
      *same = &t;
    }
  }
  std::stable_sort(largest.begin(), largest.end(), [](const auto* a, const auto* b) {
    return a->share_explained > b->share_explained;
  });
  std::vector<std::string> out;
  out.reserve(largest.size());
  for (const ResidualTest* t : largest)
    out.push_back(fmt::format("{} blocks of motion are too few to decide whether {}", t->blocks,
                              t->sentence));
  return out;
}

double effective_samples(const VectorXd& values, const std::vector<int>& block,
                         const AutocorrelationOptions& options) {
  const Index n = values.size();
  if (n < 3) return static_cast<double>(n);
  const VectorXd e = values.array() - values.mean();
  const double variance = e.squaredNorm() / static_cast<double>(n);
  if (!(variance > 0.0)) return static_cast<double>(n);
  double sum = 0.0;
  for (Index lag = 1; lag < n / 2; ++lag) {
    double products = 0.0, pairs = 0.0;
    for (Index k = 0; k + lag < n; ++k) {
      if (block[static_cast<std::size_t>(k)] != block[static_cast<std::size_t>(k + lag)]) continue;
      products += e[k] * e[k + lag];
      pairs += 1.0;
    }
    if (pairs < options.fewest_pairs) break;
    const double rho = products / pairs / variance;
    if (rho < options.gone) break;
    sum += rho;
  }
  return std::max(1.0, static_cast<double>(n) / (1.0 + 2.0 * sum));
}

ResidualTests test_residuals(const std::vector<ComparedPart>& parts, int blocks,
                             const ResidualTestOptions& options) {
  ResidualTests out;
  out.blocks = blocks;
  out.alarm = options.alarm;
  out.large_share = options.large_share;
  std::vector<Hypothesis> hypotheses;
  std::vector<VectorXd> columns;
  for (const ComparedPart& part : parts) {
    const VectorXd counts = block_sums(VectorXd::Ones(part.error.size()), part.block, blocks);
    const auto used = static_cast<int>((counts.array() > 0.0).count());
    if (used < options.least_blocks) continue;
    const auto n = static_cast<double>(part.error.size());
    const double mean = part.error.mean();
    const VectorXd error = part.error.array() - mean;
    Hypothesis bias;
    bias.part = &part;
    bias.test.stage = part.stage;
    bias.test.at = part.at;
    bias.test.regime = part.regime;
    bias.test.unit = part.unit;
    bias.test.samples = static_cast<long>(part.error.size());
    bias.test.effective_samples =
        effective_samples(part.error, part.block, options.autocorrelation);
    bias.test.blocks = used;
    bias.test.ci95 = {kNaN, kNaN};
    Hypothesis blank = bias;
    const VectorXd sums = block_sums(part.error, part.block, blocks);
    bias.test.size = mean / part.scale;
    const Range interval = block_interval(sums, counts, false, options.blocks);
    bias.test.ci95 = {interval.lo / part.scale, interval.hi / part.scale};
    bias.test.share_explained =
        part.error.squaredNorm() > 0.0 ? n * mean * mean / part.error.squaredNorm() : 0.0;
    bias.first = static_cast<Index>(columns.size());
    bias.columns = 1;
    columns.push_back(sums);
    hypotheses.push_back(bias);
    for (const RegimeSignal& signal : part.all_signals()) {
      const MatrixXd f = features(signal.values);
      if (f.cols() == 0) continue;
      Hypothesis h = blank;
      h.signal = signal.words;
      h.test.depends_on = signal.key;
      h.test.share_explained = explained(f, error);
      h.test.size = std::sqrt(h.test.share_explained * error.squaredNorm() / n) / part.scale;
      h.first = static_cast<Index>(columns.size());
      h.columns = f.cols();
      for (Index c = 0; c < f.cols(); ++c)
        columns.push_back(block_sums(f.col(c).cwiseProduct(error), part.block, blocks));
      hypotheses.push_back(std::move(h));
    }
  }
  if (hypotheses.empty()) return out;
  MatrixXd sums(blocks, static_cast<Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) sums.col(static_cast<Index>(c)) = columns[c];
  const MatrixXd judged = max_t_sign_flip(sums, options.flips, options.seed);
  out.tested = static_cast<int>(columns.size());
  for (Hypothesis& h : hypotheses) {
    Index best = 0;
    judged.col(0).segment(h.first, h.columns).maxCoeff(&best);
    h.test.statistic = judged(h.first + best, 0);
    h.test.p_value = judged(h.first + best, 1);
    h.test.least_p = judged(h.first + best, 2);
    h.test.sentence = sentence_of(h.test, *h.part, h.signal);
    out.tests.push_back(std::move(h.test));
  }
  std::stable_sort(out.tests.begin(), out.tests.end(),
                   [](const ResidualTest& a, const ResidualTest& b) {
                     if (a.p_value != b.p_value) return a.p_value < b.p_value;
                     return a.share_explained > b.share_explained;
                   });
  return out;
}

}  // namespace sparflow
