#include "diagnosis/evidence/left_out_rows.h"

namespace sparflow {

using Eigen::Index;

EvidenceChannel without_rows(const EvidenceChannel& all, const std::vector<Mask>& leave_out) {
  EvidenceChannel out = all;
  out.blocks.clear();
  out.log.clear();
  out.sample.clear();
  std::vector<Index> kept;
  for (std::size_t b = 0; b < all.blocks.size(); ++b) {
    const auto log = static_cast<std::size_t>(all.log[b]);
    bool open = false;
    for (Index r = all.blocks[b].first; r < all.blocks[b].last; ++r) {
      const Index k = all.sample[static_cast<std::size_t>(r)];
      if (log < leave_out.size() && leave_out[log][k]) {
        open = false;
        continue;
      }
      const auto row = static_cast<Index>(kept.size());
      if (!open) {
        out.blocks.push_back({row, row});
        out.log.push_back(all.log[b]);
        open = true;
      }
      kept.push_back(r);
      out.sample.push_back(k);
      out.blocks.back().last = row + 1;
    }
  }
  out.y = all.y(kept).eval();
  out.since_change = all.since_change.of_rows(kept);
  out.baseline = all.baseline(kept, Eigen::all).eval();
  if (all.force_slope.size() > 0) out.force_slope = all.force_slope(kept).eval();
  if (all.flow_slope.size() > 0) out.flow_slope = all.flow_slope(kept).eval();
  for (EvidenceChannel::SharedAction& s : out.shared) s.values = s.values(kept).eval();
  return out;
}

}  // namespace sparflow
