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

struct Whitened {
  MatrixXd rows;      // [rows x (parameters + 1)], baseline projected out, unit innovation variance
  MatrixXd baseline;  // coefficients of [columns, y] on the baseline
  double log_determinant = 0.0;
};

}  // namespace

double EffectFit::total() const {
  return std::accumulate(log_likelihood.begin(), log_likelihood.end(), 0.0);
}

namespace {

/// The baseline and y side by side, whitened.
MatrixXd whitened_baseline(const EvidenceChannel& channel, const NoiseModel& noise,
                           double* log_determinant) {
  MatrixXd all(channel.rows(), channel.baseline.cols() + 1);
  all << channel.baseline, channel.y;
  *log_determinant = noise.whiten(channel.noise_rows(), all);
  return all;
}

}  // namespace

WhitenedBaseline::WhitenedBaseline(const EvidenceChannel& channel, const NoiseModel& noise)
    : channel_(channel), noise_(noise), baseline_([&] {
        const MatrixXd all = whitened_baseline(channel, noise, &log_determinant_);
        y_ = all.rightCols(1);
        return Projection(all.leftCols(channel.baseline.cols()));
      }()) {}

MatrixXd WhitenedBaseline::rows(const MatrixXd& columns, MatrixXd* baseline_coefficients) const {
  MatrixXd all(channel_.rows(), columns.cols() + 1);
  all.leftCols(columns.cols()) = columns;
  if (columns.cols() > 0) noise_.whiten(channel_.noise_rows(), all.leftCols(columns.cols()));
  all.rightCols(1) = y_;
  MatrixXd left = baseline_.without(all, baseline_coefficients);
  // of a column in the span of the baseline only rounding is left, with which nothing must be estimated
  constexpr double kRounding = 1e-16;  // of the square
  for (Index i = 0; i < columns.cols(); ++i)
    if (left.col(i).squaredNorm() < kRounding * all.col(i).squaredNorm()) left.col(i).setZero();
  return left;
}

MatrixXd whitened_rows(const EvidenceChannel& channel, const NoiseModel& noise,
                       const MatrixXd& columns, double* log_determinant,
                       MatrixXd* baseline_coefficients) {
  const WhitenedBaseline baseline(channel, noise);
  if (log_determinant != nullptr) *log_determinant = baseline.log_determinant();
  return baseline.rows(columns, baseline_coefficients);
}

namespace {

/// White noise with the variance of `values`, whose deviation settles.
NoiseModel settling_noise_of(const EvidenceChannel& channel, const VectorXd& values,
                             const NoiseOptions& options) {
  NoiseModel noise = NoiseModel::settling_of(values, channel.noise_rows(), options);
  const VectorXd scale = noise.scale_of(channel.noise_rows());
  const double squares =
      scale.size() > 0 ? values.cwiseQuotient(scale).squaredNorm() : values.squaredNorm();
  noise.variance = std::max(squares / static_cast<double>(values.size()), 1e-300);
  return noise;
}

/// The same for ordinary least squares: beside references it is even, as starts and stops show in both groups of logs alike.
NoiseModel ordinary_noise_of(const Evidence& evidence, std::size_t channel,
                             const VectorXd& values) {
  if (!evidence.options.settles)
    return settling_noise_of(evidence.channels[channel], values, evidence.options.noise);
  return NoiseModel::white_of(values, evidence.channels[channel].noise_rows(),
                              evidence.options.noise);
}

/// Alternates between the effects' parameters, for given noise models, and the noise models of the fit's residuals.
class ProfileLikelihood {
 public:
  /// @param evidence and control must outlive this
  ProfileLikelihood(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                    const FitControl& control);

  EffectFit maximised(const std::vector<const EffectDesign*>& designs, const EffectFit* start);

 private:
  std::size_t channels() const { return evidence_.channels.size(); }
  bool active(std::size_t c) const { return control_.active.empty() || control_.active[c]; }
  Index parameter(std::size_t c, Index column) const {
    return owner_[c][static_cast<std::size_t>(column)];
  }
  void collect_columns(const std::vector<const EffectDesign*>& designs, std::size_t c);
  /// Whitens all channels by the fit's noise models and sums up the normal equations.
  /// @param baselines whitened by them; null: they are not at hand
  void set_normal_equations(const WhitenedChannels* baselines);
  VectorXd theta_in(std::size_t c) const;  ///< parameters of a channel's columns
  /// Innovations: what the fit leaves of the whitened rows.
  VectorXd innovations_in(std::size_t c) const;
  VectorXd residual_in(std::size_t c) const;  ///< [rows, SI]
  /// @param keeps_former whether the former noise model may be the more likely one
  void update_noise(std::size_t c, const VectorXd& residual, bool keeps_former);
  /// Profile likelihood: AR parameters and offset ratio as estimated, scale at its maximum. [nats]
  double log_likelihood_in(std::size_t c) const;
  MatrixXd block_scores() const;  ///< sum over all blocks of the outer product of their scores
  MatrixXd covariance() const;

