#include "diagnosis/regression/effect_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Bounds {
  VectorXd lower, upper;
};

Bounds bounds_of(const std::vector<const EffectDesign*>& designs, Index count) {
  Bounds b{VectorXd(count), VectorXd(count)};
  Index k = 0;
  for (const EffectDesign* d : designs) {
    for (std::size_t i = 0; i < d->lower.size(); ++i) {
      b.lower[k] = d->lower[i];
      b.upper[k++] = d->upper[i];
    }
  }
  return b;
}

/// min 1/2 x'Nx - g'x inside bounds: the unconstrained solution or, outside them, cyclic coordinate descent.
VectorXd solve_box(const MatrixXd& n, const VectorXd& g, const Bounds& b, bool* at_bound) {
  const Index m = g.size();
  // scaled by curvature, because parameters differ by many orders of magnitude
  VectorXd scale(m);
  for (Index i = 0; i < m; ++i) scale[i] = n(i, i) > 0.0 ? 1.0 / std::sqrt(n(i, i)) : 0.0;
  MatrixXd h = scale.asDiagonal() * n * scale.asDiagonal();
  h.diagonal().array() += 1e-10;
  const VectorXd gs = scale.cwiseProduct(g);
  VectorXd x = solve_symmetric(h, gs);
  const auto lower = [&](Index i) { return scale[i] > 0.0 ? b.lower[i] / scale[i] : 0.0; };
  const auto upper = [&](Index i) { return scale[i] > 0.0 ? b.upper[i] / scale[i] : 0.0; };
  *at_bound = false;
  for (Index i = 0; i < m; ++i) *at_bound = *at_bound || x[i] < lower(i) || x[i] > upper(i);
  if (*at_bound) {
    for (Index i = 0; i < m; ++i) x[i] = std::clamp(x[i], lower(i), upper(i));
    for (int sweep = 0; sweep < 500; ++sweep) {
      double moved = 0.0;
      for (Index i = 0; i < m; ++i) {
        const double next =
            std::clamp(x[i] + (gs[i] - h.row(i).dot(x)) / h(i, i), lower(i), upper(i));
        moved = std::max(moved, std::abs(next - x[i]));
        x[i] = next;
      }
      if (moved < 1e-9 * (1.0 + x.norm())) break;
    }
  }
  return scale.cwiseProduct(x);
}

/// Noise floor of a channel; where it is not known, the rounding error of the measurement. [SI]
double noise_or_rounding(const EvidenceChannel& channel) {
  if (channel.noise_floor > 0.0) return channel.noise_floor;
  return 1e-9 * channel.y.cwiseAbs().maxCoeff() + 1e-300;
}

/// Column `k` of all channels in units of the noise floor, orthogonal to the columns before it.
VectorXd own_part(const Evidence& evidence, const EffectDesign& design, Index k) {
  Index rows = 0;
  for (const MatrixXd& c : design.columns) rows += c.cols() > 0 ? c.rows() : 0;
  MatrixXd stacked(rows, k + 1);
  Index at = 0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!design.touches(c)) continue;
    const MatrixXd& columns = design.columns[c];
    stacked.middleRows(at, columns.rows()) =
        columns.leftCols(k + 1) / noise_or_rounding(evidence.channels[c]);
    at += columns.rows();
  }
  for (Index i = 0; i <= k; ++i) {  // modified Gram-Schmidt
    for (Index before = 0; before < i; ++before) {
      const double square = stacked.col(before).squaredNorm();
      if (square > 0.0)
        stacked.col(i) -=
            stacked.col(before).dot(stacked.col(i)) / square * stacked.col(before).eval();
    }
  }
  return stacked.col(k);
}

/// Sets a linear parameter's columns to zero where it has no own effect even at its bound: it changes no measurement
/// (a point mass on the joint's own axis, beside its moment) or is collinear with the parameters before it (a scale
/// error where the load never changes). Its estimate would be determined by rounding alone.
void drop_negligible(const Evidence& evidence, EffectDesign& design) {
  if (!design.acts()) return;
  for (Index k = 0; k < design.linear; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double most = std::max(std::abs(design.lower[at]), std::abs(design.upper[at]));
    if (!(own_part(evidence, design, k).cwiseAbs().maxCoeff() * most <
          evidence.options.negligible_action))
      continue;
    for (MatrixXd& c : design.columns) {
      if (c.cols() > 0) c.col(k).setZero();
    }
  }
}

/// @param k index among the linear parameters
bool is_optional(const EffectDesign& design, Index k) {
  for (const EffectParameter& p : design.effect.effect->info().parameters) {
    if (p.linear && k-- == 0) return p.optional;
  }
  return false;
}

