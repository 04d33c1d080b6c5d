#include "diagnosis/residual/residual_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include "diagnosis/residual/residual_oscillation.h"
#include "models/math/linear_algebra.h"
#include "models/math/parallel.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr unsigned kFourierSeed = 7;      ///< of the random features, so that results repeat
constexpr std::size_t kNamedSignals = 4;  ///< at most so many signals are named in a sentence

/// Hat functions with knots at quantiles, so that all have about the same number of rows. [rows x knots]
MatrixXd hats(const VectorXd& x, const ResidualModelOptions& options) {
  std::vector<double> knots;
  const double within = 1.0 - 2.0 * options.outermost_hat;
  for (int k = 0; k < options.hats; ++k) {
    const double v = quantile(x, options.outermost_hat + within * k / (options.hats - 1));
    if (knots.empty() || v > knots.back() + 1e-9 * (1.0 + std::abs(v))) knots.push_back(v);
  }
  const auto m = static_cast<Index>(knots.size());
  if (m < 2) return MatrixXd(x.size(), 0);
  MatrixXd h = MatrixXd::Zero(x.size(), m);
  for (Index i = 0; i < x.size(); ++i) {
    const double v = std::clamp(x[i], knots.front(), knots.back());
    auto k = std::upper_bound(knots.begin(), knots.end(), v) - knots.begin();
    k = std::clamp<std::ptrdiff_t>(k, 1, m - 1);
    const double w = (v - knots[static_cast<std::size_t>(k - 1)]) /
                     (knots[static_cast<std::size_t>(k)] - knots[static_cast<std::size_t>(k - 1)]);
    h(i, k - 1) = 1.0 - w;
    h(i, k) = w;
  }
  return h;
}

/// Cross-validated ridge regression: held-out prediction at the regularisation that predicts best.
struct Ridge {
  VectorXd prediction;
  double explained = -kInfinity;  // 1 - squared error / variance, held out
};

Ridge cross_validated(const MatrixXd& x, const VectorXd& y, const std::vector<int>& fold,
                      const ResidualModelOptions& options) {
  const auto folds = static_cast<std::size_t>(options.folds);
  const Index m = x.cols();
  std::vector<MatrixXd> gram(folds, MatrixXd::Zero(m, m));
  std::vector<VectorXd> cross(folds, VectorXd::Zero(m));
  std::vector<std::vector<Index>> rows(folds);
  for (Index i = 0; i < y.size(); ++i)
    rows[static_cast<std::size_t>(fold[static_cast<std::size_t>(i)])].push_back(i);
  MatrixXd all = MatrixXd::Zero(m, m);
  VectorXd g_all = VectorXd::Zero(m);
  for (std::size_t f = 0; f < rows.size(); ++f) {
    const MatrixXd xf = x(rows[f], Eigen::all);
    gram[f] = transposed_product(xf, xf);
    cross[f].noalias() = xf.transpose() * y(rows[f]);
    all += gram[f];
    g_all += cross[f];
  }
  Ridge best;
  const double scale = all.diagonal().mean();
  for (const double strength : options.ridge) {
    VectorXd prediction(y.size());
    for (std::size_t f = 0; f < rows.size(); ++f) {
      MatrixXd n = all - gram[f];
      n.diagonal().array() += strength * scale;
      const VectorXd w = solve_symmetric(n, g_all - cross[f]);
      for (const Index i : rows[f]) prediction[i] = x.row(i).dot(w);
    }
    const double explained = 1.0 - (y - prediction).squaredNorm() / y.squaredNorm();
    if (explained > best.explained) best = {prediction, explained};
  }
  return best;
}

std::vector<int> folds_of(const EvidenceChannel& channel, int folds) {
  std::vector<int> fold(static_cast<std::size_t>(channel.rows()));
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
      fold[static_cast<std::size_t>(i)] = static_cast<int>(b) % folds;
    }
  }
  return fold;
}

