#include "optimizer/grid/energy_grid_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/effects/effective_machine.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

int points(double width, double length_scale) {
  return std::clamp(static_cast<int>(std::ceil(8.0 * width / length_scale)), 12, 240) + 1;
}

}  // namespace

DemandTable::DemandTable(const GaussianProcess& process, double margin, double flow_max,
                         Range force)
    : flow_max_(flow_max), force_lo_(force.lo) {
  SPARFLOW_CHECK(flow_max > 0.0 && std::isfinite(flow_max) && force.hi >= force.lo,
                 "a demand table covers a finite range");
  if (process.empty()) {
    demand_.setConstant(2, 2, margin);
    least_.setConstant(2, margin);
    flow_step_ = flow_max;
    force_step_ = std::max(force.hi - force.lo, 1.0);
    make_rising();
    return;
  }
  const double width = std::max(force.hi - force.lo, 1.0);
  const int flows = points(flow_max, process.parameters().length_flow);
  const int forces = points(width, process.force_scale());
  flow_step_ = flow_max / (flows - 1);
  force_step_ = width / (forces - 1);
  demand_.resize(flows, forces);
  double flow_curve = 0.0,
         force_curve = 0.0;  // largest positive second derivatives of the pressure model
  for (int f = 0; f < forces; ++f) {
    for (int q = 0; q < flows; ++q) {
      const double flow = q * flow_step_, load = force.lo + f * force_step_;
      const GpDerivatives at = process.mean_derivatives(flow, load);
      demand_(q, f) = at.value + margin;
      const GpDerivatives between =
          process.mean_derivatives(flow + 0.5 * flow_step_, load + 0.5 * force_step_);
      flow_curve = std::max({flow_curve, at.d_flow_flow, between.d_flow_flow});
      force_curve = std::max({force_curve, at.d_force_force, between.d_force_force});
    }
  }
  /// Factor on the largest sampled second derivative.
  /// @threshold [1] 1..4; chosen: samples an eighth of a length scale apart miss less than this factor of a maximum
  constexpr double kSafety = 1.5;
  allowance_ = kSafety / 8.0 *
               (flow_step_ * flow_step_ * flow_curve + force_step_ * force_step_ * force_curve);
  least_ = demand_.colwise().minCoeff().transpose().array() - allowance_;
  make_rising();
}

void DemandTable::make_rising() {
  const auto knots = static_cast<Eigen::Index>(kFlowKnots);
  const Eigen::Index rows = demand_.rows(), cells = rows - 1;
  rising_.resize(knots + 1, demand_.cols());
  Eigen::VectorXd from(rows);  // least demand at this flow or a larger one
  // Linear interpolation at a fractional row.
  const auto at = [&](double row) {
    const Eigen::Index r = std::min(static_cast<Eigen::Index>(row), cells - 1);
    return from[r] + (row - static_cast<double>(r)) * (from[r + 1] - from[r]);
  };
  const double per_knot = static_cast<double>(cells) / static_cast<double>(knots);
  for (Eigen::Index f = 0; f < demand_.cols(); ++f) {
    from = demand_.col(f).array() - allowance_;
    for (Eigen::Index r = cells; r-- > 0;) from[r] = std::min(from[r], from[r + 1]);
    // The excess of a line between two knots over the finer table is subtracted at both knots.
    auto column = rising_.col(f);
    Eigen::VectorXd over = Eigen::VectorXd::Zero(knots + 1);
    for (Eigen::Index k = 0; k <= knots; ++k) column[k] = at(static_cast<double>(k) * per_knot);
    for (Eigen::Index r = 0; r <= cells; ++r) {
      const double place = static_cast<double>(r) / per_knot;
      const Eigen::Index k = std::min(static_cast<Eigen::Index>(place), knots - 1);
      const double line =
          column[k] + (place - static_cast<double>(k)) * (column[k + 1] - column[k]);
      over[k] = std::max(over[k], line - from[r]);
      over[k + 1] = std::max(over[k + 1], line - from[r]);
    }
    column -= over;
    for (Eigen::Index k = knots; k-- > 0;) column[k] = std::min(column[k], column[k + 1]);
  }
}

