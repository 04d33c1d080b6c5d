#include "diagnosis/verdict/law_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "diagnosis/evidence/left_out_rows.h"
#include "diagnosis/selection/effect_estimate.h"
#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/designs_by_group.h"
#include "models/math/student.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One group of logs in the channels of an effect, without the law that all logs have of it.
class GroupOfLogs {
 public:
  GroupOfLogs(const Diagnosis& d, std::size_t found, bool suspects)
      : design_(d.search.found[found].design),
        evidence_(with_law_fixed(d.evidence, design_.effect)) {
    std::vector<Mask> leave_out;
    for (std::size_t log = 0; log < d.evidence.series.size(); ++log)
      leave_out.push_back(Mask::Constant(d.evidence.series[log].samples(),
                                         (log < d.evidence.suspects) != suspects));
    const OtherEffects beside(d, found);
    others_.resize(beside.designs.size());
    for (std::size_t i = 0; i < others_.size(); ++i) {
      others_[i] = *beside.designs[i];
      others_[i].number = 0;
      others_[i].columns.clear();
    }
    std::vector<EvidenceChannel> channels;
    for (std::size_t c = 0; c < d.evidence.channels.size(); ++c) {
      if (!design_.touches(c)) continue;
      EvidenceChannel channel = evidence_.channels[c];
      for (const EvidenceChannel::SharedAction& s : d.evidence.channels[c].shared)
        if (s.effect == design_.effect) channel.y += s.values;
      const std::vector<Index> rows = rows_of(d.evidence, c, suspects);
      for (std::size_t i = 0; i < others_.size(); ++i)
        others_[i].columns.push_back(beside.designs[i]->touches(c)
                                         ? MatrixXd(beside.designs[i]->columns[c](rows, Eigen::all))
                                         : MatrixXd());
      channels.push_back(without_rows(channel, leave_out));
    }
    evidence_.channels = std::move(channels);
    std::erase_if(others_, [](const EffectDesign& other) { return !other.acts(); });
  }

  /// Fit of a law with these nonlinear parameters beside the other effects.
  EffectFit fit(const std::vector<double>& shape) const {
    EffectDesign law = design_;
    law.number = 0;
    law.shape = shape;
    law.columns.clear();
    for (const EvidenceChannel& channel : evidence_.channels)
      law.columns.push_back(
          evidence_.columns(law.effect, shape, channel, law.about, ActingLogs::kAll));
    std::vector<const EffectDesign*> all;
    for (const EffectDesign& other : others_) all.push_back(&other);
    all.push_back(&law);
    FitControl control;
    control.keep_residuals = true;
    return fit_effects(evidence_, all, nullptr, control);
  }

  /// Log-likelihood of each stretch of motion by the first fit less that by the second one, with the noise of the first. [nats]
  std::vector<double> gains(const EffectFit& own, const EffectFit& other) const {
    std::vector<double> out;
    for (std::size_t c = 0; c < evidence_.channels.size(); ++c) {
      const EvidenceChannel& channel = evidence_.channels[c];
      MatrixXd left(channel.rows(), 2);
      left << own.residual[c], other.residual[c];
      own.noise[c].whiten(channel.noise_rows(), left);
      for (const NoiseBlock& b : channel.blocks) {
        const auto here = left.middleRows(b.first, b.last - b.first);
        out.push_back(0.5 * (here.col(1).squaredNorm() - here.col(0).squaredNorm()) /
                      own.noise[c].variance);
      }
    }
    return out;
  }

 private:
  static std::vector<Index> rows_of(const Evidence& evidence, std::size_t c, bool suspects) {
    const EvidenceChannel& channel = evidence.channels[c];
    std::vector<Index> rows;
    for (std::size_t b = 0; b < channel.blocks.size(); ++b)
      for (Index r = channel.blocks[b].first; r < channel.blocks[b].last; ++r)
        if ((static_cast<std::size_t>(channel.log[b]) < evidence.suspects) == suspects)
          rows.push_back(r);
    return rows;
  }

  EffectDesign design_;
  Evidence evidence_;
  std::vector<EffectDesign> others_;
};

/// Chance of a mean of the gains as large as theirs if it were zero (Vuong).
double chance_of_mean(const std::vector<double>& gains) {
  const auto n = static_cast<double>(gains.size());
  double sum = 0.0, squares = 0.0;
  for (const double g : gains) sum += g;
  for (const double g : gains) squares += std::pow(g - sum / n, 2);
  const double error = std::sqrt(squares * n / (n - 1.0));
  if (!(error > 0.0)) return sum > 0.0 ? 0.0 : 1.0;
  return student_tail(sum / error, n - 1.0);
}

/// Chance of as many gains if each stretch were as likely to lose (Clarke).
double chance_of_signs(const std::vector<double>& gains) {
  const auto better = std::count_if(gains.begin(), gains.end(), [](double g) { return g > 0.0; });
  const auto worse = std::count_if(gains.begin(), gains.end(), [](double g) { return g < 0.0; });
  const auto n = static_cast<double>(better + worse);
  double chance = 0.0;
  for (auto k = better; k <= better + worse; ++k) {
    const auto of = static_cast<double>(k);
    chance += std::exp(std::lgamma(n + 1.0) - std::lgamma(of + 1.0) - std::lgamma(n - of + 1.0) -
                       n * std::numbers::ln2);
  }
  return chance;
}

/// Whether a group of logs is explained worse by one law than by its own.
bool is_worse(const Diagnosis& d, const GroupOfLogs& group, const std::vector<double>& own,
              const std::vector<double>& law) {
  const std::vector<double> gains = group.gains(group.fit(own), group.fit(law));
  const double chance = chance_of_gains_in(gains);
  if (tracing())
    fmt::print(stderr,
               "    its own law is better by {:.4g} nats in {} stretches, by chance {:.2g}\n",
               std::accumulate(gains.begin(), gains.end(), 0.0), gains.size(), chance);
  return chance < d.thresholds.excess_false_alarm;
}

}  // namespace

double chance_of_gains_in(const std::vector<double>& stretches) {
  if (stretches.size() < 2) return 0.0;  // one stretch does not say how far they scatter
  return std::min(chance_of_mean(stretches), chance_of_signs(stretches));
}

bool as_good_as_own_laws(const Diagnosis& d, std::size_t found, const FoundEffect& law) {
  const EffectDesign& own = d.search.found[found].design;
  if (!is_replaced_when_changed(*own.effect.effect)) return false;
  const std::vector<AppliedEffect>& shared = d.evidence.options.shared;
  const auto known = std::find_if(shared.begin(), shared.end(), [&](const AppliedEffect& e) {
    return same_place(e, own.effect);
  });
  if (known == shared.end()) return false;
  return !is_worse(d, {d, found, false}, shape_of(*known), law.design.shape) &&
         !is_worse(d, {d, found, true}, own.shape, law.design.shape);
}

}  // namespace sparflow
