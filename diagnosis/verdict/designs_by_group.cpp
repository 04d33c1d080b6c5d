#include "diagnosis/verdict/designs_by_group.h"

#include <algorithm>

#include "diagnosis/selection/effect_estimate.h"

namespace sparflow {

using Eigen::Index;

bool same_place(const AppliedEffect& a, const EffectAt& b) {
  return a.effect == b.effect && a.at == b.at;
}

EffectDesign design_in(const Evidence& evidence, const EffectDesign& found, ActingLogs where) {
  EffectDesign design = found;
  design.number = 0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c)
    design.columns[c] =
        found.touches(c)
            ? evidence.columns(found.effect, found.shape, evidence.channels[c], found.about, where)
            : Eigen::MatrixXd();
  // the same law, with the same parameters absent
  for (Index k = 0; k < found.linear; ++k) {
    bool absent = true;
    for (const Eigen::MatrixXd& m : found.columns)
      absent = absent && (m.cols() == 0 || m.col(k).isZero(0.0));
    for (Eigen::MatrixXd& m : design.columns)
      if (absent && m.cols() > 0) m.col(k).setZero();
  }
  return design;
}

bool is_shared(const Evidence& evidence, const FoundEffect& f) {
  const std::vector<AppliedEffect>& all = evidence.options.shared;
  return std::any_of(all.begin(), all.end(), [&](const AppliedEffect& e) {
    return same_place(e, f.design.effect) && shape_of(e) == f.design.shape;
  });
}

EffectDesign in_all_logs(const EffectDesign& suspect, const EffectDesign& reference) {
  EffectDesign all = suspect;
  all.number = 0;
  for (std::size_t c = 0; c < all.columns.size(); ++c) {
    if (!reference.touches(c)) continue;
    if (suspect.touches(c))
      all.columns[c] += reference.columns[c];
    else
      all.columns[c] = reference.columns[c];
  }
  return all;
}

OtherEffects::OtherEffects(const Diagnosis& d, std::size_t found) {
  in_references.reserve(d.search.found.size());
  for (std::size_t i = 0; i < d.search.found.size(); ++i) {
    if (i == found) continue;
    const FoundEffect& f = d.search.found[i];
    designs.push_back(&f.design);
    if (is_shared(d.evidence, f)) continue;  // acts there already
    in_references.push_back(design_in(d.evidence, f.design, ActingLogs::kReferences));
    if (in_references.back().acts()) designs.push_back(&in_references.back());
  }
}

EffectFit fit_beside(const Evidence& evidence, std::vector<const EffectDesign*> others,
                     std::initializer_list<const EffectDesign*> more, const EffectFit& start) {
  others.insert(others.end(), more);
  FitControl control;
  control.covariance = true;
  return fit_effects(evidence, others, &start, control);
}

Evidence with_law_fixed(const Evidence& evidence, const EffectAt& effect) {
  Evidence out = evidence;
  for (EvidenceChannel& channel : out.channels) {
    const auto own =
        std::find_if(channel.shared.begin(), channel.shared.end(),
                     [&](const EvidenceChannel::SharedAction& s) { return s.effect == effect; });
    if (own == channel.shared.end()) continue;
    std::vector<Index> others;
    for (Index k = 0; k < channel.baseline.cols(); ++k)
      if (k < own->first || k >= own->first + own->columns) others.push_back(k);
    channel.baseline = channel.baseline(Eigen::all, others).eval();
    channel.shared.clear();  // their places in the baseline have changed
  }
  return out;
}

}  // namespace sparflow
