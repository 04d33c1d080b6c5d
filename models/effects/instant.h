#pragma once
/// Fills one `Instant` for the laws without memory.
#include "models/effects/effect.h"

namespace sparflow {

/// An instant whose vectors have the machine's sizes.
template <class T = double>
Instant<T> make_instant(const Machine& machine) {
  Instant<T> s;
  s.machine = &machine;
  const auto n = static_cast<std::size_t>(machine.joint_count());
  const auto m = static_cast<std::size_t>(machine.cylinder_count());
  const auto k = static_cast<std::size_t>(machine.pump_count());
  for (auto* v : {&s.q, &s.qd, &s.qdd, &s.static_torque}) v->resize(n);
  for (auto* v : {&s.length, &s.rate, &s.speed, &s.static_force, &s.force, &s.flow, &s.return_flow,
                  &s.pressure}) {
    v->resize(m);
  }
  s.side.resize(m);
  s.pump_flow.resize(k);
  s.pump_pressure.resize(k);
  s.leader.resize(k);
  return s;
}

/// Fills `s` from row `row` of a log: `force` and `pressure` as measured (static force where none is measured), `side`
/// the commanded direction, `pump_pressure` the pump's demand. @param s from make_instant
void fill_instant(const MachineSeries& log, Eigen::Index row, Instant<double>& s);

}  // namespace sparflow
