// The fixed structure of a transcription: indices of nodes, rows and derivatives, computed once.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "models/math/error.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void Transcription::make_points() {
  const auto add = [&](int knot, TerminalModel* model) {
    points_.push_back({knot, model, model->count(), 0, 0, {}});
    terminal_count_ += model->count();
  };
  if (spec_.terminal) add(intervals_, spec_.terminal.get());
  for (const Waypoint& w : spec_.waypoints) {
    SPARFLOW_CHECK(w.model && w.knot >= 0 && w.knot <= intervals_, "a waypoint is at a knot");
    add(w.knot, w.model.get());
  }
}

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
  make_row_sets();
}

/// Gives every node its path rows; nodes with equal rows share a list.
void Transcription::make_row_sets() {
  place_nodes();
  for (Node& node : nodes_) {
    std::vector<int> rows;
    for (const int row : node.all_rows ? all_rows_ : acceleration_rows_) {
      if (spec_.knot->path_imposed_at(row, node.knot)) rows.push_back(row);
    }
    const auto known = std::find(row_sets_.begin(), row_sets_.end(), rows);
    node.rows = static_cast<int>(known - row_sets_.begin());
    if (known == row_sets_.end()) row_sets_.push_back(std::move(rows));
  }
}

void Transcription::place_nodes() {
  if (!with_acceleration_) {
    for (int k = 0; k < knots_; ++k) {
      const int after = k < intervals_ ? k : -1;
      if (k > 0 && k < intervals_ && spec_.knot->split_at(k)) {
        nodes_.push_back({k, -1, k - 1, -1, 0, k - 1, true});
        nodes_.push_back({k, -1, -1, k, 0, k, false});
        continue;
      }
      nodes_.push_back({k, -1, k - 1, after, 0, std::min(k, intervals_ - 1), true});
    }
    return;
  }
  // Rows without acceleration belong to the interval that begins at the knot; those of the last knot to the last interval.
  for (int k = 0; k < intervals_; ++k) {
    nodes_.push_back({k, k, -1, k, 0, k, true});
    nodes_.push_back({k + 1, k, k, -1, 0, k, k + 1 == intervals_});
  }
}

const std::vector<int>& Transcription::rows_of(const Node& node) const {
  return row_sets_[static_cast<std::size_t>(node.rows)];
}

/// Leaves out a defect that holds and all of whose variables are fixed: its empty row would make the KKT matrix singular
/// and count against the degrees of freedom (a joint at rest over a phase has one in each interval). A defect that does
/// not hold stays, so that the solver reports the contradiction.
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
        // With free times a defect is left out only if it holds for every step.
        const double moving = velocity ? b.qdd_lower(k, i) : std::max(std::abs(qd0), std::abs(qd1));
        if (phase_count_ > 0 && moving != 0.0) all_fixed = false;
        /// Residual, as share of its terms, up to which a defect holds for every value.
        /// @threshold [1] 1e-16..1e-10; numerical: some 50 units in the last place of the terms
        constexpr double kRounding = 1e-14;
        if (all_fixed && std::abs(residual) <= kRounding * scale) continue;
        defects_.push_back({k, i, velocity});
      }
    }
  }
  terminal_row_ = static_cast<int>(defects_.size());
  row_count_ = terminal_row_;
  for (Point& p : points_) {
    p.row = row_count_;
    row_count_ += p.count;
  }
  first_interval_row_ = row_count_;
  row_count_ += intervals_ * interval_rows_;
  for (Node& node : nodes_) {
    node.first_row = row_count_;
    row_count_ += static_cast<int>(rows_of(node).size());
  }
  const PhaseTimes& times = spec_.phases;
  if (phase_count_ > 0 && (times.total_lower > 0.0 || std::isfinite(times.total_upper)))
    total_time_row_ = row_count_++;
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
      if (phase_count_ > 0) add(row, tau_index(phase(k)), 0.0);
    } else {
      add(row, q_index(k, i), -1.0);
      add(row, q_index(k + 1, i), 1.0);
      add(row, qd_index(k, i), -0.5 * h);
      add(row, qd_index(k + 1, i), -0.5 * h);
      if (phase_count_ > 0) add(row, tau_index(phase(k)), 0.0);
    }
  }
  for (Point& p : points_) {
    p.jacobian = static_cast<int>(constant.size());
    for (int r = 0; r < p.count; ++r) {
      for (int i = 0; i < n_; ++i) add(p.row + r, q_index(p.knot, i), 0.0);
    }
  }
  first_interval_jacobian_ = static_cast<int>(constant.size());
  for (int k = 0; k < intervals_; ++k) {
    for (int r = 0; r < interval_rows_; ++r) {
      const int row = first_interval_row_ + k * interval_rows_ + r;
      for (int i = 0; i < n_; ++i) add(row, q_index(k, i), 0.0);
      for (int i = 0; i < n_; ++i) add(row, q_index(k + 1, i), 0.0);
      for (int i = 0; i < n_; ++i) add(row, qdd_index(k, i), 0.0);
    }
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
  for (int p = 0; p < phase_count_ && total_time_row_ >= 0; ++p) {
    add(total_time_row_, tau_index(p), 1.0);
  }
  jacobian_constant_ = Eigen::Map<VectorXd>(constant.data(), static_cast<int>(constant.size()));
}

