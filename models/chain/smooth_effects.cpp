#include "models/chain/smooth_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/chain/pump_law.h"
#include "models/effects/effective_machine.h"
#include "models/hydraulics/return_rise.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

bool nothing(const Jet& x) { return x.variables() == 0 && x.value == 0.0; }

}  // namespace

bool SmoothEffects::needed(const CraneModel& model) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [](const AppliedEffect& e) { return acts_in_motion(*e.effect); });
}

SmoothEffects::SmoothEffects(const CraneModel& model)
    : model_(&model),
      machine_(effective_machine(model.machine, model.effects)),
      n_(model.machine.joint_count()),
      with_acceleration_(sparflow::uses_acceleration(*machine_, model.effects)),
      statics_(*machine_) {
  if (size() > Jet::kMax) {
    throw InputError({}, "effects",
                     fmt::format("a motion of {} joints cannot be optimised with effects that act "
                                 "in it: at most {} joints{}; remove the effects from the model",
                                 n_, Jet::kMax / (with_acceleration_ ? 3 : 2),
                                 with_acceleration_ ? " with inertia" : ""));
  }
  for (const AppliedEffect& e : model.effects) {
    if (acts_in_motion(*e.effect)) laws_.push_back(e);
  }
  const std::size_t m = machine_->cylinders.size(), p = machine_->pumps.size();
  for (std::size_t i = 0; i < m; ++i) {
    pump_of_.push_back(machine_->pump_of_cylinder(static_cast<int>(i)));
  }
  cylinders_.resize(m);
  first_ = make_instant<Jet>(*machine_);
  other_ = make_instant<Jet>(*machine_);
  for (auto* v : {&added_, &demand_first_, &demand_other_}) v->resize(m);
  for (auto* v : {&added_pump_, &pressure_, &standby_share_}) v->resize(p);
}

void SmoothEffects::set_state(const double* z, double payload, const CylinderMode* mode,
                              bool derivatives) {
  statics_.update(z, payload, derivatives ? 2 : 0);
  Instant<Jet>& s = first_;
  s.payload = payload;
  s.oil = oil;
  const auto lift = [&](int index) {
    return derivatives ? Jet::variable(z[index], index, size()) : Jet(z[index]);
  };
  // This lifts a function of q alone, given by value, gradient and Hessian.
  const auto of_posture = [&](double value, const auto& gradient, const auto& hessian) {
    if (!derivatives) return Jet(value);
    return Jet::of(
        value, size(), [&](int i) { return i < n_ ? gradient[i] : 0.0; },
        [&](int i, int j) { return i < n_ ? hessian(i, j) : 0.0; });
  };
  for (int j = 0; j < n_; ++j) {
    const auto k = static_cast<std::size_t>(j);
    s.q[k] = lift(j);
    s.qd[k] = lift(n_ + j);
    s.qdd[k] = with_acceleration_ ? lift(2 * n_ + j) : Jet(0.0);
    s.static_torque[k] = of_posture(statics_.torque()[j], statics_.torque_jacobian().row(j),
                                    statics_.torque_hessian(j));
  }
  for (std::size_t p = 0; p < s.pump_flow.size(); ++p) {
    s.pump_flow[p] = 0.0;
    s.pump_pressure[p] = model_->pumps[p].standby;
    s.leader[p] = -1;
  }
  any_both_ = false;
  for (std::size_t i = 0; i < cylinders_.size(); ++i) {
    const auto c = static_cast<int>(i);
    const Jet& q = s.q[static_cast<std::size_t>(machine_->cylinders[i].joint)];
    const Taylor3& x = statics_.length(c);
    s.length[i] = q.chain(x.value, x.d1, x.d2);
    s.rate[i] = q.chain(x.d1, x.d2, x.d3);
    s.speed[i] = s.rate[i] * s.qd[static_cast<std::size_t>(machine_->cylinders[i].joint)];
    s.static_force[i] = of_posture(statics_.force()[c], statics_.force_jacobian().row(c),
                                   statics_.force_hessian(c));
    cylinders_[i].mode = mode[i];
    set_cylinder(i);
    const int pump = pump_of_[i];
    if (pump >= 0) s.pump_flow[static_cast<std::size_t>(pump)] += s.flow[i];
  }
}

