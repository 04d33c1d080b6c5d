#include "optimizer/crane/crane_knot_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "models/effects/effective_machine.h"
#include "models/math/error.h"
#include "optimizer/crane/crane_knot_units.h"

namespace sparflow {

using namespace knot_units;

namespace {

// Rows lie within 2 cm of the exact distance: with 5 cm goals beside an obstacle were lost, 2 cm doubles the rows.
/// Inflation of the smooth clearance rows.
/// @threshold [m] 0..0.1; chosen: with 5 cm goals beside an obstacle were lost, 2 cm doubles the rows
constexpr double kRowInflation = 0.02;
// A row further from zero than this along the start is left out: solves have not moved a link that far.
/// A row further from zero than this along the start is left out.
/// @threshold [m] 0.1..10; chosen: solves have not moved a link that far; the exact distance is checked afterwards
constexpr double kNearRow = 0.5;

}  // namespace

std::vector<FullSpeed> full_speeds(const Machine& machine, const MotionLimits& limits) {
  std::vector<FullSpeed> speeds;
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(c)];
    const auto j = static_cast<std::size_t>(cylinder.joint);
    const Range& v = limits.velocity[j];
    const Range& q = machine.joints[j].position;
    const double rate = std::abs(linkage_rates(machine, c, 0.5 * (q.lo + q.hi)).d1);
    const double joint = std::max({std::abs(v.lo), std::abs(v.hi), 1e-6}) * rate;
    FullSpeed full{joint, joint};
    const Valve* valve = machine.valve_of_cylinder(c);
    if (valve != nullptr && cylinder.hydraulic()) {
      if (valve->max_flow_extend > 0.0)
        full.extend = valve->max_flow_extend / cylinder.area_piston();
      if (valve->max_flow_retract > 0.0)
        full.retract = valve->max_flow_retract / cylinder.area_rod();
    }
    speeds.push_back(full);
  }
  return speeds;
}

CraneKnotModel::CraneKnotModel(const CraneModel& model, const MotionProblem& problem,
                               CraneKnotOptions options)
    : model_(&model),
      problem_(&problem),
      machine_(effective_machine(model.machine, model.effects)),
      options_(std::move(options)),
      n_(model.machine.joint_count()),
      m_(model.machine.cylinder_count()),
      power_(model),
      statics_(*machine_),
      tip_chain_(model.machine),
      payload_(problem.payload) {
  const Machine& machine = model.machine;
  power_.smoothing = options_.smoothing;
  if (SmoothEffects::needed(model)) {
    effects_ = std::make_unique<SmoothEffects>(model);
    effects_->smoothing = options_.smoothing;
    effects_->oil = options_.oil;
  }
  for (int p = 0; p < machine.pump_count(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    const double flow =
        effect_flow_limit(machine, model.effects, p, problem.limits.pump_max_flow[i]);
    if (flow > 0.0) {
      rows_.push_back({RowKind::kPumpFlow, p, -kInfinity, options_.flow_share * flow / kFlowUnit});
    }
  }
  for (int c = 0; c < m_; ++c) {
    const Valve* valve = machine.valve_of_cylinder(c);
    const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(c)];
    if (valve == nullptr || !cylinder.hydraulic()) continue;
    const double share = options_.valve_share * problem.limits.valve_fraction;
    const auto limit = [&](double flow, double area) {
      return flow > 0.0 ? share * flow / area : kInfinity;
    };
    const double out = limit(valve->max_flow_extend, cylinder.area_piston());
    const double in = limit(valve->max_flow_retract, cylinder.area_rod());
    if (out == kInfinity && in == kInfinity) continue;
    rows_.push_back({RowKind::kValve, c, -in, out});
  }
  for (int p = 0; p < machine.pump_count() && options_.limit_pressure; ++p) {
    const auto i = static_cast<std::size_t>(p);
    const double limit = problem.limits.pump_max_pressure[i];
    if (limit <= 0.0 || machine.pumps[i].type != PumpType::kLoadSensing) continue;
    rows_.push_back(
        {RowKind::kPumpPressure, p, -kInfinity, options_.pressure_share * limit / kPressureUnit});
  }
  for (int c = 0; c < m_ && problem.limits.pressure_std > 0.0; ++c) {
    if (!machine.cylinders[static_cast<std::size_t>(c)].hydraulic()) continue;
    trusts_ = true;
    rows_.push_back({RowKind::kTrust, c, -kInfinity, options_.trust_share * options_.trust_share});
  }
  const auto* goal = std::get_if<TipGoal>(&problem.goal);
  if (problem.tip_line) {
    const Eigen::Vector3d end =
        goal ? goal->tip : tip_position<double>(machine, std::get<JointGoal>(problem.goal).q);
    line_start_ = tip_position<double>(machine, problem.start);
    line_direction_ = (end - line_start_).normalized();
    const double share = options_.tip_line_share;
    rows_.push_back({RowKind::kTipLine, 0, -kInfinity, share * share});
  }
  if (!problem.obstacles.empty()) {
    clearance_ = std::make_unique<ClearanceModel>(problem, ClearanceOptions{kRowInflation});
    choose_clearance_rows();
  }
  mode_.assign(static_cast<std::size_t>(m_), CylinderMode::kFree);
  full_speed_ = full_speeds(machine, problem.limits);
  speed_.setZero(m_);
  force_.setZero(m_);
  length_.resize(static_cast<std::size_t>(m_));
  effects_z_.setConstant(size(), std::numeric_limits<double>::quiet_NaN());
  jacobian_.setZero(2 * m_, 2 * n_);
  scratch_gradient_.setZero(2 * m_);
  scratch_hessian_.setZero(2 * m_, 2 * m_);
  product_.setZero(2 * m_, 2 * n_);
  outer_.setZero(2 * n_, 2 * n_);
  tip_jacobian_.setZero(3, n_);
}

