#include "optimizer/solve/start_bytes.h"

#include "optimizer/solve/child_processes.h"

namespace sparflow {
std::string pack_start(const StartResult& r) {
  Packer p;
  p.text(r.seed).number(static_cast<double>(r.status)).text(r.message);
  p.matrix(r.motion.t);
  p.matrix(r.motion.q);
  p.matrix(r.motion.qd);
  p.matrix(r.motion.qdd);
  p.number(static_cast<double>(r.motion.stops.size()));
  for (const double stop : r.motion.stops) p.number(stop);
  p.number(r.duration).number(r.cost).number(r.plan.count());
  p.number(static_cast<double>(r.plan.modes.cols()));
  for (Eigen::Index i = 0; i < r.plan.modes.size(); ++i)
    p.number(static_cast<double>(r.plan.modes.data()[i]));
  p.matrix(r.plan.durations);
  p.number(static_cast<double>(r.plan.waypoint_after.size()));
  for (const int phase : r.plan.waypoint_after) p.number(phase);
  p.number(r.energy_exact).number(r.energy_smooth).number(r.excess).number(r.iterations);
  p.number(r.solve_s).number(r.callbacks_s).number(r.linear_solver_s).number(r.modes_held);
  p.number(r.converged);
  p.number(r.seed_energy).number(r.seed_feasible).number(static_cast<double>(r.stages.size()));
  for (const StageRecord& s : r.stages) {
    p.text(s.what).number(static_cast<double>(s.status)).number(s.iterations);
    p.number(s.solve_s).number(s.energy_exact).number(s.excess);
  }
  return p.bytes();
}

StartResult unpack_start(const std::string& bytes) {
  Unpacker u(bytes);
  StartResult r;
  r.seed = u.text();
  r.status = static_cast<NlpStatus>(static_cast<int>(u.number()));
  r.message = u.text();
  r.motion.t = u.matrix();
  r.motion.q = u.matrix();
  r.motion.qd = u.matrix();
  r.motion.qdd = u.matrix();
  r.motion.stops.resize(static_cast<std::size_t>(u.number()));
  for (double& stop : r.motion.stops) stop = u.number();
  r.duration = u.number();
  r.cost = u.number();
  const auto phases = static_cast<Eigen::Index>(u.number());
  r.plan.modes.resize(phases, static_cast<Eigen::Index>(u.number()));
  for (Eigen::Index i = 0; i < r.plan.modes.size(); ++i)
    r.plan.modes.data()[i] = static_cast<CylinderMode>(static_cast<int>(u.number()));
  r.plan.durations = u.matrix();
  r.plan.waypoint_after.resize(static_cast<std::size_t>(u.number()));
  for (int& phase : r.plan.waypoint_after) phase = static_cast<int>(u.number());
  r.energy_exact = u.number();
  r.energy_smooth = u.number();
  r.excess = u.number();
  r.iterations = static_cast<int>(u.number());
  r.solve_s = u.number();
  r.callbacks_s = u.number();
  r.linear_solver_s = u.number();
  r.modes_held = u.number() != 0.0;
  r.converged = u.number() != 0.0;
  r.seed_energy = u.number();
  r.seed_feasible = u.number() != 0.0;
  r.stages.resize(static_cast<std::size_t>(u.number()));
  for (StageRecord& s : r.stages) {
    s.what = u.text();
    s.status = static_cast<NlpStatus>(static_cast<int>(u.number()));
    s.iterations = static_cast<int>(u.number());
    s.solve_s = u.number();
    s.energy_exact = u.number();
    s.excess = u.number();
  }
  return r;
}

}  // namespace sparflow