/// Products of hat functions of own flow and own measured force.
MatrixXd own_process_basis(const Evidence& evidence, const EvidenceChannel& channel,
                           const std::vector<Index>& rows, const ResidualModelOptions& options) {
  VectorXd flow(channel.rows()), force(channel.rows());
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    const CylinderSeries& c = evidence.series[static_cast<std::size_t>(channel.log[b])]
                                  .cylinders[static_cast<std::size_t>(channel.index)];
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
      const Index k = channel.sample[static_cast<std::size_t>(i)];
      flow[i] = c.flow[k];
      force[i] = c.force.size() > k ? c.force[k] : c.static_force[k];
    }
  }
  const MatrixXd a = hats(flow(rows), options), b = hats(force(rows), options);
  if (a.cols() == 0 || b.cols() == 0) return MatrixXd::Ones(static_cast<Index>(rows.size()), 1);
  MatrixXd basis(static_cast<Index>(rows.size()), a.cols() * b.cols());
  for (Index i = 0; i < a.cols(); ++i) {
    for (Index j = 0; j < b.cols(); ++j)
      basis.col(i * b.cols() + j) = a.col(i).cwiseProduct(b.col(j));
  }
  return basis;
}

/// [SI] Structure of smaller RMS is not reported, however regular.
double smallest_of_interest(const EvidenceChannel& channel, const ResidualModelOptions& options) {
  if (channel.kind == EvidenceKind::kFlow) return options.smallest_speed;
  if (channel.kind != EvidenceKind::kForce) return options.smallest_pressure;
  return options.smallest_force_share * channel.largest_force;
}

struct ResidualModelFit {
  Ridge ridge;
  std::vector<MatrixXd> parts;  // by signal
};

/// Random Fourier features of all signals together. [rows x features]
MatrixXd fourier_features(const std::vector<VectorXd>& values, Index rows,
                          const ResidualModelOptions& options) {
  MatrixXd standard(rows, static_cast<Index>(values.size()));
  for (std::size_t s = 0; s < values.size(); ++s) {
    const VectorXd& v = values[s];
    const double sd = std::sqrt((v.array() - v.mean()).square().mean());
    standard.col(static_cast<Index>(s)) =
        sd > 0.0 ? VectorXd((v.array() - v.mean()) / sd) : VectorXd::Zero(v.size());
  }
  std::mt19937 random(kFourierSeed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 2.0 * std::numbers::pi);
  MatrixXd fourier(rows, options.fourier);
  for (int k = 0; k < options.fourier; ++k) {
    VectorXd w = VectorXd::Zero(standard.cols());
    for (int pick = 0; pick < options.fourier_signals; ++pick)
      w[static_cast<Index>(random() % static_cast<unsigned>(w.size()))] =
          options.fourier_width * normal(random);
    fourier.col(k) = ((standard * w).array() + uniform(random)).cos();
  }
  fourier.rowwise() -= fourier.colwise().mean().eval();
  return options.fourier_weight * fourier;
}

MatrixXd side_by_side(const std::vector<MatrixXd>& parts, Index rows) {
  Index width = 0;
  for (const MatrixXd& p : parts) width += p.cols();
  MatrixXd x(rows, width);
  Index at = 0;
  for (const MatrixXd& p : parts) {
    x.middleCols(at, p.cols()) = p;
    at += p.cols();
  }
  return x;
}

std::vector<MatrixXd> centred(std::vector<MatrixXd> hat) {
  for (MatrixXd& h : hat) {
    if (h.cols() > 0) h.rowwise() -= h.colwise().mean().eval();
  }
  return hat;
}

std::vector<MatrixXd> driven_by(const VectorXd& driver, std::vector<MatrixXd> hat) {
  for (MatrixXd& h : hat) h = driver.asDiagonal() * h;
  return hat;
}

