#include "identification/learning/gaussian_process/learn_pressure.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>

#include "identification/learning/gaussian_process/choose_law.h"
#include "identification/learning/gaussian_process/gp_likelihood.h"
#include "identification/learning/gaussian_process/gp_screening.h"
#include "identification/learning/gaussian_process/minimise_bounded.h"
#include "identification/learning/gaussian_process/sparse_gp.h"
#include "models/hydraulics/uninformed_length.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"
#include "models/math/parallel.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// value = offset + scale * scaled
struct Scale {
  double offset = 0.0, scale = 1.0;
  bool constant = false;
  ArrayXd apply(const ArrayXd& x) const { return (x - offset) / scale; }
};

Scale input_scale(const ArrayXd& x) {
  Scale s;
  const double lo = x.minCoeff(), hi = x.maxCoeff();
  s.offset = lo;
  s.scale = hi - lo;
  // A spread of one millionth of the value is the rounding of the log.
  s.constant = s.scale <= 1e-6 * std::max(std::abs(lo), std::abs(hi));
  if (s.constant) s.scale = std::max({std::abs(lo), std::abs(hi), 1e-9});
  return s;
}

/// The data of one pressure model in scaled units, with the scales.
struct Problem {
  Scale flow, force, pressure;
  VectorXd
      line;  // [b] coefficients of the plane by least squares, which is subtracted from points.y
  GpPoints points;
  GpHyper lower, upper;
};

Problem make_problem(const ArrayXd& flow, const ArrayXd& force, const ArrayXd& pressure,
                     const LearnGpOptions& options) {
  Problem p;
  p.flow = input_scale(flow);
  p.force = input_scale(force);
  p.pressure.offset = pressure.mean();
  const double spread = std::sqrt((pressure - p.pressure.offset).square().mean());
  p.pressure.scale = std::max(spread, options.smallest_noise);
  p.points.x1 = p.flow.apply(flow);
  p.points.x2 = p.force.apply(force);
  p.points.y = p.pressure.apply(pressure);
  const bool over_force = !p.force.constant;
  const auto mean_over = [&](bool over_flow) {
    MatrixXd basis = MatrixXd::Ones(flow.size(), 1 + (over_force ? 1 : 0) + (over_flow ? 1 : 0));
    if (over_force) basis.col(1) = p.points.x2;
    if (over_flow) basis.rightCols<1>() = p.points.x1;
    return basis;
  };
  p.points.basis = mean_over(!p.flow.constant);
  // Losses grow with the flow. A plane that falls with it follows starts, where pressure is high and flow low, or friction at
  // low speed; beyond the flows of the data it would promise what no valve does. The process keeps the fall inside them.
  if (!p.flow.constant &&
      !(p.points.basis.colPivHouseholderQr().solve(p.points.y).tail<1>()[0] >= 0.0))
    p.points.basis = mean_over(false);
  p.points.basis_precision = VectorXd::Zero(p.points.basis.cols());
  p.points.basis_precision.tail(p.points.basis.cols() - 1)
      .setConstant(1.0 / (options.slope_std * options.slope_std));
  p.line = VectorXd::Zero(p.points.basis.cols());
  if (p.line.size() > 1) {
    p.line = p.points.basis.colPivHouseholderQr().solve(p.points.y);
    p.points.y -= p.points.basis * p.line;
  }
  const double shortest = std::log(options.shortest_length);
  const double longest = std::log(options.longest_length);
  const double noise = 2.0 * std::log(options.smallest_noise / p.pressure.scale);
  // The last two bounds are those of the signal's and the noise's variance.
  p.lower = GpHyper(p.flow.constant ? longest : shortest, p.force.constant ? longest : shortest,
                    std::log(options.smallest_signal * options.smallest_signal), noise);
  p.upper = GpHyper(longest, longest, 2.0 * std::log(options.largest_signal),
                    std::max(noise, std::log(options.largest_noise * options.largest_noise)));
  return p;
}