void Transcription::make_hessian() {
  // Two nodes can share the block of a knot or of a qdd, but each entry of the lower triangle has one value.
  std::unordered_map<long, int> known;
  const long width = tau_index(phase_count_);
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
  for (Point& p : points_) {
    for (int c = 0; c < n_; ++c) {
      for (int r = c; r < n_; ++r)
        p.hessian.push_back(place(q_index(p.knot, r), q_index(p.knot, c)));
    }
  }
  for (int k = 0; k < intervals_ && interval_rows_ > 0; ++k) {
    for (const int knot : {k, k + 1}) {
      for (int c = 0; c < n_; ++c) {
        for (int r = c; r < n_; ++r)
          interval_hessian_.push_back(place(q_index(knot, r), q_index(knot, c)));
      }
    }
  }
  for (int k = 0; k < intervals_; ++k) {
    for (int i = 0; i < n_; ++i) {
      acceleration_hessian_.push_back(place(qdd_index(k, i), qdd_index(k, i)));
    }
  }
  if (phase_count_ == 0) return;
  for (const Node& node : nodes_) {
    for (const int side : {node.before, node.after}) {
      for (int i = 0; i < z_size_ && side >= 0; ++i)
        time_node_hessian_.push_back(place(tau_index(phase(side)), global_index(node, i)));
    }
  }
  for (const auto [k, i, velocity] : defects_) {
    const int tau = tau_index(phase(k));
    if (velocity) {
      time_defect_hessian_.push_back(place(tau, qdd_index(k, i)));
    } else {
      time_defect_hessian_.push_back(place(tau, qd_index(k, i)));
      time_defect_hessian_.push_back(place(tau, qd_index(k + 1, i)));
    }
  }
  for (int k = 0; k < intervals_ && spec_.acceleration_weight_times_step; ++k) {
    for (int i = 0; i < n_; ++i)
      time_acceleration_hessian_.push_back(place(tau_index(phase(k)), qdd_index(k, i)));
  }
}

NlpSize Transcription::size() const {
  return {tau_index(phase_count_), row_count_, static_cast<int>(jacobian_row_.size()),
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
  if (phase_count_ > 0) {
    x_lower.tail(phase_count_) = spec_.phases.lower;
    x_upper.tail(phase_count_) = spec_.phases.upper;
  }
  g_lower.head(terminal_row_).setZero();
  g_upper.head(terminal_row_).setZero();
  for (const Point& p : points_) p.model->bounds(g_lower.data() + p.row, g_upper.data() + p.row);
  g_lower.segment(first_interval_row_, intervals_ * interval_rows_).setZero();
  g_upper.segment(first_interval_row_, intervals_ * interval_rows_).setZero();
  if (total_time_row_ >= 0) {
    g_lower[total_time_row_] = spec_.phases.total_lower;
    g_upper[total_time_row_] = spec_.phases.total_upper;
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
  if (index >= tau_index(0)) return fmt::format("duration of phase {}", index - tau_index(0));
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
  if (index == total_time_row_) return "total duration";
  for (const Point& p : points_) {
    if (index >= p.row && index < p.row + p.count) return p.model->name(index - p.row);
  }
  const int interval_row = index - first_interval_row_;
  if (interval_row >= 0 && interval_row < intervals_ * interval_rows_) {
    return fmt::format("{} after t = {:.4g} s", spec_.interval->name(interval_row % interval_rows_),
                       spec_.t[interval_row / interval_rows_]);
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
