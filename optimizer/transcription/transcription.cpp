#include "optimizer/transcription/transcription.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "models/math/error.h"

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool same_point(const VectorXd& known, const double* x) {
  return std::memcmp(known.data(), x, sizeof(double) * static_cast<std::size_t>(known.size())) == 0;
}

}  // namespace

Transcription::Transcription(TranscriptionSpec spec)
    : spec_(std::move(spec)),
      n_(spec_.knot ? spec_.knot->joint_count() : 0),
      knots_(static_cast<int>(spec_.t.size())),
      intervals_(knots_ - 1),
      phase_count_(spec_.phases.count()),
      z_size_(spec_.knot ? spec_.knot->size() : 0),
      path_count_(spec_.knot ? spec_.knot->path_count() : 0),
      with_acceleration_(spec_.knot && spec_.knot->uses_acceleration()) {
  SPARFLOW_CHECK(n_ >= 1 && intervals_ >= 1, "a transcription needs a model and two knots");
  step_ = spec_.t.tail(intervals_) - spec_.t.head(intervals_);
  SPARFLOW_CHECK((step_.array() > 0.0).all(), "knots must increase in time");
  const TranscriptionBounds& b = spec_.bounds;
  for (const MatrixXd* m : {&b.q_lower, &b.q_upper, &b.qd_lower, &b.qd_upper}) {
    SPARFLOW_CHECK(m->rows() == knots_ && m->cols() == n_, "bounds of q and qd are (N+1) x n");
  }
  for (const MatrixXd* m : {&b.qdd_lower, &b.qdd_upper}) {
    SPARFLOW_CHECK(m->rows() == intervals_ && m->cols() == n_, "bounds of qdd are N x n");
  }
  if (spec_.acceleration_weight.size() == 0) spec_.acceleration_weight = VectorXd::Zero(n_);
  SPARFLOW_CHECK(spec_.acceleration_weight.size() == n_,
                 "there is one acceleration weight for each joint");

  check_phases();
  if (phase_count_ > 0) {
    VectorXd tau = VectorXd::Zero(phase_count_);
    for (int k = 0; k < intervals_; ++k) tau[phase(k)] += step_[k];
    share_.resize(intervals_);
    for (int k = 0; k < intervals_; ++k) share_[k] = step_[k] / tau[phase(k)];
  }
  interval_rows_ = spec_.interval ? spec_.interval->count() : 0;
  make_points();
  make_nodes();
  make_defects();
  make_jacobian();
  make_hessian();

  const int x_size = tau_index(phase_count_);
  VectorXd lower(x_size), upper(x_size), g_lower(row_count_), g_upper(row_count_);
  bounds(lower, upper, g_lower, g_upper);
  start_ = (0.5 * (lower + upper)).unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
  // NaN equals no point, so nothing is known yet.
  value_x_ = derivative_x_ = VectorXd::Constant(x_size, std::nan(""));
  cost_gradient_.resize(x_size);
  const auto z = static_cast<std::size_t>(z_size_);
  node_cost_hessian_.resize(nodes_.size() * z * z);
  node_cost_.resize(nodes_.size());
  node_cost_gradient_.resize(nodes_.size() * z);
  block_.resize(z * z);
  terminal_block_.resize(static_cast<std::size_t>(n_ * n_));
  interval_block_.resize(static_cast<std::size_t>(2 * n_ * n_));
  interval_jacobian_value_.resize(interval_rows_ * 3 * n_);
  z_.resize(z_size_);
  path_multiplier_.resize(path_count_);
  path_value_.resize(nodes_.size() * static_cast<std::size_t>(path_count_));
  path_jacobian_.resize(path_value_.size() * z);
  for (const Point& p : points_) {
    if (p.count * n_ > terminal_jacobian_value_.size())
      terminal_jacobian_value_.resize(p.count * n_);
  }
}

void Transcription::gather(const Node& node, const double* x, double* z) const {
  const std::size_t bytes = sizeof(double) * static_cast<std::size_t>(n_);
  std::memcpy(z, x + q_index(node.knot, 0), bytes);
  std::memcpy(z + n_, x + qd_index(node.knot, 0), bytes);
  if (with_acceleration_) std::memcpy(z + 2 * n_, x + qdd_index(node.interval, 0), bytes);
  spec_.knot->begin_node(node.knot, node.law);
}

double Transcription::weight(const Node& node, const double* x) const {
  return 0.5 * ((node.before >= 0 ? step(x, node.before) : 0.0) +
                (node.after >= 0 ? step(x, node.after) : 0.0));
}

double Transcription::acceleration_factor(const double* x, int interval, int joint) const {
  const double w = spec_.acceleration_weight[joint];
  return spec_.acceleration_weight_times_step ? w * step(x, interval) : w;
}