/// The flexible model: hat functions of every signal and random Fourier features of all together.
ResidualModelFit additive_residual_model(const std::vector<VectorXd>& values,
                                         const std::vector<MatrixXd>& hat, const VectorXd& y,
                                         const std::vector<int>& fold,
                                         const ResidualModelOptions& options) {
  ResidualModelFit model;
  model.parts = centred(hat);
  std::vector<MatrixXd> all = {fourier_features(values, y.size(), options)};
  all.insert(all.end(), model.parts.begin(), model.parts.end());
  model.ridge = cross_validated(side_by_side(all, y.size()), y, fold, options);
  return model;
}

/// The driven model: sign of the speed (forces) or command (speeds), times the hat functions of every signal.
ResidualModelFit driven_residual_model(const VectorXd& driver, const std::vector<MatrixXd>& hat,
                                       const VectorXd& y, const std::vector<int>& fold,
                                       const ResidualModelOptions& options) {
  ResidualModelFit model;
  model.parts = driven_by(driver, hat);
  model.ridge = cross_validated(side_by_side(model.parts, y.size()), y, fold, options);
  return model;
}

/// Sign of the speed (forces) or command (speeds). [rows]; empty for other channels
VectorXd driver_of(const Evidence& evidence, const EvidenceChannel& channel,
                   const std::vector<Index>& rows) {
  if (channel.kind != EvidenceKind::kForce && channel.kind != EvidenceKind::kFlow) return {};
  VectorXd all = VectorXd::Zero(channel.rows());
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    const CylinderSeries& c = evidence.series[static_cast<std::size_t>(channel.log[b])]
                                  .cylinders[static_cast<std::size_t>(channel.index)];
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
      const Index k = channel.sample[static_cast<std::size_t>(i)];
      const double v = channel.kind == EvidenceKind::kForce
                           ? static_cast<double>((c.speed[k] > 0.0) - (c.speed[k] < 0.0))
                           : (k < c.command.size() ? c.command[k] : 0.0);
      all[i] = std::isfinite(v) ? v : 0.0;
    }
  }
  return all(rows);
}

/// Names of the signals that explain enough of the structure alone, held out.
std::vector<std::string> strongest(const ResidualModelFit& model,
                                   const std::vector<SignalColumn>& signals, const VectorXd& y,
                                   const std::vector<int>& fold,
                                   const ResidualModelOptions& options) {
  std::vector<std::pair<double, std::string>> alone;
  for (std::size_t s = 0; s < signals.size(); ++s) {
    if (model.parts[s].cols() == 0) continue;
    alone.emplace_back(cross_validated(model.parts[s], y, fold, options).explained,
                       signals[s].name);
  }
  std::sort(alone.rbegin(), alone.rend());
  std::vector<std::string> names;
  for (const auto& [share, name] : alone) {
    if (share < options.least_share_alone * model.ridge.explained || names.size() >= kNamedSignals)
      break;
    names.push_back(name);
  }
  if (names.empty()) names.emplace_back("several signals together");
  return names;
}

/// The residual in suspect rows; where a pressure model is learned, less a smooth function of that model's inputs.
VectorXd to_explain(const Evidence& evidence, const EvidenceChannel& channel, const VectorXd& whole,
                    const std::vector<Index>& rows, const ResidualModelOptions& options) {
  VectorXd y = whole(rows).array() - whole(rows).mean();
  if (channel.kind != EvidenceKind::kForce && channel.kind != EvidenceKind::kFlow &&
      channel.kind != EvidenceKind::kPump && channel.kind != EvidenceKind::kReturnLine) {
    // a pressure model learns any smooth law of the cylinder's own flow and force, so that is explained
    const MatrixXd own = own_process_basis(evidence, channel, rows, options);
    MatrixXd gram = transposed_product(own, own);
    gram.diagonal().array() += options.own_ridge * gram.diagonal().mean();
    y -= own * solve_symmetric(gram, own.transpose() * y);
    y.array() -= y.mean();
  }
  return y;
}

