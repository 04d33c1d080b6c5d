#include "diagnosis/verdict/block_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// Standard deviation of the prior of the slopes, whose mean is zero.
/// @threshold [1] 0..; derived: a residual in proportion to load or speed has the slope one in logarithms of squares
constexpr double kSlope = 1.0;
/// Least mean square of a load or speed in a block over that of all blocks.
/// @threshold [1] 0..1; chosen: below a tenth of the RMS a level no longer follows the load: noise of the sensors is left
constexpr double kLeastShare = 0.01;

double mean_square(const VectorXd& x, Index first, Index last) {
  double sum = 0.0, n = 0.0;
  for (Index i = first; i < std::min(last, x.size()); ++i) {
    if (!std::isfinite(x[i])) continue;
    sum += x[i] * x[i];
    n += 1.0;
  }
  return n > 0.0 ? sum / n : 0.0;
}

VectorXd summed(const MachineSeries& log, const std::vector<int>& cylinders,
                VectorXd CylinderSeries::*flow) {
  VectorXd sum = VectorXd::Zero(log.samples());
  for (const int i : cylinders) {
    const VectorXd& own = log.cylinders[static_cast<std::size_t>(i)].*flow;
    if (own.size() == sum.size()) sum += own;
  }
  return sum;
}

/// Load and motion of a channel: force and speed of a cylinder, pressure and flow of a pump, flow of the return line. [samples, SI]
std::pair<VectorXd, VectorXd> work_of(const MachineSeries& log, const EvidenceChannel& c) {
  const auto at = static_cast<std::size_t>(c.index);
  if (c.kind == EvidenceKind::kPump)
    return {log.pumps[at].pressure, summed(log, log.pumps[at].feeds, &CylinderSeries::flow)};
  if (c.kind == EvidenceKind::kReturnLine) {
    std::vector<int> all(log.cylinders.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    return {VectorXd(), summed(log, all, &CylinderSeries::return_flow)};
  }
  return {log.cylinders[at].static_force, log.cylinders[at].speed};
}

/// Logarithms of the mean squares of load and motion of each block. [blocks x 2]
MatrixXd work_of_blocks(const Evidence& evidence, const EvidenceChannel& c) {
  MatrixXd squares(std::ssize(c.blocks), 2);
  std::vector<std::pair<VectorXd, VectorXd>> work;
  for (const MachineSeries& log : evidence.series) work.push_back(work_of(log, c));
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    const Index first = c.sample[static_cast<std::size_t>(c.blocks[b].first)],
                last = c.sample[static_cast<std::size_t>(c.blocks[b].last - 1)] + 1;
    const auto& [load, motion] = work[static_cast<std::size_t>(c.log[b])];
    squares.row(static_cast<Index>(b)) << mean_square(load, first, last),
        mean_square(motion, first, last);
  }
  for (Index k = 0; k < 2; ++k) {
    const double least = kLeastShare * squares.col(k).mean();
    if (least > 0.0)
      squares.col(k) = (squares.col(k).array() + least).log().eval();
    else
      squares.col(k).setZero();  // not measured, or nothing moves
  }
  return squares;
}

/// Variance of the logarithm of the mean square of so many normal values: the trigamma function of half of them (M. Abramowitz,
/// I. Stegun (1964), Handbook of Mathematical Functions, 6.4.12, three terms: 8 % too large for one value, 1 % for two).
double variance_of_level(Index rows) {
  const double x = 0.5 * static_cast<double>(rows);
  return (1.0 + (0.5 + 1.0 / (6.0 * x)) / x) / x;
}

struct Group {
  std::vector<Index> blocks;
  double mean = 0.0, variance = 0.0;  // of the levels at equal work
  Vector2d work = Vector2d::Zero();   // mean
  VectorXd levels;                    // [blocks] about their mean
  Eigen::MatrixX2d works;             // [blocks x 2] the same
  auto n() const { return static_cast<double>(blocks.size()); }
};