void SmoothEffects::set_cylinder(std::size_t i) {
  Cylinder& c = cylinders_[i];
  Instant<Jet>& s = first_;
  const sparflow::Cylinder& geometry = machine_->cylinders[i];
  const bool hydraulic = geometry.hydraulic();
  const double a = hydraulic ? geometry.area_piston() : 0.0;
  const double b = hydraulic ? geometry.area_rod() : 0.0;
  const Jet& v = s.speed[i];
  c.both = false;
  c.demands = hydraulic && c.mode != CylinderMode::kRest && pump_of_[i] >= 0 &&
              machine_->pumps[static_cast<std::size_t>(pump_of_[i])].type == PumpType::kLoadSensing;
  if (c.mode == CylinderMode::kRest) {
    c.side = 0;
    s.flow[i] = s.return_flow[i] = 0.0;
    return;
  }
  if (c.mode != CylinderMode::kFree) {
    c.side = c.mode == CylinderMode::kExtend ? 1 : -1;
    c.size = c.side * v;
    s.flow[i] = (c.side > 0 ? a : b) * c.size;
    s.return_flow[i] = (c.side > 0 ? b : a) * c.size;
    return;
  }
  c.side = v.value < 0.0 ? -1 : 1;
  const Jet t = tanh(v / smoothing.speed);
  c.share = 0.5 + (0.5 * c.side) * t;
  c.both = 1.0 - c.share.value > kNegligibleShare;
  any_both_ = any_both_ || c.both;
  c.activity = t * t;
  c.size = v * t;
  const Jet tilt = 0.5 * (a - b) * t;
  s.flow[i] = (0.5 * (a + b) + tilt) * c.size;
  s.return_flow[i] = (0.5 * (a + b) - tilt) * c.size;
}

void SmoothEffects::evaluate_side(bool other) {
  Instant<Jet>& s = other ? other_ : first_;
  if (other) other_ = first_;
  const std::size_t m = cylinders_.size();
  for (std::size_t i = 0; i < m; ++i) {
    const Cylinder& c = cylinders_[i];
    s.side[i] = other && c.both ? -c.side : c.side;
    if (c.mode == CylinderMode::kFree) s.speed[i] = s.side[i] * c.size;
    s.force[i] = s.static_force[i];
    s.pressure[i] = 0.0;
  }
  std::fill(added_.begin(), added_.end(), Jet(0.0));
  for (const AppliedEffect& e : laws_) e.effect->add_force(s, e.at, e.values, added_);
  for (std::size_t i = 0; i < m; ++i) s.force[i] += added_[i];
  std::fill(added_.begin(), added_.end(), Jet(0.0));
  for (const AppliedEffect& e : laws_) e.effect->add_return(s, e.at, e.values, added_);
  for (std::size_t i = 0; i < m; ++i) {
    const sparflow::Cylinder& geometry = machine_->cylinders[i];
    if (s.side[i] == 0 || !geometry.hydraulic()) continue;
    const CylinderModel& learned = model_->cylinders[i];
    const bool extend = s.side[i] > 0;
    const GaussianProcess& process = extend ? learned.extend : learned.retract;
    if (process.empty()) continue;
    const double area = extend ? geometry.area_piston() : geometry.area_rod();
    const Jet flow = area * cylinders_[i].size;
    s.pressure[i] = process_mean(process, flow, s.force[i]);
    if (nothing(added_[i])) continue;
    s.pressure[i] += supply_rise<Jet>({process, geometry, s.side[i]}, s.pressure[i], flow,
                                      s.force[i], added_[i]);
  }
  std::fill(added_.begin(), added_.end(), Jet(0.0));
  for (const AppliedEffect& e : laws_) e.effect->add_pressure(s, e.at, e.values, added_);
  for (std::size_t i = 0; i < m; ++i) {
    if (s.side[i] != 0 && machine_->cylinders[i].hydraulic()) s.pressure[i] += added_[i];
  }
  std::vector<Jet>& demand = other ? demand_other_ : demand_first_;
  std::fill(demand.begin(), demand.end(), Jet(0.0));
  for (const AppliedEffect& e : laws_) e.effect->add_demand(s, e.at, e.values, demand);
  for (std::size_t i = 0; i < m; ++i) {
    demand[i] += s.pressure[i] + Jet(model_->cylinders[i].margin);
  }
}