/// Maximises a likelihood and counts its evaluations in the report.
template <class Likelihood>
GpHyper maximise(const Problem& problem, const GpHyper& start, int iterations, GpReport& report,
                 Likelihood&& likelihood) {
  MinimiseOptions options;
  options.max_evaluations = 3 * iterations;  // a step costs two evaluations or three
  options.value_tolerance = 1e-6;  // of some thousand nats, far below statistical significance
  const auto negative = [&](const VectorXd& x, VectorXd& gradient) {
    GpHyper g = GpHyper::Zero();
    const double value = likelihood(GpHyper(x), &g);
    gradient = -g;
    return -value;
  };
  const Minimum r = minimise_bounded(negative, start, problem.lower, problem.upper, options);
  report.evaluations += r.evaluations;
  report.converged = r.converged;
  report.log_likelihood = -r.value;
  return r.x;
}

GpHyper maximise_exact(const Problem& problem, const GpPoints& points, const GpHyper& start,
                       int iterations, GpReport& report) {
  return maximise(problem, start, iterations, report,
                  [&](const GpHyper& h, GpHyper* g) { return exact_log_likelihood(points, h, g); });
}

/// Fits the representatives from several starts, because the likelihood often has a second maximum at which the signal
/// is explained as noise.
GpHyper preliminary_fit(const Problem& problem, const GpPoints& few, GpReport& report) {
  GpHyper best;
  double best_value = -INFINITY;
  for (const double length : {0.3, 1.2}) {
    for (const double noise : {0.02, 0.3}) {
      const GpHyper start(std::log(length), std::log(length), std::log(0.5), 2.0 * std::log(noise));
      const GpHyper found = maximise_exact(problem, few, start, 15, report);
      if (report.log_likelihood > best_value) {
        best_value = report.log_likelihood;
        best = found;
      }
    }
  }
  return std::isfinite(best_value) ? best : GpHyper(0.0, 0.0, std::log(0.5), std::log(0.1));
}

std::vector<Index> every_kth(Index n, Index at_most) {
  const Index step = (n + at_most - 1) / at_most;
  std::vector<Index> rows;
  for (Index i = step / 2; i < n; i += step) rows.push_back(i);
  return rows;
}

/// Alternates between the choice of inducing points and the hyperparameters, which depend on each other, until the
/// length-scales change little.
GpPosterior fit_inducing(const Problem& problem, const GpPoints& all, const LearnGpOptions& options,
                         GpHyper& hyper, GpReport& report) {
  const bool too_many = all.size() > options.most_samples;
  const GpPoints few =
      too_many ? all.select(every_kth(all.size(), options.most_samples)) : GpPoints();
  const GpPoints& points = too_many ? few : all;
  const auto choose = [&](const GpPoints& from) {
    const double tolerance = options.sparse_tolerance * std::exp(hyper[3] - hyper[2]);
    return choose_inducing(from.x1, from.x2, hyper, options.max_centres, tolerance);
  };
  const GpPoints thinned = points.select(every_kth(points.size(), options.hyper_samples));
  for (int round = 0; round < 3; ++round) {
    const GpHyper before = hyper;
    SparseGp sparse(thinned, choose(thinned).rows);
    hyper = maximise(problem, before, 30, report,
                     [&](const GpHyper& h, GpHyper* g) { return sparse.bound(h, g); });
    if ((hyper - before).head<2>().cwiseAbs().maxCoeff() < options.settled) break;
  }
  const InducingChoice choice = choose(points);
  const double left = choice.mean_variance * std::exp(hyper[2] - hyper[3]);
  if (left > options.warned_ratio * options.sparse_tolerance) {
    report.warnings.push_back(fmt::format(
        "With {} centres the mean conditional variance is {:.0f} % of the noise variance; more "
        "centres would fit more closely.",
        choice.rows.size(), 100.0 * left));
  }
  SparseGp sparse(points, choice.rows);
  report.log_likelihood = sparse.bound(hyper, nullptr);
  return sparse.posterior(hyper);
}

