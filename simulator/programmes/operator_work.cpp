#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/machine/static_force.h"
#include "simulator/operator/operator_motion.h"
#include "simulator/programmes/programmes.h"

namespace sparflow::plant {
namespace {

constexpr double kLeverSkip = 0.8;  // of a dead band, over which the operator's lever goes quickly

class OperatorWork : public Programme {
 public:
  OperatorWork(const Machine& machine, const PlantParameters& parameters,
               const WorkRequest& request)
      : machine_(machine),
        parameters_(parameters),
        step_(request.sample_time),
        motion_(machine, flows(machine, parameters), request.seed),
        lengths_(machine.cylinders.size(), 1.0),
        command_(machine.cylinders.size(), 0.0) {
    start_ = motion_.start_posture();
    simulator::Random random(request.seed, "loads");
    const double usual = usual_payload(machine);
    const int stretches = request.payload ? 1 : 3;
    for (int i = 0; i < stretches; ++i) {
      const double share = 0.5 * (i + random.below(2));  // 0, a half or all of it, in rising order
      loads_.push_back(
          request.payload.value_or(std::round(usual * std::min(share, 1.0) / 10.0) * 10.0));
      until_.push_back(request.seconds * (i + 1) / stretches);
    }
  }

  std::vector<double> start() const override { return start_; }
  double start_payload() const override { return loads_.front(); }

  ProgrammeStep step(const Record& r) override {
    ProgrammeStep s;
    if (motion_.resting() && now_ + 1 < loads_.size() && r.t > until_[now_])
      s.payload = loads_[++now_];
    for (int c = 0; c < machine_.cylinder_count(); ++c) {
      const auto k = static_cast<std::size_t>(c);
      const auto j = static_cast<std::size_t>(machine_.cylinders[k].joint);
      lengths_[k] = linkage_rates(machine_, c, r.q[j]).d1;
    }
    motion_.levers(r.t, step_, r.q, lengths_, command_);
    s.command = command_;
    for (std::size_t c = 0; c < command_.size(); ++c) {
      double& u = s.command[c];
      const SpoolParameters& spool = parameters_.cylinders[c].spool;
      const double gap = kLeverSkip * (u > 0.0 ? spool.dead_band_extend : spool.dead_band_retract);
      u += std::copysign(gap * std::min(1.0, std::abs(u) / 0.03), u) - gap * u;
      u = std::round(std::clamp(u, -1.0, 1.0) * 1e4) / 1e4;
    }
    return s;
  }

 private:
  static std::vector<simulator::LeverFlow> flows(const Machine& machine,
                                                 const PlantParameters& parameters) {
    const LeverMap levers(machine, parameters);
    std::vector<std::array<double, 2>> full;
    for (const CylinderParameters& p : parameters.cylinders)
      full.push_back({p.max_flow_extend, p.max_flow_retract});
    std::vector<simulator::LeverFlow> f = simulator::lever_flows(machine, full);
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const auto k = static_cast<std::size_t>(c);
      if (!machine.cylinders[k].hydraulic())
        f[k] = {{levers.fastest(c, true), levers.fastest(c, false)}, {1.0, 1.0}};
    }
    return f;
  }

  const Machine& machine_;
  const PlantParameters& parameters_;
  double step_;
  simulator::OperatorMotion motion_;
  std::vector<double> start_, lengths_, command_, loads_, until_;
  std::size_t now_ = 0;
};

}  // namespace

double usual_payload(const Machine& machine) {
  // In seven of eight postures of a lattice each cylinder carries it with less than 60 % of its pump's pressure.
  StaticForce statics(machine);
  const int n = machine.joint_count();
  std::vector<double> largest;
  int postures = 1;
  for (int k = 0; k < std::min(n, 5); ++k) postures *= 3;
  for (int p = 0; p < postures; ++p) {
    Eigen::VectorXd q(n);
    int rest = p;
    for (int k = 0; k < n; ++k, rest /= 3) {
      const Range r = machine.joints[static_cast<std::size_t>(k)].position;
      q[k] = r.lo + (r.hi - r.lo) * (0.15 + 0.35 * (rest % 3));
    }
    double most = 4000.0;
    statics.update(q.data(), 0.0, 0);
    const Eigen::VectorXd empty = statics.force();
    statics.update(q.data(), 1.0, 0);
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const Cylinder& drive = machine.cylinders[static_cast<std::size_t>(c)];
      const int pump = machine.pump_of_cylinder(c);
      if (!drive.hydraulic() || pump < 0) continue;
      const double each = statics.force()[c] - empty[c];
      const double pressure = 0.6 * machine.pumps[static_cast<std::size_t>(pump)].max_pressure;
      const double limit = each > 0.0 ? pressure * drive.area_piston() - empty[c]
                                      : pressure * drive.area_rod() + empty[c];
      if (std::abs(each) > 1e-9) most = std::min(most, std::max(0.0, limit) / std::abs(each));
    }
    largest.push_back(most);
  }
  std::sort(largest.begin(), largest.end());
  return std::round(largest[largest.size() / 8] / 50.0) * 50.0;
}

std::unique_ptr<Programme> operator_work(const Machine& machine, const PlantParameters& parameters,
                                         const WorkRequest& request) {
  return std::make_unique<OperatorWork>(machine, parameters, request);
}

}  // namespace sparflow::plant
