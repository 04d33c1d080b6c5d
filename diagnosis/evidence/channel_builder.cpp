#include "diagnosis/evidence/channel_builder.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
/// Quantiles of the law's pressure from which the search for the limit starts.
constexpr double kInitialPressureLevels[] = {0.15, 0.4, 0.7};
constexpr int kTurns = 25;  // of the alternating assignment

/// The lower limit of a chamber's pressure by its anti-cavitation valve; below it the law of flow and force ends.
struct CavitationFloor {
  VectorXd law;        ///< coefficients of the baseline's columns; empty: the limit is not reached
  double level = 0.0;  ///< [Pa] the limit

  /// Pressure by which the valve exceeds the law. [rows, Pa]
  VectorXd held(const Eigen::MatrixXd& baseline) const {
    return (level - (baseline * law).array()).cwiseMax(0.0);
  }
};

/// Fits max(law, level) by alternating assignment; empty where that is not much better than the law alone.
CavitationFloor cavitation_floor(const Eigen::MatrixXd& baseline, const VectorXd& y,
                                 const CavitationOptions& options) {
  CavitationFloor best;
  if (y.size() < options.fewest_rows) return best;
  const VectorXd plain = least_squares(baseline, y);
  double least = options.largest_error_ratio * (y - baseline * plain).squaredNorm();
  for (const double start : kInitialPressureLevels) {
    CavitationFloor f{plain, quantile(VectorXd(baseline * plain), start)};
    for (int turn = 0; turn < kTurns; ++turn) {
      const VectorXd by_law = baseline * f.law;
      std::vector<Index> on_law, held;
      on_law.reserve(static_cast<std::size_t>(y.size()));
      held.reserve(static_cast<std::size_t>(y.size()));
      for (Index i = 0; i < y.size(); ++i) (by_law[i] < f.level ? held : on_law).push_back(i);
      if (static_cast<Index>(std::min(on_law.size(), held.size())) < options.fewest_rows_of_piece)
        break;
      f.law = least_squares(baseline(on_law, Eigen::all), y(on_law));
      f.level = y(held).mean();
      const double squares = (y - baseline * f.law - f.held(baseline)).squaredNorm();
      if (squares < least) {
        least = squares;
        best = f;
      }
    }
  }
  return best;
}

/// Adds a column for the limit to a supply channel's baseline; it is learned from the references if there are any.
CavitationFloor add_cavitation_floor(EvidenceChannel& channel, std::size_t suspects,
                                     const EvidenceOptions& options) {
  std::vector<Index> rows;
  for (const bool references : {true, false}) {
    rows.clear();
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      if (references && static_cast<std::size_t>(channel.log[b]) < suspects) continue;
      for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) rows.push_back(i);
    }
    if (static_cast<Index>(rows.size()) >= options.fewest_reference_rows) break;
  }
  const CavitationFloor floor =
      cavitation_floor(channel.baseline(rows, Eigen::all), channel.y(rows), options.cavitation);
  if (floor.law.size() == 0) return floor;
  Eigen::MatrixXd wider(channel.rows(), channel.baseline.cols() + 1);
  wider << channel.baseline, floor.held(channel.baseline) * 1e-5;
  channel.baseline = std::move(wider);
  return floor;
}

}  // namespace

void ChannelBuilder::add(std::size_t log, const Eigen::Array<bool, Eigen::Dynamic, 1>& mask,
                         const VectorXd& values, const Eigen::MatrixXd& base, Index margin) {
  const MachineSeries& s = evidence_.series[log];
  const Index stride = evidence_.stride;
  const EvidenceOptions& options = evidence_.options;
  const auto longest = std::max<Index>(options.rows_of_longest_block * stride,
                                       static_cast<Index>(options.longest_block / s.step));
  const auto shortest = static_cast<Index>(options.shortest_block / s.step);
  for (const auto& [run_first, run_last] : s.runs) {
    for (Index i = run_first; i < run_last;) {
      if (!mask[i]) {
        ++i;
        continue;
      }
      Index end = i;
      while (end < run_last && mask[end]) ++end;
      const Index first = i + margin, last = end - margin;
      i = end;
      if (last - first < std::max<Index>(shortest, options.fewest_rows_of_block * stride)) continue;
      const Index pieces = std::max<Index>(1, (last - first + longest - 1) / longest);
      for (Index piece = 0; piece < pieces; ++piece) {
        block(log, first + (last - first) * piece / pieces,
              first + (last - first) * (piece + 1) / pieces, values, base);
      }
    }
  }
}

