#include "identification/learning/learn_pump.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/chain/pump_law.h"
#include "models/math/error.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr double kFinest = 100.0;  // [Pa] resolution of the search, a hundredth of a sensor's
constexpr int kGrid = 96;          // points of each refinement of the search

/// Unknowns of the law in one array: margins of the m cylinders, then standby.
/// Term k of sample t is offset(t, k) + unknown[k]; -infinity where the cylinder is not active.
struct PumpTerms {
  MatrixXd offset;    // [samples x (m + 1)], the last column zero
  VectorXd pressure;  // [samples]

  Index samples() const { return pressure.size(); }
  Index terms() const { return offset.cols(); }
  /// The law at sample t, without the term `except` if that is one of them.
  PumpLaw at(const VectorXd& unknown, Index t, Index except = -1) const {
    const Index m = terms() - 1;
    PumpLaw law(except == m ? kNever : unknown[m]);
    for (Index k = 0; k < m; ++k) {
      if (k != except) law.add(static_cast<int>(k), offset(t, k) + unknown[k]);
    }
    return law;
  }
  double value(const VectorXd& unknown, Index t) const { return at(unknown, t).pressure(); }
  /// @return largest term except one
  double others(const VectorXd& unknown, Index t, Index except) const {
    return at(unknown, t, except).pressure();
  }
  VectorXd residuals(const VectorXd& unknown) const {
    VectorXd r(samples());
    for (Index t = 0; t < samples(); ++t) r[t] = pressure[t] - value(unknown, t);
    return r;
  }
};

/// Selects the usable rows and counts the others in `out`.
PumpTerms usable_samples(const PumpSamples& s, const LearnPumpOptions& options, LearnedPump& out) {
  const Index m = s.active.cols();
  PumpTerms law{MatrixXd::Constant(s.pressure.size(), m + 1, kNever), VectorXd(s.pressure.size())};
  Index n = 0;
  for (Index t = 0; t < s.pressure.size(); ++t) {
    bool valid = std::isfinite(s.pressure[t]);
    for (Index i = 0; i < m; ++i) {
      valid = valid && (!s.active(t, i) || std::isfinite(s.working_pressure(t, i)));
    }
    if (!valid) {
      ++out.invalid;
      continue;
    }
    if (options.max_pressure > 0.0 &&
        s.pressure[t] > options.cut_off_share * options.max_pressure) {
      ++out.saturated;
      continue;
    }
    law.pressure[n] = s.pressure[t];
    for (Index i = 0; i < m; ++i) {
      if (s.active(t, i)) law.offset(n, i) = s.working_pressure(t, i);
    }
    law.offset(n, m) = 0.0;
    ++n;
  }
  law.offset.conservativeResize(n, m + 1);
  law.pressure.conservativeResize(n);
  return law;
}

/// The objective as a function of one unknown, with the others fixed.
class OneUnknown {
 public:
  OneUnknown(const PumpTerms& law, const VectorXd& unknown, Index k, double limit) : limit_(limit) {
    for (Index t = 0; t < law.samples(); ++t) {
      if (law.offset(t, k) == kNever) continue;
      samples_.push_back({law.offset(t, k), law.others(unknown, t, k), law.pressure[t]});
    }
  }
  double operator()(double x) const {
    double sum = 0.0;
    for (const Sample& s : samples_)
      sum += huber_loss(s.pressure - pump_pressure(s.others, s.own + x), limit_);
    return sum;
  }
  /// @return upper end of the search: the margin at which the largest distance to the measured pressure is closed; 0 when
  ///   the cylinder is never active
  double largest_useful() const {
    double largest = 0.0;
    for (const Sample& s : samples_) largest = std::max(largest, s.pressure - s.own);
    return largest;
  }

 private:
  struct Sample {
    double own, others, pressure;
  };
  std::vector<Sample> samples_;
  double limit_;
};

