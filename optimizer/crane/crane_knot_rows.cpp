// Limits at a knot as rows of the NLP: their bounds, names, values and derivatives.
#include <fmt/format.h>

#include <algorithm>

#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/crane/crane_knot_units.h"

namespace sparflow {

using namespace knot_units;

void CraneKnotModel::path_bounds(double* lower, double* upper) const {
  std::size_t k = 0;
  for (const Row& row : rows_) {
    lower[k] = row.lower;
    upper[k++] = row.upper;
  }
  for (int r = 0; r < clearance_rows_; ++r) {
    lower[k] = clearance_lower_[r];
    upper[k++] = kInfinity;
  }
}

bool CraneKnotModel::path_uses_velocity(int row) const {
  return row < static_cast<int>(rows_.size()) &&
         rows_[static_cast<std::size_t>(row)].kind != RowKind::kTipLine;
}

bool CraneKnotModel::path_uses_acceleration(int row) const {
  return uses_acceleration() && row < static_cast<int>(rows_.size()) &&
         rows_[static_cast<std::size_t>(row)].kind == RowKind::kPumpPressure;
}

std::string CraneKnotModel::path_name(int row) const {
  const Machine& machine = model_->machine;
  if (row >= static_cast<int>(rows_.size()))
    return clearance_->row_name(near_rows_[static_cast<std::size_t>(row) - rows_.size()]);
  const Row& r = rows_[static_cast<std::size_t>(row)];
  const auto i = static_cast<std::size_t>(r.index);
  switch (r.kind) {
    case RowKind::kPumpFlow:
      return fmt::format("flow of pump {}", machine.pumps[i].name);
    case RowKind::kValve:
      return fmt::format("flow through valve {}", machine.cylinders[i].name);
    case RowKind::kPumpPressure:
      return fmt::format("pressure of pump {}", machine.pumps[i].name);
    case RowKind::kTipLine:
      return "distance of the tip from its line";
    case RowKind::kTrust:
      return fmt::format("standard deviation of the pressure of {}", machine.cylinders[i].name);
  }
  return "path";
}

double CraneKnotModel::tip_line(const double* q, double* gradient, double* hessian, double factor) {
  // The row is the squared distance from the line in units of the tolerance.
  ChainGeometry& chain = tip_chain_;
  chain.update(model_->machine, q);
  const Tip& tip = model_->machine.tip;
  const Eigen::Vector3d p = chain.point(tip.joint, tip.xyz);
  const double scale = 1.0 / (problem_->tip_line->tolerance * problem_->tip_line->tolerance);
  Eigen::Vector3d off = p - line_start_;
  off -= line_direction_ * line_direction_.dot(off);
  if (gradient == nullptr && hessian == nullptr) return scale * off.squaredNorm();
  for (int k = 0; k < n_; ++k) {
    tip_jacobian_.col(k) = point_jacobian(chain, tip.joint, p, k);
    if (gradient != nullptr) gradient[k] = 2.0 * scale * off.dot(tip_jacobian_.col(k));
  }
  if (hessian != nullptr) {
    Eigen::Map<Eigen::MatrixXd> h(hessian, size(), size());
    for (int k = 0; k < n_; ++k) {
      for (int i = 0; i <= k; ++i) {
        const Eigen::Vector3d a = tip_jacobian_.col(i), b = tip_jacobian_.col(k);
        const double inner = a.dot(b) - a.dot(line_direction_) * b.dot(line_direction_);
        const double bend = k <= tip.joint ? off.dot(point_hessian(chain, i, b)) : 0.0;
        const double value = factor * 2.0 * scale * (inner + bend);
        h(i, k) += value;
        if (i != k) h(k, i) += value;
      }
    }
  }
  return scale * off.squaredNorm();
}

double CraneKnotModel::pump_flow_row(int pump, double* gradient) const {
  double sum = 0.0;
  for (const int c : model_->machine.pumps[static_cast<std::size_t>(pump)].feeds) {
    const SmoothPower::Flow f = power_.flow(c, speed_[c], mode_[static_cast<std::size_t>(c)]);
    sum += f.q;
    if (gradient == nullptr) continue;
    const int j = model_->machine.cylinders[static_cast<std::size_t>(c)].joint;
    gradient[j] += f.d1 * jacobian_(c, j) / kFlowUnit;
    gradient[n_ + j] += f.d1 * jacobian_(c, n_ + j) / kFlowUnit;
  }
  return sum / kFlowUnit;
}

double CraneKnotModel::valve_row(int cylinder, double* gradient) const {
  if (gradient != nullptr) {
    const int j = model_->machine.cylinders[static_cast<std::size_t>(cylinder)].joint;
    gradient[j] = jacobian_(cylinder, j);
    gradient[n_ + j] = jacobian_(cylinder, n_ + j);
  }
  return speed_[cylinder];
}

double CraneKnotModel::pump_pressure_row(int pump, double* gradient) {
  if (effects_) {
    const Jet& pressure = effects_->pump_pressure(pump);
    if (gradient != nullptr) add_jet(pressure, 1.0 / kPressureUnit, gradient, nullptr);
    return pressure.value / kPressureUnit;
  }
  if (gradient != nullptr) {
    scratch_gradient_.setZero();
    power_.add_pressure_gradient(pump, 1.0 / kPressureUnit, scratch_gradient_.data());
    chain_gradient(scratch_gradient_.data(), gradient);
  }
  return power_.pump_pressure(pump) / kPressureUnit;
}

double CraneKnotModel::trust_row(int cylinder, double* gradient) {
  const GpDerivatives d = trust(cylinder);
  if (gradient != nullptr) {
    scratch_gradient_.setZero();
    scratch_gradient_[cylinder] = d.d_flow;
    scratch_gradient_[m_ + cylinder] = d.d_force;
    chain_gradient(scratch_gradient_.data(), gradient);
  }
  return d.value;
}

double CraneKnotModel::path_row(const Row& row, const double* z, double* gradient) {
  switch (row.kind) {
    case RowKind::kPumpFlow:
      return pump_flow_row(row.index, gradient);
    case RowKind::kValve:
      return valve_row(row.index, gradient);
    case RowKind::kPumpPressure:
      return pump_pressure_row(row.index, gradient);
    case RowKind::kTipLine:
      return tip_line(z, gradient, nullptr, 1.0);
    case RowKind::kTrust:
      return trust_row(row.index, gradient);
  }
  return 0.0;
}

void CraneKnotModel::clearance_rows(const double* z, double* g, double* jacobian) {
  if (clearance_rows_ == 0) return;
  if (jacobian == nullptr) {
    clearance_->values(z, all_clearance_.data());
  } else {
    clearance_->jacobian(z, all_clearance_.data(), all_clearance_jacobian_.data());
  }
  double* out = jacobian;
  for (std::size_t r = 0; r < near_rows_.size(); ++r) {
    g[r] = all_clearance_[near_rows_[r]];
    if (out == nullptr) continue;
    for (int k = 0; k < n_; ++k) out[k] = all_clearance_jacobian_(near_rows_[r], k);
    std::fill(out + n_, out + size(), 0.0);
    out += size();
  }
}

void CraneKnotModel::path_all(const double* z, double* g, double* jacobian) {
  const bool forces = options_.limit_pressure && !effects_;
  if (options_.limit_pressure && effects_) update_effects(z, jacobian != nullptr);
  update(z, jacobian != nullptr ? 1 : 0, forces || trusts_);
  if (forces) {
    if (jacobian != nullptr) {
      power_.derivatives(speed_.data(), force_.data(), mode_.data());
    } else {
      power_.value(speed_.data(), force_.data(), mode_.data());
    }
  }
  double* out = jacobian;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (out != nullptr) std::fill(out, out + size(), 0.0);
    g[r] = path_row(rows_[r], z, out);
    if (out != nullptr) out += size();
  }
  clearance_rows(z, g + rows_.size(), out);
}