  const Evidence& evidence_;
  const FitControl& control_;
  Index count_ = 0;                        // parameters
  std::vector<MatrixXd> columns_;          // [channels] columns of all designs
  std::vector<std::vector<Index>> owner_;  // [channels][columns] parameter of a column
  std::vector<Whitened> white_;            // [channels]
  MatrixXd normal_;                        // [parameters x parameters]
  VectorXd right_side_;                    // [parameters]
  EffectFit fit_;
};

ProfileLikelihood::ProfileLikelihood(const Evidence& evidence,
                                     const std::vector<const EffectDesign*>& designs,
                                     const FitControl& control)
    : evidence_(evidence),
      control_(control),
      columns_(evidence.channels.size()),
      owner_(evidence.channels.size()),
      white_(evidence.channels.size()) {
  for (const EffectDesign* d : designs) count_ += d->linear;
  for (std::size_t c = 0; c < channels(); ++c) {
    if (active(c)) collect_columns(designs, c);
  }
}

void ProfileLikelihood::collect_columns(const std::vector<const EffectDesign*>& designs,
                                        std::size_t c) {
  columns_[c] = columns_of(designs, c, evidence_.channels[c].rows());
  Index first = 0;
  for (const EffectDesign* d : designs) {
    for (Index k = 0; k < d->columns[c].cols(); ++k) owner_[c].push_back(first + k);
    first += d->linear;
  }
}

void ProfileLikelihood::set_normal_equations(const WhitenedChannels* baselines) {
  normal_ = MatrixXd::Zero(count_, count_);
  right_side_ = VectorXd::Zero(count_);
  for (std::size_t c = 0; c < channels(); ++c) {
    if (!active(c)) continue;
    Whitened& w = white_[c];
    if (baselines != nullptr) {
      w.log_determinant = baselines->baseline[c].log_determinant();
      w.rows = baselines->baseline[c].rows(columns_[c], &w.baseline);
    } else {
      w.rows = whitened_rows(evidence_.channels[c], fit_.noise[c], columns_[c], &w.log_determinant,
                             &w.baseline);
    }
    const Index m = columns_[c].cols();
    const MatrixXd cross = transposed_product(w.rows.leftCols(m), w.rows) / fit_.noise[c].variance;
    for (Index i = 0; i < m; ++i) {
      const Index own = parameter(c, i);
      right_side_[own] += cross(i, m);
      for (Index j = 0; j < m; ++j) normal_(own, parameter(c, j)) += cross(i, j);
    }
  }
}

VectorXd ProfileLikelihood::theta_in(std::size_t c) const {
  VectorXd theta(columns_[c].cols());
  for (Index i = 0; i < theta.size(); ++i) theta[i] = fit_.theta[parameter(c, i)];
  return theta;
}

VectorXd ProfileLikelihood::innovations_in(std::size_t c) const {
  const MatrixXd& rows = white_[c].rows;
  const Index m = columns_[c].cols();
  return rows.col(m) - rows.leftCols(m) * theta_in(c);
}

VectorXd ProfileLikelihood::residual_in(std::size_t c) const {
  const EvidenceChannel& channel = evidence_.channels[c];
  const MatrixXd& baseline = white_[c].baseline;
  const VectorXd theta = theta_in(c);
  const Index m = theta.size();
  VectorXd beta = baseline.col(m);
  if (m > 0) beta -= baseline.leftCols(m) * theta;
  VectorXd r = channel.y;
  if (m > 0) r -= columns_[c] * theta;
  if (beta.size() > 0) r -= channel.baseline * beta;
  return r;
}

void ProfileLikelihood::update_noise(std::size_t c, const VectorXd& residual, bool keeps_former) {
  if (control_.ordinary) {
    fit_.noise[c] = ordinary_noise_of(evidence_, c, residual);
    return;
  }
  // the more likely of the former model and the moment estimate, so that no pass makes the fit worse
  const NoiseRows rows = evidence_.channels[c].noise_rows();
  const NoiseModel& before = fit_.noise[c];
  const NoiseModel next = NoiseModel::estimate(residual, rows, true, evidence_.options.noise);
  const bool better =
      !keeps_former || next.log_likelihood(residual, rows) > before.log_likelihood(residual, rows);
  fit_.noise[c] = better ? next : before.scaled_to(residual, rows);
}

double ProfileLikelihood::log_likelihood_in(std::size_t c) const {
  const VectorXd r = innovations_in(c);
  const auto rows = static_cast<double>(evidence_.channels[c].rows());
  const double v = std::max(r.squaredNorm() / rows, 1e-300);
  return white_[c].log_determinant - 0.5 * rows * (std::log(2.0 * std::numbers::pi * v) + 1.0);
}

MatrixXd ProfileLikelihood::block_scores() const {
  MatrixXd sum = MatrixXd::Zero(count_, count_);
  for (std::size_t c = 0; c < channels(); ++c) {
    const Index m = columns_[c].cols();
    if (!active(c) || m == 0) continue;
    const MatrixXd& rows = white_[c].rows;
    const VectorXd r = innovations_in(c);
    for (const NoiseBlock& b : evidence_.channels[c].blocks) {
      const Index length = b.last - b.first;
      const VectorXd s = rows.block(b.first, 0, length, m).transpose() *
                         r.segment(b.first, length) / fit_.noise[c].variance;
      VectorXd full = VectorXd::Zero(count_);
      for (Index i = 0; i < m; ++i) full[parameter(c, i)] += s[i];
      sum += full * full.transpose();
    }
  }
  return sum;
}

/// Sandwich: bread N^-1, filling by blocks (White 1980; Liang & Zeger 1986). The larger variance of both, with the
/// correlations of the model-based one.
MatrixXd ProfileLikelihood::covariance() const {
  const MatrixXd bread = solve_symmetric_columns(normal_, MatrixXd::Identity(count_, count_));
  const MatrixXd robust = product(product(bread, block_scores()), bread);
  MatrixXd out = bread;
  for (Index i = 0; i < count_; ++i) {
    const double f = std::sqrt(std::max(1.0, robust(i, i) / bread(i, i)));
    out.row(i) *= f;
    out.col(i) *= f;
  }
  return out;
}

EffectFit ProfileLikelihood::maximised(const std::vector<const EffectDesign*>& designs,
                                       const EffectFit* start) {
  const Bounds bounds = bounds_of(designs, count_);
  fit_.theta = VectorXd::Zero(count_);
  fit_.noise.resize(channels());
  fit_.log_likelihood.assign(channels(), 0.0);
  fit_.residual.resize(channels());
  if (start != nullptr) {
    fit_.noise = start->noise;
    fit_.log_likelihood = start->log_likelihood;
  } else if (control_.first != nullptr) {
    fit_.noise = control_.first->noise;
  } else {
    for (std::size_t c = 0; c < channels(); ++c) {
      if (!active(c)) continue;
      const VectorXd& y = evidence_.channels[c].y;
      fit_.noise[c] = control_.ordinary
                          ? ordinary_noise_of(evidence_, c, y)
                          : settling_noise_of(evidence_.channels[c], y, evidence_.options.noise);
    }
  }
  for (int pass = 0; pass < control_.noise_passes + 1; ++pass) {
    set_normal_equations(pass == 0 ? control_.first : nullptr);
    if (count_ > 0) fit_.theta = solve_box(normal_, right_side_, bounds, &fit_.at_bound);
    const bool last = pass == control_.noise_passes;
    for (std::size_t c = 0; c < channels(); ++c) {
      if (!active(c)) continue;
      if (last) fit_.log_likelihood[c] = log_likelihood_in(c);
      if (last && !control_.keep_residuals) continue;
      VectorXd residual = residual_in(c);
      if (!last) update_noise(c, residual, pass > 0 || start != nullptr);
      if (control_.keep_residuals) fit_.residual[c] = std::move(residual);
    }
  }
  for (const NoiseModel& noise : fit_.noise)
    evidence_.options.mechanisms.act(Mechanism::kSettling, noise.transient != 1.0);
  if (control_.covariance && count_ > 0) fit_.covariance = covariance();
  return std::move(fit_);
}

}  // namespace

WhitenedChannels WhitenedChannels::by(const Evidence& evidence, std::vector<NoiseModel> noise) {
  WhitenedChannels w{std::move(noise), {}};
  w.baseline.reserve(evidence.channels.size());
  for (std::size_t c = 0; c < evidence.channels.size(); ++c)
    w.baseline.emplace_back(evidence.channels[c], w.noise[c]);
  return w;
}

WhitenedChannels WhitenedChannels::cold(const Evidence& evidence) {
  std::vector<NoiseModel> noise;
  noise.reserve(evidence.channels.size());
  for (const EvidenceChannel& c : evidence.channels)
    noise.push_back(settling_noise_of(c, c.y, evidence.options.noise));
  return by(evidence, std::move(noise));
}

EffectFit fit_effects(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                      const EffectFit* start, const FitControl& control) {
  return ProfileLikelihood(evidence, designs, control).maximised(designs, start);
}

}  // namespace sparflow