/// Minimises over [0, hi] by a grid that is refined around its best point; of equal minima `start`, or else the smallest, is
/// returned.
double minimise(const OneUnknown& f, double hi, double start) {
  double best = std::clamp(start, 0.0, hi), best_value = f(best);
  const double keep = best_value * (1.0 - 1e-12);  // an equal value does not replace `start`
  double value_to_beat = keep;
  double lo = 0.0, step = hi / kGrid;
  while (step > 0.0) {
    for (int i = 0; i <= kGrid; ++i) {
      const double x = lo + i * step;
      if (x > hi * (1.0 + 1e-12)) break;
      const double value = f(x);
      if (value < value_to_beat) {
        value_to_beat = best_value = value;
        best = x;
      }
    }
    if (step < kFinest) break;
    lo = std::max(0.0, best - step);
    step = (std::min(hi, best + step) - lo) / kGrid;
  }
  return best;
}

/// Initial values: margins that almost all samples of the cylinder allow, since p >= P_i + c_i.
VectorXd initial_unknowns(const PumpTerms& law, const LearnPumpOptions& options) {
  const Index m = law.terms() - 1;
  VectorXd unknown = VectorXd::Zero(m + 1);
  std::vector<double> idle;
  for (Index t = 0; t < law.samples(); ++t) {
    if (law.offset.row(t).head(m).maxCoeff() == kNever) idle.push_back(law.pressure[t]);
  }
  unknown[m] = static_cast<int>(idle.size()) >= options.fewest_samples
                   ? median(Eigen::Map<VectorXd>(idle.data(), static_cast<Index>(idle.size())))
                   : quantile(law.pressure, options.initial_standby_quantile);
  for (Index i = 0; i < m; ++i) {
    std::vector<double> slack;
    for (Index t = 0; t < law.samples(); ++t) {
      if (law.offset(t, i) != kNever) slack.push_back(law.pressure[t] - law.offset(t, i));
    }
    const Eigen::Map<VectorXd> values(slack.data(), static_cast<Index>(slack.size()));
    unknown[i] = std::max(0.0, quantile(values, options.initial_margin_quantile));
  }
  return unknown;
}

/// Coordinate descent until no unknown changes. @return true when it converged
bool search(const PumpTerms& law, VectorXd& unknown, int& sweeps) {
  double limit = 0.0;
  for (int sweep = 0; sweep < 40; ++sweep) {
    ++sweeps;
    // The scale is fixed after four sweeps, because with a changing scale the descent could cycle.
    if (sweep < 4) limit = kHuberStds * std::max(robust_std(law.residuals(unknown)), kFinest);
    const VectorXd before = unknown;
    for (Index k = law.terms() - 1; k >= 0; --k) {
      const OneUnknown f(law, unknown, k, limit);
      const double hi = f.largest_useful();
      if (hi > 0.0) unknown[k] = minimise(f, hi, unknown[k]);
    }
    if (sweep >= 4 && (unknown - before).cwiseAbs().maxCoeff() < kFinest) return true;
  }
  return false;
}

struct Leader {
  Index term = 0;
  double gap = 0.0;  // to the second largest term [Pa]
};

Leader leader_of(const PumpTerms& law, const VectorXd& unknown, Index t) {
  const PumpLaw at = law.at(unknown, t);
  Leader leader;
  leader.term = at.leader() >= 0 ? at.leader() : law.terms() - 1;
  leader.gap = at.pressure() - law.others(unknown, t, leader.term);
  return leader;
}

/// Huber's location and its standard error.
struct Location {
  double value = 0.0, standard_error = 0.0;
};

Location location(const VectorXd& values) {
  Location l;
  l.value = median(values);
  const double std = std::max(robust_std((values.array() - l.value).matrix()), kFinest);
  double weights = 0.0;
  for (int i = 0; i < 30; ++i) {
    double sum = 0.0;
    weights = 0.0;
    for (const double v : values) {
      const double w = huber_weight(v - l.value, kHuberStds * std);
      sum += w * v;
      weights += w;
    }
    const double before = l.value;
    l.value = sum / weights;
    if (std::abs(l.value - before) < 1e-3) break;
  }
  l.standard_error = std / std::sqrt(weights);
  return l;
}