void SmoothEffects::add_demands() {
  for (std::size_t i = 0; i < cylinders_.size(); ++i) {
    Cylinder& c = cylinders_[i];
    if (!c.demands) continue;
    c.demand = demand_first_[i];
    if (c.mode != CylinderMode::kFree) continue;
    if (c.both) c.demand = c.share * c.demand + (1.0 - c.share) * demand_other_[i];
    c.demand *= c.activity;
  }
}

void SmoothEffects::soft_maximum(std::size_t p) {
  const Pump& pump = machine_->pumps[p];
  const SmoothPumpLaw law{model_->pumps[p].standby, smoothing.pressure};
  const auto demand_of = [&](int feed) -> SmoothDemand<Jet> {
    Cylinder& c = cylinders_[static_cast<std::size_t>(feed)];
    if (!c.demands) return {};
    return {&c.demand, &c.lead};
  };
  const SmoothPumpPressure<Jet> soft = law.pressure<Jet>(pump.feeds, demand_of);
  pressure_[p] = soft.pressure;
  standby_share_[p] = soft.standby_share;
  first_.leader[p] = soft.leader;
}

Jet SmoothEffects::pump_effects(std::size_t pump, int leader, Instant<Jet>& s) {
  const int before = s.leader[pump];
  s.leader[pump] = leader;
  std::fill(added_pump_.begin(), added_pump_.end(), Jet(0.0));
  for (const AppliedEffect& e : laws_) e.effect->add_pump(s, e.at, e.values, added_pump_);
  s.leader[pump] = before;
  return added_pump_[pump];
}

void SmoothEffects::pumps() {
  for (std::size_t p = 0; p < pressure_.size(); ++p) {
    if (machine_->pumps[p].type == PumpType::kLoadSensing) {
      soft_maximum(p);
    } else {
      pressure_[p] = model_->pumps[p].standby;
      standby_share_[p] = 1.0;
      first_.leader[p] = -1;
    }
  }
  first_.pump_pressure = pressure_;
  if (any_both_) {
    other_.pump_pressure = pressure_;
    other_.leader = first_.leader;
  }
  for (std::size_t p = 0; p < pressure_.size(); ++p) {
    if (standby_share_[p].value > kNegligibleShare) {
      const Jet added = pump_effects(p, -1, first_);
      if (!nothing(added)) pressure_[p] += standby_share_[p] * added;
    }
    for (const int feed : machine_->pumps[p].feeds) {
      const Cylinder& c = cylinders_[static_cast<std::size_t>(feed)];
      if (!c.demands || c.lead.value <= kNegligibleShare) continue;
      Jet added = pump_effects(p, feed, first_);
      if (c.mode == CylinderMode::kFree && c.both) {
        added = c.share * added + (1.0 - c.share) * pump_effects(p, feed, other_);
      }
      if (!nothing(added)) pressure_[p] += c.lead * added;
    }
  }
}

void SmoothEffects::evaluate(const double* z, double payload, const CylinderMode* mode,
                             bool derivatives) {
  set_state(z, payload, mode, derivatives);
  evaluate_side(false);
  if (any_both_) evaluate_side(true);
  add_demands();
  pumps();
  power_ = 0.0;
  for (std::size_t p = 0; p < pressure_.size(); ++p) power_ += pressure_[p] * first_.pump_flow[p];
}

}  // namespace sparflow
