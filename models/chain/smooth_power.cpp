#include "models/chain/smooth_power.h"

#include <cmath>

#include "models/chain/pump_law.h"

namespace sparflow {
namespace {

/// The speed m(v) that takes oil, with its derivatives by v. [m/s], [-], [s/m]
struct FlowSpeed {
  double m, m1, m2;
};

/// Derivatives of a process of (flow, force) with respect to (speed, force), with Q = area m(v).
GpDerivatives in_speed(const GaussianProcess& process, double area, const FlowSpeed& speed,
                       double force) {
  const GpDerivatives g = process.mean_derivatives(area * speed.m, force);
  const double q1 = area * speed.m1, q2 = area * speed.m2;
  return {g.value,
          g.d_flow * q1,
          g.d_force,
          g.d_flow_flow * q1 * q1 + g.d_flow * q2,
          g.d_flow_force * q1,
          g.d_force_force};
}

}  // namespace

SmoothPower::SmoothPower(const CraneModel& model)
    : model_(&model), demands_(model.cylinders.size()), pumps_(model.pumps.size()) {
  for (int i = 0; i < model.machine.cylinder_count(); ++i) {
    pump_of_.push_back(model.machine.pump_of_cylinder(i));
  }
  const Eigen::Index n = 2 * model.machine.cylinder_count();
  gradient_.setZero(n);
  hessian_.setZero(n, n);
}

SmoothPower::Flow SmoothPower::flow(int cylinder, double speed, CylinderMode mode) const {
  const Cylinder& c = model_->machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (!c.hydraulic() || mode == CylinderMode::kRest) return {};
  const double a = c.area_piston(), b = c.area_rod();
  if (mode == CylinderMode::kExtend) return {a * speed, a, 0.0};
  if (mode == CylinderMode::kRetract) return {-b * speed, -b, 0.0};
  const double t = std::tanh(speed / smoothing.speed);
  const double t1 = (1.0 - t * t) / smoothing.speed;
  const double t2 = -2.0 * t * t1 / smoothing.speed;
  const double m = speed * t, m1 = t + speed * t1, m2 = 2.0 * t1 + speed * t2;
  const double area = 0.5 * (a + b) + 0.5 * t * (a - b);
  const double area1 = 0.5 * t1 * (a - b), area2 = 0.5 * t2 * (a - b);
  return {area * m, area1 * m + area * m1, area2 * m + 2.0 * area1 * m1 + area * m2};
}

void SmoothPower::demand(int cylinder, double speed, double force, CylinderMode mode,
                         bool derivatives) {
  const auto i = static_cast<std::size_t>(cylinder);
  Demand& out = demands_[i];
  out = Demand{};
  out.flow = flow(cylinder, speed, mode);
  const int pump = pump_of_[i];
  if (pump < 0 || mode == CylinderMode::kRest) return;
  if (model_->machine.pumps[static_cast<std::size_t>(pump)].type != PumpType::kLoadSensing) return;
  const Cylinder& c = model_->machine.cylinders[i];
  const CylinderModel& learned = model_->cylinders[i];
  if (!c.hydraulic()) return;
  out.active = true;

  if (mode != CylinderMode::kFree) {
    const bool extend = mode == CylinderMode::kExtend;
    const double sign = extend ? 1.0 : -1.0;
    const double area = extend ? c.area_piston() : c.area_rod();
    const GaussianProcess& process = extend ? learned.extend : learned.retract;
    if (!derivatives) {
      out.d = process.mean(area * sign * speed, force) + learned.margin;
      return;
    }
    const GpDerivatives g = in_speed(process, area, {sign * speed, sign, 0.0}, force);
    out.d = g.value + learned.margin;
    out.v = g.d_flow;
    out.f = g.d_force;
    out.vv = g.d_flow_flow;
    out.vf = g.d_flow_force;
    out.ff = g.d_force_force;
    return;
  }

  const double t = std::tanh(speed / smoothing.speed);
  const double w = 0.5 * (1.0 + t), other = 0.5 * (1.0 - t);
  const bool need_extend = w > kNegligibleShare, need_retract = other > kNegligibleShare;
  const double m = speed * t;
  if (!derivatives) {
    double p = learned.margin;
    if (need_extend) p += w * learned.extend.mean(c.area_piston() * m, force);
    if (need_retract) p += other * learned.retract.mean(c.area_rod() * m, force);
    out.d = t * t * p;
    return;
  }
  const double t1 = (1.0 - t * t) / smoothing.speed;
  const double t2 = -2.0 * t * t1 / smoothing.speed;
  const double m1 = t + speed * t1, m2 = 2.0 * t1 + speed * t2;
  const double w1 = 0.5 * t1, w2 = 0.5 * t2;
  GpDerivatives b;  // blended pressure + margin
  b.value = learned.margin;
  const auto blend = [&](const GpDerivatives& g, double s, double s1, double s2) {
    b.value += s * g.value;
    b.d_flow += s1 * g.value + s * g.d_flow;
    b.d_force += s * g.d_force;
    b.d_flow_flow += s2 * g.value + 2.0 * s1 * g.d_flow + s * g.d_flow_flow;
    b.d_flow_force += s1 * g.d_force + s * g.d_flow_force;
    b.d_force_force += s * g.d_force_force;
  };
  if (need_extend) blend(in_speed(learned.extend, c.area_piston(), {m, m1, m2}, force), w, w1, w2);
  if (need_retract)
    blend(in_speed(learned.retract, c.area_rod(), {m, m1, m2}, force), other, -w1, -w2);
  const double a = t * t, a1 = 2.0 * t * t1, a2 = 2.0 * (t1 * t1 + t * t2);
  out.d = a * b.value;
  out.v = a1 * b.value + a * b.d_flow;
  out.f = a * b.d_force;
  out.vv = a2 * b.value + 2.0 * a1 * b.d_flow + a * b.d_flow_flow;
  out.vf = a1 * b.d_force + a * b.d_flow_force;
  out.ff = a * b.d_force_force;
}

void SmoothPower::pump_sums() {
  for (std::size_t p = 0; p < pumps_.size(); ++p) {
    const Pump& pump = model_->machine.pumps[p];
    PumpSum& sum = pumps_[p];
    sum = PumpSum{};
    for (const int i : pump.feeds) sum.flow += demands_[static_cast<std::size_t>(i)].flow.q;
    const SmoothPumpLaw law{model_->pumps[p].standby, smoothing.pressure};
    if (pump.type != PumpType::kLoadSensing) {
      sum.pressure = law.standby;
      continue;
    }
    const auto demand_of = [&](int i) -> SmoothDemand<double> {
      Demand& d = demands_[static_cast<std::size_t>(i)];
      if (!d.active) return {};
      return {&d.d, &d.share};
    };
    sum.pressure = law.pressure<double>(pump.feeds, demand_of).pressure;
  }
}

double SmoothPower::value(const double* speed, const double* force, const CylinderMode* mode) {
  for (std::size_t i = 0; i < demands_.size(); ++i) {
    demand(static_cast<int>(i), speed[i], force[i], mode[i], false);
  }
  pump_sums();
  double power = 0.0;
  for (const PumpSum& p : pumps_) power += p.pressure * p.flow;
  return power;
}

void SmoothPower::add_pressure_gradient(int p, double factor, double* gradient) const {
  const std::size_t m = demands_.size();
  for (const int feed : model_->machine.pumps[static_cast<std::size_t>(p)].feeds) {
    const auto i = static_cast<std::size_t>(feed);
    const Demand& d = demands_[i];
    gradient[i] += factor * d.share * d.v;
    gradient[m + i] += factor * d.share * d.f;
  }
}

void SmoothPower::add_pressure_hessian(int p, double factor, Eigen::MatrixXd& hessian) const {
  const auto m = static_cast<Eigen::Index>(demands_.size());
  const std::vector<int>& feeds = model_->machine.pumps[static_cast<std::size_t>(p)].feeds;
  const double beta = smoothing.pressure;
  for (const int i : feeds) {
    const Demand& a = demands_[static_cast<std::size_t>(i)];
    if (!a.active) continue;
    hessian(i, i) += factor * a.share * a.vv;
    hessian(i, m + i) += factor * a.share * a.vf;
    hessian(m + i, i) += factor * a.share * a.vf;
    hessian(m + i, m + i) += factor * a.share * a.ff;
    for (const int j : feeds) {
      const Demand& b = demands_[static_cast<std::size_t>(j)];
      if (!b.active) continue;
      const double curvature =
          factor * (i == j ? a.share - a.share * a.share : -a.share * b.share) / beta;
      hessian(i, j) += curvature * a.v * b.v;
      hessian(i, m + j) += curvature * a.v * b.f;
      hessian(m + i, j) += curvature * a.f * b.v;
      hessian(m + i, m + j) += curvature * a.f * b.f;
    }
  }
}

double SmoothPower::derivatives(const double* speed, const double* force,
                                const CylinderMode* mode) {
  for (std::size_t i = 0; i < demands_.size(); ++i) {
    demand(static_cast<int>(i), speed[i], force[i], mode[i], true);
  }
  pump_sums();
  gradient_.setZero();
  hessian_.setZero();
  const auto m = static_cast<Eigen::Index>(demands_.size());
  double power = 0.0;
  for (std::size_t k = 0; k < pumps_.size(); ++k) {
    const auto p = static_cast<int>(k);
    const PumpSum& sum = pumps_[k];
    const std::vector<int>& feeds = model_->machine.pumps[k].feeds;
    power += sum.pressure * sum.flow;
    add_pressure_gradient(p, sum.flow, gradient_.data());
    add_pressure_hessian(p, sum.flow, hessian_);
    const bool sensing = model_->machine.pumps[k].type == PumpType::kLoadSensing;
    for (const int i : feeds) {
      const Demand& a = demands_[static_cast<std::size_t>(i)];
      gradient_[i] += sum.pressure * a.flow.d1;
      hessian_(i, i) += sum.pressure * a.flow.d2;
      if (!sensing) continue;
      for (const int j : feeds) {  // d pressure (j) times d flow (i), and its transpose
        const Demand& b = demands_[static_cast<std::size_t>(j)];
        const double v = a.flow.d1 * b.share * b.v, f = a.flow.d1 * b.share * b.f;
        hessian_(i, j) += v;
        hessian_(j, i) += v;
        hessian_(i, m + j) += f;
        hessian_(m + j, i) += f;
      }
    }
  }
  return power;
}

}  // namespace sparflow
