#include "studies/baseline_methods.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "diagnosis/selection/effect_intervals.h"
#include "diagnosis/selection/effect_search.h"
#include "identification/learning/fit.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"

namespace sparflow::bench {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Removes the part of the columns that the baseline explains.
MatrixXd without(const MatrixXd& basis, const MatrixXd& x) {
  return x - basis * (basis.transpose() * x);
}

/// Mean squared error by stage, over all its places; all quantities of a stage have the same unit.
std::map<std::string, double> squared_errors(const CompareResult& result) {
  std::map<std::string, std::pair<double, double>> sums;
  for (const StageScore& s : result.scores) {
    if (s.n == 0 || s.stage == "flow_sensor") continue;
    sums[s.stage].first += static_cast<double>(s.n) * s.rmse * s.rmse;
    sums[s.stage].second += static_cast<double>(s.n);
  }
  std::map<std::string, double> mean;
  for (const auto& [stage, sum] : sums) mean[stage] = sum.first / sum.second;
  return mean;
}

CompareResult scores_only(const CraneModel& model, const std::vector<Log>& logs) {
  CompareOptions options;
  options.find_regions = options.find_causes = false;
  return compare(model, logs, options);
}

}  // namespace

/// A candidate with one set of nonlinear parameters; its columns are projected and weighted.
struct RawEvidence::Design {
  EffectAt effect;
  std::vector<double> shape;
  std::vector<MatrixXd> columns;  // [channels], without columns where it does not act
  int linear = 0;
  bool acts = false;
};

RawEvidence::RawEvidence(const CraneModel& model, const std::vector<Log>& suspects,
                         const std::vector<Log>& references)
    : machine_(model.machine) {
  SPARFLOW_CHECK(model.effects.empty(), "baseline methods need a model without effects");
  std::vector<MachineSignals> s, r;
  for (const Log& log : suspects) s.push_back(make_signals(machine_, log));
  for (const Log& log : references) r.push_back(make_signals(machine_, log));
  evidence_ = collect_evidence(model, s, r);
  signals_ = std::move(s);
  for (MachineSignals& one : r) signals_.push_back(std::move(one));
  for (const EvidenceChannel& from : evidence_.channels) {
    Channel c{from.kind, from.index, {}, {}, {}};
    std::vector<double> y;
    std::vector<VectorXd> base;
    for (std::size_t b = 0; b < from.blocks.size(); ++b) {
      const auto log = static_cast<std::size_t>(from.log[b]);
      const Index first = from.sample[static_cast<std::size_t>(from.blocks[b].first)];
      const Index last = from.sample[static_cast<std::size_t>(from.blocks[b].last - 1)];
      for (Index row = first; row <= last; ++row) {
        const double value = measured(log, c.kind, c.index, row);
        const VectorXd line = baseline_row(log, c.kind, c.index, row);
        if (!std::isfinite(value) || !line.allFinite()) continue;
        c.sample.emplace_back(log, row);
        y.push_back(value);
        base.push_back(line);
      }
    }
    if (y.size() < 20) continue;
    c.y = Eigen::Map<VectorXd>(y.data(), static_cast<Index>(y.size()));
    c.baseline.resize(c.y.size(), base.front().size());
    for (Index i = 0; i < c.y.size(); ++i) {
      c.baseline.row(i) = base[static_cast<std::size_t>(i)].transpose();
    }
    channels_.push_back(std::move(c));
  }
}

double RawEvidence::measured(std::size_t log, EvidenceKind kind, int index, Index row) const {
  const auto i = static_cast<std::size_t>(index);
  const MachineSignals& s = signals_[log];
  switch (kind) {
    case EvidenceKind::kForce:
      return s.cylinders[i].force[row] - s.cylinders[i].static_force[row];
    case EvidenceKind::kFlow:
      return s.cylinders[i].speed[row];
    case EvidenceKind::kReturnExtend:
    case EvidenceKind::kSupplyRetract:
      return s.cylinders[i].pressure_b[row];
    case EvidenceKind::kReturnRetract:
    case EvidenceKind::kSupplyExtend:
      return s.cylinders[i].pressure_a[row];
    case EvidenceKind::kReturnLine:
      break;
    case EvidenceKind::kPump:
      return s.pumps[i].pressure[row] - evidence_.series[log].pumps[i].demand[row];
  }
  return std::numeric_limits<double>::quiet_NaN();
}