/// With fixed leaders each unknown is Huber's location of p - P_i over the samples in which its term is the largest. Near
/// ties are left out (see the header) where enough samples remain, outliers always.
void polish(const PumpTerms& law, VectorXd& unknown, VectorXd& standard_error,
            const LearnPumpOptions& options) {
  const VectorXd residuals = law.residuals(unknown);
  const double std = std::max(robust_std(residuals), kFinest);
  std::vector<std::vector<double>> clear(static_cast<std::size_t>(law.terms())), all = clear;
  for (Index t = 0; t < law.samples(); ++t) {
    if (std::abs(residuals[t]) > options.outlier_threshold * std) continue;
    const Leader leader = leader_of(law, unknown, t);
    const double required = law.pressure[t] - law.offset(t, leader.term);
    all[static_cast<std::size_t>(leader.term)].push_back(required);
    if (leader.gap > options.tie_gap_stds * std)
      clear[static_cast<std::size_t>(leader.term)].push_back(required);
  }
  for (Index k = 0; k < law.terms(); ++k) {
    auto& values = clear[static_cast<std::size_t>(k)];
    auto& every = all[static_cast<std::size_t>(k)];
    const bool enough = static_cast<int>(values.size()) >= options.min_leading &&
                        options.tie_ratio * values.size() >= every.size();
    auto& used = enough ? values : every;
    if (static_cast<int>(used.size()) < options.min_leading) continue;
    const Location l = location(Eigen::Map<VectorXd>(used.data(), static_cast<Index>(used.size())));
    unknown[k] = std::max(0.0, l.value);
    standard_error[k] = l.standard_error;
  }
}

/// @return largest c_i at which the cylinder would not be the leader where the data follow another term: the
///   quantile `at` of the distances
double upper_bound(const PumpTerms& law, const VectorXd& unknown, Index i, double at) {
  std::vector<double> room;
  for (Index t = 0; t < law.samples(); ++t) {
    if (law.offset(t, i) == kNever) continue;
    const double others = law.others(unknown, t, i);
    if (others > kNever) room.push_back(others - law.offset(t, i));
  }
  if (room.empty()) return std::numeric_limits<double>::infinity();
  const Eigen::Map<VectorXd> values(room.data(), static_cast<Index>(room.size()));
  return std::max(0.0, quantile(values, at));
}

void check_enough(Index usable, const LearnedPump& out, int fewest) {
  if (usable >= fewest) return;
  throw InputError({}, "pump pressure",
                   fmt::format("got {} usable samples ({} given, {} not finite, {} at the pump's "
                               "limit), expected at least {}",
                               usable, out.given, out.invalid, out.saturated, fewest));
}

double rms(const VectorXd& r) { return std::sqrt(r.squaredNorm() / static_cast<double>(r.size())); }

std::string cylinder_name(const PumpSamples& samples, Index i) {
  const auto k = static_cast<std::size_t>(i);
  return k < samples.names.size() ? samples.names[k] : fmt::format("cylinder {}", i + 1);
}

}  // namespace

