// Conversion between motions and the variables of a transcription: bounds, start values, multipliers.
#include <algorithm>
#include <cmath>

#include "models/math/error.h"
#include "optimizer/transcription/transcription.h"

namespace sparflow {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TranscriptionBounds TranscriptionBounds::uniform(int intervals, const Box& q, const Box& qd,
                                                 const Box& qdd) {
  const auto rows = [](const VectorXd& v, int count) -> MatrixXd {
    return v.transpose().replicate(count, 1);
  };
  return {rows(q.lower, intervals + 1),  rows(q.upper, intervals + 1),
          rows(qd.lower, intervals + 1), rows(qd.upper, intervals + 1),
          rows(qdd.lower, intervals),    rows(qdd.upper, intervals)};
}

void TranscriptionBounds::fix_q(int knot, const VectorXd& q) {
  q_lower.row(knot) = q_upper.row(knot) = q.transpose();
}

void TranscriptionBounds::fix_qd(int knot, const VectorXd& qd) {
  qd_lower.row(knot) = qd_upper.row(knot) = qd.transpose();
}

void TranscriptionBounds::rest_to_rest(const VectorXd& q_start) {
  fix_q(0, q_start);
  fix_qd(0, VectorXd::Zero(q_start.size()));
  fix_qd(static_cast<int>(qd_lower.rows()) - 1, VectorXd::Zero(q_start.size()));
}

void Transcription::set_start(const VectorXd& x) {
  SPARFLOW_CHECK(x.size() == start_.size(), "start values have another size than the problem");
  start_ = x;
}

void Transcription::set_start(const Trajectory& motion) {
  const VectorXd x = variables(motion);
  VectorXd lower(x.size()), upper(x.size()), g_lower(row_count_), g_upper(row_count_);
  bounds(lower, upper, g_lower, g_upper);
  start_ = x.cwiseMax(lower).cwiseMin(upper);
}

void Transcription::start(Out x) const { x = start_; }

const NlpMultipliers* Transcription::start_multipliers() const { return start_multipliers_.get(); }

VectorXd Transcription::variables(const Trajectory& motion) const {
  SPARFLOW_CHECK(motion.q.cols() == n_, "the motion has another number of joints");
  if (phase_count_ > 0 && motion.size() == knots_) return variables_on_mesh(motion);
  return variables_on_mesh(resampled(motion, spec_.t));
}

VectorXd Transcription::variables_on_mesh(const Trajectory& mine) const {
  VectorXd x(start_.size());
  Eigen::Map<MatrixXd>(x.data() + q_index(0, 0), n_, knots_) = mine.q.transpose();
  Eigen::Map<MatrixXd>(x.data() + qd_index(0, 0), n_, knots_) = mine.qd.transpose();
  Eigen::Map<MatrixXd>(x.data() + qdd_index(0, 0), n_, intervals_) =
      mine.qdd.topRows(intervals_).transpose();
  if (phase_count_ > 0) {
    x.tail(phase_count_).setZero();
    for (int k = 0; k < intervals_; ++k) x[tau_index(phase(k))] += mine.t[k + 1] - mine.t[k];
  }
  return x;
}

Trajectory Transcription::trajectory(const VectorXd& x) const {
  SPARFLOW_CHECK(x.size() == start_.size(), "x has another size than the problem");
  using ConstMap = Eigen::Map<const MatrixXd>;
  Trajectory motion;
  motion.t = spec_.t;
  for (int k = 0; k < intervals_ && phase_count_ > 0; ++k) {
    motion.t[k + 1] = motion.t[k] + step(x.data(), k);
  }
  motion.q = ConstMap(x.data() + q_index(0, 0), n_, knots_).transpose();
  motion.qd = ConstMap(x.data() + qd_index(0, 0), n_, knots_).transpose();
  motion.qdd.resize(knots_, n_);
  motion.qdd.topRows(intervals_) = ConstMap(x.data() + qdd_index(0, 0), n_, intervals_).transpose();
  motion.qdd.row(intervals_) = motion.qdd.row(intervals_ - 1);
  return motion;
}

TranscriptionMultipliers Transcription::multipliers(const NlpMultipliers& rows) const {
  SPARFLOW_CHECK(rows.constraint.size() == row_count_, "multipliers of another problem");
  TranscriptionMultipliers m;
  m.q_defect = MatrixXd::Zero(intervals_, n_);
  m.qd_defect = MatrixXd::Zero(intervals_, n_);
  for (int row = 0; row < terminal_row_; ++row) {
    const Defect& d = defects_[static_cast<std::size_t>(row)];
    (d.velocity ? m.qd_defect : m.q_defect)(d.interval, d.joint) = rows.constraint[row];
  }
  m.terminal = rows.constraint.segment(terminal_row_, terminal_count_);
  m.interval = Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(
      rows.constraint.data() + first_interval_row_, intervals_, interval_rows_);
  m.path = MatrixXd::Zero(static_cast<int>(nodes_.size()), path_count_);
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    int row = nodes_[s].first_row;
    for (int path_row : rows_of(nodes_[s])) {
      m.path(static_cast<int>(s), path_row) = rows.constraint[row++];
    }
  }
  m.lower = rows.lower;
  m.upper = rows.upper;
  if (total_time_row_ >= 0) m.total_time = rows.constraint[total_time_row_];
  return m;
}