double Transcription::acceleration_cost(const double* x) const {
  double sum = 0.0;
  for (int k = 0; k < intervals_; ++k) {
    for (int i = 0; i < n_; ++i) {
      const double qdd = x[qdd_index(k, i)];
      sum += acceleration_factor(x, k, i) * qdd * qdd;
    }
  }
  return sum;
}

/// Evaluates cost and path constraints node by node, so that a model can share the work: a line search always needs both.
void Transcription::update_values(const double* x) {
  if (same_point(value_x_, x)) return;
  double total = 0.0;
  double* path = path_value_.data();
  for (const Node& node : nodes_) {
    gather(node, x, z_.data());
    total += weight(node, x) * spec_.knot->cost(z_.data());
    if (!rows_of(node).empty()) spec_.knot->path(z_.data(), path);
    path += path_count_;
  }
  cost_ = total;
  std::memcpy(value_x_.data(), x, sizeof(double) * static_cast<std::size_t>(value_x_.size()));
}

/// Evaluates values and first derivatives of both and the Hessian of the cost.
void Transcription::update_derivatives(const double* x) {
  if (same_point(derivative_x_, x)) return;
  double total = 0.0;
  cost_gradient_.setZero();
  double* hessian = node_cost_hessian_.data();
  double* path = path_value_.data();
  double* jacobian = path_jacobian_.data();
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    const Node& node = nodes_[s];
    gather(node, x, z_.data());
    const double h = weight(node, x);
    double* z_gradient = node_cost_gradient_.data() + s * static_cast<std::size_t>(z_size_);
    node_cost_[s] = spec_.knot->cost_derivatives(z_.data(), z_gradient, hessian);
    total += h * node_cost_[s];
    for (int i = 0; i < z_size_; ++i) cost_gradient_[global_index(node, i)] += h * z_gradient[i];
    if (!rows_of(node).empty()) spec_.knot->path_jacobian(z_.data(), path, jacobian);
    hessian += z_size_ * z_size_;
    path += path_count_;
    jacobian += path_count_ * z_size_;
  }
  cost_ = total;
  const std::size_t bytes = sizeof(double) * static_cast<std::size_t>(value_x_.size());
  std::memcpy(value_x_.data(), x, bytes);
  std::memcpy(derivative_x_.data(), x, bytes);
}

double Transcription::objective(In x) {
  update_values(x.data());
  const double time = phase_count_ > 0 ? x.tail(phase_count_).sum() : 0.0;
  return cost_ + acceleration_cost(x.data()) + spec_.phases.price * time;
}

double Transcription::model_cost(const VectorXd& x) {
  update_values(x.data());
  return cost_;
}

void Transcription::gradient(In x, Out gradient) {
  update_derivatives(x.data());
  gradient = cost_gradient_;
  for (int k = 0; k < intervals_; ++k) {
    for (int i = 0; i < n_; ++i) {
      const int at = qdd_index(k, i);
      gradient[at] += 2.0 * acceleration_factor(x.data(), k, i) * x[at];
    }
  }
  if (phase_count_ > 0) time_gradient(x.data(), gradient);
}

void Transcription::constraints(In x, Out g) {
  int row = 0;
  for (const Defect& d : defects_) {
    const int k = d.interval, i = d.joint;
    const double qd0 = x[qd_index(k, i)], qd1 = x[qd_index(k + 1, i)];
    const double h = step(x.data(), k);
    g[row++] = d.velocity ? qd1 - qd0 - h * x[qdd_index(k, i)]
                          : x[q_index(k + 1, i)] - x[q_index(k, i)] - 0.5 * h * (qd0 + qd1);
  }
  for (const Point& p : points_) {
    p.model->value(x.data() + q_index(p.knot, 0), g.data() + p.row);
  }
  for (int k = 0; k < intervals_ && interval_rows_ > 0; ++k)
    spec_.interval->value(k, ends(x.data(), k),
                          g.data() + first_interval_row_ + k * interval_rows_);
  if (total_time_row_ >= 0) g[total_time_row_] = x.tail(phase_count_).sum();
  if (path_count_ == 0) return;
  update_values(x.data());
  const double* path = path_value_.data();
  for (const Node& node : nodes_) {
    int at = node.first_row;
    for (int path_row : rows_of(node)) g[at++] = path[path_row];
    path += path_count_;
  }
}

