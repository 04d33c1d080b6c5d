#include "diagnosis/selection/effect_intervals.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/regression/acceptance_statistics.h"
#include "identification/comparison/report_numbers.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kTwoSided95 = 1.96;  ///< normal quantile of the 95 % intervals

FitControl all_rows_alike() {
  FitControl control;
  control.covariance = true;
  control.ordinary = true;
  return control;
}

std::vector<const EffectDesign*> pointers(const std::vector<EffectDesign>& designs) {
  std::vector<const EffectDesign*> out;
  out.reserve(designs.size());
  for (const EffectDesign& d : designs) out.push_back(&d);
  return out;
}

/// Whether ordinary least squares puts a linear parameter on a positive lower bound: the effect is then weaker than any
/// of its kind and rather a part of another effect.
bool less_than_plausible(const EffectDesign& design, const VectorXd& theta) {
  for (Index k = 0; k < design.linear; ++k) {
    const double lo = design.lower[static_cast<std::size_t>(k)];
    const double hi = design.upper[static_cast<std::size_t>(k)];
    if (lo > 0.0 && theta[k] < lo + kOnBound * (hi - lo) && design.parameter_acts(k)) return true;
  }
  return false;
}

/// Joint significance test (Wald): whether the joint 95 % region of the linear parameters contains zero. Of two nearly
/// collinear parameters (a laminar and a turbulent part) each alone may be zero, and yet not both.
bool holds_nothing(const VectorXd& theta, const Eigen::MatrixXd& covariance) {
  constexpr double kChiSquare95[] = {3.841, 5.991, 7.815, 9.488, 11.070};  // 1 .. 5 parameters
  const VectorXd sd = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const bool none = (theta.cwiseAbs().array() <= kTwoSided95 * sd.array()).all();
  const Index n = theta.size();
  if (!none || n < 2 || n > 5 || !(sd.minCoeff() > 0.0)) return none;
  const VectorXd scaled = theta.cwiseQuotient(sd), scale = sd.cwiseInverse();
  Cholesky correlation;
  if (!correlation.compute(scale.asDiagonal() * covariance * scale.asDiagonal())) return none;
  return scaled.dot(correlation.solve(scaled)) <= kChiSquare95[n - 1];
}

/// Whether zero is inside the interval of a nonlinear parameter that distinguishes the effect from a plainer one.
bool may_be_plainer(const Effect& effect, const std::vector<double>& values,
                    const std::vector<double>& half) {
  if (effect.info().refines.empty()) return false;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const EffectParameter& p = effect.info().parameters[k];
    if (!p.linear && !p.choice && std::abs(values[k]) <= half[k]) return true;
  }
  return false;
}

/// Relative residual of a linear parameter's action beside those of the parameters before it below which it is the same
/// action: a mass at a link's end and the moment of the link before it.
/// @threshold [1] 0..1e-2; numerical: difference quotients of masses and angles are right to five digits
constexpr double kSameAction = 1e-4;

/// Takes parameters whose action is that of former ones out of the designs: the logs cannot tell them apart whatever the motion.
void drop_same_actions(const Evidence& evidence, std::vector<EffectDesign>& designs) {
  Index count = 0;
  for (const EffectDesign& d : designs) count += d.linear;
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = evidence.channels[c];
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(channel.rows(), count);
    Index at = 0;
    for (const EffectDesign& d : designs) {
      if (d.touches(c)) columns.middleCols(at, d.linear) = d.columns[c].leftCols(d.linear);
      at += d.linear;
    }
    const double squares = channel.y.squaredNorm();
    if (squares > 0.0) gram += columns.transpose() * columns / squares;
  }
  // Cholesky's factor column by column; one whose diagonal vanishes adds nothing to those before it
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(count, count);
  Index k = 0;
  for (EffectDesign& d : designs) {
    for (Index own = 0; own < d.linear; ++own, ++k) {
      const double left = gram(k, k) - factor.row(k).head(k).squaredNorm();
      if (left > kSameAction * kSameAction * gram(k, k)) {
        factor(k, k) = std::sqrt(left);
        for (Index r = k + 1; r < count; ++r)
          factor(r, k) =
              (gram(r, k) - factor.row(r).head(k).dot(factor.row(k).head(k))) / factor(k, k);
        continue;
      }
      for (Eigen::MatrixXd& m : d.columns)
        if (m.cols() > 0) m.col(own).setZero();
    }
  }
}

/// Covariance of the values in the order of info().parameters: that of sampling, and beside it the model-form error of each. Choices
/// have none. @param columns of the linear parameters and then of the nonlinear ones
Eigen::MatrixXd covariance_of(const Effect& effect, const VectorXd& linear,
                              const Eigen::MatrixXd& columns, const std::vector<double>& values) {
  const std::vector<EffectParameter>& parameters = effect.info().parameters;
  const auto n = static_cast<Eigen::Index>(parameters.size());
  std::vector<Eigen::Index> own;
  own.reserve(parameters.size());
  Eigen::Index l = 0, s = linear.size();
  for (const EffectParameter& p : parameters) own.push_back(p.linear ? l++ : s++);
  Eigen::MatrixXd out = columns(own, own);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (parameters[at].choice) {
      out.row(k).setZero();
      out.col(k).setZero();
    } else {
      out(k, k) += std::pow(effect.info().form_error * values[at], 2);
    }
  }
  return out;
}