void Transcription::set_start_multipliers(const TranscriptionMultipliers& m) {
  SPARFLOW_CHECK(m.q_defect.rows() == intervals_ && m.q_defect.cols() == n_ &&
                     m.qd_defect.rows() == intervals_ && m.qd_defect.cols() == n_ &&
                     m.terminal.size() == terminal_count_ &&
                     m.interval.size() == intervals_ * interval_rows_ &&
                     m.path.cols() == path_count_ &&
                     m.path.rows() == static_cast<int>(nodes_.size()) &&
                     m.lower.size() == start_.size() && m.upper.size() == start_.size(),
                 "multipliers of a transcription of another shape");
  auto rows = std::make_unique<NlpMultipliers>();
  rows->constraint.resize(row_count_);
  for (int row = 0; row < terminal_row_; ++row) {
    const Defect& d = defects_[static_cast<std::size_t>(row)];
    rows->constraint[row] = (d.velocity ? m.qd_defect : m.q_defect)(d.interval, d.joint);
  }
  rows->constraint.segment(terminal_row_, terminal_count_) = m.terminal;
  for (int k = 0; k < intervals_; ++k) {
    for (int r = 0; r < interval_rows_; ++r)
      rows->constraint[first_interval_row_ + k * interval_rows_ + r] = m.interval(k, r);
  }
  for (std::size_t s = 0; s < nodes_.size(); ++s) {
    int row = nodes_[s].first_row;
    for (int path_row : rows_of(nodes_[s])) {
      rows->constraint[row++] = m.path(static_cast<int>(s), path_row);
    }
  }
  if (total_time_row_ >= 0) rows->constraint[total_time_row_] = m.total_time;
  rows->lower = m.lower;
  rows->upper = m.upper;
  start_multipliers_ = std::move(rows);
}

Trajectory resampled(const Trajectory& motion, const VectorXd& t) {
  SPARFLOW_CHECK(motion.size() >= 1, "an empty motion cannot be sampled");
  const Eigen::Index last = motion.size() - 1, rows = t.size(), joints = motion.q.cols();
  Trajectory out{t, MatrixXd(rows, joints), MatrixXd(rows, joints), MatrixXd::Zero(rows, joints),
                 motion.stops};
  // A mesh over the whole motion may exceed it by a rounding error, which does not count as outside.
  const double slack = 1e-12 * (std::abs(motion.t[0]) + std::abs(motion.t[last]));
  for (Eigen::Index r = 0; r < rows; ++r) {
    if (t[r] < motion.t[0] - slack || t[r] > motion.t[last] + slack) {
      out.q.row(r) = motion.q.row(t[r] < motion.t[0] ? 0 : last);
      out.qd.row(r).setZero();
      continue;
    }
    const auto after = std::upper_bound(motion.t.begin(), motion.t.end(), t[r]);
    const Eigen::Index k = std::max<Eigen::Index>(after - motion.t.begin() - 1, 0);
    const double dt = t[r] - motion.t[k];
    out.q.row(r) = motion.q.row(k) + dt * motion.qd.row(k) + 0.5 * dt * dt * motion.qdd.row(k);
    out.qd.row(r) = motion.qd.row(k) + dt * motion.qdd.row(k);
  }
  for (Eigen::Index r = 0; r + 1 < rows; ++r) {
    out.qdd.row(r) = (out.qd.row(r + 1) - out.qd.row(r)) / (t[r + 1] - t[r]);
  }
  if (rows >= 2) out.qdd.row(rows - 1) = out.qdd.row(rows - 2);
  return out;
}

Trajectory with_duration(const Trajectory& motion, double duration) {
  SPARFLOW_CHECK(duration > 0.0 && motion.duration() > 0.0, "durations are positive");
  const double slower = duration / motion.duration();
  Trajectory out = motion;
  out.t = motion.t[0] + slower * (motion.t.array() - motion.t[0]);
  for (double& stop : out.stops) stop = motion.t[0] + slower * (stop - motion.t[0]);
  out.qd /= slower;
  out.qdd /= slower * slower;
  return out;
}

}  // namespace sparflow
