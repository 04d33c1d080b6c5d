#include "apps/tasks/benchmark/smoothed_motion.h"

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

/// Time between two instants of the average.
/// @threshold [s] 0.005..0.2; numerical: speeds are linear in between, which leaves less than 0.1 mm
constexpr double kStep = 0.05;

/// Position and its integral over time, at rest before and after the motion.
class Course {
 public:
  explicit Course(const Trajectory& motion) : m_(motion) {
    integral_ = Eigen::MatrixXd::Zero(m_.q.rows(), m_.q.cols());
    for (Eigen::Index k = 0; k + 1 < m_.size(); ++k)
      integral_.row(k + 1) = integral_.row(k) + within(k, m_.t[k + 1] - m_.t[k]);
  }
  Eigen::RowVectorXd position(double t) const {
    if (t <= m_.t[0]) return m_.q.row(0);
    if (t >= last()) return m_.q.row(m_.size() - 1);
    const Eigen::Index k = interval(t);
    const double s = t - m_.t[k];
    return m_.q.row(k) + s * m_.qd.row(k) + 0.5 * s * s * m_.qdd.row(k);
  }
  /// Since the begin of the motion.
  Eigen::RowVectorXd integral(double t) const {
    if (t <= m_.t[0]) return (t - m_.t[0]) * m_.q.row(0);
    if (t >= last()) return integral_.row(m_.size() - 1) + (t - last()) * m_.q.row(m_.size() - 1);
    const Eigen::Index k = interval(t);
    return integral_.row(k) + within(k, t - m_.t[k]);
  }

 private:
  double last() const { return m_.t[m_.size() - 1]; }
  Eigen::Index interval(double t) const {
    const double* begin = m_.t.data();
    return std::upper_bound(begin, begin + m_.size(), t) - begin - 1;
  }
  Eigen::RowVectorXd within(Eigen::Index k, double s) const {
    return s * m_.q.row(k) + s * s / 2.0 * m_.qd.row(k) + s * s * s / 6.0 * m_.qdd.row(k);
  }

  const Trajectory& m_;
  Eigen::MatrixXd integral_;
};

}  // namespace

Trajectory smoothed(const Trajectory& motion, double width) {
  if (width <= 0.0 || motion.size() < 2) return motion;
  const Course course(motion);
  const double duration = motion.duration() + width;
  const auto steps = static_cast<Eigen::Index>(std::ceil(duration / kStep));
  Trajectory s;
  s.t = Eigen::VectorXd::LinSpaced(steps + 1, motion.t[0], motion.t[0] + duration);
  s.q.resize(steps + 1, motion.q.cols());
  s.qd = s.qdd = s.q;
  for (Eigen::Index k = 0; k <= steps; ++k) {
    const double to = s.t[k], from = to - width;
    s.q.row(k) = (course.integral(to) - course.integral(from)) / width;
    s.qd.row(k) = (course.position(to) - course.position(from)) / width;
  }
  for (Eigen::Index k = 0; k < steps; ++k)
    s.qdd.row(k) = (s.qd.row(k + 1) - s.qd.row(k)) / (s.t[k + 1] - s.t[k]);
  s.qdd.row(steps) = s.qdd.row(steps - 1);
  return s;
}

}  // namespace sparflow