GpPosterior fit_subset(const Problem& problem, const GpPoints& points,
                       const LearnGpOptions& options, GpHyper& hyper, GpReport& report) {
  // Once the inputs are covered further points only average noise, so the remaining ones are taken evenly from the log.
  const double tolerance = options.sparse_tolerance * std::exp(hyper[3] - hyper[2]);
  std::vector<Index> rows =
      choose_inducing(points.x1, points.x2, hyper, options.max_centres, tolerance).rows;
  const Index open =
      std::min<Index>(options.max_centres, points.size()) - static_cast<Index>(rows.size());
  if (open > 0) {
    const std::vector<Index> even = every_kth(points.size(), open);
    rows.insert(rows.end(), even.begin(), even.end());
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  }
  const GpPoints chosen = points.select(rows);
  hyper = maximise_exact(problem, chosen, hyper, 30, report);
  return exact_posterior(chosen, hyper);
}

/// Converts a posterior from scaled units to SI.
GpParameters to_si(const Problem& problem, const GpPosterior& posterior, const GpHyper& hyper) {
  const Scale &q = problem.flow, &f = problem.force, &p = problem.pressure;
  const Index m = posterior.weight.size(), b = posterior.beta.size();
  GpParameters out;
  out.length_flow = std::exp(hyper[0]) * q.scale;
  out.length_force = std::exp(hyper[1]) * f.scale;
  out.signal_std = std::exp(0.5 * hyper[2]) * p.scale;
  out.noise_std = std::exp(0.5 * hyper[3]) * p.scale;
  const VectorXd mean = problem.line + posterior.beta;
  const Index over_force = problem.force.constant ? 0 : 1, over_flow = b > 1 + over_force ? 1 : 0;
  if (over_force > 0) out.mean_slope = mean[1] * p.scale / f.scale;
  if (over_flow > 0) out.mean_flow_slope = mean[b - 1] * p.scale / q.scale;
  out.mean_constant =
      p.offset + mean[0] * p.scale - out.mean_slope * f.offset - out.mean_flow_slope * q.offset;
  out.flow = q.offset + q.scale * posterior.x1;
  out.force = f.offset + f.scale * posterior.x2;
  out.weight = posterior.weight.array() / p.scale;
  // Scaled basis = T * SI basis: k' = k / p^2, 1 = 1, x2 = (F - offset) / scale, x1 = (Q - offset) / scale.
  MatrixXd t = MatrixXd::Zero(m + b, m + 2 + over_flow);
  t.topLeftCorner(m, m).diagonal().setConstant(1.0 / (p.scale * p.scale));
  t(m, m) = 1.0;
  if (over_force > 0) {
    t(m + 1, m) = -f.offset / f.scale;
    t(m + 1, m + 1) = 1.0 / f.scale;
  }
  if (over_flow > 0) {
    t(m + b - 1, m) = -q.offset / q.scale;
    t(m + b - 1, m + 2) = 1.0 / q.scale;
  }
  const MatrixXd core = p.scale * p.scale * product(transposed_product(t, posterior.core), t);
  out.variance_core = 0.5 * (core + core.transpose());
  return out;
}

/// Hyperparameters at which the process is a plane: no signal, and the spread about the plane as noise.
GpHyper plane_hyper(const Problem& problem) {
  const double spread = problem.points.y.squaredNorm() / static_cast<double>(problem.points.size());
  return {problem.upper[0], problem.upper[1], problem.lower[2],
          std::clamp(std::log(std::max(spread, 1e-300)), problem.lower[3], problem.upper[3])};
}

