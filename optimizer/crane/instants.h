#pragma once
/// The instants at which a motion is evaluated by the exact law.
#include <Eigen/Core>

#include "models/machine/trajectory.h"

namespace sparflow {

/// Calls visit(q, qd, qdd, step [s]) in the middle of each of `parts` equal parts of every interval. Such an instant never
/// falls on a knot, where cylinders start and stop.
template <class Visit>
void for_each_instant(const Trajectory& motion, int parts, const Visit& visit) {
  Eigen::VectorXd q(motion.q.cols()), qd(motion.q.cols()), qdd(motion.q.cols());
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double step = (motion.t[k + 1] - motion.t[k]) / parts;
    qdd = motion.qdd.row(k);
    for (int part = 0; part < parts; ++part) {
      const double dt = (part + 0.5) * step;
      q = motion.q.row(k) + dt * motion.qd.row(k) + 0.5 * dt * dt * motion.qdd.row(k);
      qd = motion.qd.row(k) + dt * motion.qdd.row(k);
      visit(q, qd, qdd, step);
    }
  }
}

}  // namespace sparflow
