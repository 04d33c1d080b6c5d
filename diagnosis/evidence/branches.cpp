#include "diagnosis/evidence/branches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Quantiles between which the range of a pressure is measured: single samples beyond do not count.
constexpr double kLow = 0.01, kHigh = 0.99;
/// Quantiles of the return pressure below which samples are initially on the return line's branch.
constexpr double kInitialLevels[] = {0.1, 0.25, 0.5, 0.75, 0.9};
/// The expectation maximisation ends when a step gains less than this for each sample. [nat]
constexpr double kConverged = 1e-4;
constexpr int kFewestSteps = 5, kMostSteps = 60;  // of the expectation maximisation

/// Rows of all logs; pressures are in bar, and regressors are scaled to the order of one.
struct Rows {
  VectorXd p_return, p_supply;
  MatrixXd line, valve;                      ///< regressors of f and g
  VectorXd load;                             ///< [bar] force divided by the supply area
  std::vector<std::pair<int, Index>> where;  ///< log and sample
  Index count() const { return p_return.size(); }
};

bool usable(const BranchData& d, Index k) {
  return d.moving[k] && std::isfinite(d.p_return[k]) && std::isfinite(d.p_supply[k]) &&
         std::isfinite(d.q_return[k]) && std::isfinite(d.q_supply[k]) &&
         std::isfinite(d.force[k]) &&
         (d.q_return_total.size() == 0 || std::isfinite(d.q_return_total[k]));
}

/// [degC] range of the oil temperature if it is known everywhere and changes: return pressure depends on it.
std::optional<Range> oil_range(const std::vector<BranchData>& logs,
                               const std::vector<std::pair<int, Index>>& where,
                               const BranchOptions& options) {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const auto& [l, k] : where) {
    const VectorXd& oil = logs[static_cast<std::size_t>(l)].oil;
    if (oil.size() == 0 || !std::isfinite(oil[k])) return std::nullopt;
    range.lo = std::min(range.lo, oil[k]);
    range.hi = std::max(range.hi, oil[k]);
  }
  if (!(range.hi - range.lo > options.least_oil_range)) return std::nullopt;
  return range;
}

Rows gather(const std::vector<BranchData>& logs, const BranchOptions& options) {
  Rows r;
  double q_return = 0.0, q_supply = 0.0, q_total = 0.0;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const BranchData& d = logs[l];
    for (Index k = 0; k < d.moving.size(); ++k) {
      if (!usable(d, k)) continue;
      r.where.emplace_back(static_cast<int>(l), k);
      q_return = std::max(q_return, d.q_return[k]);
      q_supply = std::max(q_supply, d.q_supply[k]);
      if (d.q_return_total.size() > 0) q_total = std::max(q_total, d.q_return_total[k]);
    }
  }
  const auto n = static_cast<Index>(r.where.size());
  if (n < options.fewest_samples || !(q_return > 0.0) || !(q_supply > 0.0)) return {};
  r.p_return.resize(n);
  r.p_supply.resize(n);
  VectorXd force(n);
  const std::optional<Range> oil = oil_range(logs, r.where, options);
  const auto first_oil = 3 + static_cast<Index>(logs.size());
  r.line.setZero(n, first_oil + (oil ? 2 : 0));
  r.valve.setOnes(n, 5);
  for (Index i = 0; i < n; ++i) {
    const auto& [l, k] = r.where[static_cast<std::size_t>(i)];
    const BranchData& d = logs[static_cast<std::size_t>(l)];
    r.p_return[i] = d.p_return[k] * 1e-5;
    r.p_supply[i] = d.p_supply[k] * 1e-5;
    force[i] = d.force[k];
    const double qr = d.q_return[k] / q_return, qs = d.q_supply[k] / q_supply;
    r.line.row(i).head(3) << 1.0, qr, qr * qr;
    if (q_total > 0.0 && d.q_return_total.size() > 0) {
      r.line(i, 3 + l) = std::pow(d.q_return_total[k] / q_total, 2);
    }
    if (oil) {
      const double warm = (2.0 * d.oil[k] - oil->lo - oil->hi) / (oil->hi - oil->lo);
      r.line.row(i).segment(first_oil, 2) << warm, warm * qr;
    }
    r.valve.row(i).segment(1, 2) << qs, qs * qs;
  }
  // force = +-(A_supply p_supply - A_return p_return): areas and sign are estimated from the data
  MatrixXd pressures(n, 2);
  pressures << r.p_supply, r.p_return;
  const VectorXd areas = least_squares(pressures, force);
  r.load = std::abs(areas[0]) > 0.0 ? VectorXd(force / areas[0]) : VectorXd::Zero(n);
  const double largest = std::max(1.0, r.load.cwiseAbs().maxCoeff());
  r.valve.col(3) = r.load / largest;
  r.valve.col(4) = r.valve.col(3).cwiseProduct(r.valve.col(1));
  return r;
}

