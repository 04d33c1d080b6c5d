#include "models/effects/effective_machine.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "models/effects/instant.h"

namespace sparflow {
namespace {

/// A random state in which every law acts; values are of the size that real machines have.
void fill_random(std::mt19937& random, Instant<double>& s) {
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  const auto either = [&](double size) {
    return (unit(random) < 0.5 ? -size : size) * unit(random);
  };
  const Machine& machine = *s.machine;
  s.payload = 500.0 * unit(random);
  for (std::size_t j = 0; j < s.q.size(); ++j) {
    const Range& r = machine.joints[j].position;
    s.q[j] = r.lo + unit(random) * (r.hi - r.lo);
    s.qd[j] = either(0.2);
    s.qdd[j] = 0.0;
    s.static_torque[j] = either(1e5);
  }
  for (std::size_t i = 0; i < s.speed.size(); ++i) {
    s.length[i] = unit(random);
    s.rate[i] = either(1.0);
    s.speed[i] = either(0.2);
    s.static_force[i] = s.force[i] = either(2e5);
    s.side[i] = s.speed[i] > 0.0 ? 1 : -1;
    s.flow[i] = 2e-3 * unit(random);
    s.return_flow[i] = 2e-3 * unit(random);
    s.pressure[i] = 2e7 * unit(random);
  }
  for (std::size_t p = 0; p < s.pump_flow.size(); ++p) {
    s.pump_flow[p] = 2e-3 * unit(random);
    s.pump_pressure[p] = 2.5e7 * unit(random);
    const std::vector<int>& feeds = machine.pumps[p].feeds;
    s.leader[p] = feeds.empty() ? -1 : feeds[random() % feeds.size()];
  }
}

/// Values of all laws of an effect at one state, one law after the other.
std::vector<double> all_laws(const AppliedEffect& e, const Instant<double>& s) {
  const std::size_t m = s.speed.size();
  std::vector<double> out(4 * m + s.pump_flow.size(), 0.0);
  const std::span<double> all(out);
  e.effect->add_force(s, e.at, e.values, all.subspan(0, m));
  e.effect->add_pressure(s, e.at, e.values, all.subspan(m, m));
  e.effect->add_demand(s, e.at, e.values, all.subspan(2 * m, m));
  e.effect->add_return(s, e.at, e.values, all.subspan(3 * m, m));
  e.effect->add_pump(s, e.at, e.values, all.subspan(4 * m));
  return out;
}

}  // namespace

std::shared_ptr<const Machine> effective_machine(const Machine& machine,
                                                 std::span<const AppliedEffect> effects) {
  std::shared_ptr<Machine> changed;
  for (const AppliedEffect& e : effects) {
    if (!e.effect->changes_machine()) continue;
    if (!changed) changed = std::make_shared<Machine>(machine);
    e.effect->change_machine(*changed, e.at, e.values);
  }
  if (changed) return changed;
  return {std::shared_ptr<const Machine>(), &machine};
}

bool acts_in_motion(const Effect& effect) {
  const EffectInfo& info = effect.info();
  return !effect.changes_machine() && info.stage != EffectStage::kFlow &&
         info.stage != EffectStage::kSensor && info.in_motion.rfind("nothing", 0) != 0;
}

bool uses_acceleration(const Machine& machine, std::span<const AppliedEffect> effects) {
  std::mt19937 random(1);
  Instant<double> s = make_instant(machine);
  /// Random states at which an effect is tried for a dependence on acceleration.
  /// @threshold [1] 4..1000; chosen: enough for laws with conditions to meet both of their branches
  constexpr int kStates = 16;
  for (const AppliedEffect& e : effects) {
    if (!acts_in_motion(*e.effect)) continue;
    for (int state = 0; state < kStates; ++state) {
      fill_random(random, s);
      const std::vector<double> still = all_laws(e, s);
      for (std::size_t j = 0; j < s.qdd.size(); ++j) s.qdd[j] = 0.1 * static_cast<double>(j + 1);
      if (all_laws(e, s) != still) return true;
    }
  }
  return false;
}

double effect_flow_limit(const Machine& machine, std::span<const AppliedEffect> effects, int pump,
                         double own) {
  double limit = own > 0.0 ? own : std::numeric_limits<double>::infinity();
  for (const AppliedEffect& e : effects) {
    limit = std::min(limit, e.effect->flow_limit(machine, pump, e.at, e.values));
  }
  return std::isfinite(limit) ? limit : 0.0;
}

}  // namespace sparflow