/// A linear parameter that acts in no channel gets an interval that says nothing; where it cannot be zero, its typical value,
/// too. An optional one is absent then.
void set_undetermined(const EffectDesign& design, FoundEffect& f) {
  Index linear = 0;
  const std::vector<EffectParameter>& parameters = design.effect.effect->info().parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (!parameters[k].linear || design.parameter_acts(linear++) || parameters[k].optional)
      continue;
    const double half = 2.0 * kUndeterminedWidth * parameters[k].typical;
    if (parameters[k].lower > 0.0) f.values[k] = parameters[k].typical;
    f.lower95[k] = f.values[k] - half;
    f.upper95[k] = f.values[k] + half;
    const auto at = static_cast<Eigen::Index>(k);
    f.covariance.row(at).setZero();
    f.covariance.col(at).setZero();
    f.covariance(at, at) = std::pow(half / kTwoSided95, 2);
  }
}

}  // namespace

void estimate_intervals(const Evidence& evidence, std::vector<FoundEffect>& found) {
  std::vector<EffectDesign> designs;
  designs.reserve(found.size());
  for (const FoundEffect& f : found) designs.push_back(f.design);
  drop_same_actions(evidence, designs);
  const std::vector<EffectDesign> plain_designs = designs;
  const EffectFit fit = fit_effects(evidence, pointers(designs), nullptr, all_rows_alike());
  Index first = 0;
  for (EffectDesign& d : designs) {  // one more column for each nonlinear parameter
    const VectorXd theta = fit.theta.segment(first, d.linear);
    first += d.linear;
    d = with_shape_slopes(evidence, d, theta);
  }
  const EffectFit sloped = fit_effects(evidence, pointers(designs), nullptr, all_rows_alike());

  Index plain = 0, at = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    FoundEffect& f = found[i];
    const Effect& effect = *f.design.effect.effect;
    const auto linear = static_cast<Index>(f.design.linear);
    f.at_bound = f.at_bound || less_than_plausible(f.design, fit.theta.segment(plain, linear));
    f.values = parameter_values(effect, fit.theta.segment(plain, linear), f.design.shape);
    VectorXd sd(designs[i].linear);
    for (Index k = 0; k < sd.size(); ++k)
      sd[k] = std::sqrt(std::max(0.0, sloped.covariance(at + k, at + k)));
    const std::vector<bool> choices = shape_choices(effect, f.design.shape);
    std::vector<double> shape_sd(sd.begin() + linear, sd.end());
    for (std::size_t k = 0; k < shape_sd.size(); ++k) shape_sd[k] = choices[k] ? 0.0 : shape_sd[k];
    std::vector<double> half = parameter_values(effect, sd.head(linear), shape_sd);
    for (double& h : half) h *= kTwoSided95;
    f.not_significant = holds_nothing(fit.theta.segment(plain, linear),
                                      sloped.covariance.block(at, at, linear, linear)) ||
                        may_be_plainer(effect, f.values, half);
    f.lower95 = f.upper95 = f.values;
    for (std::size_t k = 0; k < half.size(); ++k) {
      const double whole =
          effect.info().parameters[k].choice
              ? 0.0
              : std::hypot(half[k], kTwoSided95 * effect.info().form_error * f.values[k]);
      f.lower95[k] -= whole;
      f.upper95[k] += whole;
    }
    f.covariance = covariance_of(effect, fit.theta.segment(plain, linear),
                                 sloped.covariance.block(at, at, sd.size(), sd.size()), f.values);
    set_undetermined(plain_designs[i], f);
    plain += linear;
    at += designs[i].linear;
  }
}

bool lies_on_bound(const EffectParameter& parameter, double value) {
  const double margin = kOnBound * (parameter.upper - parameter.lower);
  return value <= parameter.lower + margin || value >= parameter.upper - margin;
}

bool value_is_determined(const AppliedEffect& effect, std::size_t p) {
  return p >= effect.lower95.size() ||
         is_determined(effect.values[p], effect.lower95[p], effect.upper95[p],
                       effect.effect->info().parameters[p].typical);
}

std::vector<double> parameter_values(const Effect& effect, const VectorXd& linear,
                                     const std::vector<double>& shape) {
  std::vector<double> values;
  values.reserve(effect.info().parameters.size());
  Index l = 0;
  std::size_t s = 0;
  for (const EffectParameter& p : effect.info().parameters) {
    values.push_back(p.linear ? linear[l++] : shape[s++]);
  }
  return values;
}

}  // namespace sparflow
