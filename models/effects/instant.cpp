#include "models/effects/instant.h"

namespace sparflow {
namespace {

double at(const Eigen::VectorXd& v, Eigen::Index row, double otherwise) {
  return v.size() > row ? v[row] : otherwise;
}

}  // namespace

void fill_instant(const MachineSeries& log, Eigen::Index row, Instant<double>& s) {
  const Machine& machine = *log.machine;
  s.payload = at(log.payload, row, 0.0);
  s.oil = at(log.oil, row, 40.0);
  for (std::size_t j = 0; j < s.q.size(); ++j) {
    const auto c = static_cast<Eigen::Index>(j);
    s.q[j] = log.q(row, c);
    s.qd[j] = log.qd(row, c);
    s.qdd[j] = log.qdd(row, c);
    s.static_torque[j] = 0.0;
  }
  for (std::size_t i = 0; i < s.speed.size(); ++i) {
    const CylinderSeries& c = log.cylinders[i];
    s.length[i] = c.length[row];
    s.rate[i] = c.rate[row];
    s.speed[i] = c.speed[row];
    s.static_force[i] = c.static_force[row];
    s.force[i] = at(c.force, row, c.static_force[row]);
    s.side[i] = c.direction[row];
    s.flow[i] = c.flow[row];
    s.return_flow[i] = c.return_flow[row];
    s.pressure[i] =
        s.side[i] == 0 ? 0.0 : at(s.side[i] > 0 ? c.pressure_a : c.pressure_b, row, 0.0);
    s.static_torque[static_cast<std::size_t>(machine.cylinders[i].joint)] =
        s.static_force[i] * s.rate[i];
  }
  for (std::size_t p = 0; p < s.pump_flow.size(); ++p) {
    s.pump_flow[p] = 0.0;
    for (const int i : machine.pumps[p].feeds)
      s.pump_flow[p] += s.flow[static_cast<std::size_t>(i)];
    s.pump_pressure[p] = at(log.pumps[p].demand, row, 0.0);
    s.leader[p] = log.pumps[p].leader.size() > row ? log.pumps[p].leader[row] : -1;
  }
}

}  // namespace sparflow