/// An isolated event in a force or speed channel. Channels with a learned pressure model or margin are left out,
/// because a deviation there may only be outside the range that was learned.
std::optional<ResidualStructure> event_of(const Evidence& evidence, std::size_t index,
                                          const VectorXd& residual,
                                          const ResidualModelOptions& options) {
  const EvidenceChannel& channel = evidence.channels[index];
  if (channel.kind != EvidenceKind::kForce && channel.kind != EvidenceKind::kFlow) return {};
  const Event event = strongest_event(evidence, channel, residual, options);
  if (event.times < options.least_event || event.rms < smallest_of_interest(channel, options))
    return {};
  ResidualStructure left;
  left.channel = index;
  left.event = true;
  left.rms = event.rms;
  left.noise = event.rest;
  left.explained = event.rms * event.rms / (event.rms * event.rms + event.rest * event.rest);
  left.depends_on.push_back(fmt::format(
      "time: {:.0f} times the usual residual from {:.1f} to {:.1f} s{}", event.times, event.from,
      event.to, evidence.suspects > 1 ? fmt::format(" of log {}", event.log + 1) : ""));
  return left;
}

std::optional<ResidualStructure> residual_structure_of(const Evidence& evidence, std::size_t index,
                                                       const VectorXd& whole,
                                                       const ResidualModelOptions& options) {
  const EvidenceChannel& channel = evidence.channels[index];
  const std::vector<Index> rows = suspect_rows(evidence, channel);
  if (std::ssize(rows) < options.fewest_rows || whole.size() == 0) return {};
  const VectorXd y = to_explain(evidence, channel, whole, rows, options);
  const std::vector<int> all_folds = folds_of(channel, options.folds);
  std::vector<int> fold;
  fold.reserve(rows.size());
  for (const Index i : rows) fold.push_back(all_folds[static_cast<std::size_t>(i)]);
  const std::vector<SignalColumn> signals = channel_signals(evidence, channel, options);
  std::vector<VectorXd> values;
  std::vector<MatrixXd> hat;
  for (const SignalColumn& s : signals) {
    values.emplace_back(s.values(rows));
    hat.push_back(hats(values.back(), options));
  }
  ResidualModelFit model = additive_residual_model(values, hat, y, fold, options);
  const VectorXd driver = driver_of(evidence, channel, rows);
  if (driver.size() > 0 && driver.squaredNorm() > 0.0) {
    ResidualModelFit driven = driven_residual_model(driver, hat, y, fold, options);
    if (driven.ridge.explained > std::max(model.ridge.explained, options.least_share_driven))
      model = std::move(driven);
  }
  ResidualStructure left;
  left.channel = index;
  const double variance = y.squaredNorm() / static_cast<double>(y.size());
  const Line line = strongest_line(evidence, channel, whole, options);
  left.explained = std::max(model.ridge.explained, line.share);
  left.rms = std::sqrt(std::max(0.0, left.explained) * variance);
  left.noise = std::sqrt(std::max(0.0, 1.0 - left.explained) * variance);
  const Oscillation oscillation = strongest_oscillation(evidence, channel, options);
  if (oscillation.dip < options.deepest_dip && left.explained < options.least_share) {
    left.explained = oscillation.rms * oscillation.rms /
                     (oscillation.rms * oscillation.rms + oscillation.noise * oscillation.noise);
    left.rms = oscillation.rms;
    left.noise = oscillation.noise;
    left.frequency = oscillation.frequency;
    left.oscillation = true;
    left.depends_on.push_back(
        fmt::format("time, an oscillation near {:.1f} Hz", oscillation.frequency));
    return left;
  }
  if (left.rms < smallest_of_interest(channel, options) || left.explained < options.least_share ||
      left.rms < options.least_size * left.noise) {
    return event_of(evidence, index, whole, options);
  }
  if (line.share > options.least_line_share * left.explained) {
    left.frequency = line.frequency;
    left.depends_on.push_back(fmt::format("time, {:.2f} Hz", line.frequency));
  }
  for (std::string& name : strongest(model, signals, y, fold, options)) {
    if (left.depends_on.empty() || name != "several signals together")
      left.depends_on.push_back(std::move(name));
  }
  return left;
}

}  // namespace

