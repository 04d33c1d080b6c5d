#include "diagnosis/extension/error_beside_laws.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of two channels that are the same sample of the same log.
struct CommonRows {
  std::vector<Index> first, second;
  std::vector<bool> suspect;  ///< references determine the laws, and their errors do not count
};

CommonRows common_rows(const EvidenceChannel& a, const EvidenceChannel& b, std::size_t suspects) {
  std::map<std::pair<int, Index>, Index> in_b;
  for (std::size_t k = 0; k < b.blocks.size(); ++k)
    for (Index r = b.blocks[k].first; r < b.blocks[k].last; ++r)
      in_b[{b.log[k], b.sample[static_cast<std::size_t>(r)]}] = r;
  CommonRows out;
  for (std::size_t k = 0; k < a.blocks.size(); ++k) {
    for (Index r = a.blocks[k].first; r < a.blocks[k].last; ++r) {
      const auto at = in_b.find({a.log[k], a.sample[static_cast<std::size_t>(r)]});
      if (at == in_b.end()) continue;
      out.first.push_back(r);
      out.second.push_back(at->second);
      out.suspect.push_back(static_cast<std::size_t>(a.log[k]) < suspects);
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

void PressureErrors::add(const PressureErrors& other) {
  for (const Channel& o : other.channels) {
    const auto same = std::find_if(channels.begin(), channels.end(), [&](const Channel& c) {
      return c.kind == o.kind && c.index == o.index;
    });
    if (same == channels.end()) {
      channels.push_back(o);
      continue;
    }
    same->before += o.before;
    same->after += o.after;
    same->moved += o.moved;
    same->rows += o.rows;
  }
}

double PressureErrors::change(double least_share) const {
  double sum = 0.0, rows = 0.0;
  for (const Channel& c : channels) {
    if (!(c.moved > least_share * least_share * c.before) || !(c.after > 0.0)) continue;
    sum += c.rows * 0.5 * std::log(c.after / c.before);
    rows += c.rows;
  }
  return rows > 0.0 ? std::exp(sum / rows) : 1.0;
}

PressureErrors errors_beside_laws(const Evidence& before, const Evidence& after) {
  PressureErrors out;
  for (const EvidenceChannel& b : before.channels) {
    if (b.kind == EvidenceKind::kForce || b.kind == EvidenceKind::kFlow) continue;
    const EvidenceChannel* a = after.find(b.kind, b.index);
    if (a == nullptr) continue;
    const CommonRows rows = common_rows(b, *a, before.suspects);
    if (rows.first.empty()) continue;
    const VectorXd was = left_by_laws(b, rows.first), is = left_by_laws(*a, rows.second);
    PressureErrors::Channel sums{b.kind, b.index};
    for (std::size_t k = 0; k < rows.first.size(); ++k) {
      if (!rows.suspect[k]) continue;
      const auto r = static_cast<Index>(k);
      sums.before += was[r] * was[r];
      sums.after += is[r] * is[r];
      sums.moved += (is[r] - was[r]) * (is[r] - was[r]);
      sums.rows += 1.0;
    }
    if (sums.rows > 0.0) out.channels.push_back(sums);
  }
  return out;
}

}  // namespace sparflow