VectorXd RawEvidence::baseline_row(std::size_t log, EvidenceKind kind, int index, Index row) const {
  const auto i = static_cast<std::size_t>(index);
  const MachineSeries& s = evidence_.series[log];
  switch (kind) {
    case EvidenceKind::kForce:
      return VectorXd(0);
    case EvidenceKind::kFlow: {
      const double u = s.cylinders[i].command[row];
      return Eigen::Vector2d(std::max(u, 0.0), std::min(u, 0.0));
    }
    case EvidenceKind::kReturnExtend:
    case EvidenceKind::kReturnRetract: {
      const double q = s.cylinders[i].return_flow[row];
      return Eigen::Vector3d(1.0, q, q * q);
    }
    case EvidenceKind::kSupplyExtend:
    case EvidenceKind::kSupplyRetract: {
      const double q = s.cylinders[i].flow[row], f = s.cylinders[i].force[row];
      VectorXd line(5);
      line << 1.0, q, q * q, f, q * f;
      return line;
    }
    case EvidenceKind::kReturnLine:
      break;
    case EvidenceKind::kPump: {
      VectorXd line = VectorXd::Zero(machine_.cylinder_count() + 1);
      line[s.pumps[i].leader[row] + 1] = 1.0;
      return line;
    }
  }
  return VectorXd(0);
}

MatrixXd RawEvidence::columns(const EffectAt& effect, const std::vector<double>& shape,
                              const Channel& channel) const {
  MatrixXd all;
  for (std::size_t log = 0; log < evidence_.suspects; ++log) {
    MatrixXd one;
    if (!effect.effect->columns(evidence_.series[log], {channel.kind, channel.index}, effect.at,
                                shape, one)) {
      continue;
    }
    if (all.cols() == 0) all.setZero(channel.y.size(), one.cols());
    for (std::size_t i = 0; i < channel.sample.size(); ++i) {
      if (channel.sample[i].first != log) continue;
      const auto row = one.row(channel.sample[i].second);
      if (row.allFinite()) all.row(static_cast<Index>(i)) = row;
    }
  }
  return all;
}

std::vector<std::vector<double>> RawEvidence::shapes(const EffectAt& effect) const {
  std::vector<std::vector<double>> all = {{}};
  int count = 0;
  for (const EffectParameter& p : effect.effect->info().parameters) count += p.linear ? 0 : 1;
  for (int k = 0; k < count; ++k) {
    std::vector<std::vector<double>> longer;
    for (const double value : effect.effect->grid(evidence_.series.front(), effect.at, k)) {
      for (std::vector<double> shape : all) {
        shape.push_back(value);
        longer.push_back(std::move(shape));
      }
    }
    all = std::move(longer);
  }
  return all;
}

/// Least squares of designs on all channels with independent noise and one variance for each channel.
class RawEvidence::IidFit {
 public:
  explicit IidFit(const RawEvidence& raw)
      : raw_(raw),
        basis_(raw.channels_.size()),
        residual_(raw.channels_.size()),
        deviation_(raw.channels_.size()) {
    for (std::size_t c = 0; c < basis_.size(); ++c) {
      basis_[c] = span_of(raw.channels_[c].baseline);
      residual_[c] = without(basis_[c], raw.channels_[c].y);
      const auto count = static_cast<double>(residual_[c].size());
      deviation_[c] = std::max(1e-300, residual_[c].norm() / std::sqrt(count));
      residual_[c] /= deviation_[c];
      rows_ += count;
    }
  }
  double rows() const { return rows_; }