void CraneKnotModel::choose_clearance_rows() {
  if (options_.plane_postures.rows() > 0) clearance_->use_planes(options_.plane_postures, kNearRow);
  const int all = clearance_->rows();
  all_clearance_.setZero(all);
  all_multipliers_.setZero(all);
  all_clearance_jacobian_.setZero(all, n_);
  if (options_.plane_postures.rows() > 0) {
    near_rows_.resize(static_cast<std::size_t>(all));
    std::iota(near_rows_.begin(), near_rows_.end(), 0);
    clearance_rows_ = all;
    clearance_lower_ = Eigen::VectorXd::Constant(all, options_.extra_clearance);
    return;
  }
  const auto least = [&](const Eigen::MatrixXd& postures, double start) {
    Eigen::VectorXd low = Eigen::VectorXd::Constant(all, start), q;
    for (Eigen::Index k = 0; k < postures.rows(); ++k) {
      q = postures.row(k);
      clearance_->values(q.data(), all_clearance_.data());
      low = low.cwiseMin(all_clearance_);
    }
    return low;
  };
  const Eigen::VectorXd lower = least(options_.clear_postures, 0.0);
  const Eigen::VectorXd known = least(options_.clear_motion, 0.0);
  const Eigen::VectorXd reach = least(options_.near_postures, kInfinity);
  std::vector<double> bounds;
  for (int r = 0; r < all; ++r) {
    if (options_.near_postures.rows() > 0 && reach[r] > kNearRow) continue;
    near_rows_.push_back(r);
    const double wanted = known[r] + options_.extra_clearance;
    bounds.push_back(lower[r] < 0.0 ? std::min(lower[r], wanted) : wanted);
  }
  clearance_rows_ = static_cast<int>(near_rows_.size());
  clearance_lower_ = Eigen::Map<const Eigen::VectorXd>(bounds.data(), clearance_rows_);
}

void CraneKnotModel::begin_node(int knot, int interval) {
  if (clearance_) clearance_->at_posture(knot);
  if (!options_.payloads.empty()) payload_ = options_.payloads[static_cast<std::size_t>(interval)];
  if (options_.modes.rows() == 0) return;
  for (int c = 0; c < m_; ++c) mode_[static_cast<std::size_t>(c)] = options_.modes(interval, c);
}

bool CraneKnotModel::split_at(int knot) const {
  const auto k = static_cast<std::size_t>(knot);
  if (knot > 0 && k < options_.payloads.size() && options_.payloads[k] != options_.payloads[k - 1])
    return true;
  if (options_.modes.rows() == 0 || knot <= 0 || knot >= options_.modes.rows()) return false;
  return (options_.modes.row(knot).array() != options_.modes.row(knot - 1).array()).any();
}

void CraneKnotModel::update(const double* z, int order, bool forces) {
  if (forces) {
    statics_.update(z, payload_, order);
  }
  for (int c = 0; c < m_; ++c) {
    const auto i = static_cast<std::size_t>(c);
    const int j = model_->machine.cylinders[i].joint;
    length_[i] = forces ? statics_.length(c) : linkage_rates(*machine_, c, z[j]);
    const double qd = z[n_ + j];
    speed_[c] = length_[i].d1 * qd;
    if (forces) force_[c] = statics_.force()[c];
    if (order < 1) continue;
    jacobian_.row(c).setZero();
    jacobian_(c, j) = length_[i].d2 * qd;
    jacobian_(c, n_ + j) = length_[i].d1;
    if (forces) jacobian_.row(m_ + c).head(n_) = statics_.force_jacobian().row(c);
  }
}

void CraneKnotModel::chain_gradient(const double* g, double* gradient) const {
  for (int column = 0; column < 2 * n_; ++column) {
    double sum = 0.0;
    for (int row = 0; row < 2 * m_; ++row) sum += g[row] * jacobian_(row, column);
    gradient[column] += sum;
  }
}