struct Whitened {
  MatrixXd rows;      // [rows x (parameters + 1)], baseline projected out, unit innovation variance
  MatrixXd baseline;  // coefficients of [columns, y] on the baseline
  double log_determinant = 0.0;
};

}  // namespace

bool EffectDesign::acts() const {
  return std::any_of(columns.begin(), columns.end(),
                     [](const MatrixXd& c) { return c.cols() > 0; });
}

double EffectFit::total() const {
  return std::accumulate(log_likelihood.begin(), log_likelihood.end(), 0.0);
}

EffectDesign make_design(const Evidence& evidence, const EffectAt& effect,
                         std::vector<double> shape, std::span<const double> about, bool optional) {
  EffectDesign d;
  d.effect = effect;
  d.shape = std::move(shape);
  for (const EffectParameter& p : effect.effect->info().parameters) {
    if (!p.linear) continue;
    ++d.linear;
    d.lower.push_back(p.lower);
    d.upper.push_back(p.upper);
  }
  for (const EvidenceChannel& c : evidence.channels)
    d.columns.push_back(evidence.columns(effect, d.shape, c, about));
  drop_negligible(evidence, d);
  if (!optional) return without_optional(std::move(d));
  for (Index k = 0; k < d.linear; ++k) {
    if (!is_optional(d, k)) continue;
    for (const MatrixXd& c : d.columns)
      d.optional = d.optional || (c.cols() > 0 && !c.col(k).isZero(0.0));
  }
  return d;
}

EffectDesign without_optional(EffectDesign design) {
  for (Index k = 0; k < design.linear; ++k) {
    if (!is_optional(design, k)) continue;
    for (MatrixXd& c : design.columns) {
      if (c.cols() > 0) c.col(k).setZero();
    }
  }
  design.optional = false;
  return design;
}

MatrixXd whitened_rows(const EvidenceChannel& channel, const NoiseModel& noise,
                       const MatrixXd& columns, double* log_determinant,
                       MatrixXd* baseline_coefficients) {
  const Index n = channel.rows(), b = channel.baseline.cols(), m = columns.cols();
  MatrixXd all(n, b + m + 1);
  all << channel.baseline, columns, channel.y;
  const double l = noise.whiten(channel.blocks, all);
  if (log_determinant != nullptr) *log_determinant = l;
  if (b == 0) {
    if (baseline_coefficients != nullptr) baseline_coefficients->resize(0, m + 1);
    return all;
  }
  return without_projection(all.rightCols(m + 1), all.leftCols(b), baseline_coefficients);
}