void ChannelBuilder::block(std::size_t log, Index first, Index last, const VectorXd& values,
                           const Eigen::MatrixXd& base) {
  const Index stride = evidence_.stride;
  NoiseBlock b{static_cast<Index>(y_.size()), 0};
  for (Index k = first; k < last; k += stride) {
    if (!std::isfinite(values[k]) || !base.row(k).allFinite()) {  // a missing value ends the block
      b.last = static_cast<Index>(y_.size());
      close(log, b);
      b.first = b.last;
      continue;
    }
    y_.push_back(values[k]);
    rows_.push_back(base.row(k));
    channel.sample.push_back(k);
    if (log < since_change.size()) since_.push_back(since_change[log][k]);
  }
  b.last = static_cast<Index>(y_.size());
  close(log, b);
}

void ChannelBuilder::close(std::size_t log, const NoiseBlock& b) {
  if (b.last <= b.first) return;
  channel.blocks.push_back(b);
  channel.log.push_back(static_cast<int>(log));
}

Eigen::MatrixXd ChannelBuilder::baseline() const {
  Eigen::MatrixXd all(std::ssize(rows_), rows_.empty() ? 0 : rows_.front().size());
  for (Index i = 0; i < all.rows(); ++i)
    all.row(i) = rows_[static_cast<std::size_t>(i)].transpose();
  return all;
}

bool ChannelBuilder::finish(std::vector<EvidenceChannel>& out) {
  const auto n = static_cast<Index>(y_.size());
  const EvidenceOptions& options = evidence_.options;
  if (n < options.fewest_rows ||
      channel.blocks.size() < static_cast<std::size_t>(options.fewest_blocks))
    return false;
  channel.y = Eigen::Map<VectorXd>(y_.data(), n);
  channel.baseline = acting_columns(baseline());
  if (!since_.empty())
    channel.since_change =
        SettlingTimes(Eigen::Map<VectorXd>(since_.data(), std::ssize(since_)), options.noise);
  out.push_back(std::move(channel));
  return true;
}

void set_slopes(EvidenceChannel& channel, std::size_t suspects, const EvidenceOptions& options) {
  channel.flow_slope = VectorXd::Zero(channel.rows());
  if (channel.baseline.cols() == 3) {
    const VectorXd b = least_squares(channel.baseline, channel.y);
    channel.flow_slope = (b[1] + 2.0 * b[2] * channel.baseline.col(1).array()) / kBaselineFlow;
  }
  const bool returning =
      channel.kind == EvidenceKind::kReturnExtend || channel.kind == EvidenceKind::kReturnRetract;
  if (!returning) channel.force_slope = VectorXd::Zero(channel.rows());
  if (channel.baseline.cols() != 5) return;
  const CavitationFloor floor = add_cavitation_floor(channel, suspects, options);
  const auto flow = channel.baseline.col(1).array(), force = channel.baseline.col(3).array();
  const auto by_flow = [&](const VectorXd& law) {
    return (law[1] + 2.0 * law[2] * flow + law[4] * force).eval();
  };
  const VectorXd b = least_squares(channel.baseline, channel.y);
  channel.force_slope = (b[3] + b[4] * flow) / kBaselineForce;
  channel.flow_slope = by_flow(b) / kBaselineFlow;
  if (floor.law.size() == 0) return;
  const auto held = (channel.baseline.col(5).array() > 0.0).cast<double>();
  channel.force_slope.array() -=
      b[5] * 1e-5 * held * (floor.law[3] + floor.law[4] * flow) / kBaselineForce;
  channel.flow_slope.array() -= b[5] * 1e-5 * held * by_flow(floor.law) / kBaselineFlow;
}

}  // namespace sparflow