  Design design(const EffectAt& effect, const std::vector<double>& shape) const {
    Design d{effect, shape, std::vector<MatrixXd>(basis_.size()), 0, false};
    for (std::size_t c = 0; c < basis_.size(); ++c) {
      const MatrixXd x = raw_.columns(effect, shape, raw_.channels_[c]);
      if (x.cols() == 0) continue;
      d.columns[c] = without(basis_[c], x) / deviation_[c];
      d.linear = static_cast<int>(x.cols());
      d.acts = true;
    }
    return d;
  }

  /// Sum of n ln(squared error / n) with all designs and their parameters `theta` within bounds.
  double misfit(const std::vector<const Design*>& designs, VectorXd& theta) const {
    Index width = 0;
    for (const Design* d : designs) width += d->linear;
    MatrixXd gram = MatrixXd::Zero(width, width);
    VectorXd cross = VectorXd::Zero(width);
    std::vector<MatrixXd> x(residual_.size());
    for (std::size_t c = 0; c < x.size(); ++c) {
      x[c].setZero(residual_[c].size(), width);
      Index at = 0;
      for (const Design* d : designs) {
        if (d->columns[c].cols() > 0) x[c].middleCols(at, d->linear) = d->columns[c];
        at += d->linear;
      }
      gram.noalias() += x[c].transpose() * x[c];
      cross.noalias() += x[c].transpose() * residual_[c];
    }
    const VectorXd scale = gram.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const MatrixXd scaled = scale.asDiagonal() * gram * scale.asDiagonal();
    theta = scale.asDiagonal() *
            least_squares_of_least_norm(scaled, VectorXd(scale.asDiagonal() * cross));
    Index at = 0;
    for (const Design* d : designs) {
      for (const EffectParameter& p : d->effect.effect->info().parameters) {
        if (!p.linear) continue;
        theta[at] = std::clamp(theta[at], p.lower, p.upper);
        ++at;
      }
    }
    double sum = 0.0;
    for (std::size_t c = 0; c < x.size(); ++c) {
      const auto count = static_cast<double>(residual_[c].size());
      sum += count * std::log((residual_[c] - x[c] * theta).squaredNorm() / count);
    }
    return sum;
  }

 private:
  const RawEvidence& raw_;
  std::vector<MatrixXd> basis_;
  std::vector<VectorXd> residual_;  ///< without the baseline, scaled to unit variance
  std::vector<double> deviation_;
  double rows_ = 0.0;
};

SimpleAnswer RawEvidence::iid_bic(int most) const {
  const IidFit fit(*this);
  std::vector<Design> pool;
  std::vector<double> first_gain;
  for (const EffectAt& effect : candidates(machine_)) {
    double best = -std::numeric_limits<double>::infinity();
    Design kept;
    for (const std::vector<double>& shape : shapes(effect)) {
      Design d = fit.design(effect, shape);
      VectorXd theta;
      if (!d.acts) continue;
      const double gain = -fit.misfit({&d}, theta);
      if (gain > best) best = gain, kept = std::move(d);
    }
    if (kept.acts) pool.push_back(std::move(kept)), first_gain.push_back(best);
  }
  SimpleAnswer answer;
  std::vector<const Design*> chosen;
  VectorXd theta;
  double before = 0.0;  // Without effects every channel has unit variance.
  while (static_cast<int>(chosen.size()) < most) {
    const Design* best = nullptr;
    double best_change = 0.0, best_misfit = 0.0;
    for (std::size_t k = 0; k < pool.size(); ++k) {
      if (std::find(chosen.begin(), chosen.end(), &pool[k]) != chosen.end()) continue;
      std::vector<const Design*> with = chosen;
      with.push_back(&pool[k]);
      const double value = chosen.empty() ? -first_gain[k] : fit.misfit(with, theta);
      const auto parameters = static_cast<double>(pool[k].effect.effect->info().parameters.size());
      const double change = value - before + parameters * std::log(fit.rows());
      if (change < best_change) best_change = change, best_misfit = value, best = &pool[k];
    }
    if (best == nullptr) break;
    chosen.push_back(best);
    before = best_misfit;
  }
  if (chosen.empty()) return answer;
  fit.misfit(chosen, theta);
  Index at = 0;
  for (const Design* d : chosen) {
    answer.found.push_back(d->effect);
    answer.values.push_back(
        parameter_values(*d->effect.effect, theta.segment(at, d->linear), d->shape));
    at += d->linear;
  }
  return answer;
}

