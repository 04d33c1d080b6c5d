// The fixed part of a transcription: who stands where, computed once.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "models/error.h"
#include "optimizer/transcription.h"

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void Transcription::make_nodes() {
  all_rows_.resize(static_cast<std::size_t>(path_count_));
  std::iota(all_rows_.begin(), all_rows_.end(), 0);
  for (int row : all_rows_) {
    const bool acceleration = with_acceleration_ && spec_.knot->path_uses_acceleration(row);
    if (acceleration) acceleration_rows_.push_back(row);
    std::vector<int> columns;
    for (int local = 0; local < z_size_; ++local) {
      const bool used = local < n_ || (local < 2 * n_ && spec_.knot->path_uses_velocity(row)) ||
                        (local >= 2 * n_ && acceleration);
      if (used) columns.push_back(local);
    }
    row_columns_.push_back(std::move(columns));
  }
  if (!with_acceleration_) {
    for (int k = 0; k < knots_; ++k) {
      const double before = k > 0 ? step_[k - 1] : 0.0;
      const double after = k < intervals_ ? step_[k] : 0.0;
      if (k > 0 && k < intervals_ && spec_.knot->split_at(k)) {
        nodes_.push_back({k, -1, 0.5 * before, 0, k - 1, true});
        nodes_.push_back({k, -1, 0.5 * after, 0, k, false});
        continue;
      }
      nodes_.push_back({k, -1, 0.5 * (before + after), 0, std::min(k, intervals_ - 1), true});
    }
    return;
  }
  // Rows without acceleration belong to the interval that begins at the knot; at the last knot, to the last one.
  for (int k = 0; k < intervals_; ++k) {
    nodes_.push_back({k, k, 0.5 * step_[k], 0, k, true});
    nodes_.push_back({k + 1, k, 0.5 * step_[k], 0, k, k + 1 == intervals_});
  }
}

const std::vector<int>& Transcription::rows_of(const Node& node) const {
  return node.all_rows ? all_rows_ : acceleration_rows_;
}

/// A defect all of whose variables are fixed and which holds anyway is left out: it would be an empty row that
/// makes the KKT matrix singular and counts against the degrees of freedom (a joint frozen over a phase has
/// one an interval). One that does not hold stays, and the solver reports the contradiction.
void Transcription::make_defects() {
  const TranscriptionBounds& b = spec_.bounds;
  const auto fixed = [](const MatrixXd& lower, const MatrixXd& upper, int row, int column) {
    return lower(row, column) == upper(row, column);
  };
  for (const bool velocity : {false, true}) {
    for (int k = 0; k < intervals_; ++k) {
      for (int i = 0; i < n_; ++i) {
        const double qd0 = b.qd_lower(k, i), qd1 = b.qd_lower(k + 1, i);
        bool all_fixed =
            fixed(b.qd_lower, b.qd_upper, k, i) && fixed(b.qd_lower, b.qd_upper, k + 1, i);
        double residual = 0.0, scale = 0.0;
        if (velocity) {
          all_fixed = all_fixed && fixed(b.qdd_lower, b.qdd_upper, k, i);
          residual = qd1 - qd0 - step_[k] * b.qdd_lower(k, i);
          scale = std::abs(qd0) + std::abs(qd1);
        } else {
          all_fixed = all_fixed && fixed(b.q_lower, b.q_upper, k, i) &&
                      fixed(b.q_lower, b.q_upper, k + 1, i);
          const double q0 = b.q_lower(k, i), q1 = b.q_lower(k + 1, i);
          residual = q1 - q0 - 0.5 * step_[k] * (qd0 + qd1);
          scale = std::abs(q0) + std::abs(q1);
        }
        constexpr double kRounding = 1e-14;  // some 50 units in the last place of the terms
        if (all_fixed && std::abs(residual) <= kRounding * scale) continue;
        defects_.push_back({k, i, velocity});
      }
    }
  }
  terminal_row_ = static_cast<int>(defects_.size());
  row_count_ = terminal_row_ + terminal_count_;
  for (Node& node : nodes_) {
    node.first_row = row_count_;
    row_count_ += static_cast<int>(rows_of(node).size());
  }
}

int Transcription::global_index(const Node& node, int local) const {
  if (local < n_) return q_index(node.knot, local);
  if (local < 2 * n_) return qd_index(node.knot, local - n_);
  return qdd_index(node.interval, local - 2 * n_);
}

void Transcription::make_jacobian() {
  std::vector<double> constant;
  const auto add = [&](int row, int column, double value) {
    jacobian_row_.push_back(row);
    jacobian_column_.push_back(column);
    constant.push_back(value);
  };
  for (int row = 0; row < terminal_row_; ++row) {
    const auto [k, i, velocity] = defects_[static_cast<std::size_t>(row)];
    const double h = step_[k];
    if (velocity) {
      add(row, qd_index(k, i), -1.0);
      add(row, qd_index(k + 1, i), 1.0);
      add(row, qdd_index(k, i), -h);
    } else {
      add(row, q_index(k, i), -1.0);
      add(row, q_index(k + 1, i), 1.0);
      add(row, qd_index(k, i), -0.5 * h);
      add(row, qd_index(k + 1, i), -0.5 * h);
    }
  }
  terminal_jacobian_ = static_cast<int>(constant.size());
  for (int r = 0; r < terminal_count_; ++r) {
    for (int i = 0; i < n_; ++i) add(terminal_row_ + r, q_index(intervals_, i), 0.0);
  }
  first_path_jacobian_ = static_cast<int>(constant.size());
  for (const Node& node : nodes_) {
    int row = node.first_row;
    for (int path_row : rows_of(node)) {
      for (int local : row_columns_[static_cast<std::size_t>(path_row)]) {
        add(row, global_index(node, local), 0.0);
      }
      ++row;
    }
  }
  jacobian_constant_ = Eigen::Map<VectorXd>(constant.data(), static_cast<int>(constant.size()));
}

