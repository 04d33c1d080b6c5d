#include "diagnosis/regression/acceptance_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/linear_algebra.h"
#include "models/math/student.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Half of the difference by which an action is differentiated, relative to the nonlinear parameter.
constexpr double kSlopeStep = 0.02;

struct Layout {  // of the designs' parameters
  std::vector<Index> first;
  Index count = 0;
  explicit Layout(const std::vector<const EffectDesign*>& designs) {
    for (const EffectDesign* d : designs) {
      first.push_back(count);
      count += d->linear;
    }
  }
};

/// Solves n x = g with a ridge that only matters where the data do not determine x.
VectorXd solve(MatrixXd n, const VectorXd& g) {
  if (g.size() == 0) return g;
  const VectorXd scale = n.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  n = scale.asDiagonal() * n * scale.asDiagonal();
  n.diagonal().array() += 1e-9;
  return scale.cwiseProduct(solve_symmetric(n, scale.cwiseProduct(g)));
}

double size_where_it_acts(const VectorXd& action) {
  return std::sqrt(action.array().pow(4).sum() / action.squaredNorm());
}

/// Squares of an action that the same effect in all logs leaves: what that takes of a difference between logs, no learned law has.
double beyond_own_law(const EvidenceChannel& channel, const EffectAt& effect,
                      const VectorXd& action) {
  for (const EvidenceChannel::SharedAction& s : channel.shared) {
    if (s.effect != effect || s.columns == 0) continue;
    const MatrixXd own = channel.baseline.middleCols(s.first, s.columns);
    return (action - own * least_squares(own, action)).squaredNorm();
  }
  return action.squaredNorm();
}

/// Products of an effect's action with the model-form error of another one, see EffectAction::over_form.
class FormError {
 public:
  /// @param scale share of the model-form error over the square of the noise
  void add(const std::vector<NoiseBlock>& blocks, const VectorXd& own, const VectorXd& other,
           double scale) {
    const VectorXd products = scale * own.cwiseProduct(other);
    for (const NoiseBlock& b : blocks) {
      const auto here = products.segment(b.first, b.last - b.first);
      const bool forward = own.segment(b.first, b.last - b.first).sum() >= 0.0;
      (forward ? forward_ : backward_) += here.sum();
      apart_ += std::pow(here.cwiseAbs().sum(), 2);
    }
  }
  double square() const { return forward_ * forward_ + backward_ * backward_ + apart_; }

 private:
  double forward_ = 0.0, backward_ = 0.0, apart_ = 0.0;
};

}  // namespace

double form_share(const Effect& effect, const RegressionOptions& options) {
  const bool exact = effect.changes_machine() || effect.info().stage == EffectStage::kForce;
  return exact ? effect.info().form_error
               : std::max(effect.info().form_error, options.least_form_error);
}

EffectDesign other_power(const EffectDesign& design, const VectorXd& theta,
                         const RegressionOptions& options) {
  const Effect& effect = *design.effect.effect;
  EffectDesign result;
  result.columns.resize(design.columns.size());
  if (effect.changes_machine() || effect.columns_filtered()) return result;
  for (std::size_t c = 0; c < design.columns.size(); ++c) {
    if (!design.touches(c)) continue;
    const VectorXd action = design.columns[c] * theta;
    const double size = std::sqrt(
        action.squaredNorm() / std::max<double>(1.0, (action.array() != 0.0).cast<double>().sum()));
    if (!(size > 0.0)) continue;
    result.columns[c] = action.unaryExpr(
        [&](double a) { return a == 0.0 ? 0.0 : a * std::log(std::abs(a) / size); });
  }
  result.linear = 1;
  result.lower = {-options.largest_power_change};
  result.upper = {options.largest_power_change};
  return result;
}