void CraneKnotModel::path(const double* z, double* g) { path_all(z, g, nullptr); }

void CraneKnotModel::path_jacobian(const double* z, double* g, double* jacobian) {
  path_all(z, g, jacobian);
}

void CraneKnotModel::add_path_hessian(const double* z, const double* multiplier, double* hessian) {
  const bool forces = options_.limit_pressure && !effects_;
  if (options_.limit_pressure && effects_) update_effects(z, true);
  update(z, forces || trusts_ ? 2 : 1, forces || trusts_);
  scratch_gradient_.setZero();
  scratch_hessian_.setZero();
  if (forces) power_.derivatives(speed_.data(), force_.data(), mode_.data());
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    const double factor = multiplier[r];
    if (factor == 0.0) continue;
    switch (row.kind) {
      case RowKind::kPumpFlow:
        for (const int c : model_->machine.pumps[static_cast<std::size_t>(row.index)].feeds) {
          const SmoothPower::Flow f = power_.flow(c, speed_[c], mode_[static_cast<std::size_t>(c)]);
          scratch_gradient_[c] += factor * f.d1 / kFlowUnit;
          scratch_hessian_(c, c) += factor * f.d2 / kFlowUnit;
        }
        break;
      case RowKind::kValve:
        scratch_gradient_[row.index] += factor;
        break;
      case RowKind::kPumpPressure:
        if (effects_) {
          add_jet(effects_->pump_pressure(row.index), factor / kPressureUnit, nullptr, hessian);
          break;
        }
        power_.add_pressure_gradient(row.index, factor / kPressureUnit, scratch_gradient_.data());
        power_.add_pressure_hessian(row.index, factor / kPressureUnit, scratch_hessian_);
        break;
      case RowKind::kTipLine:
        break;
      case RowKind::kTrust: {
        const GpDerivatives d = trust(row.index);
        const int v = row.index, f = m_ + row.index;
        scratch_gradient_[v] += factor * d.d_flow;
        scratch_gradient_[f] += factor * d.d_force;
        scratch_hessian_(v, v) += factor * d.d_flow_flow;
        scratch_hessian_(f, f) += factor * d.d_force_force;
        scratch_hessian_(v, f) += factor * d.d_flow_force;
        scratch_hessian_(f, v) += factor * d.d_flow_force;
        break;
      }
    }
  }
  chain_hessian(z, scratch_gradient_.data(), scratch_hessian_, hessian);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (rows_[r].kind == RowKind::kTipLine) tip_line(z, nullptr, hessian, multiplier[r]);
  }
  if (clearance_rows_ > 0) {
    outer_.setZero();
    for (std::size_t r = 0; r < near_rows_.size(); ++r) {
      all_multipliers_[near_rows_[r]] = multiplier[rows_.size() + r];
    }
    clearance_->add_hessian(z, all_multipliers_.data(), outer_.data());
    Eigen::Map<Eigen::MatrixXd> h(hessian, size(), size());
    h.topLeftCorner(n_, n_) += Eigen::Map<Eigen::MatrixXd>(outer_.data(), n_, n_);
  }
}

}  // namespace sparflow