LearnedPump learn_pump(const PumpSamples& samples, const LearnPumpOptions& options) {
  const Index m = samples.active.cols();
  SPARFLOW_CHECK(samples.working_pressure.rows() == samples.pressure.size() &&
                     samples.active.rows() == samples.pressure.size() &&
                     samples.working_pressure.cols() == m,
                 "pump samples must be equally long");
  LearnedPump out;
  out.given = static_cast<int>(samples.pressure.size());
  const PumpTerms law = usable_samples(samples, options, out);
  check_enough(law.samples(), out, options.fewest_samples);

  VectorXd unknown = initial_unknowns(law, options);
  VectorXd standard_error = VectorXd::Constant(m + 1, std::numeric_limits<double>::infinity());
  out.converged = search(law, unknown, out.sweeps);
  for (int i = 0; i < 3; ++i) polish(law, unknown, standard_error, options);

  std::vector<int> leading(static_cast<std::size_t>(m + 1), 0);
  for (Index t = 0; t < law.samples(); ++t) {
    ++leading[static_cast<std::size_t>(leader_of(law, unknown, t).term)];
  }
  std::vector<double> identified;
  out.margins.resize(static_cast<std::size_t>(m));
  for (Index i = 0; i < m; ++i) {
    LearnedMargin& margin = out.margins[static_cast<std::size_t>(i)];
    margin.active = static_cast<int>((law.offset.col(i).array() > kNever).count());
    margin.leading = leading[static_cast<std::size_t>(i)];
    margin.identified = margin.leading >= options.min_leading;
    if (!margin.identified) continue;
    margin.standard_error = standard_error[i];
    identified.push_back(unknown[i]);
  }
  const double typical =
      median(Eigen::Map<VectorXd>(identified.data(), static_cast<Index>(identified.size())));
  for (Index i = 0; i < m; ++i) {
    LearnedMargin& margin = out.margins[static_cast<std::size_t>(i)];
    if (!margin.identified) {
      margin.upper_bound = upper_bound(law, unknown, i, options.bound_quantile);
      unknown[i] = std::min(typical, margin.upper_bound);
      const std::string bound =
          std::isfinite(margin.upper_bound)
              ? fmt::format("it is at most {:.1f} bar", margin.upper_bound / 1e5)
              : std::string("nothing bounds it");
      out.warnings.push_back(fmt::format(
          "{} is the load-sensing leader in {} of {} active samples: its margin is not identified, "
          "{}; {:.1f} bar is assumed; record it moving alone.",
          cylinder_name(samples, i), margin.leading, margin.active, bound, unknown[i] / 1e5));
    }
    margin.margin = unknown[i];
  }
  out.standby_leading = leading[static_cast<std::size_t>(m)];
  out.standby_identified = out.standby_leading >= options.min_leading;
  if (!out.standby_identified) {
    // Without samples at standby the data sheet's value is used, but not above the lowest measured pressure.
    const double lowest = quantile(law.pressure, options.lowest_quantile);
    unknown[m] =
        options.data_sheet_standby > 0.0 ? std::min(options.data_sheet_standby, lowest) : lowest;
    out.warnings.push_back(
        fmt::format("The pump is at standby in {} samples only: standby is not identified, {:.1f} "
                    "bar is assumed.",
                    out.standby_leading, unknown[m] / 1e5));
  }
  out.standby = unknown[m];
  const VectorXd residuals = law.residuals(unknown);
  out.rmse = rms(residuals);
  out.robust_std = robust_std(residuals);
  const double limit = options.outlier_threshold * std::max(out.robust_std, kFinest);
  out.outliers = static_cast<int>((residuals.array().abs() > limit).count());
  if (!out.converged) out.warnings.push_back("The search for margins did not converge.");
  return out;
}

LearnedPump learn_constant_pump(const Eigen::Ref<const VectorXd>& pressure,
                                const LearnPumpOptions& options) {
  LearnedPump out;
  out.given = static_cast<int>(pressure.size());
  std::vector<double> valid;
  std::copy_if(pressure.begin(), pressure.end(), std::back_inserter(valid),
               [](double p) { return std::isfinite(p); });
  out.invalid = out.given - static_cast<int>(valid.size());
  check_enough(static_cast<Index>(valid.size()), out, options.fewest_samples);
  const Eigen::Map<VectorXd> values(valid.data(), static_cast<Index>(valid.size()));
  out.standby = location(values).value;
  out.standby_identified = true;
  out.standby_leading = static_cast<int>(valid.size());
  const VectorXd residuals = values.array() - out.standby;
  out.rmse = rms(residuals);
  out.robust_std = robust_std(residuals);
  const double limit = options.outlier_threshold * std::max(out.robust_std, kFinest);
  out.outliers = static_cast<int>((residuals.array().abs() > limit).count());
  out.converged = true;
  return out;
}

}  // namespace sparflow