EffectAction effect_action(const Evidence& evidence,
                           const std::vector<const EffectDesign*>& designs, std::size_t index,
                           const EffectFit& fit, const RegressionOptions& options) {
  const Layout layout(designs);
  const auto acts_in = [&](std::size_t k, std::size_t c) {
    return VectorXd(designs[k]->columns[c] *
                    fit.theta.segment(layout.first[k], designs[k]->linear));
  };
  EffectAction action;
  double whole = 0.0, left = 0.0, most = 0.0;
  std::vector<FormError> form(designs.size());
  double of_form = 0.0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!designs[index]->touches(c)) continue;
    const EvidenceChannel& channel = evidence.channels[c];
    const double noise = fit.noise[c].deviation();
    VectorXd own = acts_in(index, c);
    const double here = beyond_own_law(channel, designs[index]->effect, own);
    whole += here / (noise * noise);
    if (channel.baseline.cols() > 0) own -= channel.baseline * least_squares(channel.baseline, own);
    const double squares = own.squaredNorm();
    left += squares / (noise * noise);
    if (!(squares > 0.0)) continue;
    if (squares / (noise * noise) > most) {
      most = squares / (noise * noise);
      action.absorbed_where_seen = 1.0 - squares / here;
    }
    action.size = std::max(action.size, size_where_it_acts(own) / noise);
    for (std::size_t k = 0; k < designs.size(); ++k) {
      if (k == index || !designs[k]->touches(c) || designs[k]->effect.effect == nullptr) continue;
      const double share = form_share(*designs[k]->effect.effect, options);
      form[k].add(channel.blocks, own, acts_in(k, c), share / (noise * noise));
    }
    for (const EvidenceChannel::SharedAction& s : channel.shared) {
      const double share = options.shared_form_share * form_share(*s.effect.effect, options);
      FormError error;
      error.add(channel.blocks, own, s.values, share / (noise * noise));
      of_form += error.square();
    }
  }
  action.absorbed = whole > 0.0 ? 1.0 - left / whole : 1.0;
  for (const FormError& error : form) of_form += error.square();
  if (of_form > 0.0) action.over_form = left / std::sqrt(of_form);
  return action;
}

bool rests_on_bound(const EffectDesign& design, const Eigen::Ref<const VectorXd>& theta) {
  for (Index k = 0; k < design.linear; ++k) {
    const double lo = design.lower[static_cast<std::size_t>(k)];
    const double hi = design.upper[static_cast<std::size_t>(k)];
    const double edge = kOnBound * (hi - lo);
    if (!design.parameter_acts(k)) continue;
    if (theta[k] > hi - edge || (lo > 0.0 && theta[k] < lo + edge)) return true;
  }
  return false;
}

namespace {
/// What the other folds predict in a stretch of motion, in units of the noise.
struct Prediction {
  double square;   ///< of the predicted action
  double product;  ///< of the predicted action with what the stretch shows
};

/// One-sided chance of gains as large. What the stretches show is the slope times what is predicted in them: one of an effect that acts
/// as predicted, and below one half nothing is gained. The slope is a regression through the origin with variances in proportion to the
/// information of the stretches (Cochran 1977, Sampling Techniques, section 6.7), at least those of the noise.
double chance_of_gains(const std::vector<Prediction>& stretches) {
  double squares = 0.0, products = 0.0, scatter = 0.0, count = 0.0;
  for (const Prediction& p : stretches) {
    if (!(p.square > 0.0)) continue;
    squares += p.square;
    products += p.product;
    count += 1.0;
  }
  if (count < 2.0) return 1.0;
  const double slope = products / squares;
  for (const Prediction& p : stretches)
    if (p.square > 0.0) scatter += std::pow(p.product - slope * p.square, 2) / p.square;
  const double variance = std::max(1.0, scatter / (count - 1.0)) / squares;
  return student_tail((slope - 0.5) / std::sqrt(variance), count - 1.0);
}

/// A stretch of motion in which an effect acts.
struct Stretch {
  std::size_t fold;
  std::vector<Index> owner;  ///< parameters of its columns
  MatrixXd cross;            ///< of the columns with each other and with the measured values
};

/// Normal equations of the folds, over all parameters of the designs.
struct Folds {
  std::vector<MatrixXd> n;
  std::vector<VectorXd> g;
  std::vector<Stretch> stretches;  ///< of the effect that is judged

  Folds(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
        std::size_t index, const EffectFit& fit, std::size_t count) {
    const Layout layout(designs);
    n.assign(count, MatrixXd::Zero(layout.count, layout.count));
    g.assign(count, VectorXd::Zero(layout.count));
    for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
      const EvidenceChannel& channel = evidence.channels[c];
      const MatrixXd columns = columns_of(designs, c, channel.rows());
      const Index width = columns.cols();
      if (width == 0) continue;
      std::vector<Index> owner;
      for (std::size_t k = 0; k < designs.size(); ++k)
        for (Index i = 0; i < designs[k]->columns[c].cols(); ++i)
          owner.push_back(layout.first[k] + i);
      const MatrixXd rows =
          whitened_rows(channel, fit.noise[c], columns) / std::sqrt(fit.noise[c].variance);
      for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
        const NoiseBlock& block = channel.blocks[b];
        const Index length = block.last - block.first;
        const MatrixXd part = rows.middleRows(block.first, length);
        const MatrixXd cross = transposed_product(part.leftCols(width), part);
        if (designs[index]->touches(c) &&
            !designs[index]->columns[c].middleRows(block.first, length).isZero(0.0))
          stretches.push_back({b % count, owner, cross});
        for (Index i = 0; i < width; ++i) {
          const Index oi = owner[static_cast<std::size_t>(i)];
          g[b % count][oi] += cross(i, width);
          for (Index j = 0; j < width; ++j)
            n[b % count](oi, owner[static_cast<std::size_t>(j)]) += cross(i, j);
        }
      }
    }
  }
};