void Transcription::jacobian(In x, Out value) {
  value = jacobian_constant_;
  if (phase_count_ > 0) {
    int at = 0;
    for (const Defect& d : defects_) {
      const int k = d.interval, i = d.joint;
      const double h = step(x.data(), k);
      if (d.velocity) {
        value[at + 2] = -h;
        value[at + 3] = -share_[k] * x[qdd_index(k, i)];
        at += 4;
      } else {
        value[at + 2] = value[at + 3] = -0.5 * h;
        value[at + 4] = -0.5 * share_[k] * (x[qd_index(k, i)] + x[qd_index(k + 1, i)]);
        at += 5;
      }
    }
  }
  for (const Point& p : points_) {
    p.model->jacobian(x.data() + q_index(p.knot, 0), terminal_jacobian_value_.data());
    value.segment(p.jacobian, p.count * n_) = terminal_jacobian_value_.head(p.count * n_);
  }
  for (int k = 0; k < intervals_ && interval_rows_ > 0; ++k) {
    const Eigen::Index size = interval_jacobian_value_.size();
    spec_.interval->jacobian(k, ends(x.data(), k), interval_jacobian_value_.data());
    value.segment(first_interval_jacobian_ + k * size, size) = interval_jacobian_value_;
  }
  if (path_count_ == 0) return;
  update_derivatives(x.data());
  const double* block = path_jacobian_.data();
  int at = first_path_jacobian_;
  for (const Node& node : nodes_) {
    for (int path_row : rows_of(node)) {
      const double* line = block + path_row * z_size_;
      for (int local : row_columns_[static_cast<std::size_t>(path_row)]) value[at++] = line[local];
    }
    block += path_count_ * z_size_;
  }
}

void Transcription::hessian(In x, double objective_factor, In multiplier, Out value) {
  if (objective_factor != 0.0) update_derivatives(x.data());
  value.setZero();
  const std::size_t block = static_cast<std::size_t>(z_size_ * z_size_);
  const int* place = node_hessian_.data();
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    const Node& node = nodes_[s];
    const double* cost = node_cost_hessian_.data() + s * block;
    const double factor = objective_factor * weight(node, x.data());
    if (factor !=
        0.0) {  // in the restoration phase it is zero: only the constraints' part is needed
      for (std::size_t i = 0; i < block; ++i) block_[i] = factor * cost[i];
    } else {
      std::fill(block_.begin(), block_.end(), 0.0);
    }
    if (path_count_ > 0) {
      const std::vector<int>& rows = rows_of(node);
      path_multiplier_.setZero();
      bool any = false;
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const double m = multiplier[node.first_row + static_cast<int>(r)];
        path_multiplier_[rows[r]] = m;
        any = any || m != 0.0;
      }
      if (any) {
        gather(node, x.data(), z_.data());
        spec_.knot->add_path_hessian(z_.data(), path_multiplier_.data(), block_.data());
      }
    }
    for (int c = 0; c < z_size_; ++c) {
      for (int r = c; r < z_size_; ++r) {
        value[*place++] += block_[static_cast<std::size_t>(c * z_size_ + r)];
      }
    }
  }
  for (const Point& p : points_) {
    std::fill(terminal_block_.begin(), terminal_block_.end(), 0.0);
    p.model->add_hessian(x.data() + q_index(p.knot, 0), multiplier.data() + p.row,
                         terminal_block_.data());
    const int* at = p.hessian.data();
    for (int c = 0; c < n_; ++c) {
      for (int r = c; r < n_; ++r) {
        value[*at++] += terminal_block_[static_cast<std::size_t>(c * n_ + r)];
      }
    }
  }
  add_interval_hessian(x.data(), multiplier.data(), value);
  for (std::size_t i = 0; i < acceleration_hessian_.size(); ++i) {
    const int k = static_cast<int>(i) / n_, joint = static_cast<int>(i) % n_;
    value[acceleration_hessian_[i]] +=
        2.0 * objective_factor * acceleration_factor(x.data(), k, joint);
  }
  if (phase_count_ > 0) time_hessian(x.data(), objective_factor, multiplier.data(), value);
}

void Transcription::add_interval_hessian(const double* x, const double* multiplier, Out value) {
  const int* at = interval_hessian_.data();
  const std::size_t end = static_cast<std::size_t>(n_ * n_);
  for (int k = 0; k < intervals_ && interval_rows_ > 0; ++k) {
    std::fill(interval_block_.begin(), interval_block_.end(), 0.0);
    spec_.interval->add_hessian(k, ends(x, k),
                                multiplier + first_interval_row_ + k * interval_rows_,
                                interval_block_.data(), interval_block_.data() + end);
    for (std::size_t side = 0; side < 2; ++side) {
      const double* block = interval_block_.data() + side * end;
      for (int c = 0; c < n_; ++c) {
        for (int r = c; r < n_; ++r) value[*at++] += block[c * n_ + r];
      }
    }
  }
}

}  // namespace sparflow