struct Law {
  VectorXd coefficients;
  double deviation = 1.0;  ///< [bar]
  double share = 0.0;

  void fit(const MatrixXd& x, const VectorXd& y, const VectorXd& weight,
           const BranchOptions& options) {
    const double total = weight.sum();
    MatrixXd normal = weighted_gram(x, weight);
    // a ridge that is small beside the regressors: it holds coefficients that the samples do not determine at zero
    normal.diagonal().array() += 1e-6 * total + 1e-12;
    coefficients = solve_symmetric(normal, x.transpose() * weight.cwiseProduct(y));
    const VectorXd r = y - x * coefficients;
    deviation = std::max(options.least_deviation,
                         std::sqrt(weight.dot(r.cwiseAbs2()) / std::max(total, 1e-9)));
    share = total / static_cast<double>(y.size());
  }
};

double above(double z) { return 0.5 * std::erfc(-z * M_SQRT1_2); }
double density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI); }

double spread(const VectorXd& v, const BranchOptions& options) {
  return std::max(options.least_pressure_range, quantile(v, kHigh) - quantile(v, kLow));
}

struct Mixture {
  Law line, valve;
  double range_return = 0.0, range_supply = 0.0;  ///< [bar] of the pressure that a law does not set
  double likelihood = -std::numeric_limits<double>::infinity();

  /// Computes the posterior weights of both laws [rows] and the log-likelihood.
  void expect(const Rows& r, const BranchOptions& options, VectorXd& on_line, VectorXd& on_valve) {
    const Index n = r.count();
    const VectorXd e1 = line.share > 0.0 ? VectorXd(r.p_return - r.line * line.coefficients)
                                         : VectorXd::Constant(n, 1e9);
    const VectorXd e2 = valve.share > 0.0 ? VectorXd(r.p_supply - r.valve * valve.coefficients)
                                          : VectorXd::Constant(n, 1e9);
    on_line.resize(n);
    on_valve.resize(n);
    likelihood = 0.0;
    const double outlier = options.outlier_share / (range_return * range_supply);
    for (Index i = 0; i < n; ++i) {
      const double z1 = e1[i] / line.deviation, z2 = e2[i] / valve.deviation;
      const double a = line.share * density(z1) / line.deviation * above(z2) / range_supply;
      const double b = valve.share * density(z2) / valve.deviation * above(z1) / range_return;
      const double sum = a + b + outlier;
      on_line[i] = a / sum;
      on_valve[i] = b / sum;
      likelihood += std::log(sum);
    }
  }

