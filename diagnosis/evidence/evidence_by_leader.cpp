// Parts of the evidence that depend on the load-sensing leader and on how the pump follows it.
#include <algorithm>
#include <cmath>

#include "diagnosis/evidence/evidence.h"
#include "identification/signals/load_sensing_leader.h"
#include "identification/signals/series.h"

namespace sparflow {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Whether two laws differ so much that what acts through them has another signature.
bool differ(const LawOfModel& a, const LawOfModel& b) {
  /// Difference of a lag's parameters over their size, up to which signatures are the same.
  /// @threshold [1] 0.01..0.2; numerical: by less, a step that arrives late differs by 2 % of itself at most
  constexpr double kSame = 0.05;
  if (a.effect != b.effect || a.at != b.at) return true;
  return !std::equal(a.values.begin(), a.values.end(), b.values.begin(), b.values.end(),
                     [](double x, double y) {
                       return std::abs(x - y) <= kSame * std::max(std::abs(x), std::abs(y));
                     });
}

}  // namespace

MatrixXd acting_columns(const MatrixXd& baseline) {
  std::vector<Index> used;
  for (Index c = 0; c < baseline.cols(); ++c) {
    if (baseline.col(c).cwiseAbs().maxCoeff() > 0.0) used.push_back(c);
  }
  return baseline(Eigen::all, used);
}

namespace {

/// Whether what an effect of the model does stands in the baseline of a channel: the opening that a valve reaches by it.
bool in_baseline(const AppliedEffect& effect, const MachineSeries& log, EvidenceKind kind) {
  return kind == EvidenceKind::kFlow && effect.effect->acts_on_opening() &&
         log.cylinders[static_cast<std::size_t>(effect.at)].reached.size() > 0;
}

}  // namespace

VectorXd Evidence::known(std::size_t log, EvidenceKind kind, int index) const {
  VectorXd sum = VectorXd::Zero(series[log].samples());
  for (const AppliedEffect& effect : known_in(log)) {
    if (in_baseline(effect, series[log], kind)) continue;
    const VectorXd one = effect_series(effect, series[log], kind, index);
    if (one.size() > 0) sum += one;
  }
  return sum;
}

VectorXd Evidence::smooth_known(std::size_t log, EvidenceKind kind, int index) const {
  const Index n = series[log].samples();
  VectorXd to_filter = VectorXd::Zero(n), filtered = VectorXd::Zero(n);
  for (const AppliedEffect& effect : known_in(log)) {
    if (in_baseline(effect, series[log], kind)) continue;
    const VectorXd one = effect_series(effect, series[log], kind, index);
    if (one.size() > 0) (effect.effect->columns_filtered() ? filtered : to_filter) += one;
  }
  return filter(log, kind, to_filter) + filtered;
}

MatrixXd Evidence::margins(std::size_t log, int pump) const {
  const auto at = static_cast<std::size_t>(pump);
  const std::vector<int>& feeds = series[log].machine->pumps[at].feeds;
  const Eigen::VectorXi& leader = series[log].pumps[at].leader;
  MatrixXd base(leader.size(), static_cast<Index>(feeds.size()) + 1);
  for (std::size_t k = 0; k <= feeds.size(); ++k) {
    const int who = k < feeds.size() ? feeds[k] : -1;
    base.col(static_cast<Index>(k)) =
        filter(log, EvidenceKind::kPump, (leader.array() == who).cast<double>().matrix());
  }
  return base;
}

std::optional<Evidence> Evidence::with_leaders_of(std::span<const AppliedEffect> found) const {
  std::vector<std::vector<PumpSeries>> pumps;
  bool changed = false;
  for (std::size_t log = 0; log < series.size(); ++log) {
    std::vector<AppliedEffect> acting = known_in(log);
    if (log < suspects) acting.insert(acting.end(), found.begin(), found.end());
    pumps.push_back(pumps_led_by(acting, series[log]));
    if (!options.mechanisms.enabled(Mechanism::kPumpFollows))
      for (PumpSeries& p : pumps.back()) p.following = {};
    for (std::size_t p = 0; p < pumps.back().size(); ++p) {
      const PumpSeries &now = pumps.back()[p], &before = series[log].pumps[p];
      changed = changed || now.leader != before.leader || differ(now.following, before.following);
    }
  }
  if (!changed) return {};
  Evidence out = *this;
  for (std::size_t log = 0; log < series.size(); ++log) out.series[log].pumps = pumps[log];
  for (EvidenceChannel& channel : out.channels) {
    if (channel.kind != EvidenceKind::kPump) continue;
    const auto p = static_cast<std::size_t>(channel.index);
    channel.baseline.setZero(channel.rows(), series[0].machine->pumps[p].feeds.size() + 1);
    for (std::size_t log = 0; log < series.size(); ++log) {
      const PumpSeries& before = series[log].pumps[p];
      if (before.demand.size() == 0 || before.pressure.size() == 0) continue;
      const VectorXd demand = before.demand - pumps[log][p].demand;
      if (log < channel.raw.size() && channel.raw[log].size() > 0)
        channel.raw[log] += demand + known(log, channel.kind, channel.index) -
                            out.known(log, channel.kind, channel.index);
      const VectorXd y = filter(log, channel.kind, demand) +
                         smooth_known(log, channel.kind, channel.index) -
                         out.smooth_known(log, channel.kind, channel.index);
      const MatrixXd base = out.margins(log, channel.index);
      for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
        if (channel.log[b] != static_cast<int>(log)) continue;
        for (Index row = channel.blocks[b].first; row < channel.blocks[b].last; ++row) {
          const Index k = channel.sample[static_cast<std::size_t>(row)];
          channel.y[row] += y[k];
          channel.baseline.row(row) = base.row(k);
        }
      }
    }
    channel.baseline = acting_columns(channel.baseline);
    out.add_shared(channel);
  }
  return out;
}

}  // namespace sparflow