void DemandTable::rising(double force, Rising& demand) const {
  const double x =
      std::clamp((force - force_lo_) / force_step_, 0.0, static_cast<double>(least_.size() - 1));
  const Eigen::Index f = std::min(static_cast<Eigen::Index>(x), least_.size() - 2);
  const double share = x - static_cast<double>(f);
  for (std::size_t k = 0; k <= kFlowKnots; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    demand[k] = rising_(row, f) + share * (rising_(row, f + 1) - rising_(row, f));
  }
}

double DemandTable::demand(double flow, double force) const {
  const auto place = [](double x, Eigen::Index count, Eigen::Index& cell) {
    x = std::clamp(x, 0.0, static_cast<double>(count - 1));
    cell = std::min(static_cast<Eigen::Index>(x), count - 2);
    return x - static_cast<double>(cell);
  };
  Eigen::Index q = 0, f = 0;
  const double a = place(flow / flow_step_, demand_.rows(), q);
  const double b = place((force - force_lo_) / force_step_, demand_.cols(), f);
  const double lo = demand_(q, f) + a * (demand_(q + 1, f) - demand_(q, f));
  const double hi = demand_(q, f + 1) + a * (demand_(q + 1, f + 1) - demand_(q, f + 1));
  return lo + b * (hi - lo);
}

double DemandTable::least(double force) const {
  const double x =
      std::clamp((force - force_lo_) / force_step_, 0.0, static_cast<double>(least_.size() - 1));
  const Eigen::Index f = std::min(static_cast<Eigen::Index>(x), least_.size() - 2);
  return least_[f] + (x - static_cast<double>(f)) * (least_[f + 1] - least_[f]);
}

std::vector<double> pump_flow_limits(const CraneModel& model, const MotionProblem& problem) {
  std::vector<double> limits;
  for (int p = 0; p < model.machine.pump_count(); ++p) {
    const double most = effect_flow_limit(
        model.machine, model.effects, p, problem.limits.pump_max_flow[static_cast<std::size_t>(p)]);
    limits.push_back(most > 0.0 ? most : kUnlimited);
  }
  return limits;
}

std::vector<CylinderDemand> cylinder_demands(const CraneModel& model, const MotionProblem& problem,
                                             const std::vector<Range>& force_range) {
  const Machine& machine = model.machine;
  const std::vector<double> pump_flow = pump_flow_limits(model, problem);
  std::vector<CylinderDemand> all;
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const auto i = static_cast<std::size_t>(c);
    const Cylinder& cylinder = machine.cylinders[i];
    CylinderDemand d;
    d.cylinder = c;
    d.joint = cylinder.joint;
    d.pump = machine.pump_of_cylinder(c);
    if (!cylinder.hydraulic() || d.pump < 0) continue;
    const auto pump = static_cast<std::size_t>(d.pump);
    d.load_sensing = machine.pumps[pump].type == PumpType::kLoadSensing;
    d.area[0] = cylinder.area_piston();
    d.area[1] = cylinder.area_rod();
    // The largest rod speed that the joint's speed limit allows is sought over its range.
    const Range& q = problem.limits.position[static_cast<std::size_t>(d.joint)];
    const Range& v = problem.limits.velocity[static_cast<std::size_t>(d.joint)];
    double rate = 0.0;
    /// Positions of a joint at which the largest rate of its cylinder is taken.
    /// @threshold [1] 9..1000; chosen: rates of a linkage are smooth over the range
    constexpr int kSamples = 65;
    for (int k = 0; k < kSamples; ++k) {
      const double at = q.lo + (q.hi - q.lo) * k / (kSamples - 1);
      rate = std::max(rate, std::abs(linkage_rates(machine, c, at).d1));
    }
    const Valve* valve = machine.valve_of_cylinder(c);
    for (const int side : {0, 1}) {
      const double full = valve == nullptr ? 0.0
                          : side == 0      ? valve->max_flow_extend
                                           : valve->max_flow_retract;
      d.valve_flow[side] = full > 0.0 ? problem.limits.valve_fraction * full : kUnlimited;
      const double by_joint = 1.02 * rate * std::max(v.hi, -v.lo) * d.area[side];
      const double most = std::min({d.valve_flow[side], pump_flow[pump], by_joint});
      const CylinderModel& learned = model.cylinders[i];
      d.table[side] = DemandTable(side == 0 ? learned.extend : learned.retract, learned.margin,
                                  std::max(most, 1e-9), force_range[i]);
    }
    all.push_back(std::move(d));
  }
  return all;
}

}  // namespace sparflow
