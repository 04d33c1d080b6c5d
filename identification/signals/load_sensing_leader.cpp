#include "identification/signals/load_sensing_leader.h"

#include <algorithm>
#include <cmath>

#include "models/chain/pump_law.h"
#include "models/effects/instant.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// @param extra [samples x cylinders] contributions of effects to the demands [Pa], or no rows
void find_leader(const MatrixXd& extra, PumpSeries& pump) {
  const Index n = pump.asked.rows();
  for (Index k = 0; k < n; ++k) {
    if (std::isnan(pump.demand[k])) continue;
    PumpLaw law(pump.standby);  // a cylinder at rest has NaN and demands nothing
    for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
      const double asked = pump.asked(k, static_cast<Index>(f));
      const double more = extra.rows() > 0 ? extra(k, pump.feeds[f]) : 0.0;
      law.add(static_cast<int>(f), asked + (std::isfinite(more) ? more : 0.0));
    }
    const bool led = law.leader() >= 0;
    pump.leader[k] = led ? pump.feeds[static_cast<std::size_t>(law.leader())] : -1;
    pump.demand[k] = led ? pump.asked(k, law.leader()) : pump.standby;
  }
}

}  // namespace

MatrixXd asked_by_effects(std::span<const AppliedEffect> effects, const MachineSeries& log) {
  std::vector<const AppliedEffect*> acting;
  for (const AppliedEffect& e : effects) {
    const std::vector<EvidenceKind> kinds = e.effect->shows_in();
    if (!e.effect->changes_machine() &&
        std::find(kinds.begin(), kinds.end(), EvidenceKind::kPump) != kinds.end()) {
      acting.push_back(&e);
    }
  }
  if (acting.empty()) return {};
  MatrixXd extra = MatrixXd::Zero(log.samples(), log.machine->cylinder_count());
  Instant<double> instant = make_instant(*log.machine);
  std::vector<double> out(static_cast<std::size_t>(extra.cols()));
  for (Index k = 0; k < extra.rows(); ++k) {
    fill_instant(log, k, instant);
    std::fill(out.begin(), out.end(), 0.0);
    for (const AppliedEffect* e : acting) e->effect->add_demand(instant, e->at, e->values, out);
    extra.row(k) = Eigen::Map<const Eigen::RowVectorXd>(out.data(), extra.cols());
  }
  return (extra.array() == 0.0).all() ? MatrixXd{} : extra;
}

std::vector<PumpSeries> pumps_led_by(std::span<const AppliedEffect> effects,
                                     const MachineSeries& log) {
  std::vector<PumpSeries> pumps = pumps_with_lags_of(effects, log);
  const MatrixXd extra = asked_by_effects(effects, log);
  for (PumpSeries& p : pumps) {
    if (p.demand.size() > 0) find_leader(extra, p);
  }
  return pumps;
}

std::vector<PumpSeries> pumps_with_lags_of(std::span<const AppliedEffect> effects,
                                           const MachineSeries& log) {
  std::vector<PumpSeries> pumps = log.pumps;
  const Eigen::VectorXd unchanged = Eigen::VectorXd::Zero(log.samples());
  for (std::size_t p = 0; p < pumps.size(); ++p) {
    pumps[p].following = {};
    for (const AppliedEffect& e : effects) {
      if (e.effect->followed_demand(log, static_cast<int>(p), e.at, e.values, unchanged).size() > 0)
        pumps[p].following = {e.effect, e.at, e.values};
    }
  }
  return pumps;
}

}  // namespace sparflow