void add_warnings(const Problem& problem, const GpHyper& hyper, GpReport& report) {
  // What is below one measurement's noise is no change that a user could find in the log.
  const bool above_noise = hyper[2] > hyper[3];
  const auto at_lower = [&](int i) { return hyper[i] <= problem.lower[i] + 1e-6; };
  const char* input[] = {"flow", "force"};
  const bool constant[] = {problem.flow.constant, problem.force.constant};
  for (int i = 0; i < 2; ++i) {
    if (constant[i]) {
      report.warnings.push_back(
          fmt::format("The {} does not vary enough in these samples for the pressure's dependence "
                      "on it to be learned.",
                      input[i]));
    } else if (at_lower(i) && above_noise) {
      report.warnings.push_back(fmt::format(
          "The pressure changes by about {:.2g} bar within {:.0f} % of the range of the "
          "{}, more sharply than a smooth law does (friction, a dead band, too little "
          "data?): its length-scale is at its lower bound.",
          std::exp(0.5 * hyper[2]) * problem.pressure.scale / units::kBar,
          100.0 * std::exp(problem.lower[i]), input[i]));
    }
  }
  if (!report.converged) {
    report.warnings.push_back("The likelihood's maximum was not reached within its iterations.");
  }
}

double rms_error(const GaussianProcess& process, const ArrayXd& flow, const ArrayXd& force,
                 const ArrayXd& pressure) {
  double sum = 0.0;
  for (Index i = 0; i < flow.size(); ++i) {
    const double error = process.mean(flow[i], force[i]) - pressure[i];
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(flow.size()));
}

/// @throws InputError with fewer than `min_samples` finite rows
GpDataset finite_samples(const GpDataset& samples, const LearnGpOptions& options,
                         GpReport& report) {
  const ArrayXd &flow = samples.flow, &force = samples.force, &pressure = samples.pressure;
  SPARFLOW_CHECK(flow.size() == force.size() && flow.size() == pressure.size(),
                 "flow, force and pressure must be equally long");
  report.given = static_cast<int>(flow.size());
  std::vector<Index> rows;
  for (Index i = 0; i < flow.size(); ++i) {
    if (std::isfinite(flow[i]) && std::isfinite(force[i]) && std::isfinite(pressure[i])) {
      rows.push_back(i);
    }
  }
  report.invalid = report.given - static_cast<int>(rows.size());
  // With fewer than three samples the mean alone is not determined.
  const int fewest = std::max(options.min_samples, 3);
  if (static_cast<int>(rows.size()) < fewest) {
    throw InputError({}, "pressure",
                     fmt::format("got {} usable samples ({} given, {} not finite), expected at "
                                 "least {}; log more motion in this direction",
                                 rows.size(), report.given, report.invalid, fewest));
  }
  return samples.select(rows);
}

/// Fits representatives of the samples, which gives initial values and the reference for outliers, and removes these.
/// @param samples without the outliers afterwards  @param hyper initial values
Problem without_outliers(GpDataset& samples, const LearnGpOptions& options, GpHyper& hyper,
                         GpReport& report) {
  const Problem all = make_problem(samples.flow, samples.force, samples.pressure, options);
  const std::vector<Index> few = representative_points(all.points, options.representative_cells);
  hyper = preliminary_fit(all, all.points.select(few), report);
  const Screening screening = screen_outliers(all.points, few, hyper, options.outlier_threshold,
                                              options.max_outlier_fraction);
  if (screening.too_many) {
    report.warnings.push_back(
        "So many samples lie far from a smooth pressure that they are no outliers: all are kept.");
  }
  report.outliers = static_cast<int>(all.points.size()) - static_cast<int>(screening.kept.size());
  report.used = static_cast<int>(screening.kept.size());
  if (report.outliers == 0) return all;
  samples = samples.select(screening.kept);
  // Removing outliers may reduce the scales; the hyperparameters are converted to the new ones.
  Problem kept = make_problem(samples.flow, samples.force, samples.pressure, options);
  hyper[0] += std::log(all.flow.scale / kept.flow.scale);
  hyper[1] += std::log(all.force.scale / kept.force.scale);
  hyper.tail<2>().array() += 2.0 * std::log(all.pressure.scale / kept.pressure.scale);
  return kept;
}

}  // namespace