std::vector<double> agreement_with_references(const Evidence& evidence, const EffectFit& fit,
                                              const ResidualStructure& structure,
                                              const ResidualModelOptions& options) {
  const std::size_t channel = structure.channel;
  const EvidenceChannel& c = evidence.channels[channel];
  if (!evidence.has_reference() || fit.residual[channel].size() == 0) return {};
  VectorXd y = fit.residual[channel];
  const VectorXd scale = fit.noise[channel].scale_of(c.noise_rows());
  if (scale.size() > 0) y.array() /= scale.array();
  std::vector<Index> rows(static_cast<std::size_t>(c.rows()));
  std::iota(rows.begin(), rows.end(), Index{0});
  std::vector<int> group(rows.size());
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    const bool reference = static_cast<std::size_t>(c.log[b]) >= evidence.suspects;
    std::fill(group.begin() + c.blocks[b].first, group.begin() + c.blocks[b].last, reference);
  }
  std::vector<VectorXd> values;
  std::vector<MatrixXd> hat;
  std::vector<SignalColumn> signals = channel_signals(evidence, c, options);
  const auto named = [&](const SignalColumn& s) {
    return std::find(structure.depends_on.begin(), structure.depends_on.end(), s.name) !=
           structure.depends_on.end();
  };
  if (std::any_of(signals.begin(), signals.end(), named))
    std::erase_if(signals, [&](const SignalColumn& s) { return !named(s); });
  for (SignalColumn& s : signals) {
    values.push_back(std::move(s.values));
    hat.push_back(hats(values.back(), options));
  }
  std::vector<MatrixXd> all = {fourier_features(values, c.rows(), options)};
  const auto add = [&](const std::vector<MatrixXd>& parts) {
    all.insert(all.end(), parts.begin(), parts.end());
  };
  add(centred(hat));
  const VectorXd driver = driver_of(evidence, c, rows);
  if (driver.size() > 0) add(driven_by(driver, hat));
  ResidualModelOptions two = options;
  two.folds = 2;
  const Ridge other = cross_validated(side_by_side(all, c.rows()), y, group, two);
  std::vector<double> agreement;
  agreement.reserve(c.blocks.size());
  double squares = 0.0;
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    if (static_cast<std::size_t>(c.log[b]) >= evidence.suspects) continue;
    const Index n = c.blocks[b].last - c.blocks[b].first;
    const auto left = y.segment(c.blocks[b].first, n);
    agreement.push_back(other.prediction.segment(c.blocks[b].first, n).dot(left));
    squares += left.squaredNorm();
  }
  for (double& a : agreement) a *= static_cast<double>(agreement.size()) / squares;
  return agreement;
}

std::vector<ResidualStructure> find_residual_structure(const Evidence& evidence,
                                                       const EffectFit& fit,
                                                       const ResidualModelOptions& options) {
  const std::size_t channels = evidence.channels.size();
  std::vector<std::optional<ResidualStructure>> each(channels);
  parallel(channels, [&](std::size_t c) {
    // while the machine settles a residual is larger without structure
    const VectorXd scale = fit.noise[c].scale_of(evidence.channels[c].noise_rows());
    const bool settles = scale.size() > 0 && fit.residual[c].size() > 0;
    each[c] = residual_structure_of(
        evidence, c, settles ? VectorXd(fit.residual[c].cwiseQuotient(scale)) : fit.residual[c],
        options);
  });
  std::vector<ResidualStructure> found;
  for (std::optional<ResidualStructure>& left : each) {
    if (left) found.push_back(std::move(*left));
  }
  std::sort(found.begin(), found.end(), [](const ResidualStructure& a, const ResidualStructure& b) {
    return a.rms / a.noise > b.rms / b.noise;
  });
  return found;
}

}  // namespace sparflow