  /// Expectation maximisation from initial weights [rows].
  void maximise(const Rows& r, const BranchOptions& options, VectorXd on_line, VectorXd on_valve) {
    double before = -std::numeric_limits<double>::infinity();
    for (int step = 0; step < kMostSteps; ++step) {
      line.share = valve.share = 0.0;
      const double few = static_cast<double>(options.fewest_of_branch) *
                         static_cast<double>(r.count()) /
                         static_cast<double>(std::max<Index>(r.count(), options.most_fitted));
      if (on_line.sum() > few) line.fit(r.line, r.p_return, on_line, options);
      if (on_valve.sum() > few) valve.fit(r.valve, r.p_supply, on_valve, options);
      // a "valve" whose supply pressure carries all of the load is the return line again
      if (valve.share > 0.0 && slope(r, on_valve, options) > options.largest_load_share) {
        likelihood = -std::numeric_limits<double>::infinity();
        return;
      }
      expect(r, options, on_line, on_valve);
      if (likelihood - before < kConverged * static_cast<double>(r.count()) && step >= kFewestSteps)
        break;
      before = likelihood;
    }
    // penalty of each law's coefficients (Schwarz), for the independent ones among the samples
    const double cost =
        0.5 * std::log(std::max(2.0, static_cast<double>(r.count()) / options.samples_alike));
    if (line.share > 0.0) likelihood -= cost * static_cast<double>(line.coefficients.size() + 1);
    if (valve.share > 0.0) likelihood -= cost * static_cast<double>(valve.coefficients.size() + 1);
  }

  /// Share of the load that the supply pressure carries by the valve's law.
  double slope(const Rows& r, const VectorXd& weight, const BranchOptions& options) const {
    const double mean_load = weight.dot(r.load) / weight.sum();
    const VectorXd d = r.load.array() - mean_load;
    const double variance = weight.dot(d.cwiseAbs2());
    const double least = options.least_load_deviation;
    if (variance < least * least * weight.sum()) return 0.0;  // not known
    const VectorXd by_load = r.valve.rightCols(2) * valve.coefficients.tail(2);
    return weight.dot(d.cwiseProduct(by_load)) / variance;
  }
};

Rows chosen(const Rows& all, const std::vector<Index>& keep) {
  Rows r;
  r.p_return = all.p_return(keep);
  r.p_supply = all.p_supply(keep);
  r.line = all.line(keep, Eigen::all);
  r.valve = all.valve(keep, Eigen::all);
  r.load = all.load(keep);
  for (const Index i : keep) r.where.push_back(all.where[static_cast<std::size_t>(i)]);
  return r;
}

Rows thinned(const Rows& all, const BranchOptions& options) {
  const Index stride = (all.count() + options.most_fitted - 1) / options.most_fitted;
  if (stride <= 1) return all;
  std::vector<Index> keep;
  for (Index i = 0; i < all.count(); i += stride) keep.push_back(i);
  return chosen(all, keep);
}

/// Rows of some logs.
Rows of_logs(const Rows& all, int first, int last) {
  std::vector<Index> keep;
  for (Index i = 0; i < all.count(); ++i) {
    const int log = all.where[static_cast<std::size_t>(i)].first;
    if (log >= first && log < last) keep.push_back(i);
  }
  return chosen(all, keep);
}

/// @param range_return, range_supply [bar] of all samples, so that likelihoods of subsets are comparable
Mixture most_likely(const Rows& r, const BranchOptions& options, double range_return,
                    double range_supply) {
  const Index n = r.count();
  const VectorXd none = VectorXd::Zero(n), every = VectorXd::Ones(n);
  Mixture fresh;
  fresh.range_return = range_return;
  fresh.range_supply = range_supply;
  Mixture best = fresh;
  best.maximise(r, options, every, none);
  const auto consider = [&](const VectorXd& on_line, const VectorXd& on_valve) {
    Mixture m = fresh;
    m.maximise(r, options, on_line, on_valve);
    if (m.likelihood > best.likelihood) best = m;
  };
  Mixture valve_alone = fresh;
  valve_alone.maximise(r, options, none, every);
  if (valve_alone.likelihood > best.likelihood) best = valve_alone;
  if (valve_alone.valve.share >
      0.0) {  // outliers above it may be a return line under high return pressure
    const VectorXd e = r.p_supply - r.valve * valve_alone.valve.coefficients;
    const VectorXd high =
        (e.array() > options.clear_deviations * valve_alone.valve.deviation).cast<double>();
    consider(high, every - high);
  }
  for (const double level : kInitialLevels) {
    const double threshold = quantile(r.p_return, level);
    const VectorXd low = (r.p_return.array() < threshold).cast<double>();
    consider(low, every - low);
  }
  return best;
}