SimpleAnswer RawEvidence::strongest_correlation() const {
  double best = 0.0, best_p = 1.0;
  EffectAt best_effect;
  std::vector<double> best_values;
  int tried = 0;
  for (const Channel& c : channels_) {
    std::vector<Index> suspect, reference;
    for (std::size_t i = 0; i < c.sample.size(); ++i) {
      (c.sample[i].first < evidence_.suspects ? suspect : reference)
          .push_back(static_cast<Index>(i));
    }
    if (suspect.size() < 20) continue;
    const std::vector<Index>& learned_from = reference.size() < 20 ? suspect : reference;
    VectorXd r = c.y(suspect);
    if (c.baseline.cols() > 0) {
      const VectorXd scale = c.baseline.colwise().norm().cwiseMax(1e-300).cwiseInverse();
      const MatrixXd base = c.baseline * scale.asDiagonal();
      const VectorXd beta = least_squares_of_least_norm(MatrixXd(base(learned_from, Eigen::all)),
                                                        VectorXd(c.y(learned_from)));
      r -= base(suspect, Eigen::all) * beta;
    }
    r.array() -= r.mean();
    for (const EffectAt& effect : candidates(machine_)) {
      std::vector<double> shape, values;
      VectorXd size(0);
      for (const EffectParameter& p : effect.effect->info().parameters) {
        values.push_back(p.typical);
        if (!p.linear) shape.push_back(p.typical);
      }
      const MatrixXd x = columns(effect, shape, c);
      if (x.cols() == 0) continue;
      VectorXd signal = VectorXd::Zero(x.rows());
      for (Index k = 0; k < x.cols(); ++k) signal += x.col(k) * values[static_cast<std::size_t>(k)];
      VectorXd s = signal(suspect);
      s.array() -= s.mean();
      if (!(s.norm() > 1e-9 * signal.norm())) continue;  // A constant correlates with nothing.
      ++tried;
      const double correlation = std::abs(s.dot(r)) / (s.norm() * r.norm());
      if (!(correlation > best)) continue;
      best = correlation;
      best_effect = effect;
      best_values = values;
      // Fisher's transformation; with hundreds of rows its normal distribution is accurate enough.
      const double z = std::atanh(std::min(correlation, 1.0 - 1e-15)) *
                       std::sqrt(static_cast<double>(suspect.size()) - 3.0);
      best_p = std::erfc(z / std::sqrt(2.0));
    }
  }
  if (best_effect.effect == nullptr || best_p * tried > 0.05) return {};
  return {{best_effect}, {best_values}};
}

std::vector<AbsorbedError> absorbed_by_refit(const CraneModel& model,
                                             const std::vector<Log>& references,
                                             const std::vector<Log>& suspects) {
  const FitResult again = fit(model.machine, suspects);
  const auto own = squared_errors(scores_only(model, references));
  const auto before = squared_errors(scores_only(model, suspects));
  const auto after = squared_errors(again.held_out ? *again.held_out : again.train);
  std::vector<AbsorbedError> shares;
  for (const auto& [stage, error] : before) {
    const auto floor = own.find(stage), left = after.find(stage);
    if (floor == own.end() || left == after.end() || error < 1.21 * floor->second) continue;
    shares.push_back(
        {stage, std::clamp((error - left->second) / (error - floor->second), -1.0, 1.0)});
  }
  return shares;
}

}  // namespace sparflow::bench