void CraneKnotModel::chain_hessian(const double* z, const double* g, const Eigen::MatrixXd& h,
                                   double* hessian) {
  Eigen::Map<Eigen::MatrixXd> whole(hessian, size(), size());
  auto out = whole.topLeftCorner(2 * n_, 2 * n_);
  product_.noalias() = h.lazyProduct(jacobian_);
  outer_.noalias() = jacobian_.transpose().lazyProduct(product_);
  out += outer_;
  for (int c = 0; c < m_; ++c) {
    const auto i = static_cast<std::size_t>(c);
    const int j = model_->machine.cylinders[i].joint;
    out(j, j) += g[c] * length_[i].d3 * z[n_ + j];
    out(n_ + j, j) += g[c] * length_[i].d2;
    out(j, n_ + j) += g[c] * length_[i].d2;
    if (g[m_ + c] != 0.0) out.topLeftCorner(n_, n_) += g[m_ + c] * statics_.force_hessian(c);
  }
}

void CraneKnotModel::update_effects(const double* z, bool derivatives) {
  const Eigen::Map<const Eigen::VectorXd> at(z, size());
  const bool known = effects_z_ == at && effects_mode_ == mode_ && effects_payload_ == payload_;
  if (known && (effects_derivatives_ || !derivatives)) return;
  effects_->evaluate(z, payload_, mode_.data(), derivatives);
  effects_z_ = at;
  effects_mode_ = mode_;
  effects_payload_ = payload_;
  effects_derivatives_ = derivatives;
}

GpDerivatives CraneKnotModel::trust(int cylinder) const {
  const auto i = static_cast<std::size_t>(cylinder);
  const CylinderMode mode = mode_[i];
  if (mode != CylinderMode::kExtend && mode != CylinderMode::kRetract) return {};
  const bool out = mode == CylinderMode::kExtend;
  const Cylinder& c = model_->machine.cylinders[i];
  const CylinderModel& learned = model_->cylinders[i];
  const double area = out ? c.area_piston() : -c.area_rod();
  GpDerivatives d = (out ? learned.extend : learned.retract)
                        .variance_derivatives(area * speed_[cylinder], force_[cylinder]);
  const double unit = 1.0 / (problem_->limits.pressure_std * problem_->limits.pressure_std);
  d.value *= unit;
  d.d_flow *= unit * area;
  d.d_force *= unit;
  d.d_flow_flow *= unit * area * area;
  d.d_flow_force *= unit * area;
  d.d_force_force *= unit;
  return d;
}

double CraneKnotModel::add_commands(const double* z, double* gradient, double* hessian) {
  double sum = 0.0;
  const double w = options_.command_weight / kPowerUnit;
  for (int c = 0; c < m_; ++c) {
    const auto i = static_cast<std::size_t>(c);
    const double u = full_speed_[i].command(speed_[c]);
    sum += w * u * u;
    if (gradient == nullptr || speed_[c] == 0.0) continue;
    const double d1 = 2.0 * w * u * u / speed_[c], d2 = d1 / speed_[c];
    const int j = model_->machine.cylinders[i].joint;
    const double qd = z[n_ + j];
    const double vq = length_[i].d2 * qd, vd = length_[i].d1;
    gradient[j] += d1 * vq;
    gradient[n_ + j] += d1 * vd;
    const int size = this->size();
    hessian[j * size + j] += d2 * vq * vq + d1 * length_[i].d3 * qd;
    hessian[(n_ + j) * size + n_ + j] += d2 * vd * vd;
    const double mixed = d2 * vq * vd + d1 * length_[i].d2;
    hessian[(n_ + j) * size + j] += mixed;
    hessian[j * size + n_ + j] += mixed;
  }
  return sum;
}

double CraneKnotModel::cost(const double* z) {
  if (options_.energy_weight == 0.0 || options_.command_weight > 0.0) update(z, 0, false);
  const double commands = options_.command_weight > 0.0 ? add_commands(z, nullptr, nullptr) : 0.0;
  if (options_.energy_weight == 0.0) return commands;
  if (effects_) {
    update_effects(z, false);
    return options_.energy_weight * effects_->power().value / kPowerUnit + commands;
  }
  update(z, 0, true);
  const double power = power_.value(speed_.data(), force_.data(), mode_.data());
  return options_.energy_weight * power / kPowerUnit + commands;
}

double CraneKnotModel::cost_derivatives(const double* z, double* gradient, double* hessian) {
  Eigen::Map<Eigen::VectorXd> g(gradient, size());
  Eigen::Map<Eigen::MatrixXd> h(hessian, size(), size());
  g.setZero();
  h.setZero();
  const double scale = options_.energy_weight / kPowerUnit;
  if (scale == 0.0) {
    if (options_.command_weight == 0.0) return 0.0;
    update(z, 2, false);
    return add_commands(z, gradient, hessian);
  }
  if (effects_) {
    update_effects(z, true);
    add_jet(effects_->power(), scale, gradient, hessian);
    double value = scale * effects_->power().value;
    if (options_.command_weight > 0.0) {
      update(z, 2, false);
      value += add_commands(z, gradient, hessian);
    }
    return value;
  }
  update(z, 2, true);
  const double power = power_.derivatives(speed_.data(), force_.data(), mode_.data());
  chain_gradient(power_.gradient().data(), gradient);
  chain_hessian(z, power_.gradient().data(), power_.hessian(), hessian);
  g *= scale;
  h *= scale;
  if (options_.command_weight == 0.0) return scale * power;
  return scale * power + add_commands(z, gradient, hessian);
}

}  // namespace sparflow