GpDataset GpDataset::select(const std::vector<Index>& rows) const {
  std::vector<int> groups;
  for (std::size_t i = 0; i < rows.size() && !group.empty(); ++i)
    groups.push_back(group[static_cast<std::size_t>(rows[i])]);
  return {name, flow(rows), force(rows), pressure(rows), std::move(groups)};
}

const char* gp_method_name(GpMethod method) {
  switch (method) {
    case GpMethod::kAutomatic:
      return "automatic";
    case GpMethod::kExact:
      return "exact";
    case GpMethod::kInducing:
      return "inducing points";
    default:
      return "subset";
  }
}

LearnedGp learn_gp(const Eigen::Ref<const ArrayXd>& flow, const Eigen::Ref<const ArrayXd>& force,
                   const Eigen::Ref<const ArrayXd>& pressure, const LearnGpOptions& options) {
  return learn_gp(GpDataset{{}, flow, force, pressure}, options);
}

LearnedGp learn_gp(const GpDataset& samples, const LearnGpOptions& options) {
  const auto start_time = std::chrono::steady_clock::now();
  LearnedGp learned;
  GpReport& report = learned.report;
  GpDataset used = finite_samples(samples, options, report);
  GpHyper hyper;
  const Problem problem = without_outliers(used, options, hyper, report);
  const GpPoints& points = problem.points;

  report.method = options.method;
  if (report.method == GpMethod::kAutomatic) {
    report.method = report.used <= options.exact_limit ? GpMethod::kExact : GpMethod::kInducing;
  }
  GpPosterior posterior;
  if (report.method == GpMethod::kExact) {
    hyper = maximise_exact(problem, points, hyper, 40, report);
    posterior = exact_posterior(points, hyper);
  } else if (report.method == GpMethod::kInducing) {
    posterior = fit_inducing(problem, points, options, hyper, report);
  } else {
    posterior = fit_subset(problem, points, options, hyper, report);
  }

  const GpHyper plane = plane_hyper(problem);
  if (options.simplest_law &&
      plane_is_not_worse({points, used.group, hyper, plane}, options, report)) {
    report.law = PressureLaw::kPlane;
    hyper = plane;
    posterior = SparseGp(points, {points.size() / 2}).posterior(hyper);
    posterior.weight.setZero();
  }
  report.plane_left_out *= problem.pressure.scale;
  report.process_left_out *= problem.pressure.scale;

  GpParameters& out = learned.parameters;
  out = to_si(problem, posterior, hyper);
  out.law = report.law;
  out.flow_min = used.flow.minCoeff();
  out.flow_max = used.flow.maxCoeff();
  out.force_min = used.force.minCoeff();
  out.force_max = used.force.maxCoeff();
  replace_uninformed_lengths(out);
  out.data_count = report.used;
  report.centres = static_cast<int>(out.weight.size());
  report.noise_std = out.noise_std;
  report.rmse = rms_error(GaussianProcess(out), used.flow, used.force, used.pressure);
  add_warnings(problem, hyper, report);
  report.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_time).count();
  return learned;
}

std::vector<LearnedGp> learn_gps(const std::vector<GpDataset>& datasets,
                                 const LearnGpOptions& options,
                                 const std::function<void(int, int, const std::string&)>& progress,
                                 int threads) {
  const int total = static_cast<int>(datasets.size());
  std::vector<LearnedGp> learned(datasets.size());
  int done = 0;
  std::mutex mutex;
  parallel(
      datasets.size(),
      [&](std::size_t at) {
        const GpDataset& data = datasets[at];
        try {
          learned[at] = learn_gp(data, options);
        } catch (const InputError& error) {
          learned[at].report.failure = fmt::format("{}: {}", data.name, error.what());
        }
        const std::lock_guard lock(mutex);
        ++done;
        if (progress) progress(done, total, data.name);
      },
      threads);
  return learned;
}

}  // namespace sparflow