void centre(Group& g, const VectorXd& level, const MatrixXd& work) {
  g.mean = level(g.blocks).mean();
  g.work = work(g.blocks, Eigen::all).colwise().mean();
  g.levels = level(g.blocks).array() - g.mean;
  g.works = work(g.blocks, Eigen::all).rowwise() - g.work.transpose();
}

}  // namespace

LevelComparison compare_levels(const Evidence& evidence, std::size_t channel,
                               const VectorXd& residual) {
  const EvidenceChannel& c = evidence.channels[channel];
  Group suspect, reference;
  VectorXd level(std::ssize(c.blocks));
  for (std::size_t b = 0; b < c.blocks.size(); ++b) {
    const Index length = c.blocks[b].last - c.blocks[b].first, at = static_cast<Index>(b);
    const double square = residual.segment(c.blocks[b].first, length).squaredNorm();
    level[at] = std::log(
        std::max(square / static_cast<double>(length), std::numeric_limits<double>::min()));
    (static_cast<std::size_t>(c.log[b]) >= evidence.suspects ? reference : suspect)
        .blocks.push_back(at);
  }
  LevelComparison out;
  out.suspects = static_cast<int>(suspect.blocks.size());
  out.references = static_cast<int>(reference.blocks.size());
  if (std::min(out.suspects, out.references) < 2) return out;

  const MatrixXd work = work_of_blocks(evidence, c);
  for (Group* g : {&suspect, &reference}) centre(*g, level, work);
  // each group by the variance of its levels, so that those of a change that spread widely say little about the slopes
  Matrix2d data = Matrix2d::Zero();
  Vector2d products = Vector2d::Zero();
  for (const Group* g : {&suspect, &reference}) {
    const double variance = g->levels.squaredNorm() / (g->n() - 1.0);
    if (variance <= 0.0) continue;  // all levels are equal
    data += g->works.transpose() * g->works / variance;
    products += g->works.transpose() * g->levels / variance;
  }
  const Matrix2d covariance = (data + Matrix2d::Identity() / (kSlope * kSlope)).inverse();
  const Vector2d slope = covariance * products;
  // the slopes have taken so many degrees of freedom, less than two by their prior
  const double free = suspect.n() + reference.n() - 2.0, taken = (covariance * data).trace();
  for (Group* g : {&suspect, &reference})
    g->variance =
        (g->levels - g->works * slope).squaredNorm() / (g->n() - 1.0) * free / (free - taken);

  const Vector2d apart = suspect.work - reference.work;
  out.explained = slope.dot(apart);
  out.difference = suspect.mean - reference.mean - out.explained;
  const double of_suspects = suspect.variance / suspect.n(),
               of_references = reference.variance / reference.n(),
               of_slope = apart.dot(covariance * apart);
  out.variance = of_suspects + of_references + of_slope;
  out.freedom = out.variance * out.variance /
                (of_suspects * of_suspects / (suspect.n() - 1.0) +
                 of_references * of_references / (reference.n() - 1.0) +
                 of_slope * of_slope / (suspect.n() + reference.n() - 2.0));
  const auto above = [&](Index b) {
    return level[b] - reference.mean - slope.dot(work.row(b).transpose() - reference.work);
  };
  out.largest = out.largest_in_references = -std::numeric_limits<double>::infinity();
  for (const Index b : reference.blocks)
    out.largest_in_references = std::max(out.largest_in_references, above(b));
  // a stretch of one or two rows tells its level worse than those of the references tell theirs
  const auto sampling = [&](Index b) {
    const NoiseBlock& rows = c.blocks[static_cast<std::size_t>(b)];
    return variance_of_level(rows.last - rows.first);
  };
  double usual = 0.0;
  for (const Index b : reference.blocks) usual += sampling(b) / reference.n();
  double most = -std::numeric_limits<double>::infinity();
  for (const Index b : suspect.blocks) {
    const Vector2d x = work.row(b).transpose() - reference.work;
    const double deviation = std::sqrt(reference.variance + of_references + x.dot(covariance * x) +
                                       std::max(0.0, sampling(b) - usual));
    if (above(b) <= most * deviation) continue;
    most = above(b) / deviation;
    out.largest = above(b);
    out.largest_deviation = deviation;
  }
  return out;
}

}  // namespace sparflow