Prediction prediction_in(const Stretch& s, const VectorXd& with, const VectorXd& without) {
  const VectorXd change = with(s.owner) - without(s.owner);
  const MatrixXd& n = s.cross;
  const VectorXd shown = n.col(change.size()) - n.leftCols(change.size()) * without(s.owner);
  return {change.dot(n.leftCols(change.size()) * change), change.dot(shown)};
}

}  // namespace

HeldOutGain held_out_gain(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                          std::size_t index, const EffectFit& fit, int folds) {
  const Layout layout(designs);
  const auto count = static_cast<std::size_t>(folds);
  const Folds data(evidence, designs, index, fit, count);
  MatrixXd n_all = MatrixXd::Zero(layout.count, layout.count);
  VectorXd g_all = VectorXd::Zero(layout.count);
  for (std::size_t f = 0; f < count; ++f) {
    n_all += data.n[f];
    g_all += data.g[f];
  }
  std::vector<Index> others;
  for (Index i = 0; i < layout.count; ++i) {
    if (i < layout.first[index] || i >= layout.first[index] + designs[index]->linear)
      others.push_back(i);
  }
  std::vector<double> gains;
  std::vector<Prediction> by_stretch;
  for (std::size_t f = 0; f < count; ++f) {
    const MatrixXd nf = n_all - data.n[f];
    const VectorXd gf = g_all - data.g[f];
    const VectorXd with = solve(nf, gf);
    VectorXd without = VectorXd::Zero(layout.count);
    without(others) = solve(nf(others, others), gf(others));
    // squared error on the fold, up to a constant: theta'N theta - 2 g'theta
    const auto error = [&](const VectorXd& theta) {
      return theta.dot(data.n[f] * theta) - 2.0 * data.g[f].dot(theta);
    };
    gains.push_back(0.5 * (error(without) - error(with)));
    for (const Stretch& s : data.stretches)
      if (s.fold == f) by_stretch.push_back(prediction_in(s, with, without));
  }
  HeldOutGain result;
  result.chance = chance_of_gains(by_stretch);
  double squares = 0.0;
  for (const double v : gains) {
    result.gain += v;
    result.improved += v > 0.0 ? 1.0 / static_cast<double>(folds) : 0.0;
  }
  const double mean = result.gain / static_cast<double>(folds);
  for (const double v : gains) squares += (v - mean) * (v - mean);
  result.error = std::sqrt(squares * static_cast<double>(folds) /
                           std::max(1.0, static_cast<double>(folds) - 1.0));
  return result;
}

std::vector<bool> shape_choices(const Effect& effect, std::span<const double> shape) {
  std::vector<bool> choices;
  for (const EffectParameter& p : effect.info().parameters) {
    if (!p.linear) choices.push_back(p.choice || is_absent(p, shape[choices.size()]));
  }
  return choices;
}

EffectDesign with_shape_slopes(const Evidence& evidence, const EffectDesign& design,
                               const VectorXd& theta) {
  EffectDesign result = design;
  result.number = 0;
  const std::vector<bool> choices = shape_choices(*design.effect.effect, design.shape);
  for (std::size_t s = 0; s < design.shape.size(); ++s) {
    const double h = kSlopeStep * std::max(std::abs(design.shape[s]), 1e-9);
    std::vector<double> up = design.shape, down = design.shape;
    up[s] += h;
    down[s] -= h;
    const EffectDesign a = make_design(evidence, design.effect, up),
                       b = make_design(evidence, design.effect, down);
    const bool choice = choices[s];
    for (std::size_t c = 0; c < design.columns.size(); ++c) {
      if (!design.touches(c)) continue;
      VectorXd slope = VectorXd::Zero(evidence.channels[c].rows());
      if (a.touches(c)) slope += a.columns[c] * theta;
      if (b.touches(c)) slope -= b.columns[c] * theta;
      slope /= 2.0 * h;
      if (choice) slope.setZero();
      MatrixXd wider(slope.size(), result.columns[c].cols() + 1);
      wider << result.columns[c], slope;
      result.columns[c] = std::move(wider);
    }
    ++result.linear;
    result.lower.push_back(-std::numeric_limits<double>::max());
    result.upper.push_back(std::numeric_limits<double>::max());
  }
  return result;
}

}  // namespace sparflow