/// Appends a label for each row: 1 return line, 2 counterbalance valve, 0 undecided.
void label_rows(const Rows& rows, const BranchOptions& options, Mixture& laws,
                std::vector<int>& label) {
  VectorXd on_line, on_valve;
  laws.expect(rows, options, on_line, on_valve);
  const bool both = laws.line.share > 0.0 && laws.valve.share > 0.0;
  for (Index i = 0; i < rows.count(); ++i) {
    const double sure = options.least_probability;
    int own = on_line[i] > sure ? 1 : (on_valve[i] > sure ? 2 : 0);
    if (both) {
      const double above_line =
          (rows.p_return[i] - rows.line.row(i).dot(laws.line.coefficients)) / laws.line.deviation;
      const double above_valve =
          (rows.p_supply[i] - rows.valve.row(i).dot(laws.valve.coefficients)) /
          laws.valve.deviation;
      if (own == 1 && above_valve < options.clear_deviations) own = 0;
      if (own == 2 && above_line < options.clear_deviations) own = 0;
    }
    label.push_back(own);
  }
}

}  // namespace

std::vector<BranchSplit> split_branches(const std::vector<BranchData>& logs,
                                        std::size_t first_machine, const BranchOptions& options) {
  std::vector<BranchSplit> splits;
  for (const BranchData& d : logs) {
    const Mask none = Mask::Constant(d.moving.size(), false);
    splits.push_back({none, none});
  }
  const Rows rows = gather(logs, options);
  if (rows.count() == 0) return splits;
  const double range_return = spread(rows.p_return, options),
               range_supply = spread(rows.p_supply, options);
  const auto laws_of = [&](const Rows& r) {
    return most_likely(r, options, range_return, range_supply);
  };
  const Rows some = thinned(rows, options);
  Mixture laws = laws_of(some);
  std::vector<int> label;
  const auto cut = static_cast<int>(std::min(first_machine, logs.size()));
  const Rows before = of_logs(some, 0, cut),
             after = of_logs(some, cut, static_cast<int>(logs.size()));
  bool apart = before.count() >= options.fewest_samples && after.count() >= options.fewest_samples;
  if (apart) {
    Mixture one = laws_of(before), other = laws_of(after);
    apart = one.likelihood + other.likelihood >
            laws.likelihood + options.separate_laws_gain * options.samples_alike;
    if (apart) {
      label_rows(of_logs(rows, 0, cut), options, one, label);
      label_rows(of_logs(rows, cut, static_cast<int>(logs.size())), options, other, label);
    }
  }
  if (!apart) label_rows(rows, options, laws, label);
  // near a change of branch the filter mixes both laws
  for (std::size_t i = 0; i < label.size(); ++i) {
    const auto& [log, sample] = rows.where[i];
    bool steady = label[i] != 0;
    for (const int step : {-1, 1}) {
      for (std::size_t j = i; steady;) {
        if ((step < 0 && j == 0) || (step > 0 && j + 1 == label.size())) break;
        j = step < 0 ? j - 1 : j + 1;
        if (rows.where[j].first != log ||
            std::abs(rows.where[j].second - sample) > options.guard_samples)
          break;
        steady = label[j] == 0 || label[j] == label[i];
      }
    }
    if (!steady) continue;
    BranchSplit& split = splits[static_cast<std::size_t>(log)];
    (label[i] == 1 ? split.return_line : split.counterbalance)[sample] = true;
  }
  for (BranchSplit& split : splits) {
    for (Mask* mask : {&split.return_line, &split.counterbalance}) {
      if (mask->count() < options.fewest_of_branch) mask->setConstant(false);
    }
  }
  return splits;
}

}  // namespace sparflow