void Transcription::make_hessian() {
  // Two nodes share a knot's block, or a qdd's: each place of the lower triangle has one value.
  std::unordered_map<long, int> known;
  const long width = static_cast<long>(n_) * (2 * knots_ + intervals_);
  const auto place = [&](int row, int column) {
    const auto [at, fresh] =
        known.try_emplace(row * width + column, static_cast<int>(hessian_row_.size()));
    if (fresh) {
      hessian_row_.push_back(row);
      hessian_column_.push_back(column);
    }
    return at->second;
  };
  for (const Node& node : nodes_) {
    for (int c = 0; c < z_size_; ++c) {
      // Local order is q, qd, qdd as in x, so local row >= column means global row >= column.
      for (int r = c; r < z_size_; ++r) {
        node_hessian_.push_back(place(global_index(node, r), global_index(node, c)));
      }
    }
  }
  for (int c = 0; c < n_ && terminal_count_ > 0; ++c) {
    for (int r = c; r < n_; ++r) {
      terminal_hessian_.push_back(place(q_index(intervals_, r), q_index(intervals_, c)));
    }
  }
  for (int k = 0; k < intervals_; ++k) {
    for (int i = 0; i < n_; ++i) {
      acceleration_hessian_.push_back(place(qdd_index(k, i), qdd_index(k, i)));
    }
  }
}

NlpSize Transcription::size() const {
  return {n_ * (2 * knots_ + intervals_), row_count_, static_cast<int>(jacobian_row_.size()),
          static_cast<int>(hessian_row_.size())};
}

void Transcription::jacobian_structure(OutIndex row, OutIndex column) const {
  std::copy(jacobian_row_.begin(), jacobian_row_.end(), row.begin());
  std::copy(jacobian_column_.begin(), jacobian_column_.end(), column.begin());
}

void Transcription::hessian_structure(OutIndex row, OutIndex column) const {
  std::copy(hessian_row_.begin(), hessian_row_.end(), row.begin());
  std::copy(hessian_column_.begin(), hessian_column_.end(), column.begin());
}

void Transcription::bounds(Out x_lower, Out x_upper, Out g_lower, Out g_upper) const {
  const TranscriptionBounds& b = spec_.bounds;
  const int q = q_index(0, 0), qd = qd_index(0, 0), qdd = qdd_index(0, 0);
  const auto lay = [&](Out x, int at, const MatrixXd& m) {
    Eigen::Map<MatrixXd>(x.data() + at, n_, m.rows()) = m.transpose();
  };
  lay(x_lower, q, b.q_lower);
  lay(x_upper, q, b.q_upper);
  lay(x_lower, qd, b.qd_lower);
  lay(x_upper, qd, b.qd_upper);
  lay(x_lower, qdd, b.qdd_lower);
  lay(x_upper, qdd, b.qdd_upper);
  g_lower.head(terminal_row_).setZero();
  g_upper.head(terminal_row_).setZero();
  if (terminal_count_ > 0) {
    spec_.terminal->bounds(g_lower.data() + terminal_row_, g_upper.data() + terminal_row_);
  }
  if (path_count_ == 0) return;
  VectorXd lower(path_count_), upper(path_count_);
  spec_.knot->path_bounds(lower.data(), upper.data());
  for (const Node& node : nodes_) {
    int row = node.first_row;
    for (int path_row : rows_of(node)) {
      g_lower[row] = lower[path_row];
      g_upper[row] = upper[path_row];
      ++row;
    }
  }
}

std::string Transcription::joint_name(int joint) const {
  return joint < static_cast<int>(spec_.joint_names.size())
             ? spec_.joint_names[static_cast<std::size_t>(joint)]
             : fmt::format("joint {}", joint);
}

std::string Transcription::variable_name(int index) const {
  const int instant = index / n_;
  const std::string joint = joint_name(index % n_);
  if (instant < knots_) return fmt::format("q[{}] at t = {:.4g} s", joint, spec_.t[instant]);
  if (instant < 2 * knots_) {
    return fmt::format("qd[{}] at t = {:.4g} s", joint, spec_.t[instant - knots_]);
  }
  return fmt::format("qdd[{}] after t = {:.4g} s", joint, spec_.t[instant - 2 * knots_]);
}

std::string Transcription::constraint_name(int index) const {
  if (index < terminal_row_) {
    const Defect& d = defects_[static_cast<std::size_t>(index)];
    return fmt::format("{} defect of {} after t = {:.4g} s", d.velocity ? "velocity" : "position",
                       joint_name(d.joint), spec_.t[d.interval]);
  }
  if (index < terminal_row_ + terminal_count_) {
    return spec_.terminal->name(index - terminal_row_);
  }
  for (const Node& node : nodes_) {
    const std::vector<int>& rows = rows_of(node);
    const int offset = index - node.first_row;
    if (offset < 0 || offset >= static_cast<int>(rows.size())) continue;
    return fmt::format("{} at t = {:.4g} s",
                       spec_.knot->path_name(rows[static_cast<std::size_t>(offset)]),
                       spec_.t[node.knot]);
  }
  return fmt::format("g[{}]", index);
}

}  // namespace sparflow
