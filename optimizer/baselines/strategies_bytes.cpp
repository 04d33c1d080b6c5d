/// Packs a comparison for the pipe of a child process.
#include "optimizer/baselines/strategies.h"
#include "optimizer/solve/child_processes.h"

namespace sparflow {
namespace {

void put_list(Packer& p, const std::vector<double>& v) { p.numbers(v.data(), v.size()); }

void put_energy(Packer& p, const MotionEnergy& e) {
  p.number(e.total).number(e.potential_difference).number(e.largest_pressure_std);
  p.number(e.moving_share_outside_data);
  put_list(p, e.pump);
  put_list(p, e.throttling);
  put_list(p, e.useful);
  put_list(p, e.share_moving);
  put_list(p, e.creep);
}

MotionEnergy take_energy(Unpacker& u) {
  MotionEnergy e;
  e.total = u.number();
  e.potential_difference = u.number();
  e.largest_pressure_std = u.number();
  e.moving_share_outside_data = u.number();
  e.pump = u.numbers();
  e.throttling = u.numbers();
  e.useful = u.numbers();
  e.share_moving = u.numbers();
  e.creep = u.numbers();
  return e;
}

void put_motion(Packer& p, const Trajectory& m) {
  p.matrix(m.t);
  p.matrix(m.q);
  p.matrix(m.qd);
  p.matrix(m.qdd);
}

Trajectory take_motion(Unpacker& u) {
  Trajectory m;
  m.t = u.matrix();
  m.q = u.matrix();
  m.qd = u.matrix();
  m.qdd = u.matrix();
  return m;
}

void put_outcome(Packer& p, const StrategyOutcome& o) {
  p.text(o.kind).text(o.detail).text(o.why).text(o.worst).number(o.duration).number(o.shortest);
  put_motion(p, o.motion);
  put_energy(p, o.energy);
  put_list(p, o.peak_pressure);
  put_list(p, o.mean_pressure);
}

StrategyOutcome take_outcome(Unpacker& u) {
  StrategyOutcome o;
  o.kind = u.text();
  o.detail = u.text();
  o.why = u.text();
  o.worst = u.text();
  o.duration = u.number();
  o.shortest = u.number();
  o.motion = take_motion(u);
  o.energy = take_energy(u);
  o.peak_pressure = u.numbers();
  o.mean_pressure = u.numbers();
  return o;
}

}  // namespace

std::string packed(const StrategyOutcome& outcome) {
  Packer p;
  put_outcome(p, outcome);
  return p.bytes();
}

StrategyOutcome unpacked_outcome(const std::string& bytes) {
  Unpacker u(bytes);
  return take_outcome(u);
}

StrategyOutcome kept_outcome(const StrategyOptions& options, const std::string& part,
                             const std::function<StrategyOutcome()>& compute) {
  if (options.journal == nullptr) return compute();
  return unpacked_outcome(options.journal->kept(part, [&] {
    std::string bytes = packed(compute());
    const std::function<bool()>& stop = options.optimize.interrupted;
    return Journal::Part{std::move(bytes), !(stop && stop())};
  }));
}

std::string packed(const StrategyComparison& c) {
  Packer p;
  p.text(c.problem).text(c.file).text(c.message).text(c.shortest_of);
  p.number(c.payload).number(c.idle_power).number(c.shortest).number(c.solve_s);
  p.number(c.interrupted ? 1.0 : 0.0);
  p.number(static_cast<double>(c.rows.size()));
  for (const StrategyRow& row : c.rows) {
    p.text(row.name).number(row.factor).number(row.duration);
    p.number(static_cast<double>(row.outcomes.size()));
    for (const StrategyOutcome& o : row.outcomes) put_outcome(p, o);
  }
  p.number(static_cast<double>(c.orders.size()));
  for (const BaselineMotion& m : c.orders) {
    p.text(m.kind).text(m.detail).text(m.why).number(m.duration).number(m.shortest);
    put_energy(p, m.energy);
  }
  return p.bytes();
}

StrategyComparison unpacked_comparison(const std::string& bytes) {
  Unpacker u(bytes);
  StrategyComparison c;
  c.problem = u.text();
  c.file = u.text();
  c.message = u.text();
  c.shortest_of = u.text();
  c.payload = u.number();
  c.idle_power = u.number();
  c.shortest = u.number();
  c.solve_s = u.number();
  c.interrupted = u.number() != 0.0;
  c.rows.resize(static_cast<std::size_t>(u.number()));
  for (StrategyRow& row : c.rows) {
    row.name = u.text();
    row.factor = u.number();
    row.duration = u.number();
    row.outcomes.resize(static_cast<std::size_t>(u.number()));
    for (StrategyOutcome& o : row.outcomes) o = take_outcome(u);
  }
  c.orders.resize(static_cast<std::size_t>(u.number()));
  for (BaselineMotion& m : c.orders) {
    m.kind = u.text();
    m.detail = u.text();
    m.why = u.text();
    m.duration = u.number();
    m.shortest = u.number();
    m.energy = take_energy(u);
  }
  return c;
}

}  // namespace sparflow
