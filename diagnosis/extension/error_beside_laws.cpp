#include "diagnosis/extension/error_beside_laws.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of two channels that are the same sample of the same log.
struct CommonRows {
  std::vector<Index> first, second;
  std::vector<std::pair<int, Index>> place;  ///< log and sample
};

CommonRows common_rows(const EvidenceChannel& a, const EvidenceChannel& b) {
  std::map<std::pair<int, Index>, Index> in_b;
  for (std::size_t k = 0; k < b.blocks.size(); ++k)
    for (Index r = b.blocks[k].first; r < b.blocks[k].last; ++r)
      in_b[{b.log[k], b.sample[static_cast<std::size_t>(r)]}] = r;
  CommonRows out;
  for (std::size_t k = 0; k < a.blocks.size(); ++k) {
    for (Index r = a.blocks[k].first; r < a.blocks[k].last; ++r) {
      const std::pair<int, Index> place{a.log[k], a.sample[static_cast<std::size_t>(r)]};
      const auto at = in_b.find(place);
      if (at == in_b.end()) continue;
      out.first.push_back(r);
      out.second.push_back(at->second);
      out.place.push_back(place);
    }
  }
  return out;
}

/// What the learned laws leave of these rows. [rows, Pa]
VectorXd left_by_laws(const EvidenceChannel& channel, const std::vector<Index>& rows) {
  const VectorXd y = channel.y(rows);
  const MatrixXd baseline = acting_columns(channel.baseline(rows, Eigen::all));
  if (baseline.cols() == 0) return y;
  return y - baseline * least_squares_of_least_norm(baseline, y);
}

}  // namespace

void PressureErrors::Sums::add(const Sums& other) {
  before += other.before;
  after += other.after;
  moved += other.moved;
  rows += other.rows;
}

PressureErrors::Sums PressureErrors::Channel::all() const {
  Sums out;
  for (const auto& [piece, sums] : pieces) out.add(sums);
  return out;
}

void PressureErrors::add(const PressureErrors& other) {
  for (const Channel& o : other.channels) {
    const auto same = std::find_if(channels.begin(), channels.end(), [&](const Channel& c) {
      return c.kind == o.kind && c.index == o.index;
    });
    if (same == channels.end()) {
      channels.push_back(o);
      continue;
    }
    for (const auto& [piece, sums] : o.pieces) same->pieces[piece].add(sums);
  }
}

PressureChange PressureErrors::change(double least_share) const {
  struct Part {
    double added = 0.0;  // to the mean's logarithm, to first order
    double rows = 0.0;
  };
  std::map<Piece, Part> parts;
  double sum = 0.0, rows = 0.0;
  for (const Channel& c : channels) {
    const Sums all = c.all();
    if (!(all.moved > least_share * least_share * all.before) || !(all.after > 0.0)) continue;
    sum += all.rows * 0.5 * std::log(all.after / all.before);
    rows += all.rows;
    for (const auto& [piece, s] : c.pieces) {
      parts[piece].added += all.rows * (s.after - s.before) / (all.before + all.after);
      parts[piece].rows += s.rows;
    }
  }
  PressureChange out;
  if (!(rows > 0.0)) return out;
  out.ratio = std::exp(sum / rows);
  const auto n = static_cast<double>(parts.size());
  if (n < 2.0) return out;
  double added = 0.0, squares = 0.0;
  for (const auto& [piece, p] : parts) added += p.added;
  for (const auto& [piece, p] : parts) squares += std::pow(p.added - added / rows * p.rows, 2);
  const double deviation = std::sqrt(squares * n / (n - 1.0)) / rows;
  if (deviation > 0.0) out.deviations = -sum / rows / deviation;
  return out;
}

PressureErrors errors_beside_laws(const Evidence& before, const Evidence& after, double piece_s) {
  PressureErrors out;
  for (const EvidenceChannel& b : before.channels) {
    if (b.kind == EvidenceKind::kForce || b.kind == EvidenceKind::kFlow) continue;
    const EvidenceChannel* a = after.find(b.kind, b.index);
    if (a == nullptr) continue;
    const CommonRows rows = common_rows(b, *a);
    if (rows.first.empty()) continue;
    const VectorXd was = left_by_laws(b, rows.first), is = left_by_laws(*a, rows.second);
    PressureErrors::Channel channel{b.kind, b.index, {}};
    for (std::size_t k = 0; k < rows.place.size(); ++k) {
      const auto [log, sample] = rows.place[k];
      // references determine the laws, and their errors do not count
      if (static_cast<std::size_t>(log) >= before.suspects) continue;
      const double time = before.series[static_cast<std::size_t>(log)].time[sample];
      const auto r = static_cast<Index>(k);
      channel.pieces[{log, static_cast<int>(std::floor(time / piece_s))}].add(
          {was[r] * was[r], is[r] * is[r], (is[r] - was[r]) * (is[r] - was[r]), 1.0});
    }
    if (!channel.pieces.empty()) out.channels.push_back(std::move(channel));
  }
  return out;
}

}  // namespace sparflow