EffectFit fit_effects(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                      const EffectFit* start, const FitControl& control) {
  const std::size_t channels = evidence.channels.size();
  Index count = 0;
  for (const EffectDesign* d : designs) count += d->linear;
  const Bounds bounds = bounds_of(designs, count);

  EffectFit fit;
  fit.theta = VectorXd::Zero(count);
  fit.noise.resize(channels);
  fit.log_likelihood.assign(channels, 0.0);
  fit.residual.resize(channels);
  if (start != nullptr) {
    fit.noise = start->noise;
    fit.log_likelihood = start->log_likelihood;
  }
  const auto active = [&](std::size_t c) { return control.active.empty() || control.active[c]; };

  // the columns of all designs in each channel, and the parameters that they belong to
  std::vector<MatrixXd> columns(channels);
  std::vector<std::vector<Index>> owner(channels);
  for (std::size_t c = 0; c < channels; ++c) {
    if (!active(c)) continue;
    Index width = 0, first = 0;
    for (const EffectDesign* d : designs) width += d->columns[c].cols();
    columns[c].resize(evidence.channels[c].rows(), width);
    Index at = 0;
    for (const EffectDesign* d : designs) {
      const Index w = d->columns[c].cols();
      if (w > 0) columns[c].middleCols(at, w) = d->columns[c];
      for (Index k = 0; k < w; ++k) owner[c].push_back(first + k);
      at += w;
      first += d->linear;
    }
  }

  std::vector<Whitened> white(channels);
  for (int pass = 0; pass < control.noise_passes + 1; ++pass) {
    const bool first_pass = pass == 0 && start == nullptr;
    MatrixXd n = MatrixXd::Zero(count, count);
    VectorXd g = VectorXd::Zero(count);
    for (std::size_t c = 0; c < channels; ++c) {
      if (!active(c)) continue;
      const EvidenceChannel& channel = evidence.channels[c];
      if (first_pass) {  // white noise with the variance of y
        fit.noise[c] = NoiseModel{};
        fit.noise[c].variance =
            std::max(channel.y.squaredNorm() / static_cast<double>(channel.rows()), 1e-300);
      }
      Whitened& w = white[c];
      w.rows = whitened_rows(channel, fit.noise[c], columns[c], &w.log_determinant, &w.baseline);
      const Index m = columns[c].cols();
      const MatrixXd cross = transposed_product(w.rows.leftCols(m), w.rows) / fit.noise[c].variance;
      for (Index i = 0; i < m; ++i) {
        const Index oi = owner[c][static_cast<std::size_t>(i)];
        g[oi] += cross(i, m);
        for (Index j = 0; j < m; ++j) n(oi, owner[c][static_cast<std::size_t>(j)]) += cross(i, j);
      }
    }
    if (count > 0) fit.theta = solve_box(n, g, bounds, &fit.at_bound);
    const bool last = pass == control.noise_passes;
    for (std::size_t c = 0; c < channels; ++c) {
      if (!active(c)) continue;
      const EvidenceChannel& channel = evidence.channels[c];
      const Index m = columns[c].cols();
      VectorXd theta(m);
      for (Index i = 0; i < m; ++i) theta[i] = fit.theta[owner[c][static_cast<std::size_t>(i)]];
      const Whitened& w = white[c];
      if (last) {
        const VectorXd r = w.rows.col(m) - w.rows.leftCols(m) * theta;
        const auto rows = static_cast<double>(channel.rows());
        const double v = std::max(r.squaredNorm() / rows, 1e-300);
        // profile likelihood: AR parameters and offset ratio as estimated, scale at its maximum
        fit.log_likelihood[c] =
            w.log_determinant - 0.5 * rows * (std::log(2.0 * std::numbers::pi * v) + 1.0);
      }
      if (!last || control.keep_residuals) {
        VectorXd beta = w.baseline.col(m);
        if (m > 0) beta -= w.baseline.leftCols(m) * theta;
        VectorXd r = channel.y;
        if (m > 0) r -= columns[c] * theta;
        if (beta.size() > 0) r -= channel.baseline * beta;
        if (!last) {
          // the more likely of the former model and the moment estimate, so that no pass makes the fit worse
          const NoiseModel& before = fit.noise[c];
          const NoiseModel next =
              NoiseModel::estimate(r, channel.blocks, true, evidence.options.noise);
          const bool better = first_pass || next.log_likelihood(r, channel.blocks) >
                                                before.log_likelihood(r, channel.blocks);
          fit.noise[c] = better ? next : before.scaled_to(r, channel.blocks);
          if (control.ordinary) {
            fit.noise[c] = NoiseModel{};
            fit.noise[c].variance =
                std::max(r.squaredNorm() / static_cast<double>(channel.rows()), 1e-300);
          }
        }
        if (control.keep_residuals) fit.residual[c] = std::move(r);
      }
    }
    if (last && control.covariance && count > 0) {
      // sandwich: bread N^-1, filling by blocks (White 1980; Liang & Zeger 1986)
      const MatrixXd bread = solve_symmetric_columns(n, MatrixXd::Identity(count, count));
      MatrixXd filling = MatrixXd::Zero(count, count);
      for (std::size_t c = 0; c < channels; ++c) {
        if (!active(c)) continue;
        const EvidenceChannel& channel = evidence.channels[c];
        const Index m = columns[c].cols();
        if (m == 0) continue;
        VectorXd theta(m);
        for (Index i = 0; i < m; ++i) theta[i] = fit.theta[owner[c][static_cast<std::size_t>(i)]];
        const MatrixXd& rows = white[c].rows;
        const VectorXd r = rows.col(m) - rows.leftCols(m) * theta;
        for (const NoiseBlock& b : channel.blocks) {
          const Index length = b.last - b.first;
          const VectorXd s = rows.block(b.first, 0, length, m).transpose() *
                             r.segment(b.first, length) / fit.noise[c].variance;
          VectorXd full = VectorXd::Zero(count);
          for (Index i = 0; i < m; ++i) full[owner[c][static_cast<std::size_t>(i)]] += s[i];
          filling += full * full.transpose();
        }
      }
      const MatrixXd robust = product(product(bread, filling), bread);
      fit.covariance = bread;
      for (Index i = 0; i < count;
           ++i) {  // the larger variance of both, with the correlations of the model-based one
        const double f = std::sqrt(std::max(1.0, robust(i, i) / bread(i, i)));
        fit.covariance.row(i) *= f;
        fit.covariance.col(i) *= f;
      }
    }
  }
  return fit;
}

}  // namespace sparflow
